"""Exact potential and depth of law H of a closed mesh.

Fully-corrective Frank-Wolfe, as in :mod:`asperity.contacts.split_solver`, with the closest points
of a mesh. For c >= 1 every y that is queried is at most as far from the probe as its closest point
is, so y is inside and the mesh's closest point is that of the outside.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.split_optimality import (
    split_duality_gap,
    split_evaluate_energy,
    split_solve_weights,
)
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.textures.meshes.triangle_tree import (
    TriangleTree,
    opposite_walls,
    tree_closest,
    tree_crossings,
    winding_above,
)

KERNELS = Kernels(loops=("column_batch", "point_batch"), iterates=True)

# Duality gap at which the search ends, in squared distances of the closest point; single precision
# resolves 6e-8 of a potential.
_GAP = 2e-9
_MAX_QUERIES = 60
_UNLIMITED = 1e300
# Atoms farther apart than 120 degrees, seen from their common centre, are on opposite walls.
_OPPOSITE = -0.5
# Cosine of 30 degrees: so far may walls on opposite sides of a vertical span be tilted.
_PARALLEL = 0.866

# Depths, in units of max_depth, beyond which the potential is constant: e.
CORE = math.e

# Entries of a row of a column's summary.
HEIGHT = 0
DEEPEST = 1
THIN = 2
THIN_Z = 3
LEAST_WINDING = 4
GREATEST_WINDING = 5
FAULT_Z = 6


class BodyLaw(NamedTuple):
    """Law H of a body.

    Attributes:
        continuity: c, at least 1.
        max_depth: depth to which the potential is exact [m].
        tolerance: duality gap at which the search ends [m²].
    """

    continuity: float
    max_depth: float
    tolerance: float


def limited_potential(energy: float, max_depth: float) -> tuple[float, float]:
    """Return a function of U [m²] that is U within the depth and constant far below, and its slope.

    With a = max_depth²/2 it has the second derivative -1/(2U) for a < U < e² a. Since
    ``|∇U|² <= 2 U``, the eigenvalues of its Hessian are at least -c - 1 and at most 1.
    """
    a = 0.5 * max_depth * max_depth
    if energy <= a:
        return energy, 1.0
    if energy >= CORE * CORE * a:
        return 0.5 * (CORE * CORE - 1.0) * a, 0.0
    rest = 0.5 * math.log(energy / a)
    return energy * (1.5 - rest) - 0.5 * a, 1.0 - rest


def split_in_mesh(
    p: FloatArray,
    near: int,
    law: BodyLaw,
    y: FloatArray,
    atoms: FloatArray,
    offset: FloatArray,
    tree: TriangleTree,
) -> tuple[float, int, int, float]:
    """Write y, the atoms of law H (5, 4) and z̄ - p, ``offset``, at a point inside a closed mesh.

    Returns:
        U [m²], the number of atoms, the triangle of the closest point, and its distance [m]. In the
        core the number is 0.
    """
    c = law.continuity
    mu = 1.0 / (1.0 + c)
    # U >= (1 - μ) d²/2: beyond this distance d nothing but the constant is left.
    limit = (law.max_depth * CORE) ** 2 / (1.0 - mu)
    square, atoms[0, 0], atoms[0, 1], atoms[0, 2], triangle = tree_closest(
        p[0], p[1], p[2], limit, near, tree
    )
    if triangle < 0:
        return 0.5 * limit, 0, near, math.sqrt(limit)
    a = local_array((7, 10))
    atoms[0, 3] = 1.0
    count = 1
    last = triangle
    scale = abs(p[0]) + abs(p[1]) + abs(p[2])
    energy = split_evaluate_energy(atoms, count, p, mu, offset)
    for _ in range(_MAX_QUERIES):
        for d in range(3):
            y[d] = p[d] - offset[d] / c
        _s, atoms[count, 0], atoms[count, 1], atoms[count, 2], last = tree_closest(
            y[0], y[1], y[2], _UNLIMITED, last, tree
        )
        atoms[count, 3] = 0.0
        gap, rounding = split_duality_gap(atoms, count, y, mu, scale)
        if gap <= max(_GAP * square, law.tolerance, rounding):
            return energy - 0.5 * gap, count, triangle, math.sqrt(square)
        left = split_solve_weights(atoms, count + 1, p, mu, a)
        if left == 0:  # by rounding: there are no better weights
            break
        count = left
        energy = split_evaluate_energy(atoms, count, p, mu, offset)
    return energy, count, triangle, math.sqrt(square)


def summarize_column(
    count: int, crossings: FloatArray, tolerance: float, row: int, out: FloatArray
) -> None:
    """Write the greatest z of a column and the extreme winding numbers between its crossings."""
    out[row, HEIGHT] = crossings[0, 0] if count > 0 else -np.inf
    out[row, DEEPEST] = 0.0
    out[row, THIN] = np.inf
    out[row, LEAST_WINDING] = 0.0
    out[row, GREATEST_WINDING] = 0.0
    total = 0.0
    for k in range(count):
        total += crossings[k, 1]
        if k + 1 < count and crossings[k, 0] - crossings[k + 1, 0] <= tolerance:
            continue
        if total < 0.0 or total > 1.0 or (k + 1 == count and total != 0.0):
            out[row, FAULT_Z] = crossings[k, 0]
        out[row, LEAST_WINDING] = min(out[row, LEAST_WINDING], total)
        out[row, GREATEST_WINDING] = max(out[row, GREATEST_WINDING], total)


def note_thin_part(atoms: FloatArray, count: int, y: FloatArray, row: int, out: FloatArray) -> None:
    """Write half the thickness at y, if atoms lie on opposite walls and it is the least so far."""
    square = 0.0
    for d in range(3):
        square += (atoms[0, d] - y[d]) ** 2
    half = math.sqrt(square)
    if half < out[row, THIN] and opposite_walls(atoms, count, y) < _OPPOSITE:
        out[row, THIN] = half
        out[row, THIN_Z] = y[2]


def note_thin_spans(
    p: FloatArray,
    count: int,
    crossings: FloatArray,
    lengths: tuple[float, float],
    row: int,
    out: FloatArray,
    tree: TriangleTree,
) -> None:
    """Write the least half thickness of spans between opposite walls, if between two lengths.

    It is the distance of the middle of a span from the mesh. Parts that lie between two nodes are
    found by this alone.
    """
    total = 0.0
    for k in range(count - 1):
        total += crossings[k, 1]
        half = 0.5 * (crossings[k, 0] - crossings[k + 1, 0])
        if total > 0.0 and lengths[0] < half < lengths[1]:
            z = crossings[k, 0] - half
            distance = math.sqrt(tree_closest(p[0], p[1], z, half * half, 0, tree)[0])
            if _PARALLEL * half <= distance < out[row, THIN]:
                out[row, THIN] = distance
                out[row, THIN_Z] = z


def column_batch(
    columns: FloatArray,
    z: FloatArray,
    law: BodyLaw,
    tolerance: float,
    margin: float,
    out: NDArray[np.float32],
    summary: FloatArray,
    crossings: FloatArray,
    tree: TriangleTree,
) -> None:
    """Write the depths of columns of nodes.

    Args:
        columns: x and y [m], shape (n, 2).
        z: of the levels [m].
        law: the law.
        tolerance: distance of crossings that count as one [m].
        margin: [m].
        out: result [m], shape (n, levels): √(2U), and outside the negative distance of the body, at
            least -margin.
        summary: result, shape (n, 7): the greatest z of the body, the greatest distance, the least
            half thickness between opposite walls and z there [m], the least and the greatest
            winding number, and z of a winding number other than 0 and 1.
        crossings: workspace, shape (m, 2).
        tree: the mesh.
    """
    p = local_array((3,))
    y = local_array((3,))
    offset = local_array((3,))
    atoms = local_array((5, 4))
    near = 0
    for i in range(columns.shape[0]):
        p[0] = columns[i, 0]
        p[1] = columns[i, 1]
        total = tree_crossings(p[0], p[1], crossings, tree)
        summarize_column(min(total, crossings.shape[0]), crossings, tolerance, i, summary)
        if total > crossings.shape[0]:
            summary[i, GREATEST_WINDING] = np.inf
        count = min(total, crossings.shape[0])
        spans = (tolerance, law.max_depth)
        note_thin_spans(p, count, crossings, spans, i, summary, tree)
        for m in range(out.shape[1]):
            p[2] = z[m]
            if winding_above(p[2], total, crossings) <= 0:
                square, _x, _y, _z, triangle = tree_closest(
                    p[0], p[1], p[2], margin * margin, near, tree
                )
                out[i, m] = -math.sqrt(square) if triangle >= 0 else -margin
                continue
            energy, count, near, distance = split_in_mesh(p, near, law, y, atoms, offset, tree)
            energy, _slope = limited_potential(energy, law.max_depth)
            out[i, m] = math.sqrt(max(2.0 * energy, 0.0))
            summary[i, DEEPEST] = max(summary[i, DEEPEST], distance)
            if count > 1:
                note_thin_part(atoms, count, y, i, summary)


def point_batch(
    points: FloatArray, law: BodyLaw, out: FloatArray, crossings: FloatArray, tree: TriangleTree
) -> None:
    """Write law H at points (n, 3) [m].

    Args:
        points: [m].
        law: the law.
        out: result, shape (n, 5): U [m²], the force over the stiffness [m], and the depth, the
            distance of the closest point [m]; zeros outside.
        crossings: workspace, shape (m, 2).
        tree: the mesh.
    """
    p = local_array((3,))
    y = local_array((3,))
    offset = local_array((3,))
    atoms = local_array((5, 4))
    near = 0
    for i in range(points.shape[0]):
        for d in range(3):
            p[d] = points[i, d]
        for d in range(5):
            out[i, d] = 0.0
        total = tree_crossings(p[0], p[1], crossings, tree)
        if winding_above(p[2], total, crossings) <= 0:
            continue
        energy, count, near, out[i, 4] = split_in_mesh(p, near, law, y, atoms, offset, tree)
        out[i, 0], slope = limited_potential(energy, law.max_depth)
        for d in range(3):
            out[i, 1 + d] = slope * offset[d] if count > 0 else 0.0
