"""Certified bounds of the second derivatives of a baked potential, by Bernstein hulls.

Where S > 0 the Hessian of T = S²/2 is ∇S ∇Sᵀ + S Hess S. On each cell S and its derivatives are
polynomials of degree 2, which lie in the hull of their Bernstein coefficients; those of the
product, of degree 4, are weighted means of products of theirs. The greatest eigenvalue is a convex
function, so no matrix of the hull has a greater one than the coefficients have. A coefficient at a
corner of the cell is the second derivative there, from inside the cell: it is attained.

Most cells are excluded before the product is formed. With the values S₀, g₀, H₀ of the middle
coefficient, S H = S₀ H + (S - S₀) H₀ + (S - S₀)(H - H₀), and the last term is bounded by the
greatest factors of the cell; ∇S ∇Sᵀ is convex, and not less than g₀ ∇Sᵀ + ∇S g₀ᵀ - g₀ g₀ᵀ. What is
left is linear or convex in the coefficients. The matrices of a run of cells of one column are
computed together in vector registers, and the signs of their leading minors show that their
eigenvalues are below the bounds found before. The cells of which they do not are packed, and the
product is formed on several of them together.

The weights of coefficients are those of :func:`field_certificate.hull_weights`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.textures.fields.field_record import (
    OFFSETS,
    PERIODIC,
    FieldArguments,
    field_reach,
    field_rows,
    field_triple,
)

IntArray = NDArray[np.int64]

KERNELS = Kernels(loops=("hull_batch",), iterates=True)

# Bounds are raised by 2 SLACK above an eigenvalue, and cells tested against bounds SLACK lower, but
# attained values SLACK higher: equal eigenvalues are not evaluated again.
SLACK = 1e-7
# Rounding error of a minor, for second derivatives of about 1.
MINOR_ROUNDING = 1e-14
# Cells of which the product is formed together.
LANES = 16


def largest_eigenvalue_3x3(
    xx: float, xy: float, xz: float, yy: float, yz: float, zz: float
) -> float:
    """Return the greatest eigenvalue of a symmetric matrix, to 1e-7 of its norm."""
    mean = (xx + yy + zz) / 3.0
    a = xx - mean
    b = yy - mean
    d = zz - mean
    size = math.sqrt((a * a + b * b + d * d + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    if size == 0.0:
        return mean
    det = a * (b * d - yz * yz) - xy * (xy * d - yz * xz) + xz * (xy * yz - b * xz)
    cosine = min(max(0.5 * det / (size * size * size), -1.0), 1.0)
    return mean + 2.0 * size * math.cos(math.acos(cosine) / 3.0)


def least_minor(
    bound: float, xx: float, xy: float, xz: float, yy: float, yz: float, zz: float
) -> float:
    """Return the least leading minor of bound I - H: positive if all eigenvalues are below."""
    a = bound - xx
    b = bound - yy
    c = bound - zz
    middle = a * b - xy * xy
    return min(a, middle, c * middle - a * yz * yz - b * xz * xz - 2.0 * xy * xz * yz)


def load_nodes(
    i: int, j: int, m: int, count: int, rows: int, nodes: FloatArray, field: FieldArguments
) -> None:
    """Write the coefficients of the columns around a cell from level m on, (3 rows, count)."""
    for q in range(3 * rows):
        for k in range(count):
            nodes[q, k] = field_triple(i + q // 3, j + q % 3, m + k, field)[1]
            if m + k < field.stretched_cells.shape[0]:
                nodes[q, k] += field.stretched_cells[m + k, OFFSETS + 1]


def mix_nodes(nodes: FloatArray, count: int, n: int, plane: FloatArray, mixed: FloatArray) -> None:
    """Write the weighted sums (6, count) of columns of nodes for coefficient n in the plane."""
    for t in range(6):
        for k in range(count):
            mixed[t, k] = 0.0
        for q in range(plane.shape[2]):
            w = plane[n, t, q]
            if w != 0.0:
                for k in range(count):
                    mixed[t, k] += w * nodes[q, k]


def expand_run(
    m: int,
    count: int,
    nodes: FloatArray,
    plane: FloatArray,
    upward: FloatArray,
    mixed: FloatArray,
    margin: float,
    hull: FloatArray,
) -> None:
    """Write the Bernstein coefficients of S, ∇S and Hess S of a run of cells from level m on.

    ``hull`` (27, 10, count) holds S, x, y, z, xx, xy, xz, yy, yz, zz.
    """
    sources = (5, 3, 4, 5, 0, 1, 3, 2, 4, 5)  # mixture of columns, and derivative along z
    orders = (0, 0, 0, 1, 0, 0, 1, 0, 1, 2)
    for n in range(plane.shape[0]):
        mix_nodes(nodes, count + 2, n, plane, mixed)
        for g in range(3):
            q = 3 * n + g
            for t in range(10):
                source = sources[t]
                order = orders[t]
                shift = margin if t == 0 else 0.0
                for k in range(count):
                    value = upward[g, order, 0, m + k] * mixed[source, k]
                    value += upward[g, order, 1, m + k] * mixed[source, k + 1]
                    value += upward[g, order, 2, m + k] * mixed[source, k + 2]
                    hull[q, t, k] = value - shift


def measure_hulls(count: int, hull: FloatArray, work: FloatArray, size: int) -> None:
    """Write how far the coefficients of each cell are from its middle one, and the greatest S.

    Rows 0, 2 and 4 of ``work`` are that of S, the greatest S, and that of ∂S/∂z; row 1 is the
    product of that of S and that of Hess S; row 3 is made large.
    """
    middle = size // 2
    for k in range(count):
        work[0, k] = 0.0
        work[1, k] = 0.0
        work[2, k] = hull[middle, 0, k]
        work[3, k] = 1e300
        work[4, k] = 0.0
    for q in range(size):
        for k in range(count):
            s = hull[q, 0, k]
            change = 0.0
            for t in range(4, 10):
                weight = 1.0 if t in (4, 7, 9) else 2.0
                change += weight * (hull[q, t, k] - hull[middle, t, k]) ** 2
            work[0, k] = max(work[0, k], abs(s - hull[middle, 0, k]))
            work[4, k] = max(work[4, k], abs(hull[q, 3, k] - hull[middle, 3, k]))
            work[1, k] = max(work[1, k], change)
            work[2, k] = max(work[2, k], s)
    for k in range(count):
        work[1, k] = work[0, k] * math.sqrt(work[1, k])


def exclude_cells(
    m: int,
    count: int,
    rate: float,
    hull: FloatArray,
    bounds: FloatArray,
    work: FloatArray,
    size: int,
    field: FieldArguments,
) -> None:
    """Write to row 3 of ``work`` what is positive for cells whose bounds are not raised.

    It is the least leading minor, of linearized matrices, or 1 where S is nowhere positive.
    """
    middle = size // 2
    side = 0.5 * field.fade / field.below
    for q in range(size):
        for k in range(count):
            slack = work[1, k]
            above = bounds[0, 0] * (1.0 - SLACK) - slack
            s0 = hull[middle, 0, k]
            ds = hull[q, 0, k] - s0
            xx = s0 * hull[q, 4, k] + ds * hull[middle, 4, k]
            xy = s0 * hull[q, 5, k] + ds * hull[middle, 5, k]
            xz = s0 * hull[q, 6, k] + ds * hull[middle, 6, k]
            yy = s0 * hull[q, 7, k] + ds * hull[middle, 7, k]
            yz = s0 * hull[q, 8, k] + ds * hull[middle, 8, k]
            zz = s0 * hull[q, 9, k] + ds * hull[middle, 9, k]
            x = hull[q, 1, k]
            y = hull[q, 2, k]
            z = hull[q, 3, k]
            a = hull[middle, 1, k]
            b = hull[middle, 2, k]
            c = hull[middle, 3, k]
            depth = field.lift + (field.below + 1 - m - k - 0.5 * (q % 3)) * side
            drop = rate * (s0 * c - s0 * z - hull[q, 0, k] * c - depth)
            sag = rate * work[0, k] * work[4, k]
            upper = least_minor(
                above,
                xx + x * x,
                xy + x * y,
                xz + x * z,
                yy + y * y,
                yz + y * z,
                zz + z * z - drop + sag,
            )
            lower = least_minor(
                bounds[1, 0] * (1.0 - SLACK) - slack,
                a * (a - 2.0 * x) - xx,
                a * b - a * y - b * x - xy,
                a * c - a * z - c * x - xz,
                b * (b - 2.0 * y) - yy,
                b * c - b * z - c * y - yz,
                c * (c - 2.0 * z) - zz + drop + sag,
            )
            if rate > 0.0:
                upper = min(upper, above - 1.0 + drop - sag)
            work[3, k] = min(work[3, k], upper, lower)
    exclude_outside(count, work)


def exclude_outside(count: int, work: FloatArray) -> None:
    """Write 1 to row 3 of ``work`` for cells where S is nowhere positive."""
    for k in range(count):
        if work[2, k] <= 0.0:
            work[3, k] = 1.0


def pack_cell(
    k: int,
    lane: int,
    place: tuple[int, int, int],
    rate: float,
    size: int,
    hull: FloatArray,
    packed: FloatArray,
    places: FloatArray,
) -> None:
    """Copy cell k of a run to a lane: its coefficients, (27, 10, LANES), place and rate."""
    for q in range(size):
        for t in range(10):
            packed[q, t, lane] = hull[q, t, k]
    places[0, lane] = place[0]
    places[1, lane] = place[1]
    places[2, lane] = place[2] + k
    places[3, lane] = rate


def multiply_packed(
    n: int,
    starts: IntArray,
    pairs: IntArray,
    weights: FloatArray,
    packed: FloatArray,
    product: FloatArray,
) -> None:
    """Write Bernstein coefficient n, of degree 4, of Hess T and S ∂S/∂z of packed cells.

    Its pairs of coefficients of degree 2 are those from ``starts[n]`` to ``starts[n + 1]``. They
    are rows 0 to 6 of ``product``, (8, LANES); the last one is left to :func:`least_minors`.
    """
    product[:] = 0.0
    for term in range(starts[n], starts[n + 1]):
        i = pairs[term, 0]
        j = pairs[term, 1]
        w = weights[term]
        for k in range(LANES):
            s = w * packed[i, 0, k]
            x = w * packed[i, 1, k]
            y = w * packed[i, 2, k]
            z = w * packed[i, 3, k]
            along_x = packed[j, 1, k]
            along_y = packed[j, 2, k]
            along_z = packed[j, 3, k]
            product[0, k] += s * packed[j, 4, k] + x * along_x
            product[1, k] += s * packed[j, 5, k] + x * along_y
            product[2, k] += s * packed[j, 6, k] + x * along_z
            product[3, k] += s * packed[j, 7, k] + y * along_y
            product[4, k] += s * packed[j, 8, k] + y * along_z
            product[5, k] += s * packed[j, 9, k] + z * along_z
            product[6, k] += s * along_z


def is_undecided(
    k: int, place: tuple[int, int, int], work: FloatArray, marks: NDArray[np.uint8]
) -> bool:
    """Return whether the product must be formed on cell k of a run, and unmark it."""
    i, j, m = place
    is_open = not work[3, k] > MINOR_ROUNDING
    if marks.shape[0] > 0:
        is_open = is_open and marks[i, j, m + k] > 0
        marks[i, j, m + k] = 0
    return is_open


def least_minors(
    n: int, places: FloatArray, bounds: FloatArray, product: FloatArray, field: FieldArguments
) -> None:
    """Write the least minor of either bound of Hess T at coefficient n to the last row of products.

    Below the floor the rate, 1/F, is not zero. The Hessian there is that of the spline, its second
    derivative along z lowered by 1/F of what the force less the depth exceeds the lift by, all
    times ψ' for each z, plus 1 - ψ'² times 1 less the same: no eigenvalue exceeds both bounds, and
    none is attained. Row 5 is lowered by that, which becomes row 6.

    Args:
        n: coefficient of degree 4.
        places: the node in the middle of each cell, along the axes, and its rate, (4, LANES).
        bounds: as in :func:`hull_batch`.
        product: from :func:`multiply_packed`.
        field: the field.
    """
    side = 0.5 * field.fade / field.below
    part = 0.25 * (n % 5) - 0.5
    upper = bounds[0, 0] * (1.0 - SLACK)
    lower = bounds[1, 0] * (1.0 - SLACK)
    if n // 25 % 4 + n // 5 % 5 % 4 + n % 5 % 4 == 0:  # at a corner, where it is attained
        upper = min(upper, bounds[0, 1])
        lower = min(lower, bounds[1, 1])
    for k in range(LANES):
        depth = (field.below + 0.5 - places[2, k] - part) * side + field.lift
        drop = -places[3, k] * (product[6, k] + depth)
        xx = product[0, k]
        xy = product[1, k]
        xz = product[2, k]
        yy = product[3, k]
        yz = product[4, k]
        zz = product[5, k] - drop
        product[5, k] = zz
        wall = 1.0
        if places[3, k] > 0.0:
            wall = bounds[0, 0] - 1.0 + drop
        product[7, k] = min(
            least_minor(upper, xx, xy, xz, yy, yz, zz),
            least_minor(lower, -xx, -xy, -xz, -yy, -yz, -zz),
            wall,
        )
        product[6, k] = drop


def raise_bounds(
    n: int,
    lane: int,
    places: FloatArray,
    packed: FloatArray,
    product: FloatArray,
    bounds: FloatArray,
    field: FieldArguments,
) -> None:
    """Raise the bounds of Hess T and of its negative by coefficient n of a packed cell.

    ``bounds[row]`` holds the upper bound, the greatest value attained, and where.
    """
    rows = min(field_rows(field), 3)
    e = n // 25
    f = n // 5 % 5
    g = n % 5
    rate = places[3, lane]
    corner = rate == 0.0 and e % 4 + f % 4 + g % 4 == 0
    corner = corner and packed[9 * (e // 2) + 3 * (f // 2) + g // 2, 0, lane] > 0.0
    if rate > 0.0:
        bounds[0, 0] = max(bounds[0, 0], 1.0 - product[6, lane])
    for row in range(2):
        sign = 1.0 - 2.0 * row
        matrix = (
            sign * product[0, lane],
            sign * product[1, lane],
            sign * product[2, lane],
            sign * product[3, lane],
            sign * product[4, lane],
            sign * product[5, lane],
        )
        bound = bounds[row, 0] * (1.0 - SLACK)
        if corner:
            bound = min(bound, bounds[row, 1])
        if least_minor(bound, *matrix) > MINOR_ROUNDING:
            continue
        top = largest_eigenvalue_3x3(*matrix)
        bounds[row, 0] = max(bounds[row, 0], top * (1.0 + 2.0 * SLACK))
        if corner and top > bounds[row, 1]:
            bounds[row, 1] = top
            bounds[row, 2] = places[0, lane] + 0.25 * f - 0.5
            bounds[row, 3] = places[1, lane] + (0.25 * e - 0.5 if rows > 1 else 0.0)
            bounds[row, 4] = places[2, lane] + 0.25 * g - 0.5


def search_packed(
    count: int,
    places: FloatArray,
    starts: IntArray,
    pairs: IntArray,
    weights: FloatArray,
    packed: FloatArray,
    product: FloatArray,
    bounds: FloatArray,
    marks: NDArray[np.uint8],
    field: FieldArguments,
) -> None:
    """Raise the bounds by the first packed cells, or mark the cells that would raise them."""
    upper = bounds[0, 0]
    lower = bounds[1, 0]
    tests = marks.shape[0] > 0
    for n in range(starts.shape[0] - 1):
        multiply_packed(n, starts, pairs, weights, packed, product)
        least_minors(n, places, bounds, product, field)
        for k in range(count):
            place = (int(places[0, k]), int(places[1, k]), int(places[2, k]))
            if product[7, k] > MINOR_ROUNDING or (tests and marks[place] > 0):
                continue
            raise_bounds(n, k, places, packed, product, bounds, field)
            if tests:
                marks[place] = 1 if bounds[0, 0] > upper or bounds[1, 0] > lower else 0
                bounds[0, 0] = upper
                bounds[1, 0] = lower


def hull_batch(
    first: int,
    last: int,
    plane: FloatArray,
    upward: FloatArray,
    starts: IntArray,
    pairs: IntArray,
    weights: FloatArray,
    bounds: FloatArray,
    marks: NDArray[np.uint8],
    field: FieldArguments,
) -> None:
    """Raise bounds of the eigenvalues of Hess T by the cells of nodes first to last along x.

    Args:
        first: first node along x.
        last: node after the last.
        plane: weights of the columns around a cell, (9, 6, 9); (3, 6, 3) for a profile.
        upward: weights along z, (3, 3, 3, levels).
        starts: the first of the pairs of coefficients whose products add to each coefficient of
            degree 4, and their end, (126,) or (26,).
        pairs: of coefficients, (729, 2) or (81, 2).
        weights: of their products.
        bounds: (2, 5), for Hess T and for its negative: an upper bound of the greatest eigenvalue,
            the greatest value attained at a corner, and that corner in nodes along the axes.
        marks: cells to test, not 0: left so if their bounds are above those given, which then do
            not change; shape of the nodes, those along x first, or empty to search the bounds.
        field: the field.
    """
    rows = min(field_rows(field), 3)
    size = 9 * rows
    nodes = local_array((9, 34))
    mixed = local_array((6, 34))
    work = local_array((5, 32))
    hull = local_array((27, 10, 32))
    packed = local_array((27, 10, LANES))
    product = local_array((8, LANES))
    places = local_array((4, LANES))
    packed[:] = 0.0
    lanes = 0
    terms = (starts, pairs, weights)
    lines = max(field_rows(field) - 3 + int(field.border != PERIODIC), 1)
    tests = marks.shape[0] > 0
    for i in range(lines):
        for j in range(first, last):
            end = min(field_reach(i + rows // 2, j + 1, field) + 1, field.levels - 1)
            m = 1
            if tests:
                marks[j, i, :1] = 0
                marks[j, i, end:] = 0
            while m < end:
                if tests and marks[j, i, m] == 0:
                    m += 1
                    continue
                above = m > field.below
                count = min(32, (end if above else min(end, field.below + 1)) - m)
                while tests and marks[j, i, m + count - 1] == 0:
                    count -= 1
                rate = 0.0 if above else 1.0 / field.fade
                load_nodes(i, j, m - 1, count + 2, rows, nodes, field)
                expand_run(m, count, nodes, plane, upward, mixed, field.margin, hull)
                measure_hulls(count, hull, work, size)
                exclude_cells(m, count, rate, hull, bounds, work, size, field)
                place = (j, i, m)
                for k in range(count):
                    if not is_undecided(k, place, work, marks):
                        continue
                    pack_cell(k, lanes, place, rate, size, hull, packed, places)
                    lanes += 1
                    if lanes == LANES:
                        search_packed(lanes, places, *terms, packed, product, bounds, marks, field)
                        lanes = 0
                m += count
    search_packed(lanes, places, *terms, packed, product, bounds, marks, field)
