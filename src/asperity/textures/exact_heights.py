"""Defining formulas of the texture kinds in multi-precision arithmetic (mpmath).

Each is a function h(x, y, m, n): the derivative of order (m, n) of the height, m + n <= 2.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import Any

import mpmath
import numpy as np

from asperity.contacts.contact import ExactHeight
from asperity.core.checks import FloatArray


def exact_waves(waves: list[tuple[Any, Any, Any, Any]]) -> ExactHeight:
    """Return Σ a sin(k_x x + k_y y + phase) of waves (a, k_x, k_y, phase)."""

    def height(x: Any, y: Any, m: int, n: int) -> Any:
        total = mpmath.mpf(0)
        for a, kx, ky, phase in waves:
            u = mpmath.mpf(kx)
            v = mpmath.mpf(ky)
            angle = u * x + v * y + mpmath.mpf(phase)
            total += mpmath.mpf(a) * u**m * v**n * mpmath.sin(angle + (m + n) * mpmath.pi / 2)
        return total

    return height


def taylor_continuation(derivatives: Callable[[FloatArray], FloatArray]) -> ExactHeight:
    """Return the second-order Taylor continuation of the double-precision height."""

    def height(x: Any, y: Any, m: int, n: int) -> Any:
        near = [float(x), float(y)]
        h, hx, hy, hxx, hxy, hyy = map(mpmath.mpf, derivatives(np.array([near]))[0].tolist())
        dx = x - mpmath.mpf(near[0])
        dy = y - mpmath.mpf(near[1])
        if m + n == 2:
            return (hyy, hxy, hxx)[m]
        if m == 1:
            return hx + hxx * dx + hxy * dy
        if n == 1:
            return hy + hxy * dx + hyy * dy
        return h + dx * (hx + hxx * dx / 2 + hxy * dy) + dy * (hy + hyy * dy / 2)

    return height


def exact_spline(
    coefficients: FloatArray, pitch: tuple[float, ...], origin: FloatArray, periodic: bool
) -> ExactHeight:
    """Return the cubic B-spline of coefficients at nodes, (ny, nx) or (n,)."""

    def height(x: Any, y: Any, m: int, n: int) -> Any:
        if n and coefficients.ndim == 1:
            return mpmath.mpf(0)
        steps = [mpmath.mpf(step) for step in pitch]
        weights = []
        for place, order, count, step, first in zip(
            (x, y), (m, n), coefficients.shape[::-1], steps, origin, strict=False
        ):
            u = (place - mpmath.mpf(float(first))) / step
            weights.append(_weights(u, count, periodic, order).items())
        total = mpmath.mpf(0)
        for around in product(*reversed(weights)):
            nodes, shares = zip(*around, strict=True)
            total += mpmath.fprod(shares) * mpmath.mpf(float(coefficients[nodes]))
        for step, order in zip(steps, (m, n), strict=False):
            total /= step**order
        return total

    return height


def _weights(u: Any, count: int, periodic: bool, order: int) -> dict[int, Any]:
    """Return the weight of each node at u [nodes], mirrored or periodic at the border."""
    weights: dict[int, Any] = {}
    first = int(mpmath.floor(u)) - 1
    for j in range(first, first + 4):
        node = j % count if periodic else abs((j + count - 1) % (2 * (count - 1)) - (count - 1))
        weights[node] = weights.get(node, 0) + _basis(u - j, order)
    return weights


def _basis(u: Any, order: int) -> Any:
    """Return the cubic B-spline β(u), support (-2, 2), or a derivative, by truncated powers."""
    total = mpmath.mpf(0)
    for j, weight in enumerate((1, -4, 6, -4, 1)):
        t = u + 2 - j
        if t > 0:
            total += weight * t ** (3 - order) / mpmath.factorial(3 - order)
    return total
