"""Bounds of the squared distance of a spline from its coefficients.

ψ of ``closest_search`` is a spline as the height is: X² has the coefficients p_x² (j² - 1/3), so
the coefficients of ψ follow from those of h one by one. Where none of the sixteen coefficients of
a cell is below the squared distance of the best point, the cell holds no closer point.

The Bernstein coefficients of ψ, with a g of each cell's own, bound it more tightly than its
spline coefficients: a cell without any below the squared distance is pruned. Around a minimum w
of φ that is as close as the best point, cells always stay open. With Δ = (X, Y) - w, a, b, d the
second derivatives of ψ/2 there and g = h - z at w, let

    q = e Δ_x² + 2 b Δ_x Δ_y + f Δ_y²,  e f = b²,  e/f = a/d.

This is a square, (√e Δ_x ± √f Δ_y)², so ψ is nowhere below ψ - q, which is bicubic as well. At w
all first derivatives of ψ - q are zero, and so is the mixed second one. In a part of a cell that
has a corner at w, the coefficients next to the corner are therefore no less than φ(w), and the
others exceed it as far as third derivatives allow: no bound of those is needed.
"""

import math

import numpy as np

from asperity.contacts.sampler_interface import Ball, Box, Minimum
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels, local_array
from asperity.textures.spline.bspline_kernels import (
    SplineArguments,
    Vector4,
    cell_counts,
    cell_sides,
    fold_cells,
    probe_cells,
)

KERNELS = Kernels(provides=EVERY_FUNCTION)

# Distance [cells] from the middle of a cell within which a minimum may prune it.
NEAR_DISTANCE = 2.5


def shrink_to_cells(
    u: float,
    v: float,
    z: float,
    threshold: float,
    gap: float,
    west: int,
    east: int,
    south: int,
    north: int,
    texture: SplineArguments,
) -> tuple[int, int, int, int]:
    """Return the first and last column and row of the cells that have a coefficient below r²."""
    # Indices that cannot be negative let the compiler use vector registers.
    west = max(west, 0)
    south = max(south, 0)
    columns = local_array((64,))
    c = texture.c
    used = east - west + 4
    count = min((used + 7) & -8, c.shape[1] - west)  # whole registers
    side_x, side_y = cell_sides(texture)
    for m in range(count):
        away = west + m - 1 - u
        columns[m] = (away * away - 1.0 / 3.0) * side_x * side_x
    for m in range(used, count):
        columns[m] = np.inf
    first_i = north + 4
    first_j = east + 4
    last_i = last_j = -1
    for i in range(south, min(north + 4, c.shape[0])):
        away = i - 1 - v
        rest = threshold + gap * gap - (away * away - 1.0 / 3.0) * side_y * side_y
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


def can_prune_near(ball: Ball, minimum: Minimum, box: Box, texture: SplineArguments) -> bool:
    """Return whether no coefficient of ψ - q of a minimum is below the ball's r² in a cell."""
    u = minimum[0] - box[0]
    v = minimum[1] - box[2]
    is_cell = box[1] - box[0] == 1.0 and box[3] - box[2] == 1.0
    if not is_cell or max(abs(u - 0.5), abs(v - 0.5)) > NEAR_DISTANCE:
        return False
    nx, ny = cell_counts(texture)
    j, _last, sign_u, _shift = fold_cells(box[0], box[1], nx, texture.periodic)
    i, _last, sign_v, _shift = fold_cells(box[2], box[3], ny, texture.periodic)
    if sign_u * sign_v == 0.0:
        return False
    probe_u, probe_v = probe_cells(ball, texture)
    probe_u -= box[0]
    probe_v -= box[2]
    # In a mirrored copy from the other border.
    if sign_u < 0.0:
        u = 1.0 - u
        probe_u = 1.0 - probe_u
    if sign_v < 0.0:
        v = 1.0 - v
        probe_v = 1.0 - probe_v
    e, b, f = square_at(minimum, texture)
    square = (e, sign_u * sign_v * b, f)
    probe = (probe_u, probe_v, ball[2])
    return min_coefficient_near(i, j, probe, u, v, minimum[2], square, texture) >= ball[3]


def min_coefficient_near(
    i: int,
    j: int,
    probe: tuple[float, float, float],
    u: float,
    v: float,
    gap: float,
    square: tuple[float, float, float],
    texture: SplineArguments,
) -> float:
    """Return the least Bernstein coefficient of ψ - q in the parts of cell (i, j).

    The cell is subdivided at the point closest to (u, v) along each axis. This point and the probe
    are in cells from the corner of the cell, the gap is g, and the square is e, 2 b, f of q.
    """
    e, b, f = square
    z = probe[2]
    c = texture.c
    last_row = c.shape[0] - 1
    side_x, side_y = cell_sides(texture)
    patch = local_array((4, 4))
    for m in range(4):
        k = j + m
        patch[0, m], patch[1, m], patch[2, m], patch[3, m] = cubic_bernstein(
            c[i, k] - z,
            c[min(i + 1, last_row), k] - z,
            c[min(i + 2, last_row), k] - z,
            c[min(i + 3, last_row), k] - z,
        )
    a0, a1, a2, a3 = squares_bernstein(probe[0], side_x, u, e, gap * gap)
    rows = local_array((4,))
    rows[0], rows[1], rows[2], rows[3] = squares_bernstein(probe[1], side_y, v, f, 0.0)
    g = gap / 18.0
    count = min(c.shape[0], 4)
    for m in range(count):
        h0, h1, h2, h3 = row_bernstein(patch, m, 0)
        mixed = b * (v - m / 3.0)
        patch[m, 0] = g * h0 + a0 + rows[m] - mixed * u
        patch[m, 1] = g * h1 + a1 + rows[m] - mixed * (u - 1.0 / 3.0)
        patch[m, 2] = g * h2 + a2 + rows[m] - mixed * (u - 2.0 / 3.0)
        patch[m, 3] = g * h3 + a3 + rows[m] - mixed * (u - 1.0)
    return min_after_subdivision(u, v, patch, count)


def square_at(minimum: Minimum, texture: SplineArguments) -> tuple[float, float, float]:
    """Return e, 2 b and f of the square q of a minimum times the sides of a cell."""
    _u, _v, gap, _low, hxx, hxy, hyy = minimum
    a = 1.0 + gap * hxx
    b = gap * hxy
    d = 1.0 + gap * hyy
    # Any ratio makes q a square; this one takes equal shares from a and d.
    ratio = math.sqrt(min(max(a / d, 1e-6), 1e6)) if a > 0.0 and d > 0.0 else 1.0
    side_x, side_y = cell_sides(texture)
    e = abs(b) * ratio * side_x * side_x
    return e, 2.0 * b * side_x * side_y, abs(b) / ratio * side_y * side_y


def min_after_subdivision(u: float, v: float, patch: FloatArray, rows: int) -> float:
    """Return the least Bernstein coefficient of the parts of a patch, split at (u, v) inside."""
    u = min(max(u, 0.0), 1.0)
    v = min(max(v, 0.0), 1.0)
    cut = local_array((7, 4))
    least = np.inf
    for m in range(rows):
        (cut[0, m], cut[1, m], cut[2, m], cut[3, m], cut[4, m], cut[5, m], cut[6, m]) = (
            subdivide_cubic(u, patch[m, 0], patch[m, 1], patch[m, 2], patch[m, 3])
        )
    for m in range(7):
        if rows == 1:
            least = min(least, cut[m, 0])
            continue
        q0, q1, q2, q3, q4, q5, q6 = subdivide_cubic(v, cut[m, 0], cut[m, 1], cut[m, 2], cut[m, 3])
        least = min(least, q0, q1, q2, q3, q4, q5, q6)
    return least


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


def min_coefficients_in_row(
    u: float,
    v: float,
    z: float,
    i: int,
    first: int,
    count: int,
    minima: FloatArray,
    texture: SplineArguments,
) -> None:
    """Write the least Bernstein coefficient of ψ in each of at most 64 cells of row i.

    For each cell g is the height near its middle, less z.
    """
    # Indices that cannot be negative let the compiler use vector registers.
    i = max(i, 0)
    first = max(first, 0)
    c = texture.c
    last_row = c.shape[0] - 1
    i1 = min(i + 1, last_row)
    i2 = min(i + 2, last_row)
    i3 = min(i + 3, last_row)
    side_x, side_y = cell_sides(texture)
    across = local_array((4, 67))
    for m in range(count + 3):
        k = first + m
        across[0, m], across[1, m], across[2, m], across[3, m] = cubic_bernstein(
            c[i, k] - z, c[i1, k] - z, c[i2, k] - z, c[i3, k] - z
        )
    v0, v1, v2, v3 = square_bernstein(v - i)
    v0 *= side_y * side_y
    v1 *= side_y * side_y
    v2 *= side_y * side_y
    v3 *= side_y * side_y
    u -= first
    for k in range(count):
        inner = across[1, k + 1] + across[1, k + 2] + across[2, k + 1] + across[2, k + 2]
        gap = inner / 24.0
        g = gap / 18.0
        a0, a1, a2, a3 = row_bernstein(across, 0, k)
        b0, b1, b2, b3 = row_bernstein(across, 1, k)
        d0, d1, d2, d3 = row_bernstein(across, 2, k)
        e0, e1, e2, e3 = row_bernstein(across, 3, k)
        u0, u1, u2, u3 = square_bernstein(u - k)
        minima[k] = (
            min(
                min(g * a0 + v0, g * b0 + v1, g * d0 + v2, g * e0 + v3) + u0 * side_x * side_x,
                min(g * a1 + v0, g * b1 + v1, g * d1 + v2, g * e1 + v3) + u1 * side_x * side_x,
                min(g * a2 + v0, g * b2 + v1, g * d2 + v2, g * e2 + v3) + u2 * side_x * side_x,
                min(g * a3 + v0, g * b3 + v1, g * d3 + v2, g * e3 + v3) + u3 * side_x * side_x,
            )
            - gap * gap
        )


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
