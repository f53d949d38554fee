"""First-order Taylor models: rigorous enclosures of functions over many cells at once.

On a cell with coordinates ξ in [-1, 1]^d a model stands for every function with

    |f(ξ) - c - Σ g_i ξ_i| <= e,

so its error shrinks with the square of the cell size. The operators propagate the linear part and
add to e bounds of the nonlinear remainder and of rounding. The kernels that are generated from a
law run on these models as they do on numbers, as interval kernels.

Reference: Makino and Berz, Int. J. Pure Appl. Math. 4 (2003) 379 (Taylor models).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from asperity.core.checks import FloatArray

_EPS = float(np.finfo(float).eps)
# Rounding allowed for one operation and for a library function, generously.
_OPERATION_ROUNDING = 8.0 * _EPS
_FUNCTION_ROUNDING = 16.0 * _EPS

TaylorNumber: TypeAlias = "float | TaylorModel"


@dataclass(frozen=True, eq=False)
class TaylorModel:
    """One quantity on n cells of d coordinates.

    Attributes:
        c: value of the linear part at the centre, shape (n,).
        g: change from the centre to the border along each coordinate, shape (d, n).
        e: bound of the error of c + Σ g_i ξ_i, shape (n,); infinite if unbounded.
    """

    c: FloatArray
    g: FloatArray
    e: FloatArray

    # Operators of NumPy scalars defer to this class.
    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]  # enclosures cannot be compared

    def __eq__(self, other: object) -> bool:
        raise TypeError("enclosures cannot be compared")

    def __bool__(self) -> bool:
        raise TypeError("an enclosure has no truth value")

    def _reject_comparison(self, _other: object) -> bool:
        raise TypeError("a piecewise formula has no enclosure")

    __lt__ = __le__ = __gt__ = __ge__ = _reject_comparison

    @cached_property
    def linear_radius(self) -> FloatArray:
        """Greatest change of the linear part, Σ |g_i|."""
        return np.asarray(np.abs(self.g).sum(axis=0))

    @property
    def radius(self) -> FloatArray:
        """Greatest distance from c."""
        return self.linear_radius + self.e

    def __neg__(self) -> TaylorModel:
        return TaylorModel(-self.c, -self.g, self.e)

    def __add__(self, other: TaylorNumber) -> TaylorModel:
        if not isinstance(other, TaylorModel):
            if other == 0.0:
                return self
            c = self.c + other
            return TaylorModel(c, self.g, _add_rounding(self.e, np.abs(c)))
        c = self.c + other.c
        g = self.g + other.g
        scale = np.abs(c) + self.linear_radius + other.linear_radius
        return TaylorModel(c, g, _add_rounding(self.e + other.e, scale))

    __radd__ = __add__

    def __sub__(self, other: TaylorNumber) -> TaylorModel:
        return self + (-other)

    def __rsub__(self, other: TaylorNumber) -> TaylorModel:
        return (-self) + other

    def __mul__(self, other: TaylorNumber) -> TaylorNumber:
        if not isinstance(other, TaylorModel):
            return self._multiply_scalar(float(other))
        if self is other:
            return self._square()
        radius = self.linear_radius
        other_radius = other.linear_radius
        mixed = 0.5 * self.g * other.g
        c = self.c * other.c + mixed.sum(axis=0)
        g = self.c * other.g + other.c * self.g
        rest = np.abs(mixed).sum(axis=0) + _bound_cross_terms(self.g, other.g)
        size = np.abs(self.c) + radius
        other_size = np.abs(other.c) + other_radius
        e = rest + self.e * (other_size + other.e) + other.e * size
        return TaylorModel(c, g, _add_rounding(e, size * other_size))

    __rmul__ = __mul__

    def _multiply_scalar(self, factor: float) -> TaylorNumber:
        if factor == 0.0:
            return 0.0
        if factor == 1.0:
            return self
        c = factor * self.c
        g = factor * self.g
        e = _add_rounding(abs(factor) * self.e, np.abs(c) + np.abs(g).sum(axis=0))
        return TaylorModel(c, g, e)

    def _square(self) -> TaylorModel:
        half = 0.5 * self.g * self.g
        c = self.c * self.c + half.sum(axis=0)
        g = 2.0 * self.c * self.g
        size = np.abs(self.c) + self.linear_radius
        e = half.sum(axis=0) + _bound_cross_terms(self.g, self.g) + self.e * (2.0 * size + self.e)
        return TaylorModel(c, g, _add_rounding(e, size * size))

    def __truediv__(self, other: TaylorNumber) -> TaylorNumber:
        if not isinstance(other, TaylorModel):
            return self._multiply_scalar(1.0 / float(other))
        return self * reciprocal(other)

    def __rtruediv__(self, other: float) -> TaylorNumber:
        return reciprocal(self)._multiply_scalar(float(other))

    def __pow__(self, power: float) -> TaylorNumber:
        if float(power).is_integer() and abs(power) <= _MAX_INTEGER_POWER:
            return _integer_power(self, int(power))
        return _enclose_smooth(
            self,
            lambda x: x**power,
            lambda x: power * x ** (power - 1.0),
            lambda low, high: (
                abs(power * (power - 1.0)) * np.maximum(low ** (power - 2.0), high ** (power - 2.0))
            ),
            positive_domain=True,
        )

    def __abs__(self) -> TaylorModel:
        radius = self.radius
        sign = np.where(self.c >= 0.0, 1.0, -1.0)
        # If the sign is undetermined, 0 <= |f| <= |c| + radius.
        definite = np.abs(self.c) > radius
        top = 0.5 * (np.abs(self.c) + radius)
        c = np.where(definite, np.abs(self.c), top)
        g = np.where(definite, sign * self.g, 0.0)
        return TaylorModel(c, g, np.where(definite, self.e, top))


_MAX_INTEGER_POWER = 64


def _add_rounding(error: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the error enlarged by the rounding error of terms of that scale."""
    return np.asarray((error + _OPERATION_ROUNDING * scale) * (1.0 + _OPERATION_ROUNDING))


def _bound_cross_terms(a: FloatArray, b: FloatArray) -> FloatArray | float:
    """Bound Σ_{i<j} (a_i b_j + a_j b_i) ξ_i ξ_j."""
    total: FloatArray | float = 0.0
    for i in range(len(a)):
        for j in range(i):
            total = total + np.abs(a[i] * b[j] + a[j] * b[i])
    return total


def _integer_power(x: TaylorModel, power: int) -> TaylorNumber:
    if power < 0:
        return 1.0 / _integer_power(x, -power)
    result: TaylorNumber = 1.0
    for bit in bin(power)[2:]:
        result = result * result
        if bit == "1":
            result = result * x
    return result


def _enclose_smooth(
    x: TaylorNumber,
    function: Callable[[Any], FloatArray],
    derivative: Callable[[FloatArray], FloatArray],
    second_derivative_bound: Callable[[FloatArray, FloatArray], FloatArray],
    positive_domain: bool = False,
) -> TaylorNumber:
    """Return f(x): linear part f'(c) g, error |f'| e + ½ max |f''| radius².

    Args:
        x: the argument.
        function: f.
        derivative: f'.
        second_derivative_bound: a bound of |f''| on [low, high].
        positive_domain: whether f is smooth only for positive arguments.
    """
    if not isinstance(x, TaylorModel):
        return float(function(x))
    radius = x.radius
    low = x.c - radius
    high = x.c + radius
    with np.errstate(all="ignore"):
        value = function(x.c)
        rate = derivative(x.c)
        e = np.abs(rate) * x.e + 0.5 * second_derivative_bound(low, high) * radius * radius
        charge = _FUNCTION_ROUNDING * (np.abs(value) + np.abs(rate) * (np.abs(x.c) + radius))
        e = (e + charge) * (1.0 + _FUNCTION_ROUNDING)
        unbounded = ~np.isfinite(e)
        if positive_domain:
            unbounded |= low <= 0.0
    g = np.where(unbounded, 0.0, rate * x.g)
    return TaylorModel(np.where(unbounded, 0.0, value), g, np.where(unbounded, np.inf, e))


def reciprocal(x: TaylorModel) -> TaylorModel:
    """Return 1/x, unbounded if x may be zero."""
    sign = np.where(x.c < 0.0, -1.0, 1.0)
    positive = TaylorModel(sign * x.c, sign * x.g, x.e)
    enclosed = _enclose_smooth(
        positive,
        lambda v: 1.0 / v,
        lambda v: -1.0 / (v * v),
        lambda low, _high: 2.0 / low**3,
        positive_domain=True,
    )
    assert isinstance(enclosed, TaylorModel)
    return TaylorModel(sign * enclosed.c, sign * enclosed.g, enclosed.e)


def _max_abs(low: FloatArray, high: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def _asin_second_derivative_bound(low: FloatArray, high: FloatArray) -> FloatArray:
    largest = _max_abs(low, high)
    return np.asarray(np.where(largest < 1.0, largest * (1.0 - largest * largest) ** -1.5, np.inf))


# f, f' and a bound of |f''| on [low, high]; True where f is smooth only for positive arguments.
_SMOOTH: dict[str, tuple[Any, ...]] = {
    "sqrt": (np.sqrt, lambda v: 0.5 / np.sqrt(v), lambda low, _high: 0.25 * low**-1.5, True),
    "exp": (np.exp, np.exp, lambda _low, high: np.exp(high)),
    "log": (np.log, lambda v: 1.0 / v, lambda low, _high: low**-2.0, True),
    "sin": (np.sin, np.cos, lambda low, _high: np.ones_like(low)),
    "cos": (np.cos, lambda v: -np.sin(v), lambda low, _high: np.ones_like(low)),
    "asin": (np.arcsin, lambda v: (1.0 - v * v) ** -0.5, _asin_second_derivative_bound),
    "sinh": (np.sinh, np.cosh, lambda low, high: np.sinh(_max_abs(low, high))),
    "cosh": (np.cosh, np.sinh, lambda low, high: np.cosh(_max_abs(low, high))),
    # |f''| is at most 4/(3√3) and 3√3/8.
    "tanh": (np.tanh, lambda v: np.cosh(v) ** -2.0, lambda low, _high: np.full_like(low, 0.77)),
    "atan": (np.arctan, lambda v: 1.0 / (1.0 + v * v), lambda low, _high: np.full_like(low, 0.65)),
}


class _SmoothFunctions(type):
    def __getattr__(cls, name: str) -> Callable[..., TaylorNumber]:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in _SMOOTH:
            raise TypeError(f"the function {name} has no enclosure")
        return lambda x: _enclose_smooth(x, *_SMOOTH[name])


class TaylorMath(metaclass=_SmoothFunctions):
    """Replacement of ``math`` for Taylor models: the functions that generated kernels may use.

    √x and log x are unbounded if x may be zero, arc sine and cosine if |x| may be 1, the tangent if
    x may be at a pole. Any other function raises TypeError, as a comparison does.
    """

    pi = np.pi
    e = np.e

    @staticmethod
    def tan(x: TaylorNumber) -> TaylorNumber:
        """Return the tangent."""
        return TaylorMath.sin(x) / TaylorMath.cos(x)

    @staticmethod
    def acos(x: TaylorNumber) -> TaylorNumber:
        """Return the arc cosine."""
        return 0.5 * np.pi - TaylorMath.asin(x)

    @staticmethod
    def copysign(size: float, x: TaylorNumber) -> TaylorNumber:
        """Return ±size by the sign of x, or the interval between if the sign is undetermined."""
        if not isinstance(x, TaylorModel):
            return float(np.copysign(size, x))
        definite = np.abs(x.c) > x.radius
        c = np.where(definite, np.copysign(size, x.c), 0.0)
        return TaylorModel(c, np.zeros_like(x.g), np.where(definite, 0.0, abs(size)))
