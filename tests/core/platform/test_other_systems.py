"""Windows and macOS by stand-ins: what Linux alone has is hidden, their calls are in Python."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import urllib.request
from pathlib import Path
from typing import Any

import pytest
from bench.stand_ins.systems import other_systems
from bench.stress.servo_ends import STARTS
from tests.lab.started import Started

ROOT = Path(__file__).parents[3]
STAND_IN = Path(other_systems.__file__).parent
SYSTEMS = ("windows", "macos")
_SURFACE = "sinusoid:amplitude=0.1mm,period=2mm"

# The loop and its processes; then what computes, which is the same on all systems.
_LOOP = f"""
import importlib, io, pkgutil, sys
from contextlib import redirect_stderr
from pathlib import Path
import asperity
from asperity.cli.main import main

def call(*words, starts=1):
    for start in range(starts):
        code = 0
        sys.argv = ["asperity", *words]
        with redirect_stderr(io.StringIO()) as said:
            try:
                main()
            except SystemExit as end:
                code = end.code
        print(said.getvalue(), file=sys.stderr)
        if "the loop was late for too long" not in said.getvalue():
            break
        Path("run.mcap").unlink(missing_ok=True)  # the next start refuses an existing recording
    assert not code, (words, code)

if __name__ == "__main__":
    for module in pkgutil.walk_packages(asperity.__path__, "asperity."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    call("devices", "--json", "devices.json")
    for name in ("run", "study", "lab"):
        call(name, "--help")
    call(
        "run", "{_SURFACE}", "--law", "W", "--stiffness", "100N/m", "--device", "touch",
        "--duration", "0.3s", "--json", "run.json", "--record", "run.mcap", starts={STARTS},
    )
"""
_COMPUTATIONS = f"""
    call("compare", "{_SURFACE}", "--laws", "WC", "--json", "compare.json")
    call("export", "{_SURFACE}", "--law", "C", "--stiffness", "300N/m", "-o", "texture.h")
    call("init", "scene.toml")
    call("simulate", "scene.toml", "--duration", "50ms", "--json", "simulate.json")
    call("onset", "press.toml", "--laws", "W", "--delays", "0", "--starts", "2", "--json", "o.json")
"""


def environment(system: str, folder: Path, refuses: str = "") -> dict[str, str]:
    """Return the variables of a process in which the package sees another system."""
    paths = os.pathsep.join(map(str, (STAND_IN, ROOT / "src", ROOT)))
    return os.environ | {
        "PYTHONPATH": paths,
        other_systems.SYSTEM: system,
        other_systems.REFUSES: refuses,
        other_systems.CALLS: str(folder / "calls.txt"),
    }


def run_python(
    code: str, system: str, folder: Path, refuses: str = ""
) -> subprocess.CompletedProcess[str]:
    """Run code in a file of a folder, so that processes can be spawned from it."""
    script = folder / "program.py"
    script.write_text(code, encoding="utf-8")
    return subprocess.run(
        [sys.executable, str(script)],
        cwd=folder,
        env=environment(system, folder, refuses),
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )


def answer(code: str, system: str, folder: Path, refuses: str = "") -> Any:
    """Return what a function ``answer`` of the package ``asperity`` would see, as JSON."""
    lines = "import json\nnames = {'__package__': 'asperity', '__name__': 'asperity.x'}\n"
    lines += f"exec({code!r}, names)\nprint(json.dumps(names['answer']()))\n"
    result = run_python(lines, system, folder, refuses)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder as users of Windows have it."""
    path = tmp_path / "Jörg Müller" / "meine Oberflächen"
    path.mkdir(parents=True)
    return path


@pytest.mark.parametrize("system", SYSTEMS)
def test_every_module_and_the_commands_work(system: str, folder: Path) -> None:
    shutil.copy(ROOT / "examples" / "press.toml", folder)
    commands = f"{_LOOP}{_COMPUTATIONS}" if system == "windows" else _LOOP
    result = run_python(commands, system, folder)
    assert result.returncode == 0, result.stderr[-2000:]
    assert "internal error" not in result.stderr
    run = json.loads((folder / "run.json").read_text("utf-8"))
    assert run["ended"] == "finished"
    assert run["notes"] == []
    assert run["statistics"]["samples"] + run["statistics"]["skipped"] >= 300
    assert (folder / "run.mcap").stat().st_size > 10_000
    calls = (folder / "calls.txt").read_text()
    priority = "AvSetMmThreadCharacteristicsW(Pro Audio)"
    assert (priority if system == "windows" else "thread_policy_set(24000)") in calls


def test_lab_answers_and_ends(folder: Path) -> None:
    lab = Started(_SURFACE, "--law", "W", environment=environment("windows", folder))
    try:
        with urllib.request.urlopen(lab.address, timeout=60) as page:
            assert b"<canvas" in page.read()
        code, said = lab.end()
        assert code in {0, 130}
        assert "internal error" not in said
    finally:
        lab.close()


def test_what_is_hidden_is_hidden_from_the_package_alone(folder: Path) -> None:
    code = """
def answer():
    import ctypes, os, select, signal, sys, time
    lacks = [hasattr(os, "getuid"), hasattr(os, "setsid"), hasattr(signal, "SIGHUP")]
    lacks += [hasattr(select, "poll"), hasattr(time, "clock_gettime_ns")]
    for name in ("fcntl", "resource", "termios"):
        try:
            exec(f"import {name}", globals())
            lacks.append(True)
        except ModuleNotFoundError:
            pass
    return [any(lacks), os.name, sys.platform, hasattr(ctypes, "WinDLL")]
"""
    assert answer(code, "windows", folder) == [False, "nt", "win32", True]
    seen = "import os, json\nprint(json.dumps([os.name, hasattr(os, 'getuid')]))"
    assert json.loads(run_python(seen, "windows", folder).stdout) == ["posix", True]


_CLOCK = """
def answer():
    from asperity.core.platform import lateness
    from asperity.core.platform.clocks import clock_module, system_clock, system_time
    from asperity.kernels.fuse import fuse_module
    loops = fuse_module(lateness, clock_module())
    clock = system_clock()
    loops.measure_lateness(clock, 1_000_000, 1)
    before = system_time()
    worst = loops.measure_lateness(clock, 1_000_000, 50)
    took = system_time() - before
    return [clock_module().__name__, worst, took]
"""


@pytest.mark.parametrize("system", SYSTEMS)
def test_compiled_clock_waits_and_agrees_with_that_of_python(system: str, folder: Path) -> None:
    name, worst, took = answer(_CLOCK, system, folder)
    assert name == f"asperity.core.platform.{system}_clock"
    assert 0 <= worst < 0.5e9
    assert took >= 50e6  # fifty waits of a millisecond, none of which ended early


def test_windows_without_fine_timers_asks_for_a_finer_tick(folder: Path) -> None:
    code = "def answer():\n    from asperity.core.platform.clocks import system_clock\n"
    code += "    return bool(system_clock().words[3] > 2**32)"
    assert answer(code, "windows", folder)
    assert (folder / "calls.txt").read_text() == "CreateWaitableTimerExW(2)\n"
    assert answer(code, "windows", folder, refuses="timer")
    calls = (folder / "calls.txt").read_text().splitlines()[1:]
    expected = ["CreateWaitableTimerExW(2)", "timeBeginPeriod(1)", "CreateWaitableTimerExW(0)"]
    assert calls == expected


@pytest.mark.parametrize("system", SYSTEMS)
def test_refused_priority_is_said_with_the_measured_lateness(system: str, folder: Path) -> None:
    code = "def answer():\n    from asperity.servo.loop_process import realtime_notes\n"
    code += "    return realtime_notes(1e-3)"
    assert answer(code, system, folder) == []
    first, second = answer(code, system, folder, refuses="priority")
    assert first.startswith("Real-time priority is not allowed: ")
    assert ("MMCSS" if system == "windows" else "THREAD_TIME_CONSTRAINT_POLICY") in first
    assert second.startswith("Measured without real-time priority, 100 waits of 1 ms: late by")


_LOCKS = """
def answer():
    from asperity.core.errors import ParameterError
    from asperity.servo.drivers.force_dimension import ForceDimensionDriver
    from asperity.servo.loop_process import lock_device
    refused = []
    with lock_device(ForceDimensionDriver(0)), lock_device(ForceDimensionDriver(1)):
        for driver in (ForceDimensionDriver(), ForceDimensionDriver(0), ForceDimensionDriver(2)):
            try:
                with lock_device(driver):
                    refused.append("")
            except ParameterError as error:
                refused.append(str(error))
    with lock_device(ForceDimensionDriver()):
        pass
    return refused
"""


@pytest.mark.parametrize("system", SYSTEMS)
def test_devices_are_locked(system: str, folder: Path) -> None:
    kind, same, other = answer(_LOCKS, system, folder)
    assert kind.startswith("driver finds the device in use by process ")
    assert same == kind
    assert other == ""


_KEYS = """
def answer():
    import msvcrt
    from asperity.core.platform.console import open_keyboard, leave_lost_terminal
    from asperity.studies.live.screens import _SEQUENCES
    msvcrt.pressed = "\\r\\x1b\\x08\\xe0H\\x00Py"
    with open_keyboard() as read:
        keys = [read(0.0) for _ in range(7)]
    return [[_SEQUENCES.get(key, key and key.decode()) for key in keys], leave_lost_terminal()]
"""


def test_keys_of_a_console_of_windows(folder: Path) -> None:
    keys, is_lost = answer(_KEYS, "windows", folder)
    assert keys == ["Enter", "Escape", "Backspace", "ArrowUp", "ArrowDown", "y", None]
    assert not is_lost


_LIBRARY = """
def answer():
    import os
    from pathlib import Path
    from asperity.core.errors import ParameterError
    from asperity.servo.drivers import force_dimension
    from asperity.servo.drivers.library import load_library
    found = []
    for _ in range(2):
        try:
            found.append(load_library(force_dimension._LIBRARY_NAMES, "X", "install the SDK")._name)
        except ParameterError as error:
            found.append(str(error))
        os.environ["PATH"] = f"{Path.cwd()}{os.pathsep}{os.environ['PATH']}"
    return found
"""


def test_library_of_a_vendor_is_found_in_a_folder_of_path(folder: Path) -> None:
    source = folder / "empty.c"
    source.write_text("int dhdGetDeviceCount(void) { return 0; }\n")
    library = folder / "dhd64.dll"
    compiler = ["gcc", "-shared", "-fPIC", "-o", str(library), str(source)]
    subprocess.run(compiler, check=True)
    missing, found = answer(_LIBRARY, "windows", folder)
    expected = "driver needs dhd64.dll, which is not found: install the SDK, or name the file in X"
    assert missing == expected
    assert found == str(library)
