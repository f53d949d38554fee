"""Read ESRI ASCII grids (Arc/Info): a header of keys, then rows of heights from the top down."""

from __future__ import annotations

import math
import re

import numpy as np

from asperity.errors import SurfaceFileError
from asperity.measured.reading.numbers import parse_number
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.memory import reserve

_HEAD = re.compile(rb"\s{0,100}(?:ncols|nrows)\s{1,100}[0-9]")
_KEYS = {
    "ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "dx", "dy",
    "nodata_value",
}  # fmt: skip
_MISSING = -9999.0  # unless the header says another
_LONGEST_HEADER = 4000


def is_esri(file: SurfaceFile) -> bool:
    """Tell by its first keys whether a file is an ESRI ASCII grid."""
    first = file.head[:1000].lower()
    return _HEAD.match(first) is not None and b"ncols" in first and b"nrows" in first


@naming
def read_esri(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read an ESRI ASCII grid.

    The format names no unit: lengths and heights alike are in metres, or in the unit that is given.
    The first row is the northern one; rows are turned, so that y runs north.

    Raises:
        SurfaceFileError: a header that lacks a size, or heights that are not as many as it says.

    Reference:
        Esri, ASCII raster format (ArcGIS Desktop 10, "Esri ASCII raster format").
    """
    text = file.content.decode("ascii", errors="replace")
    header, begin = _header(text)
    shape = _count(header, "nrows"), _count(header, "ncols")
    if shape[0] * shape[1] > MAX_POINTS:
        raise SurfaceFileError(f"{shape[1]} x {shape[0]} points; at most {MAX_POINTS} are read")
    reserve(shape[1], shape[0])
    heights = _heights(text[begin:], shape)
    code = header.get("nodata_value", _MISSING)
    missing = heights == code
    notes = [f"{int(missing.sum())} points hold {code:g}, which marks a missing point"]
    heights[missing] = np.nan
    unit = 1.0 if options.metres is None else options.metres
    if options.metres is not None:
        notes.append(f"no unit in the file: {unit:g} m as given")
    px, py = (_side(header, name) * unit for name in ("dx", "dy"))
    return RawSurface(
        np.ascontiguousarray(heights[::-1] * unit), (px, py), file.name,
        tuple(notes if missing.any() else notes[1:]), has_units=options.metres is not None,
    )  # fmt: skip


def _header(text: str) -> tuple[dict[str, float], int]:
    """Return the values by key, and where the heights begin."""
    found: dict[str, float] = {}
    begin = 0
    for line in text[:_LONGEST_HEADER].splitlines(keepends=True):
        words = line.split()
        if words and words[0].lower() not in _KEYS:
            break
        if len(words) == 2:
            found[words[0].lower()] = parse_number(words[1].replace(",", "."), words[0])
        elif words:
            raise SurfaceFileError(f"the header's {words[0]!r} must have one value")
        begin += len(line)
    return found, begin


def _count(header: dict[str, float], name: str) -> int:
    value = header.get(name, 0.0)
    if not 1 <= value <= MAX_POINTS or value != math.floor(value):
        raise SurfaceFileError(f"the header's {name} must be a whole number from 1")
    return int(value)


def _side(header: dict[str, float], name: str) -> float:
    value = header.get(name, header.get("cellsize", 0.0))
    if not (math.isfinite(value) and value > 0.0):
        raise SurfaceFileError("the header's cellsize (or dx and dy) must be positive")
    return value


def _heights(
    text: str, shape: tuple[int, int]
) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    words = text.split()
    if len(words) != shape[0] * shape[1]:
        raise SurfaceFileError(
            f"the header says {shape[0]} rows of {shape[1]} heights, there are {len(words)} numbers"
        )
    if "." not in text:
        words = [word.replace(",", ".") for word in words]
    try:
        if "_" in text:  # Python's float would accept 1_000
            raise ValueError("1_000")
        heights = np.array(words, dtype=np.float64)
    except ValueError as error:
        reason = str(error)[-40:]
        raise SurfaceFileError(f"a height is no number ({reason})") from None
    return heights.reshape(shape)
