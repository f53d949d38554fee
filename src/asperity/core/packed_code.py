"""Machine code that the package brings along, so that shipped laws are not compiled.

``make dist`` compiles them for a level of processors, on each Python that it finds, and puts the
entries of that cache into a folder of the package, with a description of what they are for. All of
it is compared before an entry is loaded: an instruction that the processor lacks would end the
process. The entries are verified as those of the user's cache are. What cannot be used is compiled,
and one warning per process says why.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from typing import NamedTuple

from asperity.core.cache import entry_content, entry_name, list_entries, warn_once
from asperity.core.errors import ParameterError

FOLDER = Path(__file__).parents[1] / "machine_code"
"""Folder of the machine code of all interpreters; absent in a clone."""
INTERPRETER = EXTENSION_SUFFIXES[0].strip(".").partition(".")[0]
"""Minor version, flags and system of this Python, such as ``cpython-311-x86_64-linux-gnu``."""
CODE_NAMESPACE = "code"
"""Folder of machine code in the cache."""
_DESCRIPTION = "description.json"
_X86_64_V3 = (
    "avx avx2 bmi bmi2 cx16 f16c fma lzcnt movbe popcnt sahf sse3 sse4.1 sse4.2 ssse3 xsave"
)
_PROCESSOR = "NUMBA_CPU_NAME"
_LEVELS = {
    "x86_64": ("x86-64-v3", _X86_64_V3),
    "amd64": ("x86-64-v3", _X86_64_V3),
    "aarch64": ("generic", "neon"),
    "arm64": ("generic", "neon"),
}
"""Level of processors, and the features of all of them, by the machine that compiles."""


class CodeTarget(NamedTuple):
    """What machine code is compiled for.

    Attributes:
        numba: version of Numba.
        llvmlite: version of llvmlite.
        system: the system, as LLVM names it.
        processor: name of the processor or of a level of processors.
        features: names of features of the processor, each after + if the code may use it, or -.
    """

    numba: str
    llvmlite: str
    system: str
    processor: str
    features: str

    def problem_on(self, host: CodeTarget) -> str:
        """Return why the code cannot run on another target; empty if it can."""
        if self[:3] != host[:3]:
            return f"for Numba {self.numba}, llvmlite {self.llvmlite} and {self.system}"
        missing = _enabled(self.features) - _enabled(host.features)
        if missing:
            return (
                f"for processors of {self.processor}, this one lacks {', '.join(sorted(missing))}"
            )
        return ""


def _enabled(features: str) -> frozenset[str]:
    return frozenset([name[1:] for name in features.split(",") if name.startswith("+")])


class PackedCode(NamedTuple):
    """The machine code of the package for one target.

    Attributes:
        target: what it is compiled for; ``None``: none can be used.
        problem: why not; empty for a package without machine code.
    """

    target: CodeTarget | None
    problem: str = ""

    def get_entry(self, key: str) -> bytes | None:
        """Return the content of an entry, or ``None``."""
        if self.target is None:
            return None
        try:
            return entry_content(key, _entry_path(key).read_bytes())
        except OSError:
            return None

    def warn(self, key: str) -> None:
        """Warn once if an entry that is compiled should have come from the package."""
        problem = self.problem
        if self.target is not None and _entry_path(key).exists():
            problem = "damaged"
        if problem:
            warn_once(f"the machine code in this package is {problem}: it is compiled instead")


def _entry_path(key: str) -> Path:
    return FOLDER / INTERPRETER / entry_name(key)


@cache
def find_packed_code(host: CodeTarget) -> PackedCode:
    """Return the machine code of the package that runs on a target."""
    if _PROCESSOR in os.environ or not FOLDER.is_dir():  # code for the package is all compiled
        return PackedCode(None)
    try:
        text = (FOLDER / INTERPRETER / _DESCRIPTION).read_text("utf-8")
        packed = CodeTarget(**json.loads(text))
        problem = packed.problem_on(host)
    except FileNotFoundError:
        return PackedCode(None, f"not for this Python, {INTERPRETER}")
    except (OSError, ValueError, TypeError, AttributeError):
        return PackedCode(None, "damaged")
    return PackedCode(None if problem else packed, problem)


def compile_for_level() -> None:
    """Let this process and those that it starts compile for a level of processors.

    To be called before Numba is imported.

    Raises:
        ParameterError: on a machine of another architecture, or below the level.
    """
    import llvmlite.binding  # type: ignore[import-untyped]  # it has no types

    processor, names = _LEVELS.get(platform.machine().lower(), ("", ""))
    if not processor:
        raise ParameterError("pack", "is for x86-64 and arm64", platform.machine())
    missing = set(names.split()) - _enabled(llvmlite.binding.get_host_cpu_features().flatten())
    if missing:
        fault = f"needs a processor of {processor}, this one lacks {', '.join(sorted(missing))}"
        raise ParameterError("pack", fault)
    features = ",".join([f"+{name}" for name in names.split()])
    os.environ |= {_PROCESSOR: processor, "NUMBA_CPU_FEATURES": features}


def store_packed_code(folder: Path, target: CodeTarget) -> int:
    """Write the machine code of the cache into the folder of a package; return the entries."""
    place = folder / INTERPRETER
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    paths = [entry.path for entry in list_entries() if entry.namespace == CODE_NAMESPACE]
    complete = [path for path in paths if not path.suffix]
    for path in complete:
        shutil.copyfile(path, place / path.name)
    (place / _DESCRIPTION).write_text(json.dumps(target._asdict(), indent=1), "utf-8")
    return len(complete)
