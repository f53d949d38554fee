"""Writing a recording, row by row as they come, so that what is written can always be read.

Rows wait in memory until there is a block of them, or half a second has gone by, and go to the
system in one piece. Killed at any moment a process loses at most what waited and the block that
was being written: less than a second. What the system holds survives the process, not a loss of
power: Linux brings it to the disk within half a minute, and :meth:`RecordingWriter.close` waits
until it is there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.files import json_text, whole_file
from asperity.recording import mcap
from asperity.recording.rows import Columns, blank_rows, checked_table, fill_rows, schema_text
from asperity.version import __version__

FORMAT = 1
"""Version of what a recording says of itself."""
NAME = "asperity"
"""Of the metadata, of the channel and of the schema."""
LONGEST_WAIT = 0.5
"""[s] that rows wait at most for the next ones."""
# Rows of a block: 0.4 s of a loop at 10 kHz, a megabyte.
_BLOCK = 4096


class RecordingWriter:
    """Writes a recording.

    The file appears with its beginning whole, and replaces what was there. Rows are numbers in
    columns; a loop that has stopped calls :meth:`flush`, since rows wait for the next ones.

    Args:
        path: of the file.
        columns: names and units; the first is ``("time", "s")``.
        about: what the recording says of itself, plain data; see :func:`asperity.files.plain`.
        attached: files inside it, by name.
        argument: what the path is called in messages.

    Raises:
        ParameterError: if the file cannot be written, or a name cannot be that of a column.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> from asperity.recording.recording import open_recording
        >>> path = Path(tempfile.mkdtemp()) / "run.mcap"
        >>> with RecordingWriter(path, (("time", "s"), ("x", "m"))) as writer:
        ...     writer.append([[0.0, 1e-3], [1e-4, 2e-3]])
        >>> open_recording(path)["x"]
        array([0.001, 0.002])
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        columns: Columns,
        about: Mapping[str, Any] | None = None,
        attached: Mapping[str, bytes] | None = None,
        argument: str = "path",
    ) -> None:
        self._path, self._columns, self._argument = Path(path), columns, argument
        self._head = _head(columns, about or {}, attached or {})
        self._blank = blank_rows(_BLOCK, len(columns))
        self._waiting, self._since = 0, time.monotonic()
        self._chunks: list[mcap.Chunk] = []
        self.rows = 0
        """Rows that are written."""
        try:
            with whole_file(path) as stream:
                stream.write(self._head)
            self._file = open(path, "ab", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise ParameterError(argument, f"cannot be written: {error}") from None
        self._size = len(self._head)

    def __repr__(self) -> str:
        return f"<RecordingWriter of {self._path.name}, {self.rows} rows written>"

    def append(self, block: FloatArray) -> None:
        """Take rows, shape (n, columns); they are written when there are enough, or time is due.

        Raises:
            ParameterError: for another shape; if the file cannot grow, which then ends with whole
                blocks.
        """
        table = checked_table(block, self._columns)
        while len(table):
            room = min(len(table), len(self._blank) - self._waiting)
            rows = self._blank[self._waiting : self._waiting + room]
            fill_rows(rows, self.rows + self._waiting, table[:room])
            self._waiting += room
            table = table[room:]
            if self._waiting == len(self._blank):
                self.flush()
        if time.monotonic() - self._since >= LONGEST_WAIT:
            self.flush()

    def flush(self) -> None:
        """Write what waits.

        Raises:
            ParameterError: see :meth:`append`.
        """
        self._since = time.monotonic()
        if not self._waiting:
            return
        rows = self._blank[: self._waiting]
        logged, size = rows["logged"], np.uint64(rows.dtype.itemsize)
        index = np.stack([logged, np.arange(len(rows), dtype=np.uint64) * size], axis=1)
        times = int(logged[0]), int(logged[-1])
        data = rows.view(np.uint8).data
        chunk, parts = mcap.chunk(self._size, data, times, index.tobytes())
        self._waiting = 0
        self._write(*parts)
        self._chunks.append(chunk)
        self.rows += len(rows)

    def close(self) -> None:
        """Write what waits, the index for readers that seek, and wait for the disk.

        Raises:
            ParameterError: see :meth:`append`; what is written can be read all the same.
        """
        if self._file.closed:
            return
        self.flush()
        self._write(mcap.ending(self._head, self._chunks, self.rows, self._size))
        with suppress(OSError):  # a device such as /dev/null has nothing to wait for
            os.fsync(self._file.fileno())
        self._file.close()

    def _write(self, *parts: bytes | memoryview) -> None:
        """Write parts that belong together, all of them or none."""
        try:
            for part in parts:
                left = memoryview(part)
                while left:
                    left = left[self._file.write(left) or 0 :]
        except OSError as error:
            with suppress(OSError):  # a device such as /dev/full has no length
                self._file.truncate(self._size)
            self._file.close()
            words = f"cannot be written any further ({error.strerror})"
            kept = f"{self.rows} rows are in {self._path}"
            raise ParameterError(self._argument, f"{words}: {kept}") from None
        self._size += sum(map(len, parts))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _head(columns: Columns, about: Mapping[str, Any], attached: Mapping[str, bytes]) -> bytes:
    said = {
        "format": str(FORMAT),
        "version": __version__,
        "about": json_text(about),
    }
    head = mcap.header(f"asperity {__version__}")
    head += mcap.schema(f"{NAME}/Row", schema_text(columns)) + mcap.channel(f"/{NAME}")
    head += mcap.metadata(NAME, said)
    for name, data in attached.items():
        head += mcap.attachment(name, "application/octet-stream", data)
    return head
