"""Force of a baked potential field: half the square of a quadratic B-spline on a grid of nodes.

The depth is S(p) = Σ c_n Π β((p - p_n)_i/h_i) - margin, β the quadratic B-spline, the potential is
T = S²/2 where S > 0 and 0 elsewhere, and the force -k ∇T = -k S ∇S, evaluated as written: it is
conservative and continuous whatever the coefficients are, and takes 27 of them. Coefficients are
stored by columns of nodes along z, each from its first to its last coefficient that is not zero;
outside of a column they are zero.

Those of a large field are stored in bricks; the sums of a tick have one order either way.

The knots along z are equally spaced down to the lowest place of a surface, and ever farther apart
below, where the depth changes slowly with z. There the coefficients are those of S less the height
of a knot above z, which keeps them small: they are stored in single precision.

Below the floor the field of a surface is evaluated at floor - ψ of the depth d below it, plus a
function g(d): with r = d/F, where F/2 is the height of the cells below the floor, ψ' = 1 - r falls
to zero, and with it the variation of the force along z, while g'' makes up for it, so that the
field ends in the curvature of the flat wall. The field of a closed body ends inside its grid.
"""

from asperity.core.checks import FloatArray
from asperity.core.compiled import EVERY_FUNCTION, Kernels, local_array
from asperity.textures.fields import field_record
from asperity.textures.fields.field_record import (
    KNOT,
    LOWER,
    OFFSETS,
    PERIODIC,
    RATE,
    UPPER,
    ZERO,
    FieldArguments,
    ThreeWeights,
    Vector,
    column_triple,
    field_reach,
    field_rows,
    field_triple,
    field_width,
    sum_levels,
)
from asperity.textures.spline import bspline_kernels
from asperity.textures.spline.bspline_kernels import fold_coordinate

KERNELS = Kernels(provides=EVERY_FUNCTION)
PARTS = (field_record, bspline_kernels)
"""Modules whose functions it calls."""

SixEntries = tuple[float, float, float, float, float, float]


def field_fold(u: float, cells: int, border: int) -> tuple[float, float]:
    """Return the coordinate inside [0, cells] and the sign of its derivative, 0 outside."""
    if border != ZERO:
        return fold_coordinate(u, cells, border == PERIODIC)
    return (u, 1.0) if 0.0 <= u <= cells else (0.0, 0.0)


def field_coordinates(
    x: float, y: float, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return both coordinates inside the field, in nodes, each with the sign of its derivative."""
    rows = field_rows(field)
    x -= field.x0
    y -= field.y0
    u, u_sign = field_fold(x * field.m00 + y * field.m01, field_width(field) - 3, field.border)
    if rows == 1:  # a profile has no second axis
        return u, u_sign, 0.0, 1.0
    v, v_sign = field_fold(x * field.m10 + y * field.m11, rows - 3, field.border)
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


def field_gradient(x: float, y: float, z: float, field: FieldArguments) -> Vector:
    """Return ∇T [m]."""
    gx, gy, gz, _value = field_slope(x, y, z, field)
    return gx, gy, gz


def field_slope(
    x: float, y: float, z: float, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return ∇T [m] and T [m²]."""
    rows = field_rows(field)
    w = (z - field.z0) * field.iz
    u, u_sign, v, v_sign = field_coordinates(x, y, field)
    j = int(u + 0.5)
    i, v0, v1 = field_row_weights(rows, v)
    reach = field_reach(i + min(rows, 3) // 2, j + 1, field)
    if w >= reach + 0.5 or u_sign * v_sign == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    z, below = field_level(z, field)
    m, t, rate, lower, upper = field_cell(z, field)
    w0 = level_weights(t, lower, upper)
    w1 = level_weight_slopes(t, lower, upper)
    if field.bricks.shape[0] > 0:
        depth, gu, gv, gw = brick_sums(i, j, m, u0, u1, v0, v1, w0, w1, field)
    else:
        depth, gu, gv, gw = column_sums(i, j, m, u0, u1, v0, v1, w0, w1, field)
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


def column_sums(
    i: int,
    j: int,
    m: int,
    u0: ThreeWeights,
    u1: ThreeWeights,
    v0: ThreeWeights,
    v1: ThreeWeights,
    w0: ThreeWeights,
    w1: ThreeWeights,
    field: FieldArguments,
) -> tuple[float, float, float, float]:
    """Return S [m] and its derivatives along u, v and w in nodes, not of bricks."""
    depth = field_offset(m, w0, field) - field.margin
    gw = field_offset(m, w1, field)
    gu = gv = 0.0
    for a in range(min(field_rows(field), 3)):
        value = along = upward = 0.0
        for b in range(3):
            c0, c1, c2 = column_triple(i + a, j + b, m, field)
            s = w0[0] * c0 + w0[1] * c1 + w0[2] * c2
            value += u0[b] * s
            along += u1[b] * s
            upward += u0[b] * (w1[0] * c0 + w1[1] * c1 + w1[2] * c2)
        depth += v0[a] * value
        gu += v0[a] * along
        gv += v1[a] * value
        gw += v0[a] * upward
    return depth, gu, gv, gw


def brick_sums(
    i: int,
    j: int,
    m: int,
    u0: ThreeWeights,
    u1: ThreeWeights,
    v0: ThreeWeights,
    v1: ThreeWeights,
    w0: ThreeWeights,
    w1: ThreeWeights,
    field: FieldArguments,
) -> tuple[float, float, float, float]:
    """Return the sums of :func:`column_sums` of a field in bricks, for four rows at once."""
    sums = local_array((2, 4, 4))
    rows = local_array((3, 4))
    sum_levels(i >> 1, j >> 1, m, w0, w1, sums, field)
    x = j & 1
    y = i & 1
    for a in range(4):
        s0 = sums[0, x, a]
        s1 = sums[0, x + 1, a]
        s2 = sums[0, x + 2, a]
        rows[0, a] = u0[0] * s0 + u0[1] * s1 + u0[2] * s2
        rows[1, a] = u1[0] * s0 + u1[1] * s1 + u1[2] * s2
        rows[2, a] = u0[0] * sums[1, x, a] + u0[1] * sums[1, x + 1, a] + u0[2] * sums[1, x + 2, a]
    depth = field_offset(m, w0, field) - field.margin
    gw = field_offset(m, w1, field)
    gu = gv = 0.0
    for a in range(min(field_rows(field), 3)):
        depth += v0[a] * rows[0, a + y]
        gu += v0[a] * rows[1, a + y]
        gv += v1[a] * rows[0, a + y]
        gw += v0[a] * rows[2, a + y]
    return depth, gu, gv, gw


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
    rows = min(field_rows(field), 3)
    j = int(u + 0.5)
    u0 = quadratic_weights(u - j)
    u1 = quadratic_weight_slopes(u - j)
    i, v0, v1 = field_row_weights(field_rows(field), v)
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
    i = min(field_rows(field) // 2, 1) + int(v + 0.5)
    return field.z0 + (field_reach(i, int(u + 0.5) + 1, field) + 0.5) / field.iz


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


def split_contact_energy(
    x: float, y: float, z: float, _continuity: float, _warm_start: FloatArray, field: FieldArguments
) -> tuple[float, float, float, float]:
    """Return -∇T [m] and T [m²], without a search."""
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
