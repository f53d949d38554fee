"""Checks of arguments at the public edge, each made once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.errors import ParameterError

FloatArray = NDArray[np.float64]
Values = TypeVar("Values", bound=NDArray[Any])

# Beyond these nothing is a size of this world, and products of a few leave double precision.
_LEAST, _MOST = 1e-30, 1e30
_FLOAT = np.dtype(np.float64)


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
    described = _described(shape)
    return _fitting(name, _numbers(name, value, described, unit), shape, described, unit)


@dataclass(slots=True, eq=False)
class Points:
    """Points that were given, and in which form.

    Attributes:
        rows: shape (n, width); one row for one point.
        single: whether it was one point by itself, shape (width,).
    """

    rows: FloatArray
    single: bool

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.rows)

    def answer(self, values: Values) -> Values:
        """Return values, one for each point along the first axis; of one point without that axis.

        Where there is no other axis the value of one point is a number.

        Example:
            >>> points("points", [0, 0, 1], 3, "m").answer(np.array([0.5])).item()
            0.5
        """
        if not self.single:
            return values
        own: Any = values[0]  # of values without another axis a number, as NumPy itself has it
        return cast(Values, own)

    def beside(self, name: str, value: ArrayLike, width: int, unit: str) -> FloatArray:
        """Return what was given beside the points, shape (n, width), (width,) beside one point."""
        shape = (width,) if self.single else (self.count, width)
        return array(name, value, shape, unit).reshape(self.count, width)

    def truths(self, name: str, value: ArrayLike | None) -> NDArray[np.bool_]:
        """Return truth values that were given beside the points, shape (n,); False if none were."""
        if value is None:
            return np.zeros(self.count, dtype=bool)
        given = np.asarray(value)
        if given.shape != (() if self.single else (self.count,)) or given.dtype != bool:
            wanted = "one truth value" if self.single else f"{self.count} truth values"
            raise ParameterError(name, f"must be {wanted}", value)
        return np.ascontiguousarray(given).reshape(self.count)


def points(name: str, value: ArrayLike, width: int, unit: str) -> Points:
    """Return points, shape (n, width), or (width,) for one; whoever takes points calls this.

    Raises:
        ParameterError: for another shape, or a value that is not finite.

    Example:
        >>> points("points", [0, 0, 1], 3, "m").rows.shape, points("xy", [[0, 1]], 2, "m").single
        ((1, 3), False)
    """
    plain = type(value) is np.ndarray and value.dtype is _FLOAT and value.flags.c_contiguous
    given: Any = value if plain else _numbers(name, value, _rows(width), unit)
    shape, item = given.shape, given.item
    single = shape == (width,)
    # One point is asked for inside of loops; its two or three numbers are finite if their sum is.
    if single or shape == (1, width):
        total: float = item(0) + item(1) + item(-1)
        if total - total == 0.0:
            return Points(given[None] if single else given, single)
    rows = given[None] if single else given
    return Points(_fitting(name, rows, (None, width), _rows(width), unit), single)


def _rows(width: int) -> str:
    return f"(n, {width}), or ({width},) for one point"


def _numbers(name: str, value: ArrayLike, described: str, unit: str) -> FloatArray:
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):  # rows of different length
        given = np.array(None)
    if given.dtype.kind not in "fiu" and given.size:
        raise ParameterError(name, f"must be numbers of shape {described} [{unit}]")
    return np.ascontiguousarray(given, dtype=np.float64)


def _fitting(
    name: str, values: FloatArray, shape: tuple[int | None, ...], described: str, unit: str
) -> FloatArray:
    """Return the values if they are finite and have the shape, which is described in words."""
    fits = values.ndim == len(shape)
    for wanted, length in zip(shape, values.shape, strict=False):
        fits = fits and wanted in (None, length)
    if not fits:
        raise ParameterError(name, f"must have shape {described} [{unit}]", values.shape)
    if not np.isfinite(values).all():
        raise ParameterError(name, f"must be finite [{unit}]; {_first_bad(values)}")
    return values


def _described(shape: tuple[int | None, ...]) -> str:
    lengths = ["n" if length is None else str(length) for length in shape]
    return f"({lengths[0]},)" if len(lengths) == 1 else f"({', '.join(lengths)})"


def _first_bad(values: FloatArray) -> str:
    index: Any = np.argwhere(~np.isfinite(values))[0]
    place = ", ".join(str(int(i)) for i in index)
    return f"the value at [{place}] is {float(values[tuple(index)])}"
