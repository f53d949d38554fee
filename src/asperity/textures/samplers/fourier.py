"""h = Σ a_i sin(k_i · (x, y) + phase_i).

Arguments: ``a`` [m], ``kx``, ``ky`` [rad/m], ``phase`` [rad], and ``bounds`` for the search of
nearest points: of second and third derivatives [1/m, 1/m²], least and greatest height [m], the
greatest wave number [rad/m], and the direction of the first wave.
"""

import math
from typing import Any

import numpy as np

from asperity.contacts.nearest.plane_search import descend, judge, next_box

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def height(
    x: float, y: float, a: FloatArray, kx: FloatArray, ky: FloatArray, phase: FloatArray,
    bounds: FloatArray,
) -> float:  # fmt: skip
    """Return h [m]."""
    h = 0.0
    for i in range(a.size):
        h += a[i] * math.sin(kx[i] * x + ky[i] * y + phase[i])
    return h


def slope(
    x: float, y: float, a: FloatArray, kx: FloatArray, ky: FloatArray, phase: FloatArray,
    bounds: FloatArray,
) -> tuple[float, float, float]:  # fmt: skip
    """Return h [m], h_x, h_y [1]."""
    h = hx = hy = 0.0
    for i in range(a.size):
        angle = kx[i] * x + ky[i] * y + phase[i]
        c = a[i] * math.cos(angle)
        h += a[i] * math.sin(angle)
        hx += kx[i] * c
        hy += ky[i] * c
    return h, hx, hy


def curvature(
    x: float, y: float, a: FloatArray, kx: FloatArray, ky: FloatArray, phase: FloatArray,
    bounds: FloatArray,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    h = hx = hy = hxx = hxy = hyy = 0.0
    for i in range(a.size):
        angle = kx[i] * x + ky[i] * y + phase[i]
        s = a[i] * math.sin(angle)
        c = a[i] * math.cos(angle)
        h += s
        hx += kx[i] * c
        hy += ky[i] * c
        hxx -= kx[i] * kx[i] * s
        hxy -= kx[i] * ky[i] * s
        hyy -= ky[i] * ky[i] * s
    return h, hx, hy, hxx, hxy, hyy


def nearest(x: float, y: float, z: float, *texture: Any) -> tuple[float, float]:
    """Return X, Y of the globally nearest surface point."""
    foot_x, foot_y, _h, _hx, _hy = foot(x, y, z, *texture)
    return foot_x, foot_y


def foot(
    x: float, y: float, z: float, a: FloatArray, kx: FloatArray, ky: FloatArray,
    phase: FloatArray, bounds: FloatArray,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Downhill from the probe, a distance; only a square of that half-width, less what the heights
    leave over, can hold a nearer point. It is quartered from the whole down.
    """
    texture = (a, kx, ky, phase, bounds)
    best = descend(x, y, z, x, y, texture)
    gap = max(bounds[2] - z, z - bounds[3], 0.0)
    reach = math.sqrt(max(best[2] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - x) / max(reach, 1e-300)
    v = 0.5 + 0.5 * (best[1] - y) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = j = 0
    side = 1.0
    while level <= 0:
        half = reach * side
        cx = (2 * j + 1) * half - reach
        cy = (2 * i + 1) * half - reach
        near_x = max(abs(cx) - half, 0.0)
        near_y = max(abs(cy) - half, 0.0)
        deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * (1.0 - 1e-13)
        # In a box of several waves Taylor's formula says nothing.
        if deeper and half * bounds[4] < 1.5:
            best, deeper = judge(
                x, y, z, x + cx, y + cy, half, half, bounds[0], bounds[1],
                best, texture,
            )  # fmt: skip
            deeper = deeper and level > -48
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if v >= (2 * i + 1) * side else 0)
            j = 2 * j + (1 if u >= (2 * j + 1) * side else 0)
        else:
            level, side, i, j = next_box(level, side, i, j, 0, u, v)
    return best[0], best[1], best[3], best[4], best[5]
