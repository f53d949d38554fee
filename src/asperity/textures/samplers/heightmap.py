"""h = Σ c_ij β(x/p_x - j) β(y/p_y - i), a bicubic B-spline.

Arguments: ``c``, coefficients with one extra row and column before the first cell and two after the
last; ``ix``, ``iy``, nodes per metre; ``x0``, ``y0``, the first node
[m]; ``periodic``; ``low``, ``high``, the hull of the coefficients of each block of 8 × 8 cells [m].
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


def dot4(c: FloatArray, i: int, j: int, w0: float, w1: float, w2: float, w3: float) -> float:
    """Return the weighted sum of four coefficients of row i from column j on."""
    return float(w0 * c[i, j] + w1 * c[i, j + 1] + w2 * c[i, j + 2] + w3 * c[i, j + 3])


def cells_of(c: FloatArray) -> tuple[int, int]:
    """Return the number of cells along x and y."""
    return c.shape[1] - 3, c.shape[0] - 3


def height(
    x: float, y: float, c: FloatArray, ix: float, iy: float, x0: float, y0: float, periodic: bool,
    low: FloatArray, high: FloatArray,
) -> float:  # fmt: skip
    """Return h [m]."""
    nx, ny = cells_of(c)
    u, _su = fold((x - x0) * ix, nx, periodic)
    v, _sv = fold((y - y0) * iy, ny, periodic)
    j, t = cell_of(u, nx)
    i, r = cell_of(v, ny)
    w0, w1, w2, w3 = weights(t)
    v0, v1, v2, v3 = weights(r)
    return (
        v0 * dot4(c, i, j, w0, w1, w2, w3)
        + v1 * dot4(c, i + 1, j, w0, w1, w2, w3)
        + v2 * dot4(c, i + 2, j, w0, w1, w2, w3)
        + v3 * dot4(c, i + 3, j, w0, w1, w2, w3)
    )


def slope(
    x: float, y: float, c: FloatArray, ix: float, iy: float, x0: float, y0: float, periodic: bool,
    low: FloatArray, high: FloatArray,
) -> tuple[float, float, float]:  # fmt: skip
    """Return h [m], h_x, h_y [1]."""
    nx, ny = cells_of(c)
    u, su = fold((x - x0) * ix, nx, periodic)
    v, sv = fold((y - y0) * iy, ny, periodic)
    j, t = cell_of(u, nx)
    i, r = cell_of(v, ny)
    w0, w1, w2, w3 = weights(t)
    d0, d1, d2, d3 = weights_first(t)
    v0, v1, v2, v3 = weights(r)
    e0, e1, e2, e3 = weights_first(r)
    a0 = dot4(c, i, j, w0, w1, w2, w3)
    a1 = dot4(c, i + 1, j, w0, w1, w2, w3)
    a2 = dot4(c, i + 2, j, w0, w1, w2, w3)
    a3 = dot4(c, i + 3, j, w0, w1, w2, w3)
    b0 = dot4(c, i, j, d0, d1, d2, d3)
    b1 = dot4(c, i + 1, j, d0, d1, d2, d3)
    b2 = dot4(c, i + 2, j, d0, d1, d2, d3)
    b3 = dot4(c, i + 3, j, d0, d1, d2, d3)
    return (
        v0 * a0 + v1 * a1 + v2 * a2 + v3 * a3,
        su * ix * (v0 * b0 + v1 * b1 + v2 * b2 + v3 * b3),
        sv * iy * (e0 * a0 + e1 * a1 + e2 * a2 + e3 * a3),
    )


def curvature(
    x: float, y: float, c: FloatArray, ix: float, iy: float, x0: float, y0: float, periodic: bool,
    low: FloatArray, high: FloatArray,
) -> tuple[float, float, float, float, float, float]:  # fmt: skip
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    nx, ny = cells_of(c)
    u, su = fold((x - x0) * ix, nx, periodic)
    v, sv = fold((y - y0) * iy, ny, periodic)
    j, t = cell_of(u, nx)
    i, r = cell_of(v, ny)
    w0, w1, w2, w3 = weights(t)
    d0, d1, d2, d3 = weights_first(t)
    f0, f1, f2, f3 = weights_second(t)
    v0, v1, v2, v3 = weights(r)
    e0, e1, e2, e3 = weights_first(r)
    g0, g1, g2, g3 = weights_second(r)
    a0 = dot4(c, i, j, w0, w1, w2, w3)
    a1 = dot4(c, i + 1, j, w0, w1, w2, w3)
    a2 = dot4(c, i + 2, j, w0, w1, w2, w3)
    a3 = dot4(c, i + 3, j, w0, w1, w2, w3)
    b0 = dot4(c, i, j, d0, d1, d2, d3)
    b1 = dot4(c, i + 1, j, d0, d1, d2, d3)
    b2 = dot4(c, i + 2, j, d0, d1, d2, d3)
    b3 = dot4(c, i + 3, j, d0, d1, d2, d3)
    hxx = (
        v0 * dot4(c, i, j, f0, f1, f2, f3)
        + v1 * dot4(c, i + 1, j, f0, f1, f2, f3)
        + v2 * dot4(c, i + 2, j, f0, f1, f2, f3)
        + v3 * dot4(c, i + 3, j, f0, f1, f2, f3)
    )
    return (
        v0 * a0 + v1 * a1 + v2 * a2 + v3 * a3,
        su * ix * (v0 * b0 + v1 * b1 + v2 * b2 + v3 * b3),
        sv * iy * (e0 * a0 + e1 * a1 + e2 * a2 + e3 * a3),
        ix * ix * hxx,
        su * sv * ix * iy * (e0 * b0 + e1 * b1 + e2 * b2 + e3 * b3),
        iy * iy * (g0 * a0 + g1 * a1 + g2 * a2 + g3 * a3),
    )


def patch_coefficients(
    c: FloatArray, i: int, j: int, periodic: bool, out: FloatArray
) -> tuple[float, float]:
    """Copy the 16 coefficients of cell (i, j), any integers; return their least and greatest."""
    nx, ny = cells_of(c)
    low = np.inf
    high = -np.inf
    for a in range(4):
        row = i - 1 + a
        if row < -1 or row > ny + 1:
            row = fold_index(row, ny, periodic)
        for b in range(4):
            column = j - 1 + b
            if column < -1 or column > nx + 1:
                column = fold_index(column, nx, periodic)
            value = c[row + 1, column + 1]
            out[a, b] = value
            low = min(low, value)
            high = max(high, value)
    return low, high


def patch_bounds(p: FloatArray, ix: float, iy: float) -> tuple[float, float]:
    """Return bounds of |∇h| and of ‖Hess h‖ over a cell, from differences of coefficients."""
    gx = gy = hxx = hxy = hyy = 0.0
    for a in range(4):
        for b in range(3):
            gx = max(gx, abs(p[a, b + 1] - p[a, b]))
            gy = max(gy, abs(p[b + 1, a] - p[b, a]))
        for b in range(2):
            hxx = max(hxx, abs(p[a, b + 2] - 2.0 * p[a, b + 1] + p[a, b]))
            hyy = max(hyy, abs(p[b + 2, a] - 2.0 * p[b + 1, a] + p[b, a]))
    for a in range(3):
        for b in range(3):
            hxy = max(hxy, abs(p[a + 1, b + 1] - p[a + 1, b] - p[a, b + 1] + p[a, b]))
    hxx *= ix * ix
    hyy *= iy * iy
    hxy *= ix * iy
    # Inflated against the rounding of the differences.
    inflate = 1.0 + 1e-12
    slope_bound = inflate * math.sqrt(gx * ix * gx * ix + gy * iy * gy * iy)
    return slope_bound, inflate * math.sqrt(hxx * hxx + hyy * hyy + 2.0 * hxy * hxy)


def nearest(
    x: float, y: float, z: float,
    c: FloatArray, ix: float, iy: float, x0: float, y0: float, periodic: bool,
    low: FloatArray, high: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Return X, Y of the globally nearest surface point.

    Downhill from the probe, then the cells around it, give a distance; only cells within that
    distance can hold a nearer point. They are visited in blocks of 8 × 8, and a block or a cell
    is searched only if the hull of its coefficients comes near enough.
    """
    texture = (c, ix, iy, x0, y0, periodic, low, high)
    best_x, best_y, best = descend(x, y, z, x, y, texture)
    u = (x - x0) * ix
    v = (y - y0) * iy
    patch = np.empty((4, 4))
    i0 = math.floor(v)
    j0 = math.floor(u)
    for i in range(i0 - 1, i0 + 2):
        for j in range(j0 - 1, j0 + 2):
            best_x, best_y, best = search_cell(
                x, y, z, u, v, i, j, best_x, best_y, best, patch, texture
            )
    nx, ny = cells_of(c)
    reach = math.sqrt(best)
    i_low = math.floor(v - reach * iy)
    i_high = math.floor(v + reach * iy)
    j_low = math.floor(u - reach * ix)
    j_high = math.floor(u + reach * ix)
    # The plane is tiled by copies of the map, every other one mirrored if it is finite.
    for ti in range(i_low // ny, i_high // ny + 1):
        for tj in range(j_low // nx, j_high // nx + 1):
            window = (
                max(i_low - ti * ny, 0), min(i_high - ti * ny, ny - 1),
                max(j_low - tj * nx, 0), min(j_high - tj * nx, nx - 1),
            )  # fmt: skip
            best_x, best_y, best = search_tile(
                x, y, z, u, v, ti, tj, window, best_x, best_y, best, patch, texture
            )
    return best_x, best_y


def block_span(first: int, cells: int, tile: int, mirrored: bool) -> tuple[int, int]:
    """Return the cells [start, stop) of the plane that a block of 8 covers in a tile."""
    last = min(first + 8, cells)
    if mirrored:
        return tile * cells + cells - last, tile * cells + cells - first
    return tile * cells + first, tile * cells + last


def search_tile(
    x: float, y: float, z: float, u: float, v: float, ti: int, tj: int,
    window: tuple[int, int, int, int],
    best_x: float, best_y: float, best: float, patch: FloatArray, texture: Any,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the nearest point of one copy of the map if it is nearer than the best so far."""
    c, ix, iy, _x0, _y0, periodic, low, high = texture
    nx, ny = cells_of(c)
    i_first, i_last, j_first, j_last = window
    # The same window in cells of the plane, where a block is cut to it.
    i_from = ti * ny + i_first
    i_to = ti * ny + i_last + 1
    j_from = tj * nx + j_first
    j_to = tj * nx + j_last + 1
    flip_i = not periodic and ti % 2 != 0
    flip_j = not periodic and tj % 2 != 0
    if flip_i:
        i_first, i_last = ny - 1 - i_last, ny - 1 - i_first
    if flip_j:
        j_first, j_last = nx - 1 - j_last, nx - 1 - j_first
    for bi in range(i_first // 8, i_last // 8 + 1):
        i_start, i_stop = block_span(8 * bi, ny, ti, flip_i)
        near_y = max(i_start - v, v - i_stop, 0.0) / iy
        if near_y * near_y >= best:
            continue
        for bj in range(j_first // 8, j_last // 8 + 1):
            gap = max(low[bi, bj] - z, z - high[bi, bj], 0.0)
            j_start, j_stop = block_span(8 * bj, nx, tj, flip_j)
            near_x = max(j_start - u, u - j_stop, 0.0) / ix
            if near_x * near_x + near_y * near_y + gap * gap >= best:
                continue
            for i in range(max(i_start, i_from), min(i_stop, i_to)):
                for j in range(max(j_start, j_from), min(j_stop, j_to)):
                    best_x, best_y, best = search_cell(
                        x, y, z, u, v, i, j, best_x, best_y, best, patch, texture
                    )
    return best_x, best_y, best


def search_cell(
    x: float, y: float, z: float, u: float, v: float, i: int, j: int,
    best_x: float, best_y: float, best: float, patch: FloatArray, texture: Any,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the nearest point of cell (i, j) if it is nearer than the best so far."""
    c, ix, iy, _x0, _y0, periodic, _low, _high = texture
    px = 1.0 / ix
    py = 1.0 / iy
    near_x = max(j - u, u - (j + 1.0), 0.0) * px
    near_y = max(i - v, v - (i + 1.0), 0.0) * py
    flat = near_x * near_x + near_y * near_y
    if flat >= best:
        return best_x, best_y, best
    low, high = patch_coefficients(c, i, j, periodic, patch)
    gap = max(low - z, z - high, 0.0)
    if flat + gap * gap >= best:
        return best_x, best_y, best
    slope_bound, curvature_bound = patch_bounds(patch, ix, iy)
    box = ((j + 0.5 - u) * px, (i + 0.5 - v) * py, 0.5 * px, 0.5 * py)
    frame = (1.0, 0.0, slope_bound, curvature_bound, min(px, py) * 2.0**-6)
    return search_box(x, y, z, box, frame, best_x, best_y, best, texture)
