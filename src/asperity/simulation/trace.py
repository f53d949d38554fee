"""The trace of a run: in memory, in a recording, or in a table of text."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.recording.writer import RecordingWriter

COLUMNS = (
    ("time", "s"),
    *((name, "m") for name in ("x", "y", "z")),
    *((f"v{axis}", "m/s") for axis in "xyz"),
    *((f"commanded {axis}", "N") for axis in "xyz"),
    *((f"applied {axis}", "N") for axis in "xyz"),
    *((f"anchor {axis}", "m") for axis in "xyz"),
    *((f"supplied {axis}", "J") for axis in "xyz"),
    *((f"same sample {axis}", "J") for axis in "xyz"),
    *((name, "J") for name in ("lost", "hand", "friction", "sampling", "stored")),
    *((f"law anchor {axis}", "m") for axis in "xy"),
    ("law held", "1"),
)
"""Columns of the trace with their units."""

HEADER = ",".join(f"{name} [{unit}]" for name, unit in COLUMNS)
_TEXT, _RECORDING = (".csv", ".txt"), (".mcap", "")
_ROW = ",".join(["%.12g"] * len(COLUMNS)) + "\n"


def is_text(path: Path) -> bool:
    """Tell by its name whether a trace is a table of text, or a recording.

    Raises:
        ParameterError: for a name that says something else.
    """
    suffix = path.suffix.lower()
    if suffix not in (*_TEXT, *_RECORDING):
        words = "must be the path of a .mcap file (a recording), or of a .csv file (text)"
        raise ParameterError("trace", words, str(path))
    return suffix in _TEXT


class MemoryTrace:
    """Keeps all rows in one table; with no rows it keeps nothing."""

    def __init__(self, rows: int) -> None:
        try:
            self._table = np.empty((rows, len(COLUMNS)))
        except (MemoryError, ValueError):  # more than there are addresses
            limit = f"needs memory for {rows} rows: give a path, or a larger 'every'"
            raise ParameterError("trace", limit) from None
        self._filled = 0

    def room(self, rows: int) -> FloatArray:  # noqa: ARG002 - it has room for all
        """Return the rest of the table."""
        return self._table[self._filled :]

    def keep(self, rows: int) -> None:
        """Count the rows as filled."""
        self._filled += rows

    def table(self) -> FloatArray:
        """Return the filled rows."""
        return self._table[: self._filled]

    def close(self) -> None:
        """Do nothing: the table stays."""


class ThinTrace:
    """Keeps a bounded number of rows, thinned out evenly from the first.

    Args:
        rows: that will come.
        most: that are kept at most; none for 0.
    """

    def __init__(self, rows: int, most: int) -> None:
        self._buffer = np.empty((0, len(COLUMNS)))
        self._step = max(1, -(-rows // most)) if most else rows + 1
        self._table = np.empty((-(-rows // self._step) if most else 0, len(COLUMNS)))
        self._seen = self._filled = 0

    def room(self, rows: int) -> FloatArray:
        """Return a buffer of so many rows."""
        if len(self._buffer) < rows:
            self._buffer = np.empty((rows, len(COLUMNS)))
        return self._buffer

    def keep(self, rows: int) -> None:
        """Keep every so manieth of the first rows of the buffer."""
        chosen = self._buffer[-self._seen % self._step : rows : self._step]
        if len(self._table):
            self._table[self._filled : self._filled + len(chosen)] = chosen
            self._filled += len(chosen)
        self._seen += rows

    def table(self) -> FloatArray:
        """Return the rows that were kept."""
        return self._table[: self._filled]

    def close(self) -> None:
        """Do nothing: the table stays."""


class FileTrace:
    """Writes rows of a recording in blocks.

    Args:
        path: of the file.
        about: what the recording says of itself.
        attached: files inside it.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        about: Mapping[str, Any] | None = None,
        attached: Mapping[str, bytes] | None = None,
    ) -> None:
        self._buffer = np.empty((0, len(COLUMNS)))
        self._writer = RecordingWriter(path, COLUMNS, about, attached, "trace")

    def room(self, rows: int) -> FloatArray:
        """Return a buffer of so many rows."""
        if len(self._buffer) < rows:
            self._buffer = np.empty((rows, len(COLUMNS)))
        return self._buffer

    def keep(self, rows: int) -> None:
        """Hand on the first rows of the buffer.

        Raises:
            ParameterError: if the file cannot grow; it then ends with a whole block.
        """
        self._writer.append(self._buffer[:rows])

    def table(self) -> FloatArray:
        """Return an empty table: the rows are in the file."""
        return np.empty((0, len(COLUMNS)))

    def close(self) -> None:
        """Write what waits, and close the file."""
        self._writer.close()


class TextTrace:
    """Writes rows of a CSV file in chunks; what is written are whole lines.

    The first line names the columns with their units, ``time [s],x [m],...``.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._path = Path(path)
        self._buffer = np.empty((0, len(COLUMNS)))
        self.rows = 0
        try:
            self._file = open(self._path, "wb", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise ParameterError("trace", f"cannot be written: {error}") from None
        self._size = 0
        self._write((HEADER + "\n").encode())

    def room(self, rows: int) -> FloatArray:
        """Return a buffer of so many rows."""
        if len(self._buffer) < rows:
            self._buffer = np.empty((rows, len(COLUMNS)))
        return self._buffer

    def keep(self, rows: int) -> None:
        """Write the first rows of the buffer.

        Raises:
            ParameterError: if the file cannot grow; it then ends with a whole line.
        """
        values = self._buffer[:rows].ravel().tolist()
        self._write((_ROW * rows % tuple(values)).encode())

    def _write(self, text: bytes) -> None:
        left = memoryview(text)
        try:
            while left:
                left = left[self._file.write(left) or 0 :]
        except OSError as error:
            whole = self._cut(text[: len(text) - len(left)])
            kept = f"{whole} rows are in {self._path}"
            raise ParameterError(
                "trace", f"cannot be written any further ({error.strerror}): {kept}"
            ) from None
        self._size += len(text)
        self.rows += text.count(b"\n") - (self._size == len(text))

    def _cut(self, written: bytes) -> int:
        """Cut the file after its last whole line; returns the rows that it holds."""
        whole = written.rfind(b"\n") + 1
        with suppress(OSError):  # a device such as /dev/full has no length
            self._file.truncate(self._size + whole)
        header = self._size == 0 and whole > 0
        self.close()
        return self.rows + written.count(b"\n") - header

    def table(self) -> FloatArray:
        """Return an empty table: the rows are in the file."""
        return np.empty((0, len(COLUMNS)))

    def close(self) -> None:
        """Close the file."""
        self._file.close()


Trace = MemoryTrace | ThinTrace | FileTrace | TextTrace
