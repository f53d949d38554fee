"""h = Σ c_j β(x/p - j), a cubic B-spline profile; constant along y.

Arguments: ``c``, coefficients with one extra before the first cell and two after the last; ``ix``,
nodes per metre; ``x0``, the first node [m]; ``periodic``.
"""

import math
from typing import Any

import numpy as np

from asperity.textures.samplers.search import descend, search_box
from asperity.textures.samplers.spline import (
    cell_of,
    fold,
    fold_index,
    weights,
    weights_first,
    weights_second,
)

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def dot4(c: FloatArray, j: int, w0: float, w1: float, w2: float, w3: float) -> float:
    """Return the weighted sum of four coefficients from j on."""
    return float(w0 * c[j] + w1 * c[j + 1] + w2 * c[j + 2] + w3 * c[j + 3])


def height(x: float, y: float, c: FloatArray, ix: float, x0: float, periodic: bool) -> float:
    """Return h [m]."""
    cells = c.size - 3
    u, _sign = fold((x - x0) * ix, cells, periodic)
    j, t = cell_of(u, cells)
    w0, w1, w2, w3 = weights(t)
    return dot4(c, j, w0, w1, w2, w3)


def slope(
    x: float, y: float, c: FloatArray, ix: float, x0: float, periodic: bool
) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    cells = c.size - 3
    u, sign = fold((x - x0) * ix, cells, periodic)
    j, t = cell_of(u, cells)
    w0, w1, w2, w3 = weights(t)
    d0, d1, d2, d3 = weights_first(t)
    return dot4(c, j, w0, w1, w2, w3), sign * ix * dot4(c, j, d0, d1, d2, d3), 0.0


def curvature(
    x: float, y: float, c: FloatArray, ix: float, x0: float, periodic: bool
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    cells = c.size - 3
    u, sign = fold((x - x0) * ix, cells, periodic)
    j, t = cell_of(u, cells)
    w0, w1, w2, w3 = weights(t)
    d0, d1, d2, d3 = weights_first(t)
    f0, f1, f2, f3 = weights_second(t)
    h = dot4(c, j, w0, w1, w2, w3)
    hx = sign * ix * dot4(c, j, d0, d1, d2, d3)
    return h, hx, 0.0, ix * ix * dot4(c, j, f0, f1, f2, f3), 0.0, 0.0


def nearest(
    x: float, y: float, z: float, c: FloatArray, ix: float, x0: float, periodic: bool
) -> tuple[float, float]:
    """Return X, Y of the globally nearest surface point; Y = y.

    Cells to the left and right of the probe, nearest first, until they are farther away than
    the best point. A cell is searched only if the hull of its coefficients comes near enough.
    """
    texture = (c, ix, x0, periodic)
    best_x, best_y, best = descend(x, y, z, x, y, texture)
    u = (x - x0) * ix
    j0 = math.floor(u)
    pitch = 1.0 / ix
    ring = 0
    while True:
        if ring > 0:
            side = max(min(u - (j0 - ring + 1), j0 + ring - u), 0.0) * pitch
            if side * side >= best:
                break
        best_x, best_y, best = search_cell(x, y, z, u, j0 - ring, best_x, best_y, best, texture)
        if ring > 0:
            best_x, best_y, best = search_cell(x, y, z, u, j0 + ring, best_x, best_y, best, texture)
        ring += 1
    return best_x, best_y


def search_cell(
    x: float, y: float, z: float, u: float, j: int,
    best_x: float, best_y: float, best: float, texture: Any,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the nearest point of cell j if it is nearer than the best so far."""
    c, ix, _x0, periodic = texture
    cells = c.size - 3
    pitch = 1.0 / ix
    near = max(j - u, u - (j + 1.0), 0.0) * pitch
    c0 = c[fold_index(j - 1, cells, periodic) + 1]
    c1 = c[fold_index(j, cells, periodic) + 1]
    c2 = c[fold_index(j + 1, cells, periodic) + 1]
    c3 = c[fold_index(j + 2, cells, periodic) + 1]
    gap = max(min(c0, c1, c2, c3) - z, z - max(c0, c1, c2, c3), 0.0)
    if near * near + gap * gap >= best:
        return best_x, best_y, best
    # Inflated against the rounding of the differences.
    inflate = 1.0 + 1e-12
    slope_bound = inflate * ix * max(abs(c1 - c0), abs(c2 - c1), abs(c3 - c2))
    bend = max(abs(c2 - 2.0 * c1 + c0), abs(c3 - 2.0 * c2 + c1))
    box = ((j + 0.5 - u) * pitch, 0.0, 0.5 * pitch, 0.0)
    frame = (1.0, 0.0, slope_bound, inflate * ix * ix * bend, pitch * 2.0**-6)
    return search_box(x, y, z, box, frame, best_x, best_y, best, texture)
