"""Export targets, and the output of exported files."""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

from asperity.core.errors import ParameterError, escape_unprintable, find_named
from asperity.core.files import check_not_existing, open_atomic
from asperity.export.c99 import c99_files
from asperity.export.export_request import ExportRequest


@dataclass(frozen=True)
class ExportTarget:
    """A format to export to.

    Attributes:
        name: name of the target, such as ``c99``.
        description: short description.
        suffix: suffix of the main file, such as ``.h``.
        files: function of an export request and the stem of the file names that returns the texts
            of the files by name, the main file first.
    """

    name: str
    description: str
    suffix: str
    files: Callable[[ExportRequest, str], dict[str, str]]


TARGETS = {"c99": ExportTarget("c99", "a C header, or a C library", ".h", c99_files)}
"""Export targets by name."""


def register(target: ExportTarget) -> ExportTarget:
    """Register a user-defined export target.

    Raises:
        ParameterError: for a name that is taken.
    """
    if TARGETS.setdefault(target.name, target) is not target:
        raise ParameterError("lang", "is registered already", target.name)
    return target


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
        words = f"must be a file that ends in {target.suffix}"
        raise ParameterError("output", words, escape_unprintable(path.name))


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
    files = target.files(request, place.stem)
    for name in files:
        check_not_existing("output", place.parent / name, force=force)
    try:
        with ExitStack() as written:
            for name, text in files.items():
                stream = written.enter_context(open_atomic(place.parent / name))
                stream.write(text.encode())
                stream.flush()
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", str(path)) from None
    return [place.parent / name for name in files]
