"""Certified bounds of the second derivatives of a baked potential, by its Bernstein hull.

On each cell a second derivative of the spline is a polynomial of degree 2, which lies in the hull
of its Bernstein coefficients, and so does the matrix of them. The greatest eigenvalue is a convex
function, so no matrix of the hull has a greater one than the coefficients have. A coefficient at a
corner of the cell is the second derivative there, from inside the cell: it is attained.

The matrices of a run of cells of one column are computed together in vector registers. Most have
eigenvalues below the bounds found before, which the signs of their leading minors show; only of the
others are the eigenvalues computed.

The weights of coefficients are those of :func:`field_certificate.hull_weights`.
"""

import math

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.textures.fields.field_sampler import (
    REACH,
    FieldArguments,
    SixEntries,
    Vector,
    field_triple,
)

KERNELS = Kernels(loops=("hull_batch",), iterates=True)

# Bounds are raised by 2 SLACK above an eigenvalue, and cells tested against bounds SLACK lower, but
# attained values SLACK higher: equal eigenvalues are not evaluated again.
SLACK = 1e-7
# Rounding error of a minor, for second derivatives of about 1.
MINOR_ROUNDING = 1e-14


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


def raise_bound(bound: FloatArray, row: int, corner: bool, hessian: SixEntries, at: Vector) -> None:
    """Raise the bounds of the greatest eigenvalue in a row of ``bound`` by one matrix of a hull.

    It holds the upper bound, the greatest value at a corner of a cell, and that corner.
    """
    if least_minor(bound[row, 1] if corner else bound[row, 0], *hessian) > MINOR_ROUNDING:
        return
    top = largest_eigenvalue_3x3(*hessian)
    bound[row, 0] = max(bound[row, 0], top * (1.0 + 2.0 * SLACK))
    if corner and top > bound[row, 1]:
        bound[row, 1] = top
        for d in range(3):
            bound[row, 2 + d] = at[d]


def load_nodes(
    i: int, j: int, m: int, count: int, rows: int, nodes: FloatArray, field: FieldArguments
) -> None:
    """Write the coefficients of the columns around a cell from level m on, (3 rows, count)."""
    for q in range(3 * rows):
        for k in range(count):
            nodes[q, k] = field_triple(i + q // 3, j + q % 3, m + k, field)[1]


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


def hull_matrix(mixed: FloatArray, k: int, w: FloatArray, g: int) -> SixEntries:
    """Return the matrix of coefficient g along z of cell k of a run."""
    xx = w[g, 0, 0] * mixed[0, k] + w[g, 0, 1] * mixed[0, k + 1] + w[g, 0, 2] * mixed[0, k + 2]
    xy = w[g, 0, 0] * mixed[1, k] + w[g, 0, 1] * mixed[1, k + 1] + w[g, 0, 2] * mixed[1, k + 2]
    yy = w[g, 0, 0] * mixed[2, k] + w[g, 0, 1] * mixed[2, k + 1] + w[g, 0, 2] * mixed[2, k + 2]
    xz = w[g, 1, 0] * mixed[3, k] + w[g, 1, 1] * mixed[3, k + 1] + w[g, 1, 2] * mixed[3, k + 2]
    yz = w[g, 1, 0] * mixed[4, k] + w[g, 1, 1] * mixed[4, k + 1] + w[g, 1, 2] * mixed[4, k + 2]
    zz = w[g, 2, 0] * mixed[5, k] + w[g, 2, 1] * mixed[5, k + 1] + w[g, 2, 2] * mixed[5, k + 2]
    return xx, xy, xz, yy, yz, zz


def hull_run(
    place: tuple[int, int, int], count: int, nodes: FloatArray, plane: FloatArray,
    upward: FloatArray, mixed: FloatArray, bounds: FloatArray,
) -> None:  # fmt: skip
    """Raise the bounds of the eigenvalues of Hess T by a run of cells; see ``hull_batch``.

    The last row of ``mixed`` is for the least leading minor of each cell.
    """
    for n in range(plane.shape[0]):
        e = 0.5 * (n // 3) - 0.5 if plane.shape[0] > 3 else 0.0
        f = 0.5 * (n % 3) - 0.5
        mix_nodes(nodes, count + 2, n, plane, mixed)
        for g in range(3):
            corner = g != 1 and f != 0.0 and (e != 0.0 or plane.shape[0] == 3)
            above = bounds[0, 1] * (1.0 + SLACK) if corner else bounds[0, 0] * (1.0 - SLACK)
            below = bounds[1, 1] * (1.0 + SLACK) if corner else bounds[1, 0] * (1.0 - SLACK)
            for k in range(count):
                xx, xy, xz, yy, yz, zz = hull_matrix(mixed, k, upward, g)
                other = least_minor(below, -xx, -xy, -xz, -yy, -yz, -zz)
                mixed[6, k] = min(other, least_minor(above, xx, xy, xz, yy, yz, zz))
            for k in range(count):
                if not mixed[6, k] > MINOR_ROUNDING:
                    xx, xy, xz, yy, yz, zz = hull_matrix(mixed, k, upward, g)
                    at = (place[0] + f, place[1] + e, place[2] + k + 0.5 * g - 0.5)
                    raise_bound(bounds, 0, corner, (xx, xy, xz, yy, yz, zz), at)
                    raise_bound(bounds, 1, corner, (-xx, -xy, -xz, -yy, -yz, -zz), at)


def hull_batch(
    first: int, last: int, plane: FloatArray, upward: FloatArray, bounds: FloatArray,
    field: FieldArguments,
) -> None:  # fmt: skip
    """Raise bounds of the eigenvalues of Hess T by the cells of nodes first to last along x.

    Args:
        first: first node along x.
        last: node after the last.
        plane: weights of the columns around a cell, (9, 6, 9); (3, 6, 3) for a profile.
        upward: weights along z, (3, 3, 3).
        bounds: (2, 5), for Hess T and for its negative: an upper bound of the greatest eigenvalue,
            the greatest value at a corner of a cell, and that corner in nodes along x, y, z.
        field: the field.
    """
    rows = min(field.columns.shape[0], 3)
    nodes = local_array((9, 66))
    mixed = local_array((7, 66))
    for i in range(field.columns.shape[0] - rows + 1):
        for j in range(first, last):
            end = min(int(field.columns[i + rows // 2, j + 1, REACH]) + 1, field.levels - 1)
            for m in range(1, end, 64):
                count = min(64, end - m)
                load_nodes(i, j, m - 1, count + 2, rows, nodes, field)
                hull_run((j, i, m), count, nodes, plane, upward, mixed, bounds)
