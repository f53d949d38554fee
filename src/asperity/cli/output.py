"""Where results go: standard output, or a file that is whole or not there."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import click

from asperity.errors import ParameterError

STANDARD_OUTPUT = "-"


def check_output(name: str, path: str | None) -> None:
    """Refuse a path that cannot be written, before any work is done.

    Raises:
        ParameterError: if the folder does not exist or is not writable, or the path is a folder.
    """
    if path is None or path == STANDARD_OUTPUT:
        return
    folder = Path(path).absolute().parent
    if not folder.is_dir():
        raise ParameterError(name, f"must lie in a folder that exists, {folder} does not")
    if Path(path).is_dir():
        raise ParameterError(name, "must be a file, not a folder", path)
    if not os.access(folder, os.W_OK):
        raise ParameterError(name, f"must lie in a folder that can be written, not {folder}")


def write_output(name: str, path: str, text: str) -> None:
    """Write a text to standard output or to a file, which is replaced only when all is written.

    Raises:
        ParameterError: if the file cannot be written.
    """
    if path == STANDARD_OUTPUT:
        click.echo(text, nl=not text.endswith("\n"))
        return
    target = Path(path)
    handle, temporary = tempfile.mkstemp(dir=target.absolute().parent, prefix=f".{target.name}.")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(text)
        Path(temporary).chmod(0o666 & ~_umask())
        Path(temporary).replace(target)
    except OSError as error:
        Path(temporary).unlink(missing_ok=True)
        raise ParameterError(name, f"cannot be written: {error.strerror}", path) from None
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
