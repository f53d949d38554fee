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
    loops=("expansion_batch", "table_force_batch"),
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


def table_place(x: float, y: float, table: PotentialTable) -> tuple[float, float, float, float]:
    """Return both coordinates inside the table, in nodes, each with the sign of its derivative."""
    c = table.c
    u, u_sign = table_fold(table_first(x, y, table), c.shape[1] - 3, table.mirrored)
    if c.shape[0] == 1:  # a profile has no second axis
        return u, u_sign, 0.0, 1.0
    v, v_sign = table_fold(table_second(x, y, table), c.shape[0] - 3, table.mirrored)
    return u, u_sign, v, v_sign


def table_across(c: FloatArray, v: float) -> tuple[int, Weights, Weights]:
    """Return node, weights and slopes along the second axis, of the one row of a profile too."""
    if c.shape[0] == 1:
        return 0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    i = int(v + 0.5)
    return i, table_weights(v - i), table_slopes(v - i)


def table_gradient(
    x: float, y: float, z: float, table: PotentialTable
) -> tuple[float, float, float]:
    """Return ∇U [m]."""
    c = table.c
    w = (z - table.z0) * table.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0
    u, u_sign, v, v_sign = table_place(x, y, table)
    j = int(u + 0.5)
    u0 = table_weights(u - j)
    u1 = table_slopes(u - j)
    i, v0, v1 = table_across(c, v)
    m, below, w0, w1 = table_height(w)
    gu = gv = gw = 0.0
    for a in range(min(c.shape[0], 3)):
        value = along = upward = 0.0
        for b in range(3):
            s = table_dot(c, i + a, j + b, m, w0)
            value += u0[b] * s
            along += u1[b] * s
            upward += u0[b] * table_dot(c, i + a, j + b, m, w1)
        gu += v0[a] * along
        gv += v1[a] * value
        gw += v0[a] * upward
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
    i, v0, v1 = table_across(c, v)
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
    u, u_sign, v, v_sign = table_place(x, y, table)
    value, uu, uv, uw, vv, vw, ww = table_sums(c, u, v, w)
    uv *= u_sign * v_sign
    uw *= u_sign
    vw *= v_sign
    drop = min(w - 0.5, 0.0) / table.iz
    xx, xy, xz, yy, yz, zz = table_hessian(uu, uv, uw, vv, vw, ww, table)
    zz += 1.0 if drop < 0.0 else 0.0
    return value + 0.5 * drop * drop, xx, xy, xz, yy, yz, zz


def table_force_batch(points: FloatArray, out: FloatArray, k: float, table: PotentialTable) -> None:
    """Forces [N] at the points [m]."""
    for i in range(points.shape[0]):
        gx, gy, gz = table_gradient(points[i, 0], points[i, 1], points[i, 2], table)
        out[i, 0] = -k * gx
        out[i, 1] = -k * gy
        out[i, 2] = -k * gz


def expansion_batch(points: FloatArray, out: FloatArray, table: PotentialTable) -> None:
    """U [m²] and its second derivatives [1] at the points [m]."""
    for i in range(points.shape[0]):
        values = table_expansion(points[i, 0], points[i, 1], points[i, 2], table)
        for d in range(7):
            out[i, d] = values[d]
