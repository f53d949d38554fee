"""h = Σ a_i sin(k_i · (x, y) + phase_i).

The last arguments describe the search for nearest points: ``bounds`` = (slope bound M,
curvature bound K, cosine and sine of the direction of a profile, 1 if the waves are all parallel).
"""

import math

import numpy as np

from asperity.textures.samplers.search import descend, search_box

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


def nearest(
    x: float, y: float, z: float, a: FloatArray, kx: FloatArray, ky: FloatArray,
    phase: FloatArray, bounds: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Return X, Y of the globally nearest surface point.

    Newton's method from the point above or below the probe gives a distance; only a box of that
    half-width can hold a nearer point, and it is searched by branch and bound.
    """
    texture = (a, kx, ky, phase, bounds)
    best_x, best_y, best = descend(x, y, z, x, y, texture)
    reach = math.sqrt(best)
    box = (0.0, 0.0, reach, 0.0 if bounds[4] > 0.0 else reach)
    terminal = 2.0**-6 / max(bounds[5], 1e-300)
    frame = (bounds[2], bounds[3], bounds[0], bounds[1], terminal)
    best_x, best_y, best = search_box(x, y, z, box, frame, best_x, best_y, best, texture)
    return best_x, best_y
