"""Read PNG images of heights, 8 and 16 bit."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading.images.pixels import (
    Pixels,
    check_image_size,
    pixels_to_surface,
    png_scale,
)
from asperity.measured.reading.isolation import reject_on_error
from asperity.measured.reading.reader import RawSurface, ReadingOptions, SurfaceFile

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_MAX_COMPRESSION_RATIO = 1032  # deflate packs at most this many bytes into one
_BLOCK = 2**22  # bytes
_PALETTE = 3
# First column and row, and steps, of the passes of an image, and of an interlaced one.
_PASSES = ((0, 0, 1, 1),)
_ADAM7 = (
    *((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4)),
    *((0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)),
)
# By colour type: the number of channels and Pillow's mode.
_COLOUR_TYPES = {0: (1, "L"), 2: (3, "RGB"), 4: (2, "LA"), 6: (4, "RGBA")}


def read_png(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read one grey or colour image of 8 or 16 bit, with the lengths in the chunks sCAL and pCAL.

    Raises:
        SurfaceFileError: palette, less than 8 bit, animation, transparency by colour, damage.

    Reference:
        Portable Network Graphics (PNG) Specification, third edition, W3C.
    """
    try:
        pixels = _read_pixels(file.content)
    except (struct.error, zlib.error) as error:
        raise SurfaceFileError(f"damaged PNG image ({error})") from error
    return pixels_to_surface(pixels, file.name, options)


def _read_pixels(content: bytes) -> Pixels:
    chunks = list(_iter_chunks(content))
    if not chunks or chunks[0][0] != b"IHDR":
        raise SurfaceFileError("damaged PNG image (no header)")
    columns, rows, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[0][1])
    check_image_size(rows, columns)
    if colour == _PALETTE:
        raise SurfaceFileError("has a palette, whose colours are no heights; save a grey image")
    if depth not in (8, 16) or colour not in _COLOUR_TYPES:
        raise SurfaceFileError(f"has {depth} bit per pixel; 8 and 16 bit are read")
    by_kind = dict(chunks)
    if b"tRNS" in by_kind:
        raise SurfaceFileError("has a transparent colour; transparency has no height")
    if b"acTL" in by_kind:
        frames = struct.unpack_from(">I", by_kind[b"acTL"])[0]
        raise SurfaceFileError(f"is an animation of {frames} frames; one is expected")
    packed = b"".join(data for kind, data in chunks if kind == b"IDAT")
    channels, mode = _COLOUR_TYPES[colour]
    needed = 0  # bytes of all rows, each with its filter
    for x, y, step_x, step_y in _ADAM7 if interlaced else _PASSES:
        width, height = len(range(x, columns, step_x)), len(range(y, rows, step_y))
        needed += height * (width * channels * depth // 8 + 1) if width else 0
    if _MAX_COMPRESSION_RATIO * len(packed) < needed:  # before any memory is allocated
        size = f"{columns} x {rows} pixels"
        raise SurfaceFileError(f"truncated: {len(packed)} bytes cannot hold {size}")
    _check_complete(packed, needed)
    with reject_on_error("damaged or truncated PNG image"):
        values = _decode(packed, (columns, rows), mode, depth, interlaced)
    scale = png_scale(by_kind, depth)
    values = values.reshape(rows, columns, channels)
    return Pixels(values, mode.endswith("A"), scale.notes, scale)


def _iter_chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield kind and content of each chunk up to IEND, with its checksum verified."""
    start = len(PNG_MAGIC)
    while start + 8 <= len(content):
        length, kind = struct.unpack_from(">I4s", content, start)
        end = start + 8 + length
        if end + 4 > len(content):
            break
        data = content[start + 8 : end]
        if zlib.crc32(data, zlib.crc32(kind)) != int.from_bytes(content[end : end + 4]):
            raise SurfaceFileError(f"damaged PNG image (checksum of {kind.decode('latin-1')!r})")
        yield kind, data
        if kind == b"IEND":
            return
        start = end + 4
    raise SurfaceFileError("truncated PNG image")


def _check_complete(packed: bytes, needed: int) -> None:
    """Refuse missing rows, which Pillow would fill with zeros."""
    inflate = zlib.decompressobj()
    while packed and needed > 0:
        needed -= len(inflate.decompress(packed, min(needed, _BLOCK)))
        packed = inflate.unconsumed_tail
    if needed > 0:
        raise SurfaceFileError("truncated PNG image")


def _decode(
    packed: bytes, size: tuple[int, int], mode: str, depth: int, interlaced: int
) -> NDArray[Any]:
    """Return the values of all pixels and channels in order.

    Pillow's ``Image.open`` reduces 16 bit to 8 in images of several channels; its decoder does not
    where it is called with the raw mode of the high or of the low bytes.
    """
    from PIL import Image

    def unpack(mode: str, raw_mode: str) -> NDArray[Any]:
        return np.asarray(Image.frombytes(mode, size, packed, "zip", raw_mode, interlaced))

    if depth == 8:
        return unpack(mode, mode)
    if mode == "L":
        return unpack("I;16", "I;16B")
    if mode == "LA":  # two values of two bytes, taken for four of one
        return np.asarray(unpack("RGBA", "RGBA").view(">u2"), dtype=np.uint16)
    high, low = unpack(mode, f"{mode};16B"), unpack(mode, f"{mode};16L")
    return np.asarray(high.astype(np.uint16) << 8 | low)
