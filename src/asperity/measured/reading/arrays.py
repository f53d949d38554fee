"""Heights saved as one NumPy array (NPY)."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from asperity.errors import SurfaceFileError
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.reader import ReadingOptions, SurfaceFile, naming
from asperity.memory import reserve

NPY_MAGIC = b"\x93NUMPY"


@naming
def read_npy(file: SurfaceFile, options: ReadingOptions) -> RawSurface:
    """Read a 1-D (profile) or 2-D (map) real array; heights are metres unless told otherwise.

    Returns:
        The heights [m]; an NPY file has no pitch.

    Raises:
        SurfaceFileError: not a real array of one or two dimensions, or truncated.
    """
    array, metres = _mapped(file.path), options.metres
    _check_array(array)
    # A long double beyond float64 becomes inf, refused later; a signalling NaN is missing too.
    with np.errstate(over="ignore", invalid="ignore"):
        heights = np.array(array, dtype=np.float64, order="C")
    if metres is None:
        return RawSurface(heights, None, file.name, (), has_units=False)
    note = f"no unit in an NPY file: {metres:g} m as given"
    with np.errstate(over="ignore"):  # infinities are refused later
        return RawSurface(heights * metres, None, file.name, (note,))


def _mapped(path: Path) -> np.ndarray[Any, np.dtype[Any]]:
    """Map the file instead of loading it: a lying header then cannot ask for memory."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a header of NumPy under Python 2 is fine
            array = np.load(path, mmap_mode="r", allow_pickle=False)
    except Exception as error:  # NumPy names no closed list of what a damaged header raises
        raise SurfaceFileError(_reason(error, path)) from error
    if not isinstance(array, np.ndarray):
        raise SurfaceFileError("not a single NumPy array")
    return array


def _reason(error: Exception, path: Path) -> str:
    text = str(error)
    if "Object arrays" in text or "Python objects" in text or "pickle" in text:
        return "an array of Python objects; a real numeric array is expected"
    if "greater than file size" in text or "empty" in text or "EOF" in text:
        return f"truncated NPY file ({path.stat().st_size} bytes)"
    return f"damaged NPY file ({text.splitlines()[0] if text else type(error).__name__})"


def _check_array(array: np.ndarray[Any, np.dtype[Any]]) -> None:
    if array.dtype.kind not in "iuf":
        raise SurfaceFileError(
            f"array of type {array.dtype}; real numbers (integer or float) are expected"
        )
    if array.ndim not in (1, 2) or min(array.shape) < 1:
        raise SurfaceFileError(
            f"array of shape {array.shape}; (ny, nx) for a map or (n,) for a profile is expected"
        )
    if array.size > MAX_POINTS:
        raise SurfaceFileError(f"{array.size} points; at most {MAX_POINTS} are read")
    reserve(*array.shape[::-1])
