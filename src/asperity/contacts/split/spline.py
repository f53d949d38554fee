"""Law H from a table: a quadratic B-spline whose coefficients are the exact potential at nodes.

Below the floor, halfway between the two lowest nodes, the table goes on with its value and slope
there and the curvature of the flat wall: there the force stays the gradient of a potential, and
continuous.
"""

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels

KERNELS = Kernels(
    provides=("table_hessian",),
    loops=("expansion_batch", "map_force_batch", "profile_force_batch"),
)

Weights = tuple[float, float, float]


class PotentialTable(NamedTuple):
    """What the functions below receive of a table.

    Attributes:
        c: coefficients [m²] by second axis, first axis and z, with one node before the first and
            one or two after the last along both axes; a profile has no second one.
        x0: the first node [m].
        y0: likewise.
        z0: likewise.
        m00: nodes per metre along the first axis of the texture: x.
        m01: y.
        m10: along the second: x.
        m11: y.
        iz: nodes per metre along z.
        mirrored: whether the table is mirrored at its border; else it is periodic.
    """

    c: FloatArray
    x0: float
    y0: float
    z0: float
    m00: float
    m01: float
    m10: float
    m11: float
    iz: float
    mirrored: bool


def table_fold(u: float, cells: int, mirrored: bool) -> tuple[float, float]:
    """Return the coordinate inside [0, cells] and the sign of its derivative."""
    if 0.0 <= u <= cells:
        return u, 1.0
    if not mirrored:
        return min(u - cells * math.floor(u / cells), float(cells)), 1.0
    u -= 2.0 * cells * math.floor(u / (2.0 * cells))
    if u > cells:
        return max(2.0 * cells - u, 0.0), -1.0
    return u, 1.0


def table_first(x: float, y: float, table: PotentialTable) -> float:
    """Return the coordinate along the first axis of the texture, in nodes."""
    return (x - table.x0) * table.m00 + (y - table.y0) * table.m01


def table_second(x: float, y: float, table: PotentialTable) -> float:
    """Return the coordinate along the second axis of the texture, in nodes."""
    return (x - table.x0) * table.m10 + (y - table.y0) * table.m11


def table_hessian(
    uu: float, uv: float, uw: float, vv: float, vw: float, ww: float, table: PotentialTable
) -> tuple[float, float, float, float, float, float]:
    """Return xx, xy, xz, yy, yz, zz of a Hessian along the axes of the table, in nodes."""
    m00 = table.m00
    m01 = table.m01
    m10 = table.m10
    m11 = table.m11
    iz = table.iz
    return (
        m00 * m00 * uu + 2.0 * m00 * m10 * uv + m10 * m10 * vv,
        m00 * m01 * uu + (m00 * m11 + m01 * m10) * uv + m10 * m11 * vv,
        iz * (m00 * uw + m10 * vw),
        m01 * m01 * uu + 2.0 * m01 * m11 * uv + m11 * m11 * vv,
        iz * (m01 * uw + m11 * vw),
        iz * iz * ww,
    )


def table_weights(t: float) -> tuple[float, float, float]:
    """Return the three quadratic B-spline weights at t in [-1/2, 1/2] from the middle node."""
    return 0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)


def table_slopes(t: float) -> tuple[float, float, float]:
    """Return the derivatives of the weights by t."""
    return t - 0.5, -2.0 * t, t + 0.5


def table_height(w: float) -> tuple[int, float, Weights, Weights]:
    """Return node, height above the floor where that is negative, and weights along z.

    Below the floor the weights are continued in a straight line.
    """
    if w >= 0.5:
        m = int(w + 0.5)
        return m, 0.0, table_weights(w - m), table_slopes(w - m)
    t = w - 0.5
    return 1, t, (0.5 - t, 0.5 + t, 0.0), (-1.0, 1.0, 0.0)


def table_dot(c: FloatArray, i: int, j: int, m: int, w: Weights) -> float:
    """Return the weighted sum of three coefficients along z."""
    return float(w[0] * c[i, j, m - 1] + w[1] * c[i, j, m] + w[2] * c[i, j, m + 1])


def profile_gradient(
    x: float, y: float, z: float, table: PotentialTable
) -> tuple[float, float, float]:
    """Return ∇U [m]."""
    c = table.c
    w = (z - table.z0) * table.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0
    u, sign = table_fold(table_first(x, y, table), c.shape[1] - 3, table.mirrored)
    j = int(u + 0.5)
    u0, u1, u2 = table_weights(u - j)
    d0, d1, d2 = table_slopes(u - j)
    m, below, values, slopes = table_height(w)
    gu = d0 * table_dot(c, 0, j, m, values)
    gu += d1 * table_dot(c, 0, j + 1, m, values)
    gu += d2 * table_dot(c, 0, j + 2, m, values)
    gw = u0 * table_dot(c, 0, j, m, slopes)
    gw += u1 * table_dot(c, 0, j + 1, m, slopes)
    gw += u2 * table_dot(c, 0, j + 2, m, slopes)
    gu *= sign
    return table.m00 * gu, table.m01 * gu, table.iz * gw + below / table.iz


def map_gradient(x: float, y: float, z: float, table: PotentialTable) -> tuple[float, float, float]:
    """Return ∇U [m]."""
    c = table.c
    w = (z - table.z0) * table.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0
    u, u_sign = table_fold(table_first(x, y, table), c.shape[1] - 3, table.mirrored)
    v, v_sign = table_fold(table_second(x, y, table), c.shape[0] - 3, table.mirrored)
    j = int(u + 0.5)
    i = int(v + 0.5)
    u0, u1, u2 = table_weights(u - j)
    d0, d1, d2 = table_slopes(u - j)
    v0, v1, v2 = table_weights(v - i)
    e0, e1, e2 = table_slopes(v - i)
    m, below, values, slopes = table_height(w)
    a0 = table_dot(c, i, j, m, values)
    a1 = table_dot(c, i, j + 1, m, values)
    a2 = table_dot(c, i, j + 2, m, values)
    b0 = table_dot(c, i + 1, j, m, values)
    b1 = table_dot(c, i + 1, j + 1, m, values)
    b2 = table_dot(c, i + 1, j + 2, m, values)
    c0 = table_dot(c, i + 2, j, m, values)
    c1 = table_dot(c, i + 2, j + 1, m, values)
    c2 = table_dot(c, i + 2, j + 2, m, values)
    gu = v0 * (d0 * a0 + d1 * a1 + d2 * a2)
    gu += v1 * (d0 * b0 + d1 * b1 + d2 * b2)
    gu += v2 * (d0 * c0 + d1 * c1 + d2 * c2)
    gv = e0 * (u0 * a0 + u1 * a1 + u2 * a2)
    gv += e1 * (u0 * b0 + u1 * b1 + u2 * b2)
    gv += e2 * (u0 * c0 + u1 * c1 + u2 * c2)
    gw = 0.0
    for k in range(3):
        along = u0 * table_dot(c, i + k, j, m, slopes)
        along += u1 * table_dot(c, i + k, j + 1, m, slopes)
        along += u2 * table_dot(c, i + k, j + 2, m, slopes)
        gw += (v0, v1, v2)[k] * along
    gu *= u_sign
    gv *= v_sign
    return (
        table.m00 * gu + table.m10 * gv,
        table.m01 * gu + table.m11 * gv,
        table.iz * gw + below / table.iz,
    )


def table_sums(
    c: FloatArray, u: float, v: float, w: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return U and its second derivatives by u, v, w: value, uu, uv, uw, vv, vw, ww."""
    j = int(u + 0.5)
    u0 = table_weights(u - j)
    u1 = table_slopes(u - j)
    rows = min(c.shape[0], 3)  # one for a profile
    i = int(v + 0.5)
    v0 = table_weights(v - i) if rows > 1 else (1.0, 0.0, 0.0)
    v1 = table_slopes(v - i) if rows > 1 else (0.0, 0.0, 0.0)
    m, below, w0, w1 = table_height(w)
    second = (1.0, -2.0, 1.0)
    value = uu = uv = uw = vv = vw = ww = 0.0
    for a in range(rows):
        for b in range(3):
            s0 = table_dot(c, i + a, j + b, m, w0)
            s1 = table_dot(c, i + a, j + b, m, w1)
            value += v0[a] * u0[b] * s0
            uu += v0[a] * second[b] * s0
            uv += v1[a] * u1[b] * s0
            uw += v0[a] * u1[b] * s1
            vv += second[a] * u0[b] * s0
            vw += v1[a] * u0[b] * s1
            ww += v0[a] * u0[b] * table_dot(c, i + a, j + b, m, second)
    return value, uu, uv, uw, vv if rows > 1 else 0.0, vw, ww if below == 0.0 else 0.0


def table_expansion(
    x: float, y: float, z: float, table: PotentialTable
) -> tuple[float, float, float, float, float, float, float]:
    """Return U [m²] and its second derivatives xx, xy, xz, yy, yz, zz [1], of profile or map."""
    c = table.c
    w = (z - table.z0) * table.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    u, u_sign = table_fold(table_first(x, y, table), c.shape[1] - 3, table.mirrored)
    v = 0.0
    v_sign = 1.0
    if c.shape[0] > 1:
        v, v_sign = table_fold(table_second(x, y, table), c.shape[0] - 3, table.mirrored)
    value, uu, uv, uw, vv, vw, ww = table_sums(c, u, v, w)
    uv *= u_sign * v_sign
    uw *= u_sign
    vw *= v_sign
    drop = min(w - 0.5, 0.0) / table.iz
    xx, xy, xz, yy, yz, zz = table_hessian(uu, uv, uw, vv, vw, ww, table)
    zz += 1.0 if drop < 0.0 else 0.0
    return value + 0.5 * drop * drop, xx, xy, xz, yy, yz, zz


def profile_force_batch(
    points: FloatArray, out: FloatArray, k: float, table: PotentialTable
) -> None:
    """Forces [N] at the points [m]."""
    for i in range(points.shape[0]):
        gx, gy, gz = profile_gradient(points[i, 0], points[i, 1], points[i, 2], table)
        out[i, 0] = -k * gx
        out[i, 1] = -k * gy
        out[i, 2] = -k * gz


def map_force_batch(points: FloatArray, out: FloatArray, k: float, table: PotentialTable) -> None:
    """Forces [N] at the points [m]."""
    for i in range(points.shape[0]):
        gx, gy, gz = map_gradient(points[i, 0], points[i, 1], points[i, 2], table)
        out[i, 0] = -k * gx
        out[i, 1] = -k * gy
        out[i, 2] = -k * gz


def expansion_batch(points: FloatArray, out: FloatArray, table: PotentialTable) -> None:
    """U [m²] and its second derivatives [1] at the points [m]."""
    for i in range(points.shape[0]):
        values = table_expansion(points[i, 0], points[i, 1], points[i, 2], table)
        for d in range(7):
            out[i, d] = values[d]
