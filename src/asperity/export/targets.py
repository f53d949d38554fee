"""Export targets: formats of exported programs, and the writing of their files."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from asperity.core.errors import ParameterError, escape_unprintable, find_named
from asperity.core.files import check_not_existing, check_output, open_atomic
from asperity.export.c99 import c99_files
from asperity.export.surface_functions import ExportRequest
from asperity.export.unity import COMPILER, build_windows_library, check_unity, unity_files


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
"""Export targets by name."""


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
        raise ParameterError("output", requirement, escape_unprintable(path.name))


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
    check_name(place, target)
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
