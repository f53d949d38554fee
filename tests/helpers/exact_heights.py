"""Heights of all texture kinds in multi-precision arithmetic, splines by their definition."""

from __future__ import annotations

from itertools import product
from typing import Any

import mpmath
import numpy as np

from asperity.contacts.contact import ExactHeight
from asperity.core.checks import FloatArray
from asperity.textures import HeightMap, Profile, Texture


def exact_height(texture: Texture) -> ExactHeight:
    """Return h(x, y, m, n), the derivative of order (m, n), m + n <= 2, in mpmath."""
    if not isinstance(texture, HeightMap | Profile):
        return texture.exact_height()
    inner = texture.coefficients[tuple(slice(1, n + 1) for n in texture.heights.shape)]
    pitches = tuple(np.atleast_1d(texture.pitch).tolist())
    return exact_spline(inner, pitches, np.atleast_1d(texture.origin), texture.periodic)


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
