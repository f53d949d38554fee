"""Which cells can hold a point nearer than the best one, cell by cell.

With ψ of ``heightmap_window``: on a cell it is nowhere less than its Bernstein coefficients, which
bound it more closely than those of the spline. Where none is less than φ of the best, the cell
holds no nearer point; else it is open.

About a minimum w of φ as near as the best, cells are open always. With Δ = (X, Y) - w and a, b, d
for the second derivatives of ψ/2 there, g = h - z at w, let

    q = e Δ_x² + 2 b Δ_x Δ_y + f Δ_y²,  e f = b²,  e/f = a/d.

It is a square, ±(√e Δ_x ± √f Δ_y)², so ψ is nowhere less than ψ - q, which is a bicubic as well. Of
ψ - q all first derivatives are zero at w, and the mixed one, too. In a piece of a cell that has a
corner there, the coefficients next to the corner are thus no less than φ(w), and the others are
more as far as third derivatives leave them so: no bound of these is needed.
"""

import math

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.contacts.sampler import PlanePoint as Point
from asperity.textures.samplers.heightmap import HeightMapArguments, curvature
from asperity.textures.samplers.spline import Four

KERNELS = Kernels(
    provides=("basin_at", "is_near", "least_in_row", "rises_in"),
    requires=("curvature",),
    called=("least_in_row", "rises_in"),
)

# A minimum of φ: where, in cells, g, and e, 2 b, f times the pitches.
Basin = tuple[float, float, float, float, float, float]


def bernstein(a: float, b: float, c: float, d: float) -> Four:
    """Return the Bernstein coefficients of a cubic spline on a cell, times six."""
    return a + 4.0 * b + c, 4.0 * b + 2.0 * c, 2.0 * b + 4.0 * c, b + 4.0 * c + d


def square_on(t: float) -> Four:
    """Return the Bernstein coefficients of (s - t)² on 0 <= s <= 1, as a cubic."""
    return t * t, t * (t - 2.0 / 3.0), t * (t - 4.0 / 3.0) + 1.0 / 3.0, (1.0 - t) * (1.0 - t)


def along_row(a: FloatArray, m: int, k: int) -> Four:
    """Return the Bernstein coefficients of four numbers in row m from column k on, times six."""
    return bernstein(a[m, k], a[m, k + 1], a[m, k + 2], a[m, k + 3])


def least_in_row(
    x: float, y: float, z: float, i: int, first: int, count: int, least: FloatArray,
    texture: HeightMapArguments,
) -> None:  # fmt: skip
    """Write the least Bernstein coefficient of ψ in each of some cells of row i, at most 64.

    Of each cell g is the height amid it.
    """
    # What is known not to be negative lets the compiler use vector registers.
    i = max(i, 0)
    first = max(first, 0)
    c = texture.c
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    across = local_array((4, 67))
    for m in range(count + 3):
        k = first + m
        across[0, m], across[1, m], across[2, m], across[3, m] = bernstein(
            c[i, k] - z, c[i + 1, k] - z, c[i + 2, k] - z, c[i + 3, k] - z
        )
    v0, v1, v2, v3 = square_on((y - texture.y0) * texture.iy - i)
    v0 *= py * py
    v1 *= py * py
    v2 *= py * py
    v3 *= py * py
    u = (x - texture.x0) * texture.ix - first
    for k in range(count):
        amid = across[1, k + 1] + across[1, k + 2] + across[2, k + 1] + across[2, k + 2]
        gap = amid / 24.0
        g = gap / 18.0
        a0, a1, a2, a3 = along_row(across, 0, k)
        b0, b1, b2, b3 = along_row(across, 1, k)
        d0, d1, d2, d3 = along_row(across, 2, k)
        e0, e1, e2, e3 = along_row(across, 3, k)
        u0, u1, u2, u3 = square_on(u - k)
        least[k] = min(
            min(g * a0 + v0, g * b0 + v1, g * d0 + v2, g * e0 + v3) + u0 * px * px,
            min(g * a1 + v0, g * b1 + v1, g * d1 + v2, g * e1 + v3) + u1 * px * px,
            min(g * a2 + v0, g * b2 + v1, g * d2 + v2, g * e2 + v3) + u2 * px * px,
            min(g * a3 + v0, g * b3 + v1, g * d3 + v2, g * e3 + v3) + u3 * px * px,
        ) - gap * gap  # fmt: skip


def basin_at(z: float, foot: Point, texture: HeightMapArguments) -> Basin:
    """Return what ``rises_in`` is to know of a minimum of φ."""
    gap = foot[3] - z
    _h, _hx, _hy, hxx, hxy, hyy = curvature(foot[0], foot[1], texture)
    a = 1.0 + gap * hxx
    b = gap * hxy
    d = 1.0 + gap * hyy
    # Any ratio makes q a square; this one leaves the same shares of a and d.
    ratio = math.sqrt(min(max(a / d, 1e-6), 1e6)) if a > 0.0 and d > 0.0 else 1.0
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    return (
        (foot[0] - texture.x0) * texture.ix, (foot[1] - texture.y0) * texture.iy,
        gap, abs(b) * ratio * px * px, 2.0 * b * px * py, abs(b) / ratio * py * py,
    )  # fmt: skip


def is_near(basin: Basin, i: int, j: int, reach: float) -> bool:
    """Return whether a minimum is at most so many cells from the middle of cell (i, j)."""
    return abs(basin[0] - j - 0.5) <= reach and abs(basin[1] - i - 0.5) <= reach


def rises_in(
    x: float, y: float, z: float, enough: float, basin: Basin, i: int, j: int,
    texture: HeightMapArguments,
) -> bool:  # fmt: skip
    """Return whether ψ - q of a minimum has no coefficient less than enough in cell (i, j).

    The cell is cut in up to four at the minimum, or where it comes nearest along an axis.
    """
    c = texture.c
    px = 1.0 / texture.ix
    py = 1.0 / texture.iy
    at_u, at_v, gap, e, b, f = basin
    u = at_u - j
    v = at_v - i
    across = local_array((4, 4))
    for m in range(4):
        across[0, m], across[1, m], across[2, m], across[3, m] = bernstein(
            c[i, j + m] - z, c[i + 1, j + m] - z, c[i + 2, j + m] - z, c[i + 3, j + m] - z
        )
    a0, a1, a2, a3 = square_on((x - texture.x0) * texture.ix - j)
    q0, q1, q2, q3 = square_on(u)
    a0 = a0 * px * px - e * q0 - gap * gap
    a1 = a1 * px * px - e * q1 - gap * gap
    a2 = a2 * px * px - e * q2 - gap * gap
    a3 = a3 * px * px - e * q3 - gap * gap
    rows = local_array((4,))
    rows[0], rows[1], rows[2], rows[3] = square_on((y - texture.y0) * texture.iy - i)
    q0, q1, q2, q3 = square_on(v)
    rows[0] = rows[0] * py * py - f * q0
    rows[1] = rows[1] * py * py - f * q1
    rows[2] = rows[2] * py * py - f * q2
    rows[3] = rows[3] * py * py - f * q3
    g = gap / 18.0
    cut = local_array((7, 4))
    for m in range(4):
        h0, h1, h2, h3 = along_row(across, m, 0)
        mixed = b * (v - m / 3.0)
        (
            cut[0, m], cut[1, m], cut[2, m], cut[3, m], cut[4, m], cut[5, m], cut[6, m],
        ) = cut_at(
            min(max(u, 0.0), 1.0),
            g * h0 + a0 + rows[m] - mixed * u,
            g * h1 + a1 + rows[m] - mixed * (u - 1.0 / 3.0),
            g * h2 + a2 + rows[m] - mixed * (u - 2.0 / 3.0),
            g * h3 + a3 + rows[m] - mixed * (u - 1.0),
        )  # fmt: skip
    least = np.inf
    for m in range(7):
        q0, q1, q2, q3, q4, q5, q6 = cut_at(
            min(max(v, 0.0), 1.0), cut[m, 0], cut[m, 1], cut[m, 2], cut[m, 3]
        )
        least = min(least, q0, q1, q2, q3, q4, q5, q6)
    return least >= enough


def cut_at(
    t: float, a: float, b: float, c: float, d: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return the coefficients of both parts of a cubic that is cut at t: de Casteljau's scheme."""
    ab = a + t * (b - a)
    bc = b + t * (c - b)
    cd = c + t * (d - c)
    abc = ab + t * (bc - ab)
    bcd = bc + t * (cd - bc)
    return a, ab, abc, abc + t * (bcd - abc), bcd, cd, d
