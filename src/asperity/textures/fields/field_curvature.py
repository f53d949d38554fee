"""Certified bounds of the second derivatives of a baked potential, by its Bernstein hull.

On each cell a second derivative of the spline is a polynomial of degree 2, which lies in the hull
of its Bernstein coefficients, and so does the matrix of them. The greatest eigenvalue is a convex
function, so no matrix of the hull has a greater one than the coefficients have. A coefficient at a
corner of the cell is the second derivative there, from inside the cell: it is attained.
"""

import math

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.textures.fields.field_sampler import FieldArguments, field_hessian, field_triple

KERNELS = Kernels(loops=("hull_batch",), iterates=True)


def bernstein_coefficient(c0: float, c1: float, c2: float, order: int, index: int) -> float:
    """Return a Bernstein coefficient of a derivative of a quadratic B-spline on its middle cell.

    All orders are represented as polynomials of degree 2, so that their hulls can be combined.
    """
    if order == 2:
        return c0 - 2.0 * c1 + c2
    if order == 1:
        if index == 1:
            return 0.5 * (c2 - c0)
        return c1 - c0 if index == 0 else c2 - c1
    if index == 1:
        return c1
    return 0.5 * (c0 + c1) if index == 0 else 0.5 * (c1 + c2)


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


def eigenvalues_below(
    bound: float, xx: float, xy: float, xz: float, yy: float, yz: float, zz: float
) -> bool:
    """Return whether all eigenvalues are below the bound: bound I - H has positive pivots."""
    p0 = bound - xx
    if p0 <= 0.0:
        return False
    p1 = bound - yy - xy * xy / p0
    if p1 <= 0.0:
        return False
    mixed = -yz - xy * xz / p0
    return bound - zz - xz * xz / p0 - mixed * mixed / p1 > 0.0


def load_coefficients(
    i: int, j: int, m: int, rows: int, c: FloatArray, field: FieldArguments
) -> bool:
    """Write the coefficients around a node (3, 3, 3); return whether any is not zero."""
    some = False
    for a in range(rows):
        for b in range(3):
            c[a, b, 0], c[a, b, 1], c[a, b, 2] = field_triple(i + a, j + b, m, field)
            some = some or c[a, b, 0] != 0.0 or c[a, b, 1] != 0.0 or c[a, b, 2] != 0.0
    return some


def hull_entry(
    c: FloatArray, rows: int, order: tuple[int, int, int], e: int, f: int, g: int
) -> float:
    """Return a Bernstein coefficient of a derivative on a cell."""
    order_v, order_u, order_w = order
    columns = (0.0, 0.0, 0.0)
    for a in range(rows):
        lines = (0.0, 0.0, 0.0)
        for b in range(3):
            value = bernstein_coefficient(c[a, b, 0], c[a, b, 1], c[a, b, 2], order_w, g)
            lines = (lines[1], lines[2], value)
        column = bernstein_coefficient(lines[0], lines[1], lines[2], order_u, f)
        columns = (columns[1], columns[2], column)
    if rows == 1:
        return columns[2] if order_v == 0 else 0.0
    return bernstein_coefficient(columns[0], columns[1], columns[2], order_v, e)


def hull_matrix(
    c: FloatArray, rows: int, e: int, f: int, g: int, field: FieldArguments
) -> tuple[float, float, float, float, float, float]:
    """Return one matrix of the Bernstein hull of Hess T on a cell: xx, xy, xz, yy, yz, zz."""
    vv = hull_entry(c, rows, (2, 0, 0), e, f, g)
    uv = hull_entry(c, rows, (1, 1, 0), e, f, g)
    vw = hull_entry(c, rows, (1, 0, 1), e, f, g)
    uu = hull_entry(c, rows, (0, 2, 0), e, f, g)
    uw = hull_entry(c, rows, (0, 1, 1), e, f, g)
    ww = hull_entry(c, rows, (0, 0, 2), e, f, g)
    return field_hessian(uu, uv, uw, vv, vw, ww, field)


def raise_bound(
    bound: FloatArray, row: int, corner: bool,
    hessian: tuple[float, float, float, float, float, float], position: tuple[float, float, float],
) -> None:  # fmt: skip
    """Raise the bounds of the greatest eigenvalue in a row of ``bound`` by one matrix of a hull.

    It holds the upper bound, the greatest value at a corner of a cell, and that corner.
    """
    if eigenvalues_below(bound[row, 1] if corner else bound[row, 0], *hessian):
        return
    top = largest_eigenvalue_3x3(*hessian)
    bound[row, 0] = max(bound[row, 0], top * (1.0 + 1e-7))
    if corner and top > bound[row, 1]:
        bound[row, 1] = top
        for d in range(3):
            bound[row, 2 + d] = position[d]


def hull_cell(
    i: int, j: int, m: int, c: FloatArray, out: FloatArray, field: FieldArguments
) -> None:
    """Raise the bounds of the eigenvalues of Hess T by one cell; see ``hull_batch``."""
    rows = min(field.columns.shape[0], 3)
    for n in range(9 * rows):
        e, f, g = n // 9, n // 3 % 3, n % 3
        xx, xy, xz, yy, yz, zz = hull_matrix(c, rows, e, f, g, field)
        corner = (rows == 1 or e != 1) and f != 1 and g != 1
        place = (j + 0.5 * f - 0.5, i + (0.5 * e - 0.5 if rows > 1 else 0.0), m + 0.5 * g - 0.5)
        raise_bound(out, 0, corner, (xx, xy, xz, yy, yz, zz), place)
        raise_bound(out, 1, corner, (-xx, -xy, -xz, -yy, -yz, -zz), place)


def hull_batch(first: int, last: int, out: FloatArray, field: FieldArguments) -> None:
    """Write bounds of the eigenvalues of Hess T over the cells of nodes first to last along x.

    Args:
        first: first node along x.
        last: node after the last.
        out: (2, 5), for Hess T and for its negative: an upper bound of the greatest eigenvalue,
            the greatest value at a corner of a cell, and that corner in nodes along x, y, z.
        field: the field.
    """
    rows = min(field.columns.shape[0], 3)
    c = local_array((3, 3, 3))
    for i in range(field.columns.shape[0] - rows + 1):
        for j in range(first, last):
            for m in range(1, field.levels - 1):
                if load_coefficients(i, j, m, rows, c, field):
                    hull_cell(i, j, m, c, out, field)
