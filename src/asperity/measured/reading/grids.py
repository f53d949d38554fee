"""Read grids of heights without a unit: NumPy arrays (NPY) and ESRI ASCII grids (Arc/Info)."""

from __future__ import annotations

import math
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.errors import SurfaceFileError
from asperity.measured.lengths import parse_heights, parse_number
from asperity.measured.reading import reader
from asperity.measured.reading.isolation import describe_exception

NPY_MAGIC = b"\x93NUMPY"


def read_npy(file: reader.SurfaceFile, options: reader.ReadingOptions) -> reader.RawSurface:
    """Read a real array, 1-D (profile) or 2-D (map); heights are metres if no unit is given.

    Returns:
        The heights [m]; an NPY file has no pitch.

    Raises:
        SurfaceFileError: not a real array of one or two dimensions, or truncated.
    """
    array = _map_file(file.path)
    _check_array(array)
    unit, notes = options.resolve_unit(file.name)
    # A long double beyond float64 becomes inf, refused later; a signalling NaN is missing too.
    with np.errstate(over="ignore", invalid="ignore"):
        heights = np.array(array, dtype=np.float64, order="C") * (unit or 1.0)
    return reader.RawSurface(heights, None, file.name, notes, has_units=unit is not None)


def _map_file(path: Path) -> np.ndarray[Any, np.dtype[Any]]:
    """Map the file instead of loading it, so that a damaged header cannot exhaust the memory."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # headers of NumPy under Python 2 are accepted
            array = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # NumPy documents no list of errors for damaged headers
        raise SurfaceFileError(_describe_error(error, path)) from error
    if not isinstance(array, np.ndarray):
        raise SurfaceFileError("not a single NumPy array")
    return array


def _describe_error(error: Exception, path: Path) -> str:
    text = str(error)
    if "Object arrays" in text or "Python objects" in text or "pickle" in text:
        return "an array of Python objects; a real numeric array is expected"
    if "greater than file size" in text or "empty" in text or "EOF" in text:
        return f"truncated NPY file ({path.stat().st_size} bytes)"
    return f"damaged NPY file ({describe_exception(error)})"


def _check_array(array: np.ndarray[Any, np.dtype[Any]]) -> None:
    if array.dtype.kind not in "iuf":
        raise SurfaceFileError(f"array of type {array.dtype}; integers or floats are expected")
    if array.ndim not in (1, 2) or min(array.shape) < 1:
        wanted = "(ny, nx) for a map or (n,) for a profile is expected"
        raise SurfaceFileError(f"array of shape {array.shape}; {wanted}")
    reader.check_point_count(*array.shape[::-1])


_SIGNATURE = re.compile(rb"\s{0,100}(?:ncols|nrows)\s{1,100}[0-9]")
_SIZE_KEYS = ("ncols", "nrows", "cellsize", "dx", "dy", "nodata_value")
_HEADER_KEYS = (*_SIZE_KEYS, "xllcorner", "yllcorner", "xllcenter", "yllcenter")
_DEFAULT_NODATA = -9999.0
_MAX_HEADER_LENGTH = 4000


def is_esri(file: reader.SurfaceFile) -> bool:
    """Whether a file starts with the header of an ESRI ASCII grid."""
    first = file.head[:1000].lower()
    return _SIGNATURE.match(first) is not None and b"ncols" in first and b"nrows" in first


def read_esri(file: reader.SurfaceFile, options: reader.ReadingOptions) -> reader.RawSurface:
    """Read an ESRI ASCII grid.

    The format has no unit: lengths and heights are in metres, or in the unit that is given. The
    first row is the northern one; rows are reversed, so that y points north.

    Raises:
        SurfaceFileError: the header has no size, or the number of heights differs from it.

    Reference:
        Esri, ASCII raster format (ArcGIS Desktop 10, "Esri ASCII raster format").
    """
    text = file.content.decode("ascii", errors="replace")
    header, start = _parse_header(text)
    rows, columns = _header_count(header, "nrows"), _header_count(header, "ncols")
    reader.check_point_count(columns, rows)
    body = text[start:] if "." in text[start:] else text[start:].replace(",", ".")
    stored = parse_heights(body)
    if len(stored) != rows * columns:
        stated = f"the header says {rows} rows of {columns} heights"
        raise SurfaceFileError(f"{stated}, there are {len(stored)} numbers")
    code = header.get("nodata_value", _DEFAULT_NODATA)
    heights, notes = reader.mask_missing(stored.reshape(rows, columns), code)
    unit, assumed = options.resolve_unit(file.name)
    scale = unit or 1.0
    pitch = (_header_cell_size(header, "dx") * scale, _header_cell_size(header, "dy") * scale)
    heights = np.ascontiguousarray(heights[::-1] * scale)
    return reader.RawSurface(
        heights, pitch, file.name, (*notes, *assumed), has_units=unit is not None
    )


def _parse_header(text: str) -> tuple[dict[str, float], int]:
    """Return the values by key, and the position where the heights start."""
    found: dict[str, float] = {}
    start = 0
    for line in text[:_MAX_HEADER_LENGTH].splitlines(keepends=True):
        words = line.split()
        if words and words[0].lower() not in _HEADER_KEYS:
            break
        if len(words) == 2:
            found[words[0].lower()] = parse_number(words[1].replace(",", "."), words[0])
        elif words:
            raise SurfaceFileError(f"the header's {words[0]!r} must have one value")
        start += len(line)
    return found, start


def _header_count(header: dict[str, float], name: str) -> int:
    value = header.get(name, 0.0)
    if not 1 <= value < math.inf or value != math.floor(value):
        raise SurfaceFileError(f"the header's {name} must be a whole number from 1")
    return int(value)


def _header_cell_size(header: dict[str, float], name: str) -> float:
    value = header.get(name, header.get("cellsize", 0.0))
    if not (math.isfinite(value) and value > 0.0):
        raise SurfaceFileError("the header's cellsize (or dx and dy) must be positive")
    return value
