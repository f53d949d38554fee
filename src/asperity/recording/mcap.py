"""The part of the MCAP file format that recordings use.

A file is a sequence of records: operation code, length, content. The rows are in *chunks*, which
are not compressed and have a checksum. A reader takes complete chunks, so that a file that ends
anywhere is read up to its last complete one. The summary at the end is an index for readers that
seek.

Reference:
    The MCAP format specification, version 0, https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import IO

MAGIC = b"\x89MCAP0\r\n"
CHECKSUM = "checksum"
"""Name of the checksum among the metadata."""
CHANNEL = 1
"""Number of the only channel and of its schema."""
# Before the rows of a chunk: first and last time, size, checksum, no compression, size again.
_CHUNK = struct.Struct("<QQQIIQ")
_RECORD = struct.Struct("<BQ")
# A row: its record, channel, number, time.
_ROW = struct.Struct("<BQHIQ")
_MEDIA_TYPE = "application/octet-stream"


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


def encode_record(op: Opcode, *parts: bytes | str | Mapping[str, str]) -> bytes:
    """Return a record; the length of a text and of a map of texts precedes it."""
    content = b"".join(map(_encode_part, parts))
    return _RECORD.pack(op, len(content)) + content


def _encode_part(part: bytes | str | Mapping[str, str]) -> bytes:
    if isinstance(part, bytes):
        return part
    if isinstance(part, str):
        data = part.encode()
    else:
        data = b"".join([_encode_part(text) for item in part.items() for text in item])
    return struct.pack("<I", len(data)) + data


@dataclass(frozen=True)
class Head:
    """The records before the rows, and what the summary repeats of them.

    Attributes:
        content: the records.
        schema_and_channel: two of them.
        index: positions of the metadata and of the attachments.
        attachments: number of attachments.
    """

    content: bytes
    schema_and_channel: bytes
    index: bytes
    attachments: int


def encode_head(
    name: str, library: str, schema: str, texts: Mapping[str, str], attachments: Mapping[str, bytes]
) -> Head:
    """Return the records before the rows.

    Args:
        name: name of the topic, of the schema and of the metadata.
        library: name and version of the writer.
        schema: message definition of the rows (ROS 2).
        texts: metadata by name.
        attachments: files inside the file, by name.
    """
    channel = struct.pack("<H", CHANNEL)
    repeated = encode_record(Opcode.SCHEMA, channel, f"{name}/Row", "ros2msg", schema)
    repeated += encode_record(Opcode.CHANNEL, channel, channel, f"/{name}", "cdr", {})
    content = MAGIC + encode_record(Opcode.HEADER, "", library) + repeated
    checksum = head_checksum(content, texts, attachments)
    metadata = encode_record(Opcode.METADATA, name, {**texts, CHECKSUM: checksum})
    place = struct.pack("<QQ", len(content), len(metadata))
    index = encode_record(Opcode.METADATA_INDEX, place, name)
    content += metadata
    for file, data in attachments.items():
        record = _encode_attachment(file, data)
        place = struct.pack("<QQQQQ", len(content), len(record), 0, 0, len(data))
        index += encode_record(Opcode.ATTACHMENT_INDEX, place, file, _MEDIA_TYPE)
        content += record
    return Head(content, repeated, index, len(attachments))


def head_checksum(before: bytes, texts: Mapping[str, str], attachments: Iterable[str]) -> str:
    """Return the checksum of the records before the rows, which is one of the metadata.

    Args:
        before: the file up to the metadata.
        texts: metadata without the checksum.
        attachments: their names; their content has checksums of its own.
    """
    names = "".join(attachments)
    return f"{zlib.crc32(_encode_part(texts) + _encode_part(names), zlib.crc32(before)):08x}"


def _encode_attachment(name: str, data: bytes) -> bytes:
    times = bytes(16)  # unused
    content = times + _encode_part(name) + _encode_part(_MEDIA_TYPE)
    content += struct.pack("<Q", len(data)) + data
    return encode_record(Opcode.ATTACHMENT, content, struct.pack("<I", zlib.crc32(content)))


@dataclass(frozen=True)
class Chunk:
    """Position of a chunk in a file.

    Attributes:
        start: position of the record.
        rows_start: position of its rows.
        size: size of its rows [bytes].
        checksum: CRC-32 of its rows.
        times: times of the first and the last row [ns].
        index_size: size of the index of its rows, which follows [bytes].
        first_row: number, modulo 2³², and time [ns] of its first row.
    """

    start: int
    rows_start: int
    size: int
    checksum: int
    times: tuple[int, int]
    index_size: int = 0
    first_row: tuple[int, int] = (0, 0)

    @property
    def end(self) -> int:
        """Position after the record."""
        return self.rows_start + self.size


def encode_chunk(
    start: int, rows: memoryview, times: tuple[int, int], index: bytes
) -> tuple[Chunk, tuple[bytes, memoryview, bytes]]:
    """Return the position of a chunk, and its parts: head, unchanged rows, index.

    Args:
        start: its future position in the file.
        rows: bytes of complete message records.
        times: times of the first and the last row [ns].
        index: time [ns] and offset in ``rows`` of each row, 64-bit integers.
    """
    checksum = zlib.crc32(rows)
    head = _CHUNK.pack(*times, len(rows), checksum, 0, len(rows))
    # The rows are many: they are not copied into one content.
    front = _RECORD.pack(Opcode.CHUNK, len(head) + len(rows)) + head
    listed = encode_record(Opcode.MESSAGE_INDEX, struct.pack("<HI", CHANNEL, len(index)), index)
    place = Chunk(start, start + len(front), len(rows), checksum, times, len(listed))
    return place, (front, rows, listed)


def encode_summary(head: Head, chunks: list[Chunk], rows: int, offset: int) -> bytes:
    """Return the end of a complete file: an index of its records.

    Args:
        head: result of :func:`encode_head`.
        chunks: positions of the chunks.
        rows: number of rows.
        offset: position of the result in the file.
    """
    data_end = encode_record(Opcode.DATA_END, bytes(4))
    parts = [head.schema_and_channel, _encode_statistics(head, chunks, rows)]
    parts += [*map(_encode_chunk_index, chunks), head.index]
    summary = b"".join(parts)
    footer = _RECORD.pack(Opcode.FOOTER, 20) + struct.pack("<QQ", offset + len(data_end), 0)
    checksum = zlib.crc32(footer, zlib.crc32(summary))
    return data_end + summary + footer + struct.pack("<I", checksum) + MAGIC


def _encode_statistics(head: Head, chunks: list[Chunk], rows: int) -> bytes:
    times = (0, 0)
    if chunks:
        times = (chunks[0].times[0], chunks[-1].times[1])
    counts = struct.pack("<QHIIII", rows, 1, 1, head.attachments, 1, len(chunks))
    rows_of_channel = struct.pack("<IHQ", 10, CHANNEL, rows)
    return encode_record(Opcode.STATISTICS, counts, struct.pack("<QQ", *times), rows_of_channel)


def _encode_chunk_index(chunk: Chunk) -> bytes:
    data = struct.pack("<QQQQ", *chunk.times, chunk.start, chunk.end - chunk.start)
    data += struct.pack("<IHQQ", 10, CHANNEL, chunk.end, chunk.index_size)
    return encode_record(Opcode.CHUNK_INDEX, data, struct.pack("<IQQ", 0, chunk.size, chunk.size))


# --- reading --------------------------------------------------------------------------------------


class ContentReader:
    """Reads the fields of a record's content in order.

    Raises:
        DamagedError: a field exceeds the content, or a text is not UTF-8.
    """

    def __init__(self, content: bytes | memoryview) -> None:
        self._remaining = memoryview(content)

    def read(self, size: int) -> memoryview:
        """Return a number of bytes."""
        if size > len(self._remaining):
            raise DamagedError("a record ends within a field")
        part = self._remaining[:size]
        self._remaining = self._remaining[size:]
        return part

    def number(self, size: int) -> int:
        """Return an unsigned integer of a size in bytes."""
        return int.from_bytes(self.read(size), "little")

    def text(self) -> str:
        """Return a text."""
        try:
            return bytes(self.read(self.number(4))).decode()
        except UnicodeDecodeError as error:
            raise DamagedError(f"invalid text: {error}") from None

    def texts(self) -> dict[str, str]:
        """Return texts by name."""
        inner = ContentReader(self.read(self.number(4)))
        texts = {}
        while inner._remaining:
            name = inner.text()
            texts[name] = inner.text()
        return texts


def read_attachment(content: bytes) -> bytes:
    """Return the data of a file inside the file.

    Raises:
        DamagedError: its checksum differs.
    """
    reader = ContentReader(content)
    reader.read(16)  # times: unused
    name = reader.text()
    reader.text()  # media type
    data = bytes(reader.read(reader.number(8)))
    checksum = reader.number(4)
    if checksum not in {0, zlib.crc32(content[: len(content) - 4])}:
        raise DamagedError(f"the attachment {name} is damaged")
    return data


def iterate_records(stream: IO[bytes], size: int) -> Iterator[tuple[int, int, int]]:
    """Yield code, position of the content and its length for each complete record.

    Args:
        stream: stream that seeks; records begin after MAGIC.
        size: size of the file [bytes].
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
    """Return the chunk whose content begins at a position.

    Raises:
        DamagedError: the chunk is compressed, or its sizes contradict each other.
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
    row = stream.read(min(_ROW.size, size))
    number, logged = _ROW.unpack(row)[3:] if len(row) == _ROW.size else (0, 0)
    place = at - _RECORD.size, at + _CHUNK.size
    return Chunk(*place, size, checksum, (first, last), first_row=(number, logged))
