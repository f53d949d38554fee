"""Checks of arguments at the public edge, each made once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.errors import ParameterError

FloatArray = NDArray[np.float64]

# Beyond these nothing is a size of this world, and products of a few leave double precision.
_LEAST, _MOST = 1e-30, 1e30


def real(name: str, value: object, unit: str = "") -> float:
    """Return a finite number of at most 1e30 in size.

    Raises:
        ParameterError: if it is none.
    """
    unit = f" [{unit}]" if unit else ""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ParameterError(name, f"must be a number{unit}", value)
    number = float(value)
    if not math.isfinite(number):
        raise ParameterError(name, f"must be finite{unit}", value)
    if abs(number) > _MOST:
        raise ParameterError(name, f"must be at most {_MOST:g}{unit}", value)
    return number


def positive(name: str, value: object, unit: str = "") -> float:
    """Return a positive number, at least 1e-30; see :func:`real`."""
    number = real(name, value, unit)
    unit = f" [{unit}]" if unit else ""
    if number <= 0.0:
        raise ParameterError(name, f"must be positive{unit}", value)
    if number < _LEAST:
        raise ParameterError(name, f"must be at least {_LEAST:g}{unit}", value)
    return number


def fraction(name: str, value: object) -> float:
    """Return a number in [0, 1]; see :func:`real`."""
    number = real(name, value)
    if not 0.0 <= number <= 1.0:
        raise ParameterError(name, "must be in [0, 1]", value)
    return number


def array(name: str, value: ArrayLike, shape: tuple[int | None, ...], unit: str) -> FloatArray:
    """Return a contiguous float array of the shape, ``None`` standing for any length.

    Raises:
        ParameterError: for another shape, or a value that is not finite.

    Example:
        >>> array("points", [[0, 0, 1]], (None, 3), "m").shape
        (1, 3)
    """
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):  # rows of different length
        given = np.array(None)
    if given.dtype.kind not in "fiu" and given.size:
        raise ParameterError(name, f"must be numbers of shape {_described(shape)} [{unit}]")
    result: FloatArray = np.ascontiguousarray(given, dtype=np.float64)
    fits = result.ndim == len(shape)
    for wanted, length in zip(shape, result.shape, strict=False):
        fits = fits and wanted in (None, length)
    if not fits:
        raise ParameterError(name, f"must have shape {_described(shape)} [{unit}]", result.shape)
    if not np.isfinite(result).all():
        raise ParameterError(name, f"must be finite [{unit}]; {_first_bad(result)}")
    return result


def _described(shape: tuple[int | None, ...]) -> str:
    return f"({', '.join('n' if length is None else str(length) for length in shape)})"


def _first_bad(values: FloatArray) -> str:
    index: Any = np.argwhere(~np.isfinite(values))[0]
    place = ", ".join(str(int(i)) for i in index)
    return f"the value at [{place}] is {float(values[tuple(index)])}"
