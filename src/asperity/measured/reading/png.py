"""Read PNG images of heights, 8 and 16 bit."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError
from asperity.measured.reading.image import Pixels, check_size
from asperity.measured.reading.png_scale import png_scale
from asperity.measured.reading.quiet import guarded
from asperity.measured.reading.tiff_scale import NO_SCALE, Scale

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_PIECE = 2**22
_INFLATION = 1032  # deflate packs at most this many bytes into one
_GREY, _COLOUR, _PALETTE, _GREY_ALPHA, _COLOUR_ALPHA = 0, 2, 3, 4, 6
# First column and row, and steps, of the seven passes of an interlaced image.
_ADAM7 = (
    (0, 0, 8, 8),
    (4, 0, 8, 8),
    (0, 4, 4, 8),
    (2, 0, 4, 4),
    (0, 2, 2, 4),
    (1, 0, 2, 2),
    (0, 1, 1, 2),
)
_CHANNELS = {_GREY: 1, _COLOUR: 3, _GREY_ALPHA: 2, _COLOUR_ALPHA: 4}


@dataclass(frozen=True)
class _Header:
    """What the chunks say before anything is unpacked."""

    columns: int
    rows: int
    depth: int
    colour: int
    interlaced: bool
    packed: list[bytes]
    scale: Scale = NO_SCALE

    @property
    def pixel(self) -> int:
        """Bytes of a pixel."""
        return _CHANNELS[self.colour] * self.depth // 8

    @property
    def size(self) -> int:
        """Bytes of all rows unpacked, each with its filter."""
        total = 0
        for x, y, step_x, step_y in _ADAM7 if self.interlaced else ((0, 0, 1, 1),):
            columns = len(range(x, self.columns, step_x))
            rows = len(range(y, self.rows, step_y))
            total += rows * (columns * self.pixel + 1) if columns else 0
        return total


def read_png(content: bytes) -> Pixels:
    """Read one grey or colour picture of 8 or 16 bit.

    Args:
        content: the bytes of the file.

    Returns:
        The pixels as stored, with the lengths that the chunks sCAL and pCAL name.

    Raises:
        SurfaceFileError: palette, less than 8 bit, animation, transparency by colour, damage.

    Reference:
        Portable Network Graphics (PNG) Specification, third edition, W3C.
    """
    try:
        header = _header(content)
        alpha = header.colour in (_GREY_ALPHA, _COLOUR_ALPHA)
        # Pillow cuts 16 bit to 8 where there are several channels.
        if header.depth == 16 and header.colour != _GREY:
            values: NDArray[Any] = _sixteen_bit(header)
        else:
            _check_complete(header)
            values = _by_pillow(content, header)
        return Pixels(values, alpha, header.scale.notes, header.scale)
    except (struct.error, zlib.error) as error:
        raise SurfaceFileError(f"damaged PNG image ({error})") from error


def _header(content: bytes) -> _Header:
    chunks = list(_chunks(content))
    if not chunks or chunks[0][0] != b"IHDR":
        raise SurfaceFileError("damaged PNG image (no header)")
    columns, rows, depth, colour, _, _, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    check_size(rows, columns)
    if colour == _PALETTE:
        raise SurfaceFileError("has a palette, whose colours are no heights; save a grey image")
    if depth not in (8, 16) or colour not in _CHANNELS:
        raise SurfaceFileError(f"has {depth} bit per pixel; 8 and 16 bit are read")
    for kind, data in chunks:
        if kind == b"tRNS":
            raise SurfaceFileError("has a transparent colour; transparency has no height")
        if kind == b"acTL":
            raise SurfaceFileError(
                f"is an animation of {struct.unpack_from('>I', data)[0]} frames; one is expected"
            )
    packed = [data for kind, data in chunks if kind == b"IDAT"]
    scale = png_scale(dict(chunks), depth)
    header = _Header(columns, rows, depth, colour, interlace != 0, packed, scale)
    if _INFLATION * sum(map(len, packed)) < header.size:  # refused before memory is asked for
        raise SurfaceFileError(
            f"truncated: {sum(map(len, packed))} bytes cannot hold {columns} x {rows} pixels"
        )
    return header


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    at = len(PNG_MAGIC)
    while at + 8 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, at)
        data = content[at + 8 : at + 8 + length]
        if len(data) < length or at + 12 + length > len(content):
            raise SurfaceFileError("truncated PNG image")
        if zlib.crc32(data, zlib.crc32(kind)) != int.from_bytes(
            content[at + 8 + length : at + 12 + length]
        ):
            raise SurfaceFileError(f"damaged PNG image (checksum of {kind.decode('latin-1')!r})")
        yield kind, data
        if kind == b"IEND":
            return
        at += 12 + length
    raise SurfaceFileError("truncated PNG image")


def _check_complete(header: _Header) -> None:
    """Count the bytes that the pixels unpack to: Pillow fills missing rows with zeros."""
    inflate = zlib.decompressobj()
    missing = header.size
    for data in header.packed:
        while data and missing > 0:
            missing -= len(inflate.decompress(data, min(missing, _PIECE)))
            data = inflate.unconsumed_tail  # noqa: PLW2901 - what the piece left of the chunk
    if missing > 0:
        raise SurfaceFileError("truncated PNG image")


def _by_pillow(content: bytes, header: _Header) -> NDArray[Any]:
    from PIL import Image

    picture = io.BytesIO(content)
    # The size, of which it warns, was checked above.
    with guarded("damaged PNG image", "PIL"), Image.open(picture, formats=("PNG",)) as image:
        values = np.asarray(image)
    expected = (header.rows, header.columns, _CHANNELS[header.colour])
    if values.size != np.prod(expected) or values.dtype.itemsize != header.depth // 8:
        raise SurfaceFileError("damaged PNG image (pixels are missing)")
    return values.reshape(expected)


def _sixteen_bit(header: _Header) -> NDArray[np.uint16]:
    """Decode 16-bit colour or grey with opacity."""
    if header.interlaced:
        raise SurfaceFileError("is an interlaced 16-bit colour image; save it without interlacing")
    pixel = header.pixel
    stride = header.columns * pixel
    inflate = zlib.decompressobj()
    data = inflate.decompress(b"".join(header.packed), header.size)
    if len(data) != header.size:
        raise SurfaceFileError("truncated PNG image")
    rows = np.frombuffer(data, np.uint8).reshape(header.rows, stride + 1)
    if rows[:, 0].max() > 4:
        raise SurfaceFileError(f"damaged PNG image (filter {rows[:, 0].max()})")
    plain = _unfiltered(rows[:, 1:].reshape(header.rows, header.columns, pixel), rows[:, 0])
    return (
        plain.reshape(header.rows, stride)
        .view(">u2")
        .astype(np.uint16)
        .reshape(header.rows, header.columns, pixel // 2)
    )


def _unfiltered(filtered: NDArray[np.uint8], kinds: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Add what each row's filter predicts from the left (a), above (b) and above left (c).

    Pixels on one anti-diagonal need only those on the two before, so that a whole
    anti-diagonal is computed at once.
    """
    rows, columns, width = filtered.shape
    # One row above and one pixel to the left of the image are zero.
    plain = np.zeros((rows + 1, columns + 1, width), dtype=np.uint8)
    for diagonal in range(rows + columns - 1):
        i = np.arange(max(0, diagonal - columns + 1), min(rows, diagonal + 1))
        j = diagonal - i
        a = plain[i + 1, j].astype(np.int16)
        b = plain[i, j + 1].astype(np.int16)
        c = plain[i, j].astype(np.int16)
        guess = np.choose(kinds[i, None], (0 * a, a, b, (a + b) >> 1, _paeth(a, b, c)))
        plain[i + 1, j + 1] = (filtered[i, j] + guess) & 0xFF
    return np.ascontiguousarray(plain[1:, 1:])


def _paeth(a: NDArray[np.int16], b: NDArray[np.int16], c: NDArray[np.int16]) -> NDArray[np.int16]:
    """Return the neighbour that is nearest to a + b - c, in this order of preference."""
    to_a, to_b, to_c = np.abs(b - c), np.abs(a - c), np.abs(a + b - 2 * c)
    return np.where((to_a <= to_b) & (to_a <= to_c), a, np.where(to_b <= to_c, b, c))
