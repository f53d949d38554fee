"""Exclude parts of a height map that cannot hold a point closer than the best one.

Let φ be the squared distance, as in ``plane_search``. For every number g it is nowhere below

    ψ = (X - x)² + (Y - y)² + 2 g (h - z) - g²,

because (h - z)² >= 2 g (h - z) - g². With g = h - z at a minimum of φ, ψ touches φ there, and its
gradient is zero there too. Moreover ψ is a bicubic spline: X² has the coefficients p_x² (j² - 1/3),
so the coefficients of ψ follow from those of h one by one. Where none of the sixteen coefficients
of a cell is below the squared distance of the best point, the cell holds no closer point. Only the
cells around the minimum remain in the window, and nothing in them is closer if ψ increases from the
minimum along all straight lines; its second derivatives are those of 2 (I + g Hess h).

The Bernstein coefficients of ψ bound it more tightly than its spline coefficients: a cell without
any below the squared distance is pruned. Around a minimum w of φ that is as close as the best
point, cells always stay open. With Δ = (X, Y) - w, a, b, d the second derivatives of ψ/2 there and
g = h - z at w, let

    q = e Δ_x² + 2 b Δ_x Δ_y + f Δ_y²,  e f = b²,  e/f = a/d.

This is a square, (√e Δ_x ± √f Δ_y)², so ψ is nowhere below ψ - q, which is bicubic as well. At w
all first derivatives of ψ - q are zero, and so is the mixed second one. In a part of a cell that
has a corner at w, the coefficients next to the corner are therefore no less than φ(w), and the
others exceed it as far as third derivatives allow: no bound of those is needed.

A window is the first and last column and the first and last row of its cells; it is empty if a last
one is before the first. A ball holds the points closer than the best one: the probe and the square
of the radius, x, y, z [m], r² [m²].
"""

import math

import numpy as np

from asperity.contacts.closest.plane_search import symmetric_eigenvalues
from asperity.contacts.sampler_interface import PRUNED_BOX_COST
from asperity.contacts.sampler_interface import PlanePoint as Point
from asperity.core.compiled import EPS, EVERY_FUNCTION, FloatArray, Kernels, local_array
from asperity.textures.spline.bspline_kernels import Vector4, box_bounds
from asperity.textures.spline.heightmap_sampler import HeightMapArguments, sample_hessian

KERNELS = Kernels(provides=EVERY_FUNCTION)

# Least side [cells] of a window that is narrowed by boxes; boxes along a side at first and at most.
MIN_BOX_WINDOW = 20
INITIAL_BOXES = 5
MAX_BOXES = 8
# Greatest number of coefficients, along x and in all, of a window that is narrowed by coefficients.
MAX_WINDOW_COLUMNS = 64
MAX_WINDOW_COEFFICIENTS = 1200
# Cost of a coefficient as a share of that of a box.
COEFFICIENT_COST = 1.0 / 16.0

Window = tuple[int, int, int, int]
Ball = tuple[float, float, float, float]
# A minimum of φ: its position [cells], g, and e, 2 b, f times the pitches.
CertifiedMinimum = tuple[float, float, float, float, float, float]


def is_empty(window: Window) -> bool:
    """Return whether a window has no cells."""
    return window[0] > window[1] or window[2] > window[3]


def narrow_window(
    query: Ball, best: Point, window: Window, budget: float, texture: HeightMapArguments
) -> tuple[Window, float]:
    """Return the part of a window that must be searched, and the remaining evaluation budget.

    The query is the probe and the pruning factor.
    """
    x, y, z, pruning_factor = query
    ball = (x, y, z, best[2] * pruning_factor)
    size = max(window[1] - window[0], window[3] - window[2])
    level = 1
    while size >> level >= INITIAL_BOXES:
        level += 1
    level = min(level, texture.levels.shape[0])
    while size >= MIN_BOX_WINDOW and level > 0 and size >> level < MAX_BOXES and budget > 8.0:
        window = shrink_to_boxes(ball, level, window, texture)
        budget -= PRUNED_BOX_COST * ((size >> level) + 1) ** 2
        size = max(window[1] - window[0], window[3] - window[2])
        level -= 1
    columns = window[1] - window[0] + 4
    count = columns * (window[3] - window[2] + 4)
    cost = PRUNED_BOX_COST * COEFFICIENT_COST * count + 3.0
    too_large = columns > MAX_WINDOW_COLUMNS or count > MAX_WINDOW_COEFFICIENTS
    if is_empty(window) or too_large or budget <= cost:
        return window, budget
    window = shrink_to_cells(ball, best[3] - z, window, texture)
    if is_empty(window) or is_unique_minimum(x, y, z, best, window, texture):
        return (0, -1, 0, -1), budget - cost
    return window, budget - cost


def may_hold_point(ball: Ball, level: int, i: int, j: int, texture: HeightMapArguments) -> bool:
    """Return whether box (i, j) of a level, from 1 on, may hold a point of the ball."""
    x, y, z, threshold = ball
    half = 0.5 * 2.0**level
    u = (x - texture.x0) * texture.ix
    v = (y - texture.y0) * texture.iy
    away_x = max(abs((2 * j + 1) * half - u) - half, 0.0) / texture.ix
    away_y = max(abs((2 * i + 1) * half - v) - half, 0.0) / texture.iy
    row = texture.levels[level - 1, 0] + i * texture.levels[level - 1, 2]
    low, high, _hessian, _third = box_bounds(texture.boxes, row + j)
    gap = max(low - z, z - high, 0.0)
    return away_x * away_x + away_y * away_y + gap * gap < threshold


def shrink_to_boxes(ball: Ball, level: int, window: Window, texture: HeightMapArguments) -> Window:
    """Return the part of a window whose boxes of a level may hold a point of the ball."""
    west, east, south, north = window
    first_i = north
    first_j = east
    last_i = last_j = -1
    for i in range(south >> level, (north >> level) + 1):
        for j in range(west >> level, (east >> level) + 1):
            if may_hold_point(ball, level, i, j, texture):
                first_i = min(first_i, i)
                first_j = min(first_j, j)
                last_i = i
                last_j = max(last_j, j)
    return (
        max(west, first_j << level), min(east, ((last_j + 1) << level) - 1),
        max(south, first_i << level), min(north, ((last_i + 1) << level) - 1),
    )  # fmt: skip


def shrink_to_cells(ball: Ball, gap: float, window: Window, texture: HeightMapArguments) -> Window:
    """Return the part of a window whose cells have a coefficient of ψ below the ball's r².

    The window has at most ``MAX_WINDOW_COLUMNS`` coefficients along x.
    """
    x, y, z, threshold = ball
    # Indices that cannot be negative let the compiler use vector registers.
    west = max(window[0], 0)
    east = window[1]
    south = max(window[2], 0)
    north = window[3]
    columns = local_array((64,))
    c = texture.c
    used = east - west + 4
    count = min((used + 7) & -8, c.shape[1] - west)  # whole registers
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    for m in range(count):
        away = west + m - 1 - (x - texture.x0) * texture.ix
        columns[m] = (away * away - 1.0 / 3.0) * px * px
    for m in range(used, count):
        columns[m] = np.inf
    first_i = north + 4
    first_j = east + 4
    last_i = last_j = -1
    for i in range(south, north + 4):
        away = i - 1 - (y - texture.y0) * texture.iy
        rest = threshold + gap * gap - (away * away - 1.0 / 3.0) * py * py
        less = 0
        for m in range(count):
            if columns[m] + 2.0 * gap * (c[i, west + m] - z) < rest:
                less += 1
        if less > 0:
            first_i = min(first_i, i)
            last_i = i
            for m in range(count):
                if columns[m] + 2.0 * gap * (c[i, west + m] - z) < rest:
                    first_j = min(first_j, west + m)
                    last_j = max(last_j, west + m)
    return max(west, first_j - 3), min(east, last_j), max(south, first_i - 3), min(north, last_i)


def is_unique_minimum(
    x: float, y: float, z: float, best: Point, window: Window, texture: HeightMapArguments
) -> bool:
    """Return whether ψ increases from the best point along all straight lines within a window.

    Decided by its second derivatives at the point, and by how fast and how far they can decrease.
    """
    west, east, south, north = window
    gap = best[3] - z
    u = (best[0] - texture.x0) * texture.ix
    v = (best[1] - texture.y0) * texture.iy
    # A point whose gradient is not zero to rounding is no minimum.
    slope_x = best[0] - x + gap * best[4]
    slope_y = best[1] - y + gap * best[5]
    stationary = 10.0 * (slope_x * slope_x + slope_y * slope_y) <= EPS * best[2]
    if not stationary or u < west or u > east + 1 or v < south or v > north + 1:
        return False
    # Below the surface only crests curve towards the probe.
    bound = 4 if gap > 0.0 else 2
    hessian = 0.0
    third = 0.0
    for i in range(south >> 1, (north >> 1) + 1):
        row = texture.levels[0, 0] + i * texture.levels[0, 2]
        for j in range(west >> 1, (east >> 1) + 1):
            hessian = max(hessian, float(texture.boxes[row + j, bound]))
            third = max(third, float(texture.boxes[row + j, 3]))
    least = 1.0 - abs(gap) * hessian * texture.ix
    if least > 1e-3:
        return True
    _h, _hx, _hy, hxx, hxy, hyy = sample_hessian(best[0], best[1], texture)
    low, _high = symmetric_eigenvalues(1.0 + gap * hxx, gap * hxy, 1.0 + gap * hyy)
    rate = abs(gap) * third * texture.ix * texture.ix
    dx = max(u - west, east + 1 - u) / texture.ix
    dy = max(v - south, north + 1 - v) / texture.iy
    r = math.sqrt(dx * dx + dy * dy)
    return min_increase(low, least, rate, r) > 1e-3 * r * r


def min_increase(start: float, least: float, rate: float, r: float) -> float:
    """Return a lower bound of the increase over a length r of a function with zero initial slope.

    Its second derivative starts at ``start``, decreases at most at ``rate`` and is never below
    ``least``.
    """
    t = min(max((start - least) / max(rate, 1e-300), 0.0), r)
    rest = r - t
    return t * (start * (r - 0.5 * t) - rate * t * (0.5 * r - t / 3.0)) + 0.5 * least * rest * rest


def cubic_bernstein(a: float, b: float, c: float, d: float) -> Vector4:
    """Return the Bernstein coefficients of a cubic spline on a cell, times six."""
    return a + 4.0 * b + c, 4.0 * b + 2.0 * c, 2.0 * b + 4.0 * c, b + 4.0 * c + d


def square_bernstein(t: float) -> Vector4:
    """Return the Bernstein coefficients of (s - t)² on 0 <= s <= 1, as a cubic."""
    return t * t, t * (t - 2.0 / 3.0), t * (t - 4.0 / 3.0) + 1.0 / 3.0, (1.0 - t) * (1.0 - t)


def squares_bernstein(s: float, pitch: float, t: float, weight: float, shift: float) -> Vector4:
    """Return the Bernstein coefficients of p² (S - s)² - w (S - t)² - c on 0 <= S <= 1."""
    a0, a1, a2, a3 = square_bernstein(s)
    b0, b1, b2, b3 = square_bernstein(t)
    return (
        a0 * pitch * pitch - weight * b0 - shift,
        a1 * pitch * pitch - weight * b1 - shift,
        a2 * pitch * pitch - weight * b2 - shift,
        a3 * pitch * pitch - weight * b3 - shift,
    )


def row_bernstein(a: FloatArray, m: int, k: int) -> Vector4:
    """Return the Bernstein coefficients of four numbers in row m from column k on, times six."""
    return cubic_bernstein(a[m, k], a[m, k + 1], a[m, k + 2], a[m, k + 3])


def min_coefficients_in_row(
    x: float, y: float, z: float, i: int, first: int, count: int, minima: FloatArray,
    texture: HeightMapArguments,
) -> None:  # fmt: skip
    """Write the least Bernstein coefficient of ψ in each of at most 64 cells of row i.

    For each cell g is the height near its middle, less z.
    """
    # Indices that cannot be negative let the compiler use vector registers.
    i = max(i, 0)
    first = max(first, 0)
    c = texture.c
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    across = local_array((4, 67))
    for m in range(count + 3):
        k = first + m
        across[0, m], across[1, m], across[2, m], across[3, m] = cubic_bernstein(
            c[i, k] - z, c[i + 1, k] - z, c[i + 2, k] - z, c[i + 3, k] - z
        )
    v0, v1, v2, v3 = square_bernstein((y - texture.y0) * texture.iy - i)
    v0 *= py * py
    v1 *= py * py
    v2 *= py * py
    v3 *= py * py
    u = (x - texture.x0) * texture.ix - first
    for k in range(count):
        inner = across[1, k + 1] + across[1, k + 2] + across[2, k + 1] + across[2, k + 2]
        gap = inner / 24.0
        g = gap / 18.0
        a0, a1, a2, a3 = row_bernstein(across, 0, k)
        b0, b1, b2, b3 = row_bernstein(across, 1, k)
        d0, d1, d2, d3 = row_bernstein(across, 2, k)
        e0, e1, e2, e3 = row_bernstein(across, 3, k)
        u0, u1, u2, u3 = square_bernstein(u - k)
        minima[k] = min(
            min(g * a0 + v0, g * b0 + v1, g * d0 + v2, g * e0 + v3) + u0 * px * px,
            min(g * a1 + v0, g * b1 + v1, g * d1 + v2, g * e1 + v3) + u1 * px * px,
            min(g * a2 + v0, g * b2 + v1, g * d2 + v2, g * e2 + v3) + u2 * px * px,
            min(g * a3 + v0, g * b3 + v1, g * d3 + v2, g * e3 + v3) + u3 * px * px,
        ) - gap * gap  # fmt: skip


def certified_minimum_at(z: float, minimum: Point, texture: HeightMapArguments) -> CertifiedMinimum:
    """Return what ``can_prune_cell`` needs of a minimum of φ."""
    gap = minimum[3] - z
    _h, _hx, _hy, hxx, hxy, hyy = sample_hessian(minimum[0], minimum[1], texture)
    a = 1.0 + gap * hxx
    b = gap * hxy
    d = 1.0 + gap * hyy
    # Any ratio makes q a square; this one takes equal shares from a and d.
    ratio = math.sqrt(min(max(a / d, 1e-6), 1e6)) if a > 0.0 and d > 0.0 else 1.0
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    return (
        (minimum[0] - texture.x0) * texture.ix, (minimum[1] - texture.y0) * texture.iy,
        gap, abs(b) * ratio * px * px, 2.0 * b * px * py, abs(b) / ratio * py * py,
    )  # fmt: skip


def is_within(minimum: CertifiedMinimum, i: int, j: int, distance: float) -> bool:
    """Return whether a minimum is within a distance [cells] of the middle of cell (i, j)."""
    return abs(minimum[0] - j - 0.5) <= distance and abs(minimum[1] - i - 0.5) <= distance


def can_prune_cell(
    ball: Ball, minimum: CertifiedMinimum, i: int, j: int, texture: HeightMapArguments
) -> bool:
    """Return whether no coefficient of ψ - q of a minimum is below the ball's r² in cell (i, j).

    The cell is subdivided at the point closest to the minimum along each axis.
    """
    x, y, z, threshold = ball
    c = texture.c
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    at_u, at_v, gap, e, b, f = minimum
    u = at_u - j
    v = at_v - i
    across = local_array((4, 4))
    for m in range(4):
        across[0, m], across[1, m], across[2, m], across[3, m] = cubic_bernstein(
            c[i, j + m] - z, c[i + 1, j + m] - z, c[i + 2, j + m] - z, c[i + 3, j + m] - z
        )
    probe_u = (x - texture.x0) * texture.ix - j
    probe_v = (y - texture.y0) * texture.iy - i
    a0, a1, a2, a3 = squares_bernstein(probe_u, px, u, e, gap * gap)
    rows = local_array((4,))
    rows[0], rows[1], rows[2], rows[3] = squares_bernstein(probe_v, py, v, f, 0.0)
    g = gap / 18.0
    cut = local_array((7, 4))
    for m in range(4):
        h0, h1, h2, h3 = row_bernstein(across, m, 0)
        mixed = b * (v - m / 3.0)
        (cut[0, m], cut[1, m], cut[2, m], cut[3, m], cut[4, m], cut[5, m], cut[6, m]) = (
            subdivide_cubic(
                min(max(u, 0.0), 1.0),
                g * h0 + a0 + rows[m] - mixed * u,
                g * h1 + a1 + rows[m] - mixed * (u - 1.0 / 3.0),
                g * h2 + a2 + rows[m] - mixed * (u - 2.0 / 3.0),
                g * h3 + a3 + rows[m] - mixed * (u - 1.0),
            )
        )
    least = np.inf
    for m in range(7):
        q0, q1, q2, q3, q4, q5, q6 = subdivide_cubic(
            min(max(v, 0.0), 1.0), cut[m, 0], cut[m, 1], cut[m, 2], cut[m, 3]
        )
        least = min(least, q0, q1, q2, q3, q4, q5, q6)
    return least >= threshold


def subdivide_cubic(
    t: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return the Bernstein coefficients of both parts of a cubic split at t (de Casteljau)."""
    ab = a + t * (b - a)
    bc = b + t * (c - b)
    cd = c + t * (d - c)
    abc = ab + t * (bc - ab)
    bcd = bc + t * (cd - bc)
    return a, ab, abc, abc + t * (bcd - abc), bcd, cd, d
