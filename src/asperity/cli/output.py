"""Where results go: standard output, or a file that is whole or not there."""

from __future__ import annotations

import os
from pathlib import Path

import click

from asperity.errors import ParameterError
from asperity.files import is_device, write_text

STANDARD_OUTPUT = "-"


def check_outputs(**paths: str | None) -> None:
    """Refuse paths of which one cannot be written, or two are the same, before any work is done.

    Args:
        paths: by the names of their options; ``None`` for one that is not given.

    Raises:
        ParameterError: see :func:`check_output`.
    """
    taken: dict[str, str] = {}
    for name, path in paths.items():
        if path is None:
            continue
        target = path if path == STANDARD_OUTPUT else os.path.realpath(path)
        if target in taken:
            place = "go to standard output" if path == STANDARD_OUTPUT else f"be written to {path}"
            raise ParameterError(taken[target], f"and {name} cannot both {place}")
        taken[target] = name
        check_output(name, path)


def check_output(name: str, path: str | None) -> None:
    """Refuse a path that cannot be written, before any work is done.

    Raises:
        ParameterError: if the folder does not exist or is not writable, the path is a folder or a
            link to itself, or a device or a pipe that cannot be written to.
    """
    if path is None or path == STANDARD_OUTPUT:
        return
    if Path(path).is_dir():
        raise ParameterError(name, "must be a file, not a folder", path)
    if is_device(path):
        if not os.access(path, os.W_OK):
            raise ParameterError(name, "must be a file that can be written", path)
        return
    target = Path(os.path.realpath(path))
    if target.is_symlink():
        raise ParameterError(name, "must be a file, not a link to itself", path)
    folder = target.parent
    if not folder.is_dir():
        raise ParameterError(name, f"must lie in a folder that exists, {folder} does not")
    if not os.access(folder, os.W_OK):
        raise ParameterError(name, f"must lie in a folder that can be written, not {folder}")


def write_output(name: str, path: str, text: str) -> None:
    """Write a text to standard output or to a file; see :func:`asperity.files.whole_file`.

    Raises:
        ParameterError: if the file cannot be written.
    """
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=not text.endswith("\n"))
        return
    try:
        write_text(path, text)
    except OSError as error:
        raise ParameterError(name, f"cannot be written: {error.strerror}", path) from None
