"""Force of a baked potential field: half the square of a quadratic B-spline on a grid of nodes.

The depth is S(p) = Σ c_n Π β((p - p_n)_i/h_i) - margin, β the quadratic B-spline, the potential is
T = S²/2 where S > 0 and 0 elsewhere, and the force -k ∇T = -k S ∇S, evaluated as written: it is
conservative and continuous whatever the coefficients are, and takes 27 of them. Coefficients are
stored by columns of nodes along z, each from its first to its last coefficient that is not zero;
outside of a column they are zero.

The knots along z are equally spaced down to the lowest place of a surface, and ever farther apart
below, where the depth changes slowly with z. There the coefficients are those of S less the height
of a knot above z, which keeps them small: they are stored in single precision.

Below the floor the field of a surface is evaluated at floor - ψ of the depth d below it, plus a
function g(d): with r = d/F, where F/2 is the height of the cells below the floor, ψ' = 1 - r falls
to zero, and with it the variation of the force along z, while g'' makes up for it, so that the
field ends in the curvature of the flat wall. The field of a closed body ends inside its grid.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.compiled import EVERY_FUNCTION, Kernels
from asperity.textures.spline.bspline_kernels import fold_coordinate

KERNELS = Kernels(provides=EVERY_FUNCTION)

# What the field is beyond its first and last node.
PERIODIC = 0
MIRRORED = 1
ZERO = 2

# Entries of a column: where its node at level 0 would be stored, its first level, the level after
# its last, and the level after the last of positive depth of it and its eight neighbours.
OFFSET = 0
FIRST = 1
END = 2
REACH = 3

# Entries of a stretched cell: z of its lower knot, 1/h of its height h, h over the sum of h and the
# height of the cell below, likewise above, and what is subtracted from the coefficients of its
# three levels.
KNOT = 0
RATE = 1
LOWER = 2
UPPER = 3
OFFSETS = 4

ThreeWeights = tuple[float, float, float]
SixEntries = tuple[float, float, float, float, float, float]
Vector = tuple[float, float, float]


class FieldArguments(NamedTuple):
    """Record of a baked field.

    Attributes:
        c: coefficients [m], column after column.
        columns: OFFSET, FIRST, END and REACH, shape (rows, columns, 4), with one node before the
            first and two after the last along both axes; one row for a profile.
        stretched_cells: KNOT, RATE, LOWER, UPPER and OFFSETS of the lowest cells, shape (n, 7); the
            others are equally high.
        x0: the first node [m].
        y0: likewise.
        z0: likewise, of equal cells down to level 0.
        m00: nodes per metre along the first axis of the field: x.
        m01: y.
        m10: along the second: x.
        m11: y.
        iz: nodes per metre along z.
        margin: height above the surface at which coefficients are zero [m].
        lift: vertical force over the stiffness below the floor, less the depth, at least about [m].
        floor: z down to which the field is that of the spline [m].
        fade: F, twice the height of the cells below the floor [m].
        levels: number of levels.
        below: number of cells below the floor, at least 1.
        border: PERIODIC, MIRRORED or ZERO.
    """

    c: NDArray[np.float32]
    columns: NDArray[np.int32]
    stretched_cells: FloatArray
    x0: float
    y0: float
    z0: float
    m00: float
    m01: float
    m10: float
    m11: float
    iz: float
    margin: float
    lift: float
    floor: float
    fade: float
    levels: int
    below: int
    border: int


def field_fold(u: float, cells: int, border: int) -> tuple[float, float]:
    """Return the coordinate inside [0, cells] and the sign of its derivative, 0 outside."""
    if border != ZERO:
        return fold_coordinate(u, cells, border == PERIODIC)
    return (u, 1.0) if 0.0 <= u <= cells else (0.0, 0.0)


def field_coordinates(
    x: float, y: float, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return both coordinates inside the field, in nodes, each with the sign of its derivative."""
    columns = field.columns
    x -= field.x0
    y -= field.y0
    u, u_sign = field_fold(x * field.m00 + y * field.m01, columns.shape[1] - 3, field.border)
    if columns.shape[0] == 1:  # a profile has no second axis
        return u, u_sign, 0.0, 1.0
    v, v_sign = field_fold(x * field.m10 + y * field.m11, columns.shape[0] - 3, field.border)
    return u, u_sign, v, v_sign


def quadratic_weights(t: float) -> ThreeWeights:
    """Return the three quadratic B-spline weights at t in [-1/2, 1/2] from the middle node."""
    return 0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)


def quadratic_weight_slopes(t: float) -> ThreeWeights:
    """Return the derivatives of the weights by t."""
    return t - 0.5, -2.0 * t, t + 0.5


def field_row_weights(rows: int, v: float) -> tuple[int, ThreeWeights, ThreeWeights]:
    """Return node, weights and slopes along the second axis, also for the one row of a profile."""
    if rows == 1:
        return 0, (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    i = int(v + 0.5)
    return i, quadratic_weights(v - i), quadratic_weight_slopes(v - i)


def field_level(z: float, field: FieldArguments) -> tuple[float, float]:
    """Return the height at which the spline is evaluated [m], and the depth below the floor / F."""
    if z >= field.floor:
        return z, 0.0
    r = (field.floor - z) / field.fade
    s = min(r, 1.0)
    return field.floor - 0.5 * field.fade * s * (2.0 - s), r


def field_cell(z: float, field: FieldArguments) -> tuple[int, float, float, float, float]:
    """Return the level of the cell that holds z, z in cells from its middle, 1/h, LOWER, UPPER."""
    stretched_cells = field.stretched_cells
    w = (z - field.z0) * field.iz
    high = stretched_cells.shape[0]
    if high == 0 or w >= high - 0.5:
        m = int(w + 0.5)
        return m, w - m, field.iz, 0.5, 0.5
    low = 1
    while high - low > 1:
        middle = (low + high) // 2
        if z >= stretched_cells[middle, KNOT]:
            low = middle
        else:
            high = middle
    rate = stretched_cells[low, RATE]
    return (
        low,
        (z - stretched_cells[low, KNOT]) * rate - 0.5,
        rate,
        stretched_cells[low, LOWER],
        stretched_cells[low, UPPER],
    )


def level_weights(t: float, lower: float, upper: float) -> ThreeWeights:
    """Return the weights of three levels at t in [-1/2, 1/2] from the middle of a cell."""
    below = lower * (0.5 - t) * (0.5 - t)
    above = upper * (0.5 + t) * (0.5 + t)
    return below, 1.0 - below - above, above


def level_weight_slopes(t: float, lower: float, upper: float) -> ThreeWeights:
    """Return the derivatives of the weights by t."""
    below = -2.0 * lower * (0.5 - t)
    above = 2.0 * upper * (0.5 + t)
    return below, -below - above, above


def field_offset(m: int, weights: ThreeWeights, field: FieldArguments) -> float:
    """Return the sum of what is subtracted from three coefficients around a level, weighted."""
    stretched_cells = field.stretched_cells
    if stretched_cells.shape[0] == 0 or m >= stretched_cells.shape[0]:
        return 0.0
    offset = weights[0] * stretched_cells[m, OFFSETS] + weights[1] * stretched_cells[m, OFFSETS + 1]
    return float(offset + weights[2] * stretched_cells[m, OFFSETS + 2])


def field_descent(r: float, field: FieldArguments) -> Vector:
    """Return ψ', g' [m] and g [m²] at a depth of r F below the floor."""
    s = min(r, 1.0)
    size = field.fade
    beyond = size * (r - s)
    slope = s * (field.lift + size * s * (1.5 - 0.5 * s))
    value = size * s * s * (0.5 * field.lift + size * s * (0.5 - 0.125 * s))
    return 1.0 - s, slope + beyond, value + beyond * (slope + 0.5 * beyond)


def field_triple(i: int, j: int, m: int, field: FieldArguments) -> Vector:
    """Return the coefficients of a column at levels m - 1, m and m + 1."""
    start = field.columns[i, j, OFFSET] + m
    first = field.columns[i, j, FIRST]
    end = field.columns[i, j, END]
    if first < m and m + 1 < end:
        return float(field.c[start - 1]), float(field.c[start]), float(field.c[start + 1])
    below = float(field.c[start - 1]) if first < m <= end else 0.0
    middle = float(field.c[start]) if first <= m < end else 0.0
    above = float(field.c[start + 1]) if first - 1 <= m < end - 1 else 0.0
    return below, middle, above


def field_gradient(x: float, y: float, z: float, field: FieldArguments) -> Vector:
    """Return ∇T [m]."""
    gx, gy, gz, _value = field_slope(x, y, z, field)
    return gx, gy, gz


def field_slope(
    x: float, y: float, z: float, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return ∇T [m] and T [m²]."""
    columns = field.columns
    w = (z - field.z0) * field.iz
    u, u_sign, v, v_sign = field_coordinates(x, y, field)
    j = int(u + 0.5)
    i, v0, v1 = field_row_weights(columns.shape[0], v)
    rows = min(columns.shape[0], 3)
    if w >= columns[i + rows // 2, j + 1, REACH] + 0.5 or u_sign * v_sign == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    z, below = field_level(z, field)
    m, t, rate, lower, upper = field_cell(z, field)
    w0 = level_weights(t, lower, upper)
    w1 = level_weight_slopes(t, lower, upper)
    depth = field_offset(m, w0, field) - field.margin
    gw = field_offset(m, w1, field)
    gu = gv = 0.0
    for a in range(rows):
        value = along = upward = 0.0
        for b in range(3):
            c0, c1, c2 = field_triple(i + a, j + b, m, field)
            s = w0[0] * c0 + w0[1] * c1 + w0[2] * c2
            value += u0[b] * s
            along += u1[b] * s
            upward += u0[b] * (w1[0] * c0 + w1[1] * c1 + w1[2] * c2)
        depth += v0[a] * value
        gu += v0[a] * along
        gv += v1[a] * value
        gw += v0[a] * upward
    if depth <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    gu *= depth * u_sign
    gv *= depth * v_sign
    gz = depth * rate * gw
    energy = 0.5 * depth * depth
    if below > 0.0:
        share, slope, added = field_descent(below, field)
        gz = share * gz - slope
        energy += added
    return field.m00 * gu + field.m10 * gv, field.m01 * gu + field.m11 * gv, gz, energy


def field_hessian(
    uu: float, uv: float, uz: float, vv: float, vz: float, zz: float, field: FieldArguments
) -> SixEntries:
    """Return xx, xy, xz, yy, yz, zz of a Hessian along the axes of the field, in nodes, and z."""
    m00 = field.m00
    m01 = field.m01
    m10 = field.m10
    m11 = field.m11
    return (
        m00 * m00 * uu + 2.0 * m00 * m10 * uv + m10 * m10 * vv,
        m00 * m01 * uu + (m00 * m11 + m01 * m10) * uv + m10 * m11 * vv,
        m00 * uz + m10 * vz,
        m01 * m01 * uu + 2.0 * m01 * m11 * uv + m11 * m11 * vv,
        m01 * uz + m11 * vz,
        zz,
    )


def field_node_expansion(
    u: float, v: float, z: float, field: FieldArguments
) -> tuple[float, Vector, SixEntries]:
    """Return S, its derivatives along u, v in nodes and z, and the second ones.

    They are uu, uv, uz, vv, vz, zz.
    """
    rows = min(field.columns.shape[0], 3)
    j = int(u + 0.5)
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    i, v0, v1 = field_row_weights(field.columns.shape[0], v)
    m, t, rate, lower, upper = field_cell(z, field)
    w0 = level_weights(t, lower, upper)
    w1 = level_weight_slopes(t, lower, upper)
    w2 = (2.0 * lower, -2.0 * (lower + upper), 2.0 * upper)
    second = (1.0, -2.0, 1.0)
    value = field_offset(m, w0, field) - field.margin
    dw = field_offset(m, w1, field)
    ww = field_offset(m, w2, field)
    du = dv = uu = uv = uw = vv = vw = 0.0
    for a in range(rows):
        for b in range(3):
            c0, c1, c2 = field_triple(i + a, j + b, m, field)
            s0 = w0[0] * c0 + w0[1] * c1 + w0[2] * c2
            s1 = w1[0] * c0 + w1[1] * c1 + w1[2] * c2
            value += v0[a] * u0[b] * s0
            du += v0[a] * u1[b] * s0
            dv += v1[a] * u0[b] * s0
            dw += v0[a] * u0[b] * s1
            uu += v0[a] * second[b] * s0
            uv += v1[a] * u1[b] * s0
            uw += v0[a] * u1[b] * s1
            vv += second[a] * u0[b] * s0
            vw += v1[a] * u0[b] * s1
            ww += v0[a] * u0[b] * (w2[0] * c0 + w2[1] * c1 + w2[2] * c2)
    vv = vv if rows > 1 else 0.0
    return value, (du, dv, rate * dw), (uu, uv, rate * uw, vv, rate * vw, rate * rate * ww)


def field_expansion(
    x: float, y: float, z: float, field: FieldArguments
) -> tuple[float, float, float, float, float, float, float]:
    """Return T [m²] and its second derivatives xx, xy, xz, yy, yz, zz [1]."""
    w = (z - field.z0) * field.iz
    u, u_sign, v, v_sign = field_coordinates(x, y, field)
    if w >= field.levels - 1.5 or u_sign * v_sign == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    z, below = field_level(z, field)
    s, (du, dv, dz), (uu, uv, uz, vv, vz, zz) = field_node_expansion(u, v, z, field)
    if s <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xx, xy, xz, yy, yz, zz = field_hessian(
        du * du + s * uu,
        (du * dv + s * uv) * u_sign * v_sign,
        (du * dz + s * uz) * u_sign,
        dv * dv + s * vv,
        (dv * dz + s * vz) * v_sign,
        dz * dz + s * zz,
        field,
    )
    rate, _slope, added = field_descent(below, field)
    curvature = 1.0 - rate * rate
    if 0.0 < below < 1.0:
        curvature = 1.5 * curvature + (field.lift + s * dz) / field.fade
    return 0.5 * s * s + added, xx, xy, rate * xz, yy, rate * yz, rate * rate * zz + curvature


# --- the functions of a texture and of the split contact ------------------------------------------


def sample_height(x: float, y: float, field: FieldArguments) -> float:
    """Return z [m] above which the force is zero, about 2 nodes above the surface."""
    u, _u_sign, v, _v_sign = field_coordinates(x, y, field)
    i = min(field.columns.shape[0] // 2, 1) + int(v + 0.5)
    return float(field.z0 + (field.columns[i, int(u + 0.5) + 1, REACH] + 0.5) / field.iz)


def closest_point_within_budget(
    x: float,
    y: float,
    z: float,
    _start_x: float,
    _start_y: float,
    _budget: float,
    field: FieldArguments,
) -> tuple[float, float, float, float, float, float, float]:
    """Return the point to which the probe is pulled: X, Y, Z, two slopes of 0, exactly, at once."""
    gx, gy, gz = field_gradient(x, y, z, field)
    return x - gx, y - gy, z - gz, 0.0, 0.0, 0.0, 1.0


def split_contact(
    x: float, y: float, z: float, _continuity: float, field: FieldArguments
) -> Vector:
    """Return -∇T [m]."""
    gx, gy, gz = field_gradient(x, y, z, field)
    return -gx, -gy, -gz


def split_contact_warm(
    x: float, y: float, z: float, _continuity: float, _warm_start: FloatArray, field: FieldArguments
) -> Vector:
    """Return -∇T [m], without a search."""
    gx, gy, gz = field_gradient(x, y, z, field)
    return -gx, -gy, -gz


def split_contact_energy(
    x: float, y: float, z: float, _continuity: float, _warm_start: FloatArray, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return -∇T [m] and T [m²]."""
    gx, gy, gz, energy = field_slope(x, y, z, field)
    return -gx, -gy, -gz, energy


def split_energy(
    x: float, y: float, z: float, _continuity: float, field: FieldArguments
) -> tuple[float, int, float]:
    """Return T [m²], 1 for the number of points, and 0 for the duality gap."""
    return field_expansion(x, y, z, field)[0], 1, 0.0


def split_derivative(
    x: float, y: float, z: float, _continuity: float, field: FieldArguments
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return -∇T [m] and -Hess T as xx, xy, xz, yy, yz, zz."""
    gx, gy, gz = field_gradient(x, y, z, field)
    _value, xx, xy, xz, yy, yz, zz = field_expansion(x, y, z, field)
    return -gx, -gy, -gz, -xx, -xy, -xz, -yy, -yz, -zz
