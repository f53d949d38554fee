"""Checks of arguments at the public interface."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.core import compiled
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.units import parse_quantity

FloatArray = compiled.FloatArray
IntArray = compiled.IntArray
Values = TypeVar("Values", bound=NDArray[Any])

# Beyond these limits products of a few values leave the range of double precision.
_SMALLEST = 1e-30
_LARGEST = 1e30
_FLOAT = np.dtype(np.float64)


def check_keywords(
    keywords: Iterable[str], accepted: Collection[str], function: Callable[..., Any]
) -> None:
    """Check keywords that a function passes on.

    Raises:
        ParameterError: for an unknown one, with the nearest of these and of the function's own.
    """
    for name in keywords:
        if name not in accepted:
            parameters = inspect.signature(function).parameters.values()
            names = {item.name for item in parameters if item.kind is not item.VAR_KEYWORD}
            raise ParameterError(name, f"is unknown; {suggest_names(name, names.union(accepted))}")


def check_items(name: str, values: Any) -> list[Any]:
    """Return one or several values as a list; a text is one value.

    Raises:
        ParameterError: for none.
    """
    if isinstance(values, str) or not isinstance(values, Iterable):
        return [values]
    items = list(values)
    if not items:
        raise ParameterError(name, "must be one or several")
    return items


def check_real(name: str, value: object, unit: str = "") -> float:
    """Return a finite number of magnitude at most 1e30.

    A quantity with a unit may be a text, as on the command line.

    Raises:
        ParameterError: for any other value.

    Example:
        >>> check_real("max_depth", "0.5mm", "m"), check_real("max_depth", 5e-4, "m")
        (0.0005, 0.0005)
    """
    if isinstance(value, str) and unit:
        value = parse_quantity(name, value, unit)
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise ParameterError(name, f"must be a number{_unit_text(unit)}", value)
    try:
        number = float(value)
    except OverflowError:  # an integer, perhaps of more digits than can be printed
        raise ParameterError(name, f"must be at most {_LARGEST:g}{_unit_text(unit)}") from None
    if not math.isfinite(number):
        raise ParameterError(name, f"must be finite{_unit_text(unit)}", value)
    if abs(number) > _LARGEST:
        raise ParameterError(name, f"must be at most {_LARGEST:g}{_unit_text(unit)}", value)
    return number


def _unit_text(unit: str) -> str:
    return f" [{unit}]" if unit else ""


def check_positive(name: str, value: object, unit: str = "") -> float:
    """Return a positive number, at least 1e-30; see :func:`check_real`."""
    number = check_real(name, value, unit)
    if number <= 0.0:
        raise ParameterError(name, f"must be positive{_unit_text(unit)}", value)
    if number < _SMALLEST:
        raise ParameterError(name, f"must be at least {_SMALLEST:g}{_unit_text(unit)}", value)
    return number


def check_nonnegative(name: str, value: object, unit: str = "") -> float:
    """Return a number that is not negative; see :func:`check_real`."""
    number = check_real(name, value, unit)
    if number < 0.0:
        raise ParameterError(name, f"must not be negative{_unit_text(unit)}", value)
    return number


def check_fraction(name: str, value: object) -> float:
    """Return a number in [0, 1]; see :func:`check_real`."""
    number = check_real(name, value)
    if not 0.0 <= number <= 1.0:
        raise ParameterError(name, "must be in [0, 1]", value)
    return number


def check_array(
    name: str, value: ArrayLike, shape: tuple[int | None, ...], unit: str
) -> FloatArray:
    """Return a contiguous float array of a shape in which ``None`` stands for any length.

    Raises:
        ParameterError: for another shape or a value that is not finite.

    Example:
        >>> check_array("points", [[0, 0, 1]], (None, 3), "m").shape
        (1, 3)
    """
    described = _shape_text(shape)
    return _check_shape_and_values(
        name, _to_float_array(name, value, described, unit), shape, described, unit
    )


@dataclass(slots=True, eq=False)
class Points:
    """An array of points, and whether a single point was passed.

    Attributes:
        rows: shape (n, width).
        is_single: whether one point of shape (width,) was passed.
    """

    rows: FloatArray
    is_single: bool

    @property
    def count(self) -> int:
        """Number of points."""
        return len(self.rows)

    def restore_shape(self, values: Values) -> Values:
        """Return values per point, without the first axis for a single point.

        For a single point and values without a second axis the result is a NumPy scalar.

        Example:
            >>> check_points("p", [0, 0, 1], 3, "m").restore_shape(np.array([0.5])).item()
            0.5
        """
        if not self.is_single:
            return values
        return cast(Values, values[0])

    def check_array_per_point(
        self, name: str, value: ArrayLike, width: int, unit: str
    ) -> FloatArray:
        """Return an array per point, shape (n, width); (width,) is accepted for one point."""
        shape = (width,) if self.is_single else (self.count, width)
        return check_array(name, value, shape, unit).reshape(self.count, width)

    def check_flags_per_point(self, name: str, value: ArrayLike | None) -> NDArray[np.bool_]:
        """Return flags per point, shape (n,); all False for ``None``."""
        if value is None:
            return np.zeros(self.count, dtype=bool)
        flags = np.asarray(value)
        shape: tuple[int, ...] = (self.count,)
        requirement = f"must be {self.count} truth values"
        if self.is_single:
            shape = ()
            requirement = "must be one truth value"
        if flags.shape != shape or flags.dtype != bool:
            raise ParameterError(name, requirement, value)
        return np.ascontiguousarray(flags).reshape(self.count)


def check_points(name: str, value: ArrayLike, width: int, unit: str) -> Points:
    """Return points of shape (n, width), or (width,) for a single point.

    Raises:
        ParameterError: for another shape or a value that is not finite.

    Example:
        >>> check_points("points", [0, 0, 1], 3, "m").rows.shape
        (1, 3)
        >>> check_points("xy", [[0, 1]], 2, "m").is_single
        False
    """
    rows: Any = value
    if not (type(value) is np.ndarray and value.dtype is _FLOAT and value.flags.c_contiguous):
        rows = _to_float_array(name, value, _point_shape_text(width), unit)
    single = rows.shape == (width,)
    if single:
        rows = rows[None]
    # Single points are checked inside loops: their two or three values are finite if the sum is.
    if rows.shape == (1, width):
        item = rows.item
        total: float = item(0) + item(1) + item(-1)
        if total - total == 0.0:
            return Points(rows, single)
    return Points(
        _check_shape_and_values(name, rows, (None, width), _point_shape_text(width), unit), single
    )


def _point_shape_text(width: int) -> str:
    return f"(n, {width}), or ({width},) for one point"


def _to_float_array(name: str, value: ArrayLike, shape_text: str, unit: str) -> FloatArray:
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):  # rows of different length
        array = np.array(None)
    if np.ma.is_masked(value):
        raise ParameterError(name, "must have no masked values: numpy.ma.filled(array, numpy.nan)")
    if array.dtype.kind not in "fiu" and array.size:
        raise ParameterError(name, f"must be numbers of shape {shape_text} [{unit}]")
    return np.ascontiguousarray(array, dtype=np.float64)


def _check_shape_and_values(
    name: str, values: FloatArray, shape: tuple[int | None, ...], shape_text: str, unit: str
) -> FloatArray:
    """Return the values if they are finite and of the shape."""
    fits = values.ndim == len(shape)
    for required, length in zip(shape, values.shape, strict=False):
        fits = fits and required in (None, length)
    if not fits:
        raise ParameterError(name, f"must have shape {shape_text} [{unit}]", values.shape)
    if not np.isfinite(values).all():
        raise ParameterError(name, f"must be finite [{unit}]; {_describe_first_nonfinite(values)}")
    return values


def _shape_text(shape: tuple[int | None, ...]) -> str:
    return str(shape).replace("None", "n")


def _describe_first_nonfinite(values: FloatArray) -> str:
    index: Any = np.argwhere(~np.isfinite(values))[0]
    return f"the value at {index.tolist()} is {float(values[tuple(index)])}"
