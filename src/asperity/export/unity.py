"""Export target Unity: a folder for ``Assets`` with a component, its library and examples."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

from asperity.core.errors import ParameterError
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
    """Return the files of the folder by name, the component first.

    Raises:
        ParameterError: see :func:`check_unity`.
    """
    check_unity(**vars(request))
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
