"""Rows of a recording as ROS 2 messages of one size, which NumPy encodes and decodes at once.

A row is a sequence of 64-bit numbers; the schema of the file has their names and units.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, find_named
from asperity.recording.mcap import CHANNEL, DamagedError

Columns = tuple[tuple[str, str], ...]
"""Names and units; the first is the time in seconds."""

_MESSAGE = 0x05
# Header of a message in CDR: little-endian.
_CDR_HEADER = np.frombuffer(b"\x00\x01\x00\x00", np.dtype("V4"))[0]
_COLUMN_NAME = re.compile(r"[a-z]+( ?[a-z0-9]+)*")
_FIELD_LINE = re.compile(r"float64 ([a-z][a-z0-9_]*) # \[([^\]]*)\]")


def schema_text(columns: Columns) -> str:
    r"""Return the definition of a message with these columns.

    Raises:
        ParameterError: a name is not allowed in a message, or the first column is not the time.

    Example:
        >>> schema_text((("time", "s"), ("applied x", "N")))
        'float64 time # [s]\nfloat64 applied_x # [N]\n'
    """
    names = [name for name, _unit in columns]
    if not columns or columns[0] != ("time", "s"):
        raise ParameterError("columns", "must begin with ('time', 's')", columns)
    if len(set(names)) < len(names) or not all(map(_COLUMN_NAME.fullmatch, names)):
        raise ParameterError("columns", "must have different names of small letters", names)
    return "".join(f"float64 {name.replace(' ', '_')} # [{unit}]\n" for name, unit in columns)


def schema_columns(text: str) -> Columns:
    """Return the columns of a definition written by :func:`schema_text`.

    Raises:
        DamagedError: any other definition.
    """
    columns = []
    for line in text.splitlines():
        match = _FIELD_LINE.fullmatch(line)
        if match is None:
            raise DamagedError("its rows are no table with a time")
        columns.append((match[1].replace("_", " "), match[2]))
    if columns[:1] != [("time", "s")]:
        raise DamagedError("its rows are no table with a time")
    return tuple(columns)


def row_type(column_count: int) -> np.dtype[np.void]:
    """Return the layout of the message record of a row with a number of columns."""
    return np.dtype(
        [
            ("op", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("logged", "<u8"),
            ("published", "<u8"),
            ("cdr", "V4"),
            ("values", "<f8", (column_count,)),
        ]
    )


def message_template(row_count: int, column_count: int) -> NDArray[np.void]:
    """Return message records without number, time and values."""
    kind = row_type(column_count)
    blank = np.zeros(row_count, kind)
    blank["op"] = _MESSAGE
    blank["channel"] = CHANNEL
    blank["cdr"] = _CDR_HEADER
    blank["length"] = kind.itemsize - 9  # all but code and length
    return blank


def write_messages(messages: NDArray[np.void], first: int, table: FloatArray) -> None:
    """Write number, time and values of rows into message records.

    Args:
        messages: the records.
        first: number of the first row.
        table: shape (rows, count); the time [s] in its first column.
    """
    messages["sequence"] = np.arange(first, first + len(table), dtype=np.uint64) & 0xFFFFFFFF
    messages["logged"] = messages["published"] = nanoseconds(table[:, 0])
    messages["values"] = table


def nanoseconds(times: FloatArray) -> NDArray[np.uint64]:
    """Return times [s] in whole nanoseconds."""
    return np.rint(np.clip(times, 0.0, 1e10) * 1e9).astype(np.uint64)


def message_values(data: bytes, column_count: int) -> FloatArray:
    """Return the numbers of whole message records, shape (rows, count).

    Raises:
        DamagedError: for records of another kind.
    """
    kind = row_type(column_count)
    if len(data) % kind.itemsize:
        raise DamagedError("a block holds part of a row")
    rows = np.frombuffer(data, kind)
    is_row = (rows["op"] == _MESSAGE) & (rows["length"] == kind.itemsize - 9)
    if not (is_row & (rows["channel"] == CHANNEL)).all():
        raise DamagedError("a block holds something else than rows")
    return np.ascontiguousarray(rows["values"])


def check_table(table: FloatArray, columns: Sequence[object]) -> FloatArray:
    """Return a table whose rows have these columns.

    Raises:
        ParameterError: for another shape.
    """
    values = np.asarray(table, dtype=np.float64)
    if values.ndim != 2 or values.shape[1] != len(columns):
        requirement = f"must have the shape (rows, {len(columns)}), one column for each name"
        raise ParameterError("block", requirement, values.shape)
    return values


def find_column(columns: Columns, name: str) -> int:
    """Return the number of a column.

    Raises:
        ParameterError: for a name that no column has; the nearest are offered.
    """
    places = {known: place for place, (known, _unit) in enumerate(columns)}
    return find_named("column", name, places)


class NamedColumns:
    """Base class of results with rows of a loop, whose columns have names.

    Attributes:
        columns: names and units.
        table: the rows, shape (k, columns).
    """

    columns: Columns
    table: FloatArray

    def has_columns(self, *names: str) -> bool:
        """Whether all these columns exist."""
        return {*names} <= {name for name, _unit in self.columns}

    def select(self, *names: str) -> FloatArray:
        """Return columns by name, shape (k, names).

        Raises:
            ParameterError: for a name that there is not; the nearest are offered.
        """
        return self.table[:, [find_column(self.columns, name) for name in names]]

    @property
    def time(self) -> FloatArray:
        """Times of the samples [s], shape (k,)."""
        return self.table[:, 0]

    @property
    def position(self) -> FloatArray:
        """True position of the handle at the samples [m], shape (k, 3)."""
        return self.select("x", "y", "z")

    @property
    def velocity(self) -> FloatArray:
        """True velocity of the handle at the samples [m/s], shape (k, 3)."""
        return self.select("vx", "vy", "vz")

    @property
    def commanded(self) -> FloatArray:
        """Force that the law asked for at the sample, rounded and limited [N], shape (k, 3)."""
        return self._axes("commanded")

    @property
    def applied(self) -> FloatArray:
        """Force that is held from the sample on, after the delay [N], shape (k, 3)."""
        return self._axes("applied")

    @property
    def anchor(self) -> FloatArray:
        """Position of the hand at the samples [m], shape (k, 3)."""
        return self._axes("anchor")

    @property
    def energies(self) -> dict[str, FloatArray]:
        """Sums of the ledger up to the samples [J].

        ``supplied`` and ``same_sample`` have shape (k, 3), one column per axis; ``lost``,
        ``hand``, ``friction``, ``sampling`` and ``stored`` have shape (k,).
        """
        axes = {"supplied": "supplied", "same_sample": "same sample"}
        single = ("lost", "hand", "friction", "sampling", "stored")
        return {name: self._axes(head) for name, head in axes.items()} | {
            name: self.select(name)[:, 0] for name in single
        }

    def _axes(self, head: str) -> FloatArray:
        return self.select(f"{head} x", f"{head} y", f"{head} z")


@dataclass(frozen=True, eq=False)
class TraceTable(NamedColumns):
    """Rows of a recording: see :class:`NamedColumns`."""

    columns: Columns
    table: FloatArray = field(repr=False)
