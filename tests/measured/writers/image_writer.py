"""Write PNG and TIFF images for tests byte by byte, independently of the readers' libraries."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

COLOUR = {1: 0, 2: 4, 3: 2, 4: 6}  # PNG's colour type of so many channels


def chunk(kind: bytes, data: bytes) -> bytes:
    """Return a PNG chunk with its checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(
    path: Path,
    values: NDArray[Any],
    *,
    extra: bytes = b"",
    filters: bool = False,
    size: tuple[int, int] | None = None,
    colour: int | None = None,
    depth: int | None = None,
) -> Path:
    """Write 8- or 16-bit pixels, shape (rows, columns[, channels]).

    filters: take the five row filters in turn instead of none. size, colour and depth lie.
    """
    pixels = values[..., None] if values.ndim == 2 else values
    rows, columns, channels = pixels.shape
    raw = pixels.astype(">u2" if pixels.dtype.itemsize == 2 else "u1")
    lines = raw.reshape(rows, -1).view(np.uint8).astype(int).tolist()
    step = channels * pixels.dtype.itemsize
    packed = bytearray()
    above = [0] * len(lines[0])
    for number, line in enumerate(lines):
        kind = number % 5 if filters else 0
        packed.append(kind)
        packed += bytes(_filtered(line, above, step, kind))
        above = line
    width, height = size or (columns, rows)
    bits = depth or 8 * pixels.dtype.itemsize
    header = struct.pack(
        ">IIBBBBB", width, height, bits, COLOUR[channels] if colour is None else colour, 0, 0, 0
    )
    content = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + extra
    data = zlib.compress(bytes(packed))
    half = len(data) // 2  # in two chunks, as large files are
    content += chunk(b"IDAT", data[:half]) + chunk(b"IDAT", data[half:])
    path.write_bytes(content + chunk(b"IEND", b""))
    return path


def _filtered(line: list[int], above: list[int], step: int, kind: int) -> list[int]:
    out = []
    for k, value in enumerate(line):
        a = line[k - step] if k >= step else 0
        b = above[k]
        c = above[k - step] if k >= step else 0
        distances = {q: abs(a + b - c - q) for q in (a, b, c)}
        paeth = min(distances, key=distances.__getitem__)
        out.append((value - (0, a, b, (a + b) // 2, paeth)[kind]) % 256)
    return out


def write_tiff(
    path: Path,
    values: NDArray[Any],
    *,
    big_endian: bool = False,
    photometric: int = 1,
    extra_sample: int | None = None,
    pages: int = 1,
    tags: dict[int, tuple[int, bytes]] | None = None,
) -> Path:
    """Write an uncompressed TIFF of one strip a page; tags: code -> (type, value bytes)."""
    order: Literal["<", ">"] = ">" if big_endian else "<"
    pixels = values[..., None] if values.ndim == 2 else values
    rows, columns, channels = pixels.shape
    data = pixels.astype(pixels.dtype.newbyteorder(order)).tobytes()
    kind = {"u": 1, "i": 2, "f": 3}[pixels.dtype.kind]
    bits = 8 * pixels.dtype.itemsize
    content = (b"MM" if big_endian else b"II") + struct.pack(order + "HI", 42, 0)
    pointer = 4
    for _ in range(pages):
        content += data + b"\0" * (len(data) % 2)
        start = len(content) - len(data) - len(data) % 2
        entries = {
            256: (4, struct.pack(order + "I", columns)),
            257: (4, struct.pack(order + "I", rows)),
            258: (3, struct.pack(order + "H", bits) * channels),
            259: (3, struct.pack(order + "H", 1)),
            262: (3, struct.pack(order + "H", photometric)),
            273: (4, struct.pack(order + "I", start)),
            277: (3, struct.pack(order + "H", channels)),
            278: (4, struct.pack(order + "I", rows)),
            279: (4, struct.pack(order + "I", len(data))),
            339: (3, struct.pack(order + "H", kind) * channels),
        }
        if extra_sample is not None:
            entries[338] = (3, struct.pack(order + "H", extra_sample))
        content, pointer = _directory(content, pointer, entries | (tags or {}), order)
    path.write_bytes(content)
    return path


def _directory(
    content: bytes, pointer: int, entries: dict[int, tuple[int, bytes]], order: str
) -> tuple[bytes, int]:
    sizes = {2: 1, 3: 2, 4: 4, 5: 8, 7: 1, 12: 8}
    table = b""
    for code, (kind, value) in sorted(entries.items()):
        if len(value) > 4:
            place = struct.pack(order + "I", len(content))
            content += value + b"\0" * (len(value) % 2)
        else:
            place = value.ljust(4, b"\0")
        table += struct.pack(order + "HHI", code, kind, len(value) // sizes[kind]) + place
    at = len(content)
    content = content[:pointer] + struct.pack(order + "I", at) + content[pointer + 4 :]
    content += struct.pack(order + "H", len(entries)) + table + b"\0\0\0\0"
    return content, len(content) - 4
