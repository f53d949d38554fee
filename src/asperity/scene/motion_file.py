"""A file of positions against time, as the motion of a hand."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from asperity.errors import ParameterError
from asperity.simulation import Path as PathMotion

PATH_COLUMNS = ("time [s]", "x [m]", "y [m]", "z [m]")


def read_path(file: str) -> PathMotion:
    """Return the motion that a file of positions describes.

    Args:
        file: text with a line of names, ``time [s]``, ``x [m]``, ``y [m]``, ``z [m]``, and others
            that are not read; commas between. The traces of ``asperity simulate`` are such files.

    Raises:
        ParameterError: for a file that cannot be read, lacks a column, has no rows or a wrong
            number.
    """
    try:
        with Path(file).open(encoding="utf-8") as stream:
            names = [name.strip() for name in stream.readline().split(",")]
            columns = [_column(names, name, file) for name in PATH_COLUMNS]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of no rows: see below
                table = np.loadtxt(stream, delimiter=",", usecols=columns, ndmin=2)
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("motion.file", f"{file} cannot be read: {reason}") from None
    except ValueError as error:
        raise ParameterError("motion.file", f"{file} is not a table of numbers: {error}") from None
    if not len(table):
        raise ParameterError("motion.file", f"{file} has no rows")
    return PathMotion(table[:, 0], table[:, 1:])


def _column(names: list[str], name: str, file: str) -> int:
    if name not in names:
        raise ParameterError("motion.file", f"{file} has no column '{name}' in its first line")
    return names.index(name)
