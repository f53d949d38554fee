"""The container of a recording: MCAP, of which this writes and reads what a recording needs.

Records follow one another: an operation code, a length, a content. Rows stand in *chunks*, which
are plain (not compressed) and have a checksum; a reader takes whole chunks, so a file that ends
anywhere is read to its last whole one. The summary at the end is an index for readers that seek.

Reference:
    The MCAP format specification, version 0, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import IO

MAGIC = b"\x89MCAP0\r\n"
CHANNEL = 1
"""Number of the one channel, and of its schema."""
# Before the rows of a chunk: first and last time, size, checksum, no compression, size again.
_CHUNK = struct.Struct("<QQQIIQ")
_RECORD = struct.Struct("<BQ")


class Opcode(IntEnum):
    """Codes of the records."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    ATTACHMENT = 0x09
    ATTACHMENT_INDEX = 0x0A
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    DATA_END = 0x0F


class DamagedError(ValueError):
    """A record that violates the format."""


# --- writing --------------------------------------------------------------------------------------


def encode_record(op: Opcode, content: bytes) -> bytes:
    """Return a record."""
    return _RECORD.pack(op, len(content)) + content


def encode_header(library: str) -> bytes:
    """Return what a file begins with."""
    return MAGIC + encode_record(Opcode.HEADER, _encode_text("") + _encode_text(library))


def encode_schema(name: str, text: str) -> bytes:
    """Return the schema of the rows, a message definition of ROS 2."""
    data = _encode_text(name) + _encode_text("ros2msg") + _encode_text(text)
    return encode_record(Opcode.SCHEMA, struct.pack("<H", CHANNEL) + data)


def encode_channel(topic: str) -> bytes:
    """Return the channel of the rows."""
    data = _encode_text(topic) + _encode_text("cdr") + _encode_texts({})
    return encode_record(Opcode.CHANNEL, struct.pack("<HH", CHANNEL, CHANNEL) + data)


def encode_metadata(name: str, texts: Mapping[str, str]) -> bytes:
    """Return a record of texts by name."""
    return encode_record(Opcode.METADATA, _encode_text(name) + _encode_texts(texts))


def encode_attachment(name: str, kind: str, data: bytes) -> bytes:
    """Return a file inside the file."""
    content = struct.pack("<QQ", 0, 0) + _encode_text(name) + _encode_text(kind)
    content += struct.pack("<Q", len(data)) + data
    return encode_record(Opcode.ATTACHMENT, content + struct.pack("<I", zlib.crc32(content)))


@dataclass(frozen=True)
class Chunk:
    """Where a chunk lies.

    Attributes:
        start: of the record in the file.
        rows_start: where its rows begin.
        size: of its rows [bytes].
        checksum: of its rows.
        times: of the first and the last row [ns].
        index_size: of the index of its rows, which follows [bytes].
    """

    start: int
    rows_start: int
    size: int
    checksum: int
    times: tuple[int, int]
    index_size: int = 0

    @property
    def end(self) -> int:
        """Where the record ends."""
        return self.rows_start + self.size


def encode_chunk(
    start: int, rows: memoryview, times: tuple[int, int], index: bytes
) -> tuple[Chunk, tuple[bytes, memoryview, bytes]]:
    """Return where a chunk lies, and its parts: front, rows as they are, index.

    Args:
        start: where it will begin in the file.
        rows: bytes of whole message records.
        times: of the first and the last [ns].
        index: time [ns] and place in ``rows`` of each, 64-bit integers.
    """
    checksum = zlib.crc32(rows)
    head = _CHUNK.pack(*times, len(rows), checksum, 0, len(rows))
    # The length of the content, before the content is put together: rows are many.
    front = _RECORD.pack(Opcode.CHUNK, len(head) + len(rows)) + head
    listed = encode_record(Opcode.MESSAGE_INDEX, struct.pack("<HI", CHANNEL, len(index)) + index)
    place = Chunk(start, start + len(front), len(rows), checksum, times, len(listed))
    return place, (front, rows, listed)


def encode_summary(head: bytes, chunks: list[Chunk], rows: int, offset: int) -> bytes:
    """Return what a whole file ends with.

    Args:
        head: what the file begins with.
        chunks: where they lie.
        rows: how many there are.
        offset: where the ending begins in the file.
    """
    data_end = encode_record(Opcode.DATA_END, struct.pack("<I", 0))
    summary = b"".join(
        head[at : at + size]
        for op, at, size in _record_positions(head)
        if op in {Opcode.SCHEMA, Opcode.CHANNEL}
    )
    summary += _statistics(head, chunks, rows)
    summary += b"".join(map(_chunk_index, chunks))
    summary += b"".join(_head_index(head))
    start = offset + len(data_end)
    footer = _RECORD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", start, 0)
    checksum = zlib.crc32(footer, zlib.crc32(summary))
    return data_end + summary + footer + struct.pack("<I", checksum) + MAGIC


def _statistics(head: bytes, chunks: list[Chunk], rows: int) -> bytes:
    ops = [op for op, _, _ in _record_positions(head)]
    first, last = (chunks[0].times[0], chunks[-1].times[1]) if chunks else (0, 0)
    counts = rows, 1, 1, ops.count(Opcode.ATTACHMENT), ops.count(Opcode.METADATA), len(chunks)
    each = struct.pack("<IHQ", 10, CHANNEL, rows)
    return encode_record(Opcode.STATISTICS, struct.pack("<QHIIIIQQ", *counts, first, last) + each)


def _chunk_index(chunk: Chunk) -> bytes:
    begin, end = chunk.start, chunk.end
    data = struct.pack("<QQQQ", *chunk.times, begin, end - begin)
    data += struct.pack("<IHQQ", 10, CHANNEL, end, chunk.index_size)
    return encode_record(Opcode.CHUNK_INDEX, data + struct.pack("<IQQ", 0, chunk.size, chunk.size))


def _head_index(head: bytes) -> Iterator[bytes]:
    for op, at, size in _record_positions(head):
        content = memoryview(head)[at + _RECORD.size : at + size]
        if op == Opcode.METADATA:
            name = ContentReader(content).text()
            yield encode_record(
                Opcode.METADATA_INDEX, struct.pack("<QQ", at, size) + _encode_text(name)
            )
        elif op == Opcode.ATTACHMENT:
            name, kind, data = read_attachment(content)
            index = (
                struct.pack("<QQQQQ", at, size, 0, 0, len(data))
                + _encode_text(name)
                + _encode_text(kind)
            )
            yield encode_record(Opcode.ATTACHMENT_INDEX, index)


def _record_positions(head: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield code, place and size of the records at the beginning of a file."""
    at = len(MAGIC)
    while at < len(head):
        op, length = _RECORD.unpack_from(head, at)
        yield op, at, _RECORD.size + length
        at += _RECORD.size + length


def _encode_text(text: str) -> bytes:
    data = text.encode()
    return struct.pack("<I", len(data)) + data


def _encode_texts(texts: Mapping[str, str]) -> bytes:
    data = b"".join(_encode_text(name) + _encode_text(value) for name, value in texts.items())
    return struct.pack("<I", len(data)) + data


# --- reading --------------------------------------------------------------------------------------


class ContentReader:
    """Reads the parts of a record's content, one after the other.

    Raises:
        DamagedError: for a part that goes beyond the end, or a text that is none.
    """

    def __init__(self, content: bytes | memoryview) -> None:
        self._remaining = memoryview(content)

    def read(self, size: int) -> memoryview:
        """Return so many bytes."""
        if size > len(self._remaining):
            raise DamagedError("a record ends within a field")
        part, self._remaining = self._remaining[:size], self._remaining[size:]
        return part

    def number(self, size: int) -> int:
        """Return an integer of so many bytes."""
        return int.from_bytes(self.read(size), "little")

    def text(self) -> str:
        """Return a text."""
        try:
            return bytes(self.read(self.number(4))).decode()
        except UnicodeDecodeError as error:
            raise DamagedError(f"invalid text: {error}") from None

    def texts(self) -> dict[str, str]:
        """Return texts by name."""
        inner, found = ContentReader(self.read(self.number(4))), {}
        while inner._remaining:
            name = inner.text()
            found[name] = inner.text()
        return found


def read_attachment(content: bytes | memoryview) -> tuple[str, str, bytes]:
    """Return name, kind and data of a file inside the file.

    Raises:
        DamagedError: if its checksum is another.
    """
    reader = ContentReader(content)
    reader.read(16)  # times: unused
    name, kind = reader.text(), reader.text()
    data = bytes(reader.read(reader.number(8)))
    checksum = reader.number(4)
    if checksum not in {0, zlib.crc32(content[: len(content) - 4])}:
        raise DamagedError(f"the attachment {name} is damaged")
    return name, kind, data


def iterate_records(stream: IO[bytes], size: int) -> Iterator[tuple[int, int, int]]:
    """Yield code, place and length of the content of each whole record; it begins after MAGIC.

    Args:
        stream: that seeks.
        size: of the file: a record that goes beyond is none.
    """
    at = len(MAGIC)
    while at + _RECORD.size <= size:
        stream.seek(at)
        op, length = _RECORD.unpack(stream.read(_RECORD.size))
        at += _RECORD.size
        if at + length > size:
            return
        yield op, at, length
        at += length


def read_chunk(stream: IO[bytes], at: int, length: int) -> Chunk:
    """Return where the chunk lies whose content begins at a place.

    Raises:
        DamagedError: for one that is compressed, or whose sizes contradict each other.
    """
    stream.seek(at)
    head = stream.read(min(_CHUNK.size, length))
    if len(head) < _CHUNK.size:
        raise DamagedError("a block is too short")
    first, last, size, checksum, compressed, stored = _CHUNK.unpack(head)
    if compressed:
        raise DamagedError("its blocks are compressed, which asperity never does: unpack it first")
    if size != stored or _CHUNK.size + size != length:
        raise DamagedError("a block contradicts its size")
    return Chunk(at - _RECORD.size, at + _CHUNK.size, size, checksum, (first, last))
