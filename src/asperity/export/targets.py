"""Export targets: formats of exported programs, and the writing of their files.

The target Unity is a folder for ``Assets`` with a component, its library and examples.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from asperity.core.errors import ParameterError, escape_unprintable, find_named
from asperity.core.files import check_not_existing, check_output, open_atomic
from asperity.export.abi import ABI_VERSION
from asperity.export.c99 import c99_files
from asperity.export.c_language import fill_template, load_template
from asperity.export.surface_functions import PRECISIONS, ExportRequest

COMPILER = "x86_64-w64-mingw32-gcc"
"""Compiler of libraries for Windows on other systems, of MinGW-w64."""

_SCRIPTS = {
    "HapticTexture.cs": "HapticTexture.cs",
    "Asperity.@name@.asmdef": "assembly.asmdef",
    "README.txt": "README.txt",
    "Examples~/HaplyExample.cs": "HaplyExample.cs",
    "Examples~/TouchExample.cs": "TouchExample.cs",
}


def check_unity(
    precision: str = PRECISIONS[0], *, loads_field: bool = False, **_others: object
) -> None:
    """Check the options of a request.

    Raises:
        ParameterError: for single precision, or a field that is loaded at run time.
    """
    if precision != PRECISIONS[0]:
        raise ParameterError("precision", f"must be {PRECISIONS[0]}: the component uses doubles")
    if loads_field:
        raise ParameterError("load", "is for programs in C: this library holds its field")


def unity_files(request: ExportRequest, _stem: str) -> dict[str, str]:
    """Return the files of the folder by name, the component first."""
    values = _placeholders(request)
    files = {
        fill_template(file, values): fill_template(load_template(f"unity/{name}"), values)
        for file, name in _SCRIPTS.items()
    }
    library = c99_files(replace(request, as_library=True), request.name)
    return files | {f"Source~/{name}": text for name, text in library.items()}


def _placeholders(request: ExportRequest) -> dict[str, str]:
    surface = request.surface
    return {
        "name": request.name,
        "title": f"Law {surface.law}, content {surface.digest}",
        "stiffness": repr(surface.stiffness),
        "max_depth": repr(surface.max_depth),
        "content": surface.digest,
        "abi": str(ABI_VERSION),
        "command": " ".join(build_command(request)),
    }


def library_path(request: ExportRequest) -> str:
    """Return the place of the library in the folder."""
    return f"Plugins/x86_64/{request.name}.dll"


def build_command(request: ExportRequest) -> list[str]:
    """Return the command that builds the library for Windows, in the folder."""
    options = "-std=c99 -O2 -ffp-contract=off -fvisibility=hidden -shared -static-libgcc -s"
    definition = f"-D{request.name.upper()}_BUILD"
    source = f"Source~/{request.name}.c"
    return [COMPILER, *options.split(), definition, source, "-o", library_path(request)]


def build_windows_library(folder: Path, request: ExportRequest) -> list[Path]:
    """Build the library where its compiler is installed; return its path, or nothing."""
    library = folder / library_path(request)
    library.parent.mkdir(parents=True, exist_ok=True)
    if shutil.which(COMPILER) is None:
        return []
    done = subprocess.run(
        build_command(request), cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        raise ParameterError("output", f"is written, but {COMPILER} failed: {done.stderr.strip()}")
    return [library]


def _accept_all(**_options: object) -> None:
    """Accept all options."""


def _build_nothing(_folder: Path, _request: ExportRequest) -> list[Path]:
    return []


@dataclass(frozen=True)
class ExportTarget:
    """A format to export to.

    Attributes:
        name: name of the target, such as ``c99``.
        description: short description.
        suffix: suffix of the main file, such as ``.h``; empty if a folder is written.
        files: function of an export request and the stem of the file names that returns the texts
            of the files by name, the main file first.
        check: function of the options of a request that refuses those that the target lacks.
        build: function of the folder and the request that builds further files from those.
        compiler: program with which it builds; nothing is built where that is missing.
    """

    name: str
    description: str
    suffix: str
    files: Callable[[ExportRequest, str], dict[str, str]]
    check: Callable[..., None] = _accept_all
    build: Callable[[Path, ExportRequest], list[Path]] = _build_nothing
    compiler: str = ""

    def check_place(self, path: Path, *, force: bool) -> None:
        """Check before a computation that the main file or the folder can be written.

        Raises:
            ParameterError: for another suffix, or a path that exists or cannot be written.
        """
        check_name(path, self)
        if self.suffix:
            check_output("output", str(path), force=force)
        else:
            check_not_existing("output", path, force=force)

    def folder(self, path: Path) -> Path:
        """Return the folder to which the files are written."""
        return path.parent if self.suffix else path


TARGETS = {
    "c99": ExportTarget("c99", "a C header, or a C library", ".h", c99_files),
    "unity": ExportTarget(
        "unity",
        "a folder for Unity's Assets",
        "",
        unity_files,
        check_unity,
        build_windows_library,
        COMPILER,
    ),
}


def find_target(name: str) -> ExportTarget:
    """Return an export target by its name.

    Raises:
        ParameterError: for an unknown name.
    """
    return find_named("lang", name.lower(), TARGETS)


def check_name(path: Path, target: ExportTarget) -> None:
    """Check that the file name has the suffix of the target.

    Raises:
        ParameterError: for another suffix, or a name that is not printable.
    """
    if path.suffix != target.suffix or not path.stem.isprintable() or '"' in path.stem:
        requirement = "must be the name of a folder"
        if target.suffix:
            requirement = f"must be a file that ends in {target.suffix}"
        raise ParameterError("output", requirement, escape_unprintable(path.name or path))


def write_files(
    path: str | os.PathLike[str], target: ExportTarget, request: ExportRequest, *, force: bool
) -> list[Path]:
    """Write all files of an exported program, or none, and return their paths.

    Args:
        path: the main file; further files are written to the same folder.
        target: the export target.
        request: the export request.
        force: whether to replace existing files.

    Raises:
        ParameterError: for a file that exists, or cannot be written.
    """
    place = Path(path)
    folder = target.folder(place)
    texts = target.files(request, place.stem).items()
    files = {folder / name: text for name, text in texts}
    for file in files:
        check_not_existing("output", file, force=force)
    try:
        _write_all(files, makes_folders=not target.suffix)
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", str(path)) from None
    return [*files, *target.build(folder, request)]


def _write_all(files: Mapping[Path, str], *, makes_folders: bool) -> None:
    with ExitStack() as written:
        for file, text in files.items():
            if makes_folders:
                file.parent.mkdir(parents=True, exist_ok=True)
            stream = written.enter_context(open_atomic(file))
            stream.write(text.encode())
            stream.flush()
