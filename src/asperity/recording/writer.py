"""Writing of recordings, row by row, readable at any time.

Rows are buffered until a block is full, or for half a second, and are written in one piece. A
process that is killed loses at most the buffered rows and the block under way: less than a second.
Written data survive the process, but not a loss of power: Linux writes them to the disk within half
a minute, and :meth:`RecordingWriter.close` waits for it.
"""

from __future__ import annotations

import os
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import json_text, open_atomic
from asperity.core.version import __version__
from asperity.recording import mcap, row_encoding

FORMAT = 1
"""Version of the metadata of a recording."""
SCHEMA_NAME = "asperity"
"""Name of the metadata, of the channel and of the schema."""
MAX_WAIT = 0.5
"""Longest time that rows are buffered [s]."""
# Rows of a block: 0.4 s of a loop at 10 kHz, one megabyte.
_BLOCK_ROWS = 4096


class RecordingWriter(AbstractContextManager["RecordingWriter"]):
    """Writes a recording.

    The file is created with a complete header and replaces an existing one. Rows are buffered: call
    :meth:`flush` when the loop pauses.

    Args:
        path: path of the file.
        columns: names and units; the first is ``("time", "s")``.
        metadata: metadata of the recording as plain data; see
            :func:`asperity.core.files.to_plain_data`.
        attachments: files inside it, by name.
        argument: name of the path in messages.

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
        columns: row_encoding.Columns,
        metadata: Mapping[str, Any] | None = None,
        attachments: Mapping[str, bytes] | None = None,
        argument: str = "path",
    ) -> None:
        self._path = Path(path)
        self._columns = columns
        self._argument = argument
        texts = {"format": str(FORMAT), "version": __version__, "about": json_text(metadata or {})}
        library = f"asperity {__version__}"
        self._head = mcap.encode_head(
            SCHEMA_NAME, library, row_encoding.schema_text(columns), texts, attachments or {}
        )
        self._messages = row_encoding.message_template(_BLOCK_ROWS, len(columns))
        self._pending_rows = 0
        self._last_flush = time.monotonic()
        self._chunks: list[mcap.Chunk] = []
        self.rows = 0
        """Rows that are written."""
        try:
            with open_atomic(path) as stream:
                stream.write(self._head.content)
            self._file = open(path, "ab", buffering=0)  # noqa: SIM115 - closed by close()
        except OSError as error:
            raise ParameterError(argument, f"cannot be written: {error}") from None
        self._size = len(self._head.content)

    def __repr__(self) -> str:
        return f"<RecordingWriter of {self._path.name}, {self.rows} rows written>"

    def append(self, block: FloatArray) -> None:
        """Take rows, shape (n, columns); they are written when there are enough, or time is due.

        Raises:
            ParameterError: for another shape; if the file cannot grow, which then ends with whole
                blocks.
        """
        table = row_encoding.check_table(block, self._columns)
        while len(table):
            room = min(len(table), len(self._messages) - self._pending_rows)
            rows = self._messages[self._pending_rows : self._pending_rows + room]
            row_encoding.write_messages(rows, self.rows + self._pending_rows, table[:room])
            self._pending_rows += room
            table = table[room:]
            if self._pending_rows == len(self._messages):
                self.flush()
        if time.monotonic() - self._last_flush >= MAX_WAIT:
            self.flush()

    def flush(self) -> None:
        """Write the buffered rows.

        Raises:
            ParameterError: see :meth:`append`.
        """
        self._last_flush = time.monotonic()
        if not self._pending_rows:
            return
        rows = self._messages[: self._pending_rows]
        logged = rows["logged"]
        size = np.uint64(rows.dtype.itemsize)
        index = np.stack([logged, np.arange(len(rows), dtype=np.uint64) * size], axis=1)
        times = int(logged[0]), int(logged[-1])
        data = rows.view(np.uint8).data
        chunk, parts = mcap.encode_chunk(self._size, data, times, index.tobytes())
        self._pending_rows = 0
        self._write(*parts)
        self._chunks.append(chunk)
        self.rows += len(rows)

    def close(self) -> None:
        """Write the buffered rows and the index, and wait for the disk.

        Raises:
            ParameterError: see :meth:`append`; written rows can be read.
        """
        if self._file.closed:
            return
        self.flush()
        self._write(mcap.encode_summary(self._head, self._chunks, self.rows, self._size))
        with suppress(OSError):  # a device such as /dev/null cannot be synchronized
            os.fsync(self._file.fileno())
        self._file.close()

    def _write(self, *parts: bytes | memoryview) -> None:
        """Write all parts, or none."""
        try:
            for part in parts:
                remaining = memoryview(part)
                while remaining:
                    remaining = remaining[self._file.write(remaining) or 0 :]
        except OSError as error:
            with suppress(OSError):  # a device such as /dev/full has no length
                self._file.truncate(self._size)
            self._file.close()
            reason = f"cannot be written any further ({error.strerror})"
            requirement = f"{reason}: {self.rows} rows are in {self._path}"
            raise ParameterError(self._argument, requirement) from None
        self._size += sum(map(len, parts))

    def __exit__(self, *_: object) -> None:
        self.close()
