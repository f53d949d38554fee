"""Defining formulas of the texture kinds in multi-precision arithmetic (mpmath).

Each is a function h(x, y, m, n): the derivative of order (m, n) of the height, m + n <= 2.
"""

from __future__ import annotations

from collections.abc import Callable
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
