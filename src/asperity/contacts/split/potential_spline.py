"""Baked potential of law H: a quadratic B-spline with the exact potential at nodes as coefficients.

Below the floor, halfway between the two lowest nodes, the field continues with its value and slope
there and the curvature of the flat wall, so that the force stays continuous and the gradient of a
potential.
"""

import math
from typing import NamedTuple

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels

KERNELS = Kernels(
    provides=("potential_hessian",), loops=("expansion_batch", "potential_force_batch")
)

ThreeWeights = tuple[float, float, float]


class PotentialSpline(NamedTuple):
    """Record of a baked potential field.

    Attributes:
        c: coefficients [m²] by second axis, first axis and z, with one node before the first and
            one or two after the last along both axes; a profile has no second axis.
        x0: the first node [m].
        y0: likewise.
        z0: likewise.
        m00: nodes per metre along the first axis of the texture: x.
        m01: y.
        m10: along the second: x.
        m11: y.
        iz: nodes per metre along z.
        mirrored: whether the field is mirrored at its border; else it is periodic.
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


def potential_fold(u: float, cells: int, mirrored: bool) -> tuple[float, float]:
    """Return the coordinate inside [0, cells] and the sign of its derivative."""
    if 0.0 <= u <= cells:
        return u, 1.0
    if not mirrored:
        return min(u - cells * math.floor(u / cells), float(cells)), 1.0
    u -= 2.0 * cells * math.floor(u / (2.0 * cells))
    if u > cells:
        return max(2.0 * cells - u, 0.0), -1.0
    return u, 1.0


def potential_hessian(
    uu: float, uv: float, uw: float, vv: float, vw: float, ww: float, spline: PotentialSpline
) -> tuple[float, float, float, float, float, float]:
    """Return xx, xy, xz, yy, yz, zz of a Hessian along the axes of the field, in nodes."""
    m00 = spline.m00
    m01 = spline.m01
    m10 = spline.m10
    m11 = spline.m11
    iz = spline.iz
    return (
        m00 * m00 * uu + 2.0 * m00 * m10 * uv + m10 * m10 * vv,
        m00 * m01 * uu + (m00 * m11 + m01 * m10) * uv + m10 * m11 * vv,
        iz * (m00 * uw + m10 * vw),
        m01 * m01 * uu + 2.0 * m01 * m11 * uv + m11 * m11 * vv,
        iz * (m01 * uw + m11 * vw),
        iz * iz * ww,
    )


def quadratic_weights(t: float) -> tuple[float, float, float]:
    """Return the three quadratic B-spline weights at t in [-1/2, 1/2] from the middle node."""
    return 0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)


def quadratic_weight_slopes(t: float) -> tuple[float, float, float]:
    """Return the derivatives of the weights by t."""
    return t - 0.5, -2.0 * t, t + 0.5


def potential_z_weights(w: float) -> tuple[int, float, ThreeWeights, ThreeWeights]:
    """Return node, negative height above the floor or 0, and weights along z.

    Below the floor the weights are linear.
    """
    if w >= 0.5:
        m = int(w + 0.5)
        return m, 0.0, quadratic_weights(w - m), quadratic_weight_slopes(w - m)
    t = w - 0.5
    return 1, t, (0.5 - t, 0.5 + t, 0.0), (-1.0, 1.0, 0.0)


def potential_column_sum(c: FloatArray, i: int, j: int, m: int, w: ThreeWeights) -> float:
    """Return the weighted sum of three coefficients along z."""
    return float(w[0] * c[i, j, m - 1] + w[1] * c[i, j, m] + w[2] * c[i, j, m + 1])


def potential_coordinates(
    x: float, y: float, spline: PotentialSpline
) -> tuple[float, float, float, float]:
    """Return both coordinates inside the field, in nodes, each with the sign of its derivative."""
    c, mirrored = spline.c, spline.mirrored
    x -= spline.x0
    y -= spline.y0
    u, u_sign = potential_fold(x * spline.m00 + y * spline.m01, c.shape[1] - 3, mirrored)
    if c.shape[0] == 1:  # a profile has no second axis
        return u, u_sign, 0.0, 1.0
    v, v_sign = potential_fold(x * spline.m10 + y * spline.m11, c.shape[0] - 3, mirrored)
    return u, u_sign, v, v_sign


def potential_row_weights(c: FloatArray, v: float) -> tuple[int, ThreeWeights, ThreeWeights]:
    """Return node, weights and slopes along the second axis, also for the one row of a profile."""
    if c.shape[0] == 1:
        return 0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    i = int(v + 0.5)
    return i, quadratic_weights(v - i), quadratic_weight_slopes(v - i)


def potential_gradient(
    x: float, y: float, z: float, spline: PotentialSpline
) -> tuple[float, float, float]:
    """Return ∇U [m]."""
    c = spline.c
    w = (z - spline.z0) * spline.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0
    u, u_sign, v, v_sign = potential_coordinates(x, y, spline)
    j = int(u + 0.5)
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    i, v0, v1 = potential_row_weights(c, v)
    m, below, w0, w1 = potential_z_weights(w)
    gu = gv = gw = 0.0
    for a in range(min(c.shape[0], 3)):
        value = along = upward = 0.0
        for b in range(3):
            s = potential_column_sum(c, i + a, j + b, m, w0)
            value += u0[b] * s
            along += u1[b] * s
            upward += u0[b] * potential_column_sum(c, i + a, j + b, m, w1)
        gu += v0[a] * along
        gv += v1[a] * value
        gw += v0[a] * upward
    gu *= u_sign
    gv *= v_sign
    return (
        spline.m00 * gu + spline.m10 * gv,
        spline.m01 * gu + spline.m11 * gv,
        spline.iz * gw + below / spline.iz,
    )


def potential_second_derivatives(
    c: FloatArray, u: float, v: float, w: float
) -> tuple[float, float, float, float, float, float, float]:
    """Return U and its second derivatives by u, v, w: value, uu, uv, uw, vv, vw, ww."""
    j = int(u + 0.5)
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    rows = min(c.shape[0], 3)  # one for a profile
    i, v0, v1 = potential_row_weights(c, v)
    m, below, w0, w1 = potential_z_weights(w)
    second = (1.0, -2.0, 1.0)
    value = uu = uv = uw = vv = vw = ww = 0.0
    for a in range(rows):
        for b in range(3):
            s0 = potential_column_sum(c, i + a, j + b, m, w0)
            s1 = potential_column_sum(c, i + a, j + b, m, w1)
            value += v0[a] * u0[b] * s0
            uu += v0[a] * second[b] * s0
            uv += v1[a] * u1[b] * s0
            uw += v0[a] * u1[b] * s1
            vv += second[a] * u0[b] * s0
            vw += v1[a] * u0[b] * s1
            ww += v0[a] * u0[b] * potential_column_sum(c, i + a, j + b, m, second)
    return value, uu, uv, uw, vv if rows > 1 else 0.0, vw, ww if below == 0.0 else 0.0


def potential_expansion(
    x: float, y: float, z: float, spline: PotentialSpline
) -> tuple[float, float, float, float, float, float, float]:
    """Return U [m²] and its second derivatives xx, xy, xz, yy, yz, zz [1], of a profile or map."""
    c = spline.c
    w = (z - spline.z0) * spline.iz
    if w >= c.shape[2] - 1.5:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    u, u_sign, v, v_sign = potential_coordinates(x, y, spline)
    value, uu, uv, uw, vv, vw, ww = potential_second_derivatives(c, u, v, w)
    uv *= u_sign * v_sign
    uw *= u_sign
    vw *= v_sign
    drop = min(w - 0.5, 0.0) / spline.iz
    xx, xy, xz, yy, yz, zz = potential_hessian(uu, uv, uw, vv, vw, ww, spline)
    zz += 1.0 if drop < 0.0 else 0.0
    return value + 0.5 * drop * drop, xx, xy, xz, yy, yz, zz


def potential_force_batch(
    points: FloatArray, out: FloatArray, k: float, spline: PotentialSpline
) -> None:
    """Write forces [N] at points [m]."""
    for i in range(points.shape[0]):
        gx, gy, gz = potential_gradient(points[i, 0], points[i, 1], points[i, 2], spline)
        out[i, 0] = -k * gx
        out[i, 1] = -k * gy
        out[i, 2] = -k * gz


def expansion_batch(points: FloatArray, out: FloatArray, spline: PotentialSpline) -> None:
    """Write U [m²] and its second derivatives [1] at points [m]."""
    for i in range(points.shape[0]):
        values = potential_expansion(points[i, 0], points[i, 1], points[i, 2], spline)
        for d in range(7):
            out[i, d] = values[d]
