"""Read a recording, also an incomplete one whose process was killed."""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.display import Plottable
from asperity.core.errors import ParameterError
from asperity.core.files import open_input
from asperity.recording import mcap, row_encoding
from asperity.recording.writer import FORMAT, SCHEMA_NAME

# A day of a loop at 10 kHz, and more.
_MAX_BYTES = 2**40
# Of one of the records before the rows: a map of 11000 x 11000 points.
_MAX_RECORD_BYTES = 2**30
_TEXTS = {"format", "version", "about"}
_MAX_NAME = 2**10  # of an attachment [bytes]


@dataclass(frozen=True, eq=False)
class Recording(Plottable):
    """A recording of a loop; rows are read on demand.

    Attributes:
        path: path of the file.
        columns: names and units.
        rows: number of rows.
        metadata: metadata: ``surface``, ``servo``, ``scene`` and more.
        version: version of asperity that wrote it.
        is_complete: whether it was closed; if not, it ends with the last complete block.
        unread_bytes: bytes at the end after the last complete block.
    """

    path: Path
    columns: row_encoding.Columns
    rows: int
    metadata: Mapping[str, Any]
    version: str
    is_complete: bool
    unread_bytes: int
    _chunks: tuple[mcap.Chunk, ...] = field(repr=False, default=())
    _attachments: Mapping[str, tuple[int, int]] = field(repr=False, default_factory=dict)

    def __repr__(self) -> str:
        state = "" if self.is_complete else ", not closed"
        return f"<Recording {self.path.name}, {self.rows} rows, {self.duration:g} s{state}>"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple([name for name, _unit in self.columns])

    @property
    def duration(self) -> float:
        """Time from the first row to the last [s]."""
        if not self._chunks:
            return 0.0
        return 1e-9 * (self._chunks[-1].times[1] - self._chunks[0].times[0])

    def blocks(self) -> Iterator[FloatArray]:
        """Yield the rows in order, some thousands at a time, shape (n, columns).

        Raises:
            ParameterError: if the file is gone, or a block is damaged.
        """
        rows = 0
        with _open_file(self.path) as stream:
            for chunk in self._chunks:
                stream.seek(chunk.rows_start)
                data = stream.read(chunk.size)
                if zlib.crc32(data) != chunk.checksum:
                    raise _unreadable_error(self.path, f"the block after row {rows} is damaged")
                try:
                    block = row_encoding.message_values(data, len(self.columns))
                except mcap.DamagedError as error:
                    raise _unreadable_error(self.path, str(error)) from None
                yield block
                rows += len(block)

    def table(self, max_rows: int | None = None) -> FloatArray:
        """Return the rows, shape (rows, columns).

        Args:
            max_rows: rows at most, thinned out evenly from the first; by default all.

        Raises:
            ParameterError: see :meth:`blocks`.
        """
        step = max(1, -(-self.rows // (max_rows or self.rows or 1)))
        parts = [np.empty((0, len(self.columns)))]
        seen = 0
        for block in self.blocks():
            parts.append(block[-seen % step :: step])
            seen += len(block)
        return np.concatenate(parts)

    def to_columns(self, max_rows: int | None = None) -> row_encoding.TraceTable:
        """Return the rows with their parts by name: time, position, forces; see :meth:`table`."""
        return row_encoding.TraceTable(self.columns, self.table(max_rows))

    def __getitem__(self, name: str) -> FloatArray:
        """Return a column, shape (rows,).

        Raises:
            ParameterError: for a name that there is not; the nearest are offered.
        """
        column = row_encoding.find_column(self.columns, name)
        return np.concatenate([np.empty(0), *[block[:, column] for block in self.blocks()]])

    def ranges(self) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest value of each column; NaN if there are no rows."""
        low, high = np.full((2, len(self.columns)), np.nan)
        for block in self.blocks():
            low = np.fmin(low, block.min(axis=0))
            high = np.fmax(high, block.max(axis=0))
        return low, high

    def attachment(self, name: str) -> bytes | None:
        """Return a file inside the recording; ``None`` if there is none of this name.

        Raises:
            ParameterError: if it is damaged.
        """
        if name not in self._attachments:
            return None
        at, length = self._attachments[name]
        with _open_file(self.path) as stream:
            stream.seek(at)
            try:
                return mcap.read_attachment(stream.read(length))
            except mcap.DamagedError as error:
                raise _unreadable_error(self.path, str(error)) from None

    def to_dict(self) -> dict[str, Any]:
        """Return plain data without the rows."""
        return {
            "schema": 1,
            "path": str(self.path),
            "version": self.version,
            "rows": self.rows,
            "duration": self.duration,
            "whole": self.is_complete,
            "unread": self.unread_bytes,
            "columns": [{"name": name, "unit": unit} for name, unit in self.columns],
            "about": dict(self.metadata),
        }


def is_recording(path: str | os.PathLike[str]) -> bool:
    """Whether the first bytes of a file are those of MCAP."""
    try:
        with open_input(path, _MAX_BYTES) as stream:
            return stream.read(len(mcap.MAGIC)) == mcap.MAGIC
    except (OSError, ValueError):
        return False


def open_recording(path: str | os.PathLike[str]) -> Recording:
    """Open a recording, complete or truncated.

    Args:
        path: path of the file.

    Raises:
        ParameterError: for a file that cannot be read, is no recording, or one of a later version.

    Example:
        >>> import tempfile
        >>> from pathlib import Path
        >>> from asperity.recording.writer import RecordingWriter
        >>> path = Path(tempfile.mkdtemp()) / "run.mcap"
        >>> writer = RecordingWriter(path, (("time", "s"), ("x", "m")))
        >>> writer.append([[0.0, 1e-3], [0.1, 2e-3]])
        >>> writer.flush()
        >>> open_recording(path)
        <Recording run.mcap, 2 rows, 0.1 s, not closed>
        >>> writer.close()
        >>> open_recording(path)
        <Recording run.mcap, 2 rows, 0.1 s>
    """
    place = Path(path)
    with _open_file(place) as stream:
        size = os.fstat(stream.fileno()).st_size
        if not size:
            raise _unreadable_error(place, "it is empty")
        if stream.read(len(mcap.MAGIC)) != mcap.MAGIC:
            raise _unreadable_error(place, "it is not an MCAP recording")
        try:
            return _read(place, stream, size)
        except mcap.DamagedError as error:
            raise _unreadable_error(place, str(error)) from None


def _read(path: Path, stream: IO[bytes], size: int) -> Recording:
    columns: row_encoding.Columns = ()
    texts: dict[str, str] = {}
    chunks: list[mcap.Chunk] = []
    attachments: dict[str, tuple[int, int]] = {}
    is_complete = False
    foreign = False
    end = len(mcap.MAGIC)
    head_end = 0
    for op, at, length in mcap.iterate_records(stream, size):
        if op == mcap.Opcode.DATA_END:
            is_complete = True
            end = size
            break
        if op == mcap.Opcode.CHUNK and not texts:
            foreign = True
            break
        if op == mcap.Opcode.CHUNK:
            chunks.append(mcap.read_chunk(stream, at, length))
        elif op == mcap.Opcode.SCHEMA and not columns:
            columns = _columns(_record_content(stream, at, length))
        elif op == mcap.Opcode.METADATA:
            texts = _read_texts(_record_content(stream, at, length)) or texts
            head_end = end
        elif op == mcap.Opcode.ATTACHMENT:
            content = _record_content(stream, at, min(length, _MAX_NAME))
            content.read(16)  # times: unused
            attachments[content.text()] = at, length
        end = at + length
    metadata = _parse_metadata(texts, is_complete or foreign)
    if not columns:
        raise mcap.DamagedError("it does not say what its rows are")
    if not is_complete and chunks and not _is_intact(stream, chunks[-1]):
        end = chunks.pop().start  # the remains of a loss of power
    if is_complete or chunks:
        _check_head(stream, head_end, texts, attachments)
    rows = _check_rows(stream, chunks, row_encoding.row_type(len(columns)))
    version = texts["version"]
    positions = tuple(chunks)
    return Recording(
        path, columns, rows, metadata, version, is_complete, size - end, positions, attachments
    )


def _check_head(
    stream: IO[bytes], head_end: int, texts: dict[str, str], attachments: Iterable[str]
) -> None:
    """Check the checksum of the records before the rows, which early versions did not write.

    Raises:
        DamagedError: if it differs.
    """
    checksum = texts.pop(mcap.CHECKSUM, None)
    stream.seek(0)
    expected = mcap.head_checksum(stream.read(head_end), texts, attachments)
    if checksum not in {None, expected} or texts.keys() != _TEXTS:
        raise mcap.DamagedError("its metadata is damaged: the checksum is wrong")


def _check_rows(stream: IO[bytes], chunks: Sequence[mcap.Chunk], row: np.dtype[Any]) -> int:
    """Return the number of rows, none of which is missing before the last.

    Raises:
        DamagedError: for a block that is missing, or a last time that is not that of the last row.
    """
    count = 0
    for chunk in chunks:
        if chunk.first_row != (count % 2**32, chunk.times[0]):
            raise mcap.DamagedError(f"the block after row {count} is damaged or missing")
        count += chunk.size // row.itemsize
    if chunks and chunks[-1].size >= row.itemsize:
        stream.seek(chunks[-1].end - row.itemsize)
        (last,) = np.frombuffer(stream.read(row.itemsize), row)
        if last["logged"] != chunks[-1].times[1]:
            raise mcap.DamagedError("its last block contradicts the time of its last row")
    return count


def _read_texts(content: mcap.ContentReader) -> dict[str, str]:
    """Return the texts of a metadata record of asperity; none of another one."""
    return content.texts() if content.text() == SCHEMA_NAME else {}


def _record_content(stream: IO[bytes], at: int, length: int) -> mcap.ContentReader:
    if length > _MAX_RECORD_BYTES:
        raise mcap.DamagedError(f"a record of {length} bytes before the rows")
    stream.seek(at)
    return mcap.ContentReader(stream.read(length))


def _columns(content: mcap.ContentReader) -> row_encoding.Columns:
    content.read(2)
    name = content.text()
    encoding = content.text()
    if encoding != "ros2msg":
        raise mcap.DamagedError(f"its rows are {name!r} in {encoding!r}, none that asperity writes")
    return row_encoding.schema_columns(content.text())


def _is_intact(stream: IO[bytes], chunk: mcap.Chunk) -> bool:
    stream.seek(chunk.rows_start)
    return zlib.crc32(stream.read(chunk.size)) == chunk.checksum


def _parse_metadata(texts: Mapping[str, str], foreign: bool) -> dict[str, Any]:
    """Return the metadata of a recording, if this version of asperity reads it."""
    if not texts.keys() >= _TEXTS:
        if foreign:
            raise mcap.DamagedError("it was not written by asperity")
        raise mcap.DamagedError("it ends before its first row")
    if texts["format"] != str(FORMAT):
        origin = f"it is of format {texts['format']}, of asperity {texts['version']}"
        raise mcap.DamagedError(f"{origin}; this asperity reads format {FORMAT}")
    try:
        metadata = json.loads(texts["about"])
    except ValueError as error:
        raise mcap.DamagedError(f"its metadata is not valid JSON: {error}") from None
    if not isinstance(metadata, dict):
        raise mcap.DamagedError("its metadata is not a table")
    return metadata


def _open_file(path: Path) -> IO[bytes]:
    try:
        return open_input(path, _MAX_BYTES)
    except (OSError, ValueError) as error:  # the latter for a name that no file can have
        raise _unreadable_error(path, getattr(error, "strerror", "") or str(error)) from None


def _unreadable_error(path: Path, reason: str) -> ParameterError:
    return ParameterError("recording", f"{path} cannot be read: {reason}")
