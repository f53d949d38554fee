"""Read PNG and TIFF images of heights."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.errors import SurfaceFileError
from asperity.measured.reader import RawSurface, ReadingOptions, SurfaceFile, mask_missing
from asperity.measured.reading import pixels
from asperity.measured.reading.isolation import reject_on_error

_PALETTE = 3  # in both formats
_PALETTE_FAULT = "has a palette, whose colours are no heights; save a grey image"

# --- PNG ----------------------------------------------------------------------------------------

PNG_MAGIC = b"\x89PNG\r\n\x1a\n"
_MAX_DEFLATE_RATIO = 1032  # deflate packs at most this many bytes into one
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
        values, scale, has_alpha = _read_png(list(_iter_chunks(file.content)))
    except (struct.error, zlib.error) as error:
        raise SurfaceFileError(f"damaged PNG image ({error})") from error
    return pixels.pixels_to_surface(values, scale, file.name, options, has_alpha=has_alpha)


def _read_png(chunks: list[tuple[bytes, bytes]]) -> tuple[NDArray[Any], pixels.ImageScale, bool]:
    """Return the pixels, the lengths, and whether the last channel is opacity."""
    if chunks[0][0] != b"IHDR":
        raise SurfaceFileError("damaged PNG image (no header)")
    columns, rows, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", chunks[0][1])
    pixels.check_image_size(rows, columns)
    by_kind = dict(chunks)
    if colour == _PALETTE:
        raise SurfaceFileError(_PALETTE_FAULT)
    if depth not in (8, 16) or colour not in _COLOUR_TYPES:
        raise SurfaceFileError(f"has {depth} bit per pixel; 8 and 16 bit are read")
    if b"tRNS" in by_kind:
        raise SurfaceFileError("has a transparent colour; transparency has no height")
    if b"acTL" in by_kind:
        frames = struct.unpack_from(">I", by_kind[b"acTL"])[0]
        raise SurfaceFileError(f"is an animation of {frames} frames; one is expected")
    packed = b"".join(data for kind, data in chunks if kind == b"IDAT")
    channels, mode = _COLOUR_TYPES[colour]
    needed = 0  # bytes of all rows, each with its filter
    passes = _ADAM7 if interlaced else _PASSES
    for x, y, step_x, step_y in passes:
        width = len(range(x, columns, step_x))
        height = len(range(y, rows, step_y))
        if width:
            needed += height * (width * channels * depth // 8 + 1)
    if _MAX_DEFLATE_RATIO * len(packed) < needed:  # before any memory is allocated
        size = f"{columns} x {rows} pixels"
        raise SurfaceFileError(f"truncated: {len(packed)} bytes cannot hold {size}")
    # Pillow would fill missing rows with zeros.
    if len(zlib.decompressobj().decompress(packed, needed)) < needed:
        raise SurfaceFileError("truncated PNG image")
    with reject_on_error("damaged or truncated PNG image"):
        values = _decode_png(packed, (columns, rows), mode, depth, interlaced)
    values = values.reshape(rows, columns, channels)
    return values, pixels.png_scale(by_kind, depth), mode.endswith("A")


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


def _decode_png(
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
    high = unpack(mode, f"{mode};16B")
    low = unpack(mode, f"{mode};16L")
    return np.asarray(high.astype(np.uint16) << 8 | low)


# --- TIFF ---------------------------------------------------------------------------------------

TIFF_MAGIC = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
_MAX_TIFF_RATIO = 2000  # no compression that is read packs more bytes into one
_MINISWHITE = 0
_RGB = 2
_GREY = (0, 1)
_REDUCED = 1
_MASK = 4
_ORIENTATION = 274
_NODATA = 42113  # GDAL's tag for the value of a missing point


def read_tiff(file: SurfaceFile, options: ReadingOptions) -> RawSurface | None:
    """Read the one page of a grey or colour TIFF; an instrument's is left to another reader.

    Lengths are taken from ImageJ's or OME's metadata; the missing value of GDAL's tag becomes NaN.

    Raises:
        SurfaceFileError: several pages, a palette, an unknown compression, damage.

    Reference:
        TIFF Revision 6.0, Adobe, 1992.
    """
    import tifffile

    content = file.content
    with reject_on_error("damaged TIFF image"):
        tiff = tifffile.TiffFile(io.BytesIO(content))
        pages: list[Any] = list(tiff.pages)
        if any(_is_of_instrument(page) for page in pages[:8]):
            return None
        page = _single_page(tiff, pages)
        _check_page(page, len(content))
        values, notes = _to_heights(page, _decode_page(page, content))
        scale = _read_scale(tiff, page)
    has_alpha = values.shape[-1] == _count_colours(page) + 1
    return pixels.pixels_to_surface(
        values, scale, file.name, options, has_alpha=has_alpha, notes=notes
    )


def _count_colours(page: Any) -> int:
    return 3 if int(page.photometric) == _RGB else 1


def _read_scale(file: Any, page: Any) -> pixels.ImageScale:
    """Return the lengths in ImageJ's or OME's metadata; resolution tags alone describe printing."""
    if file.is_imagej:
        return pixels.imagej_scale(file.imagej_metadata or {}, _resolution(page))
    if file.is_ome:
        return pixels.ome_scale(str(page.description))
    return pixels.ImageScale()


def _resolution(page: Any) -> tuple[float, float] | None:
    """Return the pixels per unit along x and y, from the resolution tags."""
    resolution = []
    for name in ("XResolution", "YResolution"):
        tag = page.tags.get(name)
        if tag is None or int(tag.value[1]) == 0:
            return None
        resolution.append(int(tag.value[0]) / int(tag.value[1]))
    return resolution[0], resolution[1]


def _single_page(file: Any, pages: list[Any]) -> Any:
    """Return the only page that is neither a thumbnail nor a mask."""
    pages = [page for page in pages if not int(page.subfiletype) & (_REDUCED | _MASK)]
    count = len(pages)
    if file.is_imagej:
        count = max(count, int((file.imagej_metadata or {}).get("images", 1)))
    if count != 1:
        raise SurfaceFileError(f"has {count} pages; one is expected: save the one with heights")
    return pages[0]


def _check_page(page: Any, size: int) -> None:
    pixels.check_image_size(int(page.imagelength), int(page.imagewidth))
    if int(page.photometric) == _PALETTE:
        raise SurfaceFileError(_PALETTE_FAULT)
    tag = page.tags.get(_ORIENTATION)
    if tag is not None and int(tag.value) != 1:
        raise SurfaceFileError(f"is stored turned or mirrored (Orientation {tag.value}): turn it")
    if int(page.imagedepth) != 1:
        raise SurfaceFileError(f"has {page.imagedepth} layers; one is expected")
    if int(page.photometric) not in (*_GREY, _RGB):
        kind = getattr(page.photometric, "name", page.photometric)
        raise SurfaceFileError(f"stores its pixels as {kind}; grey or RGB is expected")
    if page.dtype is None or page.dtype.kind not in "iuf":
        raise SurfaceFileError(f"has pixels of type {page.dtype}; integers or floats are expected")
    if int(page.bitspersample) not in (8, 16, 32, 64):
        raise SurfaceFileError(f"has {page.bitspersample} bit per pixel; 8, 16 and float are read")
    channels = int(page.samplesperpixel)
    colours = _count_colours(page)
    if channels not in (colours, colours + 1):
        raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
    bytes_needed = page.imagelength * page.imagewidth * channels * page.dtype.itemsize
    packed = min(sum(map(int, page.databytecounts)), size)
    ratio = 1 if int(page.compression) == 1 else _MAX_TIFF_RATIO
    if bytes_needed > packed * ratio:
        pixel_count = f"{page.imagewidth} x {page.imagelength} pixels"
        raise SurfaceFileError(f"truncated: {packed} bytes cannot hold {pixel_count}")


def _decode_page(page: Any, content: bytes) -> NDArray[Any]:
    try:
        return np.asarray(page.asarray())
    except (ValueError, KeyError) as error:
        if "imagecodecs" not in str(error):
            raise
    # The codec is an extra of tifffile; Pillow has the common ones for its own pixel types.
    from PIL import Image

    name = getattr(page.compression, "name", str(page.compression))
    try:
        with Image.open(io.BytesIO(content), formats=("TIFF",)) as image:
            values = np.asarray(image)
    except Exception as error:  # Pillow documents no list of errors either
        raise SurfaceFileError(f"cannot be unpacked ({name}); save it uncompressed") from error
    kind = (values.dtype.kind, values.dtype.itemsize)
    if values.size != np.prod(page.shape) or kind != (page.dtype.kind, page.dtype.itemsize):
        raise SurfaceFileError(f"cannot be unpacked in full ({name}); save it uncompressed")
    if int(page.photometric) == _MINISWHITE and kind[1] == 1:  # Pillow has inverted 8 bit
        values = np.iinfo(values.dtype).max - values
    return values.reshape(page.shape)


def _to_heights(page: Any, values: NDArray[Any]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return values that increase with the height, NaN for missing points, and notes."""
    channels = int(page.samplesperpixel)
    if channels > 1 and int(page.planarconfig) == 2:
        values = np.moveaxis(values, 0, -1)
    values = values.reshape(int(page.imagelength), int(page.imagewidth), channels)
    notes: tuple[str, ...] = ()
    if int(page.photometric) == _MINISWHITE and values.dtype.kind == "u":
        values = np.iinfo(values.dtype).max - values
        notes = ("the file stores white as 0: inverted, so that white is high",)
    tag = page.tags.get(_NODATA)
    if tag is None or channels > 1:
        return values, notes
    try:
        code = float(str(tag.value).strip().rstrip("\x00"))
    except ValueError:
        return values, (*notes, "the tag of the missing value is not a number: ignored")
    values, missing = mask_missing(values, code)
    return values, (*notes, *missing)


_PARK_TAG = 50432
_JPK_TAGS = range(0x8000, 0x8100)
_LEXT_MARKER = "TiffTagDescData"


def _is_of_instrument(page: Any) -> bool:
    """Whether a TIFF page has calibrated heights of an instrument.

    The marks are 50432 (Park Systems), 0x8000 to 0x80FF (JPK), an XML description (Olympus LEXT).
    """
    codes = {int(tag.code) for tag in page.tags}
    is_park_or_jpk = _PARK_TAG in codes or len(codes.intersection(_JPK_TAGS)) > 2
    return is_park_or_jpk or _LEXT_MARKER in str(page.description)[:100_000]
