"""First-order Taylor models: rigorous enclosures of functions over many cells at once.

On a cell with coordinates ξ in [-1, 1]^d a model stands for every function with

    |f(ξ) - c - Σ g_i ξ_i| <= e,

so its error shrinks with the square of the cell. The operators follow the arithmetic, bound what
the linear part leaves out, and add to e what rounding can have cost. The kernels that are
generated from a law run on these models as they do on numbers: they are its interval kernels.

Reference: Makino and Berz, Int. J. Pure Appl. Math. 4 (2003) 379 (Taylor models).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from asperity.checks import FloatArray

_EPS = float(np.finfo(float).eps)
# Rounding units charged for one operation and for a library function: counted generously.
_OPERATION = 8.0 * _EPS
_FUNCTION = 16.0 * _EPS

Number: TypeAlias = "float | Taylor"


@dataclass(frozen=True, eq=False)
class Taylor:
    """One quantity on n cells of d coordinates.

    Attributes:
        c: value in the middle of the linear part, shape (n,).
        g: change from the middle to the border along each coordinate, shape (d, n).
        e: bound of the error of c + Σ g_i ξ_i, shape (n,); infinite where nothing is known.
    """

    c: FloatArray
    g: FloatArray
    e: FloatArray

    # A NumPy number leaves the operation to this class.
    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]  # nothing is equal to an enclosure

    def __eq__(self, other: object) -> bool:
        raise TypeError("what an enclosure is equal to is not known")

    def __bool__(self) -> bool:
        raise TypeError("whether an enclosure is zero is not known")

    def _compared(self, _other: object) -> bool:
        raise TypeError("it is written in pieces")

    __lt__ = __le__ = __gt__ = __ge__ = _compared

    @cached_property
    def spread(self) -> FloatArray:
        """Greatest change of the linear part, Σ |g_i|."""
        return np.asarray(np.abs(self.g).sum(axis=0))

    @property
    def radius(self) -> FloatArray:
        """Greatest distance from c."""
        return self.spread + self.e

    def __neg__(self) -> Taylor:
        return Taylor(-self.c, -self.g, self.e)

    def __pos__(self) -> Taylor:
        return self

    def __add__(self, other: Number) -> Taylor:
        if not isinstance(other, Taylor):
            if other == 0.0:
                return self
            c = self.c + other
            return Taylor(c, self.g, _rounded(self.e, np.abs(c)))
        c, g = self.c + other.c, self.g + other.g
        scale = np.abs(c) + self.spread + other.spread
        return Taylor(c, g, _rounded(self.e + other.e, scale))

    __radd__ = __add__

    def __sub__(self, other: Number) -> Taylor:
        return self + (-other)

    def __rsub__(self, other: Number) -> Taylor:
        return (-self) + other

    def __mul__(self, other: Number) -> Number:
        if not isinstance(other, Taylor):
            return self._scaled(float(other))
        if self is other:
            return self._squared()
        mine, its = self.spread, other.spread
        mixed = 0.5 * self.g * other.g
        c = self.c * other.c + mixed.sum(axis=0)
        g = self.c * other.g + other.c * self.g
        rest = np.abs(mixed).sum(axis=0) + _crossed(self.g, other.g)
        size, its_size = np.abs(self.c) + mine, np.abs(other.c) + its
        e = rest + self.e * (its_size + other.e) + other.e * size
        return Taylor(c, g, _rounded(e, size * its_size))

    __rmul__ = __mul__

    def _scaled(self, factor: float) -> Number:
        if factor == 0.0:
            return 0.0
        if factor == 1.0:
            return self
        c, g = factor * self.c, factor * self.g
        return Taylor(c, g, _rounded(abs(factor) * self.e, np.abs(c) + np.abs(g).sum(axis=0)))

    def _squared(self) -> Taylor:
        half = 0.5 * self.g * self.g
        c = self.c * self.c + half.sum(axis=0)
        g = 2.0 * self.c * self.g
        size = np.abs(self.c) + self.spread
        e = half.sum(axis=0) + _crossed(self.g, self.g) + self.e * (2.0 * size + self.e)
        return Taylor(c, g, _rounded(e, size * size))

    def __truediv__(self, other: Number) -> Number:
        if not isinstance(other, Taylor):
            return self._scaled(1.0 / float(other))
        return self * reciprocal(other)

    def __rtruediv__(self, other: float) -> Number:
        return reciprocal(self)._scaled(float(other))

    def __pow__(self, power: float) -> Number:
        if float(power).is_integer() and abs(power) <= _LARGEST_POWER:
            return _whole_power(self, int(power))
        return _curved(
            self,
            lambda x: x**power,
            lambda x: power * x ** (power - 1.0),
            lambda low, high: (
                abs(power * (power - 1.0)) * np.maximum(low ** (power - 2.0), high ** (power - 2.0))
            ),
            positive=True,
        )

    def __abs__(self) -> Taylor:
        radius = self.radius
        sign = np.where(self.c >= 0.0, 1.0, -1.0)
        # Where the sign is not settled all that is known is 0 <= |f| <= |c| + radius.
        settled = np.abs(self.c) > radius
        top = 0.5 * (np.abs(self.c) + radius)
        c = np.where(settled, np.abs(self.c), top)
        return Taylor(c, np.where(settled, sign * self.g, 0.0), np.where(settled, self.e, top))


_LARGEST_POWER = 64


def _rounded(error: FloatArray, scale: FloatArray) -> FloatArray:
    """Return the error enlarged by what rounding of terms of that scale can have cost."""
    return np.asarray((error + _OPERATION * scale) * (1.0 + _OPERATION))


def _crossed(a: FloatArray, b: FloatArray) -> FloatArray | float:
    """Bound Σ_{i<j} (a_i b_j + a_j b_i) ξ_i ξ_j."""
    total: FloatArray | float = 0.0
    for i in range(len(a)):
        for j in range(i):
            total = total + np.abs(a[i] * b[j] + a[j] * b[i])
    return total


def _whole_power(x: Taylor, power: int) -> Number:
    if power < 0:
        return 1.0 / _whole_power(x, -power)
    result: Number = 1.0
    for bit in bin(power)[2:]:
        result = result * result
        if bit == "1":
            result = result * x
    return result


def _curved(
    x: Number,
    function: Callable[[Any], FloatArray],
    slope: Callable[[FloatArray], FloatArray],
    bend: Callable[[FloatArray, FloatArray], FloatArray],
    positive: bool = False,
) -> Number:
    """Return f(x): linear part f'(c) g, error |f'| e + ½ max |f''| radius².

    Args:
        x: the argument.
        function: f.
        slope: f'.
        bend: a bound of |f''| on [low, high].
        positive: whether f is smooth for positive arguments only.
    """
    if not isinstance(x, Taylor):
        return float(function(x))
    radius = x.radius
    low, high = x.c - radius, x.c + radius
    with np.errstate(all="ignore"):
        value, rate = function(x.c), slope(x.c)
        e = np.abs(rate) * x.e + 0.5 * bend(low, high) * radius * radius
        charge = _FUNCTION * (np.abs(value) + np.abs(rate) * (np.abs(x.c) + radius))
        e = (e + charge) * (1.0 + _FUNCTION)
        bad = ~np.isfinite(e)
        if positive:
            bad |= low <= 0.0
    g = np.where(bad, 0.0, rate * x.g)
    return Taylor(np.where(bad, 0.0, value), g, np.where(bad, np.inf, e))


def reciprocal(x: Taylor) -> Taylor:
    """Return 1/x; unbounded where x may be zero."""
    sign = np.where(x.c < 0.0, -1.0, 1.0)
    upright = Taylor(sign * x.c, sign * x.g, x.e)
    one = _curved(
        upright,
        lambda v: 1.0 / v,
        lambda v: -1.0 / (v * v),
        lambda low, _high: 2.0 / low**3,
        positive=True,
    )
    assert isinstance(one, Taylor)
    return Taylor(sign * one.c, sign * one.g, one.e)


def _larger(low: FloatArray, high: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def _bend_of_asin(low: FloatArray, high: FloatArray) -> FloatArray:
    most = _larger(low, high)
    return np.asarray(np.where(most < 1.0, most * (1.0 - most * most) ** -1.5, np.inf))


# f, f' and a bound of |f''| on [low, high]; True where f is smooth for positive arguments only.
_SMOOTH: dict[str, tuple[Any, ...]] = {
    "sqrt": (np.sqrt, lambda v: 0.5 / np.sqrt(v), lambda low, _high: 0.25 * low**-1.5, True),
    "exp": (np.exp, np.exp, lambda _low, high: np.exp(high)),
    "log": (np.log, lambda v: 1.0 / v, lambda low, _high: low**-2.0, True),
    "sin": (np.sin, np.cos, lambda low, _high: np.ones_like(low)),
    "cos": (np.cos, lambda v: -np.sin(v), lambda low, _high: np.ones_like(low)),
    "asin": (np.arcsin, lambda v: (1.0 - v * v) ** -0.5, _bend_of_asin),
    "sinh": (np.sinh, np.cosh, lambda low, high: np.sinh(_larger(low, high))),
    "cosh": (np.cosh, np.sinh, lambda low, high: np.cosh(_larger(low, high))),
    # |f''| is at most 4/(3√3) and 3√3/8.
    "tanh": (np.tanh, lambda v: np.cosh(v) ** -2.0, lambda low, _high: np.full_like(low, 0.77)),
    "atan": (np.arctan, lambda v: 1.0 / (1.0 + v * v), lambda low, _high: np.full_like(low, 0.65)),
}


class _OnlyThese(type):
    def __getattr__(cls, name: str) -> Callable[..., Number]:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in _SMOOTH:
            raise TypeError(f"there is no enclosure of the function {name}")
        return lambda x: _curved(x, *_SMOOTH[name])


class TaylorMath(metaclass=_OnlyThese):
    """What ``math`` is to numbers: the functions that generated kernels may use.

    √x and log x are unbounded where x may be zero, arc sine and cosine where |x| may be 1, the
    tangent where x may be at a pole. Any other function is a TypeError, as a comparison is.
    """

    pi, e = np.pi, np.e

    @staticmethod
    def tan(x: Number) -> Number:
        """Tangent."""
        return TaylorMath.sin(x) / TaylorMath.cos(x)

    @staticmethod
    def acos(x: Number) -> Number:
        """Arc cosine."""
        return 0.5 * np.pi - TaylorMath.asin(x)

    @staticmethod
    def pow(x: Number, power: float) -> Number:
        """X to a constant power."""
        return x**power

    @staticmethod
    def copysign(size: float, x: Number) -> Number:
        """±size, by the sign of x; anything between where that is not settled."""
        if not isinstance(x, Taylor):
            return float(np.copysign(size, x))
        settled = np.abs(x.c) > x.radius
        c = np.where(settled, np.copysign(size, x.c), 0.0)
        return Taylor(c, np.zeros_like(x.g), np.where(settled, 0.0, abs(size)))

    fabs = staticmethod(abs)
