"""Exported files: all of them are written, or none."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path

from asperity.errors import ParameterError, printable
from asperity.export.order import Order
from asperity.export.targets import Target
from asperity.files import whole_file


def refuse_existing(path: Path, names: Mapping[str, str]) -> None:
    """Refuse to write where there is something.

    Raises:
        ParameterError: with the first file that exists.
    """
    for name in names:
        if (path.parent / name).exists() or (path.parent / name).is_symlink():
            words = f"exists: {printable(path.parent / name)}; --force replaces it"
            raise ParameterError("output", words)


def check_name(path: Path, target: Target) -> None:
    """Refuse a file whose name does not fit the language.

    Raises:
        ParameterError: for another suffix.
    """
    if path.suffix != target.suffix or not path.stem.isprintable() or '"' in path.stem:
        words = f"must be a file that ends in {target.suffix}"
        raise ParameterError("output", words, printable(path.name))


def write_files(
    path: str | os.PathLike[str], target: Target, order: Order, *, force: bool
) -> list[Path]:
    """Write an exported program.

    Args:
        path: of the file that others include; further files are written beside it.
        target: the language.
        order: what is to be exported.
        force: replace files that are there.

    Returns:
        The files.

    Raises:
        ParameterError: for a file that exists, or cannot be written.
    """
    place = Path(path)
    check_name(place, target)
    files = target.files(order, place.stem)
    if not force:
        refuse_existing(place, files)
    try:
        with ExitStack() as written:
            for name, text in files.items():
                stream = written.enter_context(whole_file(place.parent / name))
                stream.write(text.encode())
                stream.flush()
    except OSError as error:
        raise ParameterError("output", f"cannot be written: {error.strerror}", str(path)) from None
    return [place.parent / name for name in files]
