"""The record of a baked field, and its coefficients in columns or bricks.

A large field is stored in bricks of 2 x 2 columns and 7 levels, of 64 bytes: 28 numbers of 16 bits
and their common origin and step, a power of two times the least step of the field. So a coefficient
is exact in single precision, and decoded without rounding. The table has a row for 2 x 2 columns,
in bricks; outside of them coefficients are zero.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.compiled import EVERY_FUNCTION, Kernels, local_array

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

# Entries of a brick: high and low part of its origin in steps, its step over the least one, and its
# coefficients less the origin in steps: level by level, in each x by x.
ORIGIN_HIGH = 0
ORIGIN_LOW = 1
BRICK_STEP = 2
BRICK_VALUES = 4
BRICK_PLACES = 4
BRICK_LEVELS = 7
BRICK_ENTRIES = BRICK_VALUES + BRICK_PLACES * BRICK_LEVELS
HIGH_STEPS = 65536.0

ThreeWeights = tuple[float, float, float]
Vector = tuple[float, float, float]


class FieldArguments(NamedTuple):
    """Record of a baked field.

    Attributes:
        c: coefficients [m], column after column.
        columns: OFFSET, FIRST, END and REACH, shape (rows, columns, 4), with one node before the
            first and two after the last along both axes; one row for a profile. Of a field in
            bricks: of 2 x 2 columns, the first three in bricks.
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
        bricks: coefficients of a field in bricks, (n, BRICK_ENTRIES), the first of zeros.
        unit: least step of the coefficients of bricks [m], a power of two.
        excess_rows: 1 if the last bricks along the second axis hold one row of nodes, else 0.
        excess_columns: likewise along the first axis.
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
    bricks: NDArray[np.int16] = np.zeros((0, BRICK_ENTRIES), np.int16)
    unit: float = 1.0
    excess_rows: int = 0
    excess_columns: int = 0


def largest_coefficient(field: FieldArguments) -> float:
    """Return the greatest coefficient [m], or 0."""
    heads = field.bricks[:, :BRICK_VALUES].astype(float)
    origins = HIGH_STEPS * heads[:, ORIGIN_HIGH] + heads[:, ORIGIN_LOW]
    values = heads[:, BRICK_STEP] * (origins + field.bricks[:, BRICK_VALUES:].max(axis=1))
    return float(max(field.c.max(initial=0.0), field.unit * values.max(initial=0.0)))


def largest_step(field: FieldArguments) -> float:
    """Return the greatest step of bricks [m], 0 without them."""
    return field.unit * float(field.bricks[:, BRICK_STEP].max(initial=0))


def field_halvings(field: FieldArguments) -> int:
    """Return 1 if an entry of the table is of 2 x 2 columns, 0 if it is of one."""
    return 1 if field.bricks.shape[0] > 0 else 0


def field_rows(field: FieldArguments) -> int:
    """Return the number of stored rows of nodes."""
    return int(field.columns.shape[0] << field_halvings(field)) - field.excess_rows


def field_width(field: FieldArguments) -> int:
    """Return the number of stored columns in a row."""
    return int(field.columns.shape[1] << field_halvings(field)) - field.excess_columns


def field_reach(i: int, j: int, field: FieldArguments) -> int:
    """Return REACH of a column."""
    halvings = field_halvings(field)
    return int(field.columns[i >> halvings, j >> halvings, REACH])


def field_triple(i: int, j: int, m: int, field: FieldArguments) -> Vector:
    """Return the coefficients of a column at levels m - 1, m and m + 1."""
    if field.bricks.shape[0] > 0:
        triple = brick_triple(i, j, m, field)
    else:
        triple = column_triple(i, j, m, field)
    return triple


def brick_at(i: int, j: int, k: int, field: FieldArguments) -> int:
    """Return the brick of the entry (i, j) of the table whose first level is k BRICK_LEVELS."""
    is_stored = field.columns[i, j, FIRST] <= k < field.columns[i, j, END]
    return int(field.columns[i, j, OFFSET] + k if is_stored else 0)


def brick_scale(brick: int, field: FieldArguments) -> tuple[float, float]:
    """Return the origin of the coefficients of a brick [m], and their step [m]."""
    step = field.unit * float(field.bricks[brick, BRICK_STEP])
    origin = HIGH_STEPS * float(field.bricks[brick, ORIGIN_HIGH]) + float(
        field.bricks[brick, ORIGIN_LOW]
    )
    return origin * step, step


def brick_coefficient(i: int, j: int, level: int, field: FieldArguments) -> float:
    """Return the coefficient of a column at a level of a field in bricks."""
    k = level // BRICK_LEVELS
    brick = brick_at(i >> 1, j >> 1, k, field)
    origin, step = brick_scale(brick, field)
    place = BRICK_VALUES + BRICK_PLACES * (level - BRICK_LEVELS * k) + 2 * (j & 1) + (i & 1)
    return origin + step * float(field.bricks[brick, place])


def brick_triple(i: int, j: int, m: int, field: FieldArguments) -> Vector:
    """Return the coefficients of a column of a field in bricks at levels m - 1, m and m + 1."""
    return (
        brick_coefficient(i, j, m - 1, field),
        brick_coefficient(i, j, m, field),
        brick_coefficient(i, j, m + 1, field),
    )


def column_triple(i: int, j: int, m: int, field: FieldArguments) -> Vector:
    """Return the coefficients of a column at levels m - 1, m and m + 1, not of bricks."""
    start = field.columns[i, j, OFFSET] + m
    first = field.columns[i, j, FIRST]
    end = field.columns[i, j, END]
    if first < m and m + 1 < end:
        return float(field.c[start - 1]), float(field.c[start]), float(field.c[start + 1])
    below = float(field.c[start - 1]) if first < m <= end else 0.0
    middle = float(field.c[start]) if first <= m < end else 0.0
    above = float(field.c[start + 1]) if first - 1 <= m < end - 1 else 0.0
    return below, middle, above


def sum_levels(
    i: int,
    j: int,
    m: int,
    w0: ThreeWeights,
    w1: ThreeWeights,
    sums: FloatArray,
    field: FieldArguments,
) -> None:
    """Write the sums along z of 4 x 4 columns from an entry of the table on, (2, x, y).

    The first with the weights, the second with their slopes.
    """
    lanes = local_array((2, 4))
    k = (m - 1) // BRICK_LEVELS
    level = m - 1 - BRICK_LEVELS * k
    for a in range(2):
        row = min(i + a, field.columns.shape[0] - 1)
        for b in range(2):
            sum_brick(row, j + b, k, level, w0, w1, lanes, field)
            for order in range(2):
                sums[order, 2 * b, 2 * a] = lanes[order, 0]
                sums[order, 2 * b, 2 * a + 1] = lanes[order, 1]
                sums[order, 2 * b + 1, 2 * a] = lanes[order, 2]
                sums[order, 2 * b + 1, 2 * a + 1] = lanes[order, 3]


def sum_brick(
    i: int,
    j: int,
    k: int,
    level: int,
    w0: ThreeWeights,
    w1: ThreeWeights,
    lanes: FloatArray,
    field: FieldArguments,
) -> None:
    """Write the sums along z of 2 x 2 columns from a level of a brick on, (2, BRICK_PLACES)."""
    n0 = n1 = n2 = brick_at(i, j, k, field)
    o0, s0 = brick_scale(n0, field)
    o1 = o2 = o0
    s1 = s2 = s0
    p0 = BRICK_VALUES + BRICK_PLACES * level
    p1 = p0 + BRICK_PLACES
    p2 = p1 + BRICK_PLACES
    if level > BRICK_LEVELS - 3:  # the last level is in the next brick
        n2 = brick_at(i, j, k + 1, field)
        o2, s2 = brick_scale(n2, field)
        p2 -= BRICK_PLACES * BRICK_LEVELS
    if level > BRICK_LEVELS - 2:
        n1 = n2
        o1 = o2
        s1 = s2
        p1 -= BRICK_PLACES * BRICK_LEVELS
    for lane in range(BRICK_PLACES):
        c0 = o0 + s0 * float(field.bricks[n0, p0 + lane])
        c1 = o1 + s1 * float(field.bricks[n1, p1 + lane])
        c2 = o2 + s2 * float(field.bricks[n2, p2 + lane])
        lanes[0, lane] = w0[0] * c0 + w0[1] * c1 + w0[2] * c2
        lanes[1, lane] = w1[0] * c0 + w1[1] * c1 + w1[2] * c2
