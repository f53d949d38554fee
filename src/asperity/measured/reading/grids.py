"""Read NumPy arrays (NPY), which have no unit."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core.errors import SurfaceFileError
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
