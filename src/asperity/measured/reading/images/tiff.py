"""Read TIFF images of heights, integer and float."""

from __future__ import annotations

import io
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.errors import SurfaceFileError
from asperity.measured.reading.images.pixels import (
    ImageScale,
    Pixels,
    check_image_size,
    imagej_scale,
    ome_scale,
    pixels_to_surface,
)
from asperity.measured.reading.isolation import reject_on_error
from asperity.measured.reading.reader import RawSurface, ReadingOptions, SurfaceFile, mask_missing

TIFF_MAGIC = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
_MAX_COMPRESSION_RATIO = 2000  # no compression that is read packs more bytes into one
_MINISWHITE, _RGB, _PALETTE = 0, 2, 3
_GREY = (0, 1)
_REDUCED, _MASK = 1, 4
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
    if is_instrument_tiff(content):
        return None
    with reject_on_error("damaged TIFF image"):
        tiff = tifffile.TiffFile(io.BytesIO(content))
        page = _single_page(tiff)
        _check_page(page, len(content))
        pixels, scale = _to_pixels(page, _decode_page(page, content)), _read_scale(tiff, page)
    pixels = replace(pixels, notes=(*pixels.notes, *scale.notes), scale=scale)
    return pixels_to_surface(pixels, file.name, options)


def _read_scale(file: Any, page: Any) -> ImageScale:
    """Return the lengths in ImageJ's or OME's metadata; resolution tags alone describe printing."""
    if file.is_imagej:
        return imagej_scale(file.imagej_metadata or {}, _resolution(page))
    return ome_scale(str(page.description)) if file.is_ome else ImageScale()


def _resolution(page: Any) -> tuple[float, float] | None:
    """Return the pixels per unit along x and y, from the resolution tags."""
    found = []
    for name in ("XResolution", "YResolution"):
        tag = page.tags.get(name)
        if tag is None or int(tag.value[1]) == 0:
            return None
        found.append(int(tag.value[0]) / int(tag.value[1]))
    return found[0], found[1]


def _single_page(file: Any) -> Any:
    """Return the only page that is neither a thumbnail nor a mask."""
    pages = [page for page in list(file.pages) if not int(page.subfiletype) & (_REDUCED | _MASK)]
    stack = int((file.imagej_metadata or {}).get("images", 1)) if file.is_imagej else 1
    count = max(len(pages), stack)
    if count != 1:
        raise SurfaceFileError(f"has {count} pages; one is expected: save the one with heights")
    return pages[0]


def _check_page(page: Any, size: int) -> None:
    check_image_size(int(page.imagelength), int(page.imagewidth))
    if int(page.photometric) == _PALETTE:
        raise SurfaceFileError("has a palette, whose colours are no heights; save a grey image")
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
    if channels > 4:
        raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
    bytes_needed = page.imagelength * page.imagewidth * channels * page.dtype.itemsize
    packed = min(sum(int(n) for n in page.databytecounts), size)
    if bytes_needed > packed * (1 if int(page.compression) == 1 else _MAX_COMPRESSION_RATIO):
        raise SurfaceFileError(
            f"truncated: {packed} bytes cannot hold {page.imagewidth} x {page.imagelength} pixels"
        )


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


def _to_pixels(page: Any, values: NDArray[Any]) -> Pixels:
    channels = int(page.samplesperpixel)
    if channels > 1 and int(page.planarconfig) == 2:
        values = np.moveaxis(values, 0, -1)
    values = values.reshape(int(page.imagelength), int(page.imagewidth), channels)
    notes = []
    if int(page.photometric) == _MINISWHITE and values.dtype.kind == "u":
        values = np.iinfo(values.dtype).max - values
        notes.append("the file stores white as 0: inverted, so that white is high")
    tag = page.tags.get(_NODATA)
    if tag is not None and channels == 1:
        try:
            values, found = mask_missing(values, float(str(tag.value).strip().rstrip("\x00")))
        except ValueError:
            found = ("the tag of the missing value is not a number: ignored",)
        notes.extend(found)
    colours = 3 if int(page.photometric) == _RGB else 1
    if channels not in (colours, colours + 1):
        raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
    return Pixels(values, channels == colours + 1, tuple(notes))


_PARK_TAG = 50432
_JPK_TAGS = range(0x8000, 0x8100)
_LEXT_MARKER = "TiffTagDescData"


def is_instrument_tiff(content: bytes) -> bool:
    """Whether a TIFF is an instrument's, with calibrated heights: Park Systems, JPK, Olympus LEXT.

    Their marks: 50432 (Park), 0x8000 to 0x80FF (JPK), an XML image description (LEXT).

    Args:
        content: the bytes of a TIFF.
    """
    import tifffile

    try:
        with tifffile.TiffFile(io.BytesIO(content)) as file:
            pages: list[Any] = list(file.pages)[:8]
            for page in pages:
                codes = {int(tag.code) for tag in page.tags}
                if _PARK_TAG in codes or len(codes.intersection(_JPK_TAGS)) > 2:
                    return True
                if _LEXT_MARKER in str(page.description)[:100_000]:
                    return True
    except Exception:  # the reader refuses a damaged file
        return False
    return False
