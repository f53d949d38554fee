"""Closest point on a triangle mesh, and crossings of vertical lines with it.

The triangles are sorted along a space-filling curve, in leaves of four. The bounding boxes form a
complete binary tree: the children of node i are 2i + 1 and 2i + 2. A search that starts with the
distance to a triangle nearby prunes most of the tree, and several threads can search at once.

The crossings of a vertical line are counted with the winding number of each projected triangle.
Both triangles at an edge evaluate it with the same numbers, so the winding numbers of a closed mesh
add up to zero on every line, also through its edges and vertices.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.compiled import EVERY_FUNCTION, Kernels, local_array

KERNELS = Kernels(provides=EVERY_FUNCTION, iterates=True)

LEAF_SIZE = 4
# Squared sine of the angle of two sides below which a triangle is searched as its sides.
_NEEDLE = 1e-20

Vector = tuple[float, float, float]
FourNumbers = tuple[float, float, float, float]
FoundPoint = tuple[float, float, float, float, int]


class TriangleTree(NamedTuple):
    """Record of a mesh.

    Attributes:
        corners: x, y, z of the three corners of each triangle [m], shape (n, 9).
        boxes: least and greatest x, y, z of each node [m], shape (2 leaves - 1, 6).
        leaves: number of leaves, a power of two.
    """

    corners: FloatArray
    boxes: NDArray[np.float32]
    leaves: int


def corner(t: int, start: int, tree: TriangleTree) -> Vector:
    """Return the corner of a triangle at a column of its record."""
    return tree.corners[t, start], tree.corners[t, start + 1], tree.corners[t, start + 2]


def side_vector(t: int, start: int, end: int, tree: TriangleTree) -> Vector:
    """Return the vector between two corners of a triangle."""
    ax, ay, az = corner(t, start, tree)
    bx, by, bz = corner(t, end, tree)
    return bx - ax, by - ay, bz - az


def box_distance(x: float, y: float, z: float, node: int, tree: TriangleTree) -> float:
    """Return the squared distance [m²] of a point from the box of a node."""
    dx = max(tree.boxes[node, 0] - x, x - tree.boxes[node, 3], 0.0)
    dy = max(tree.boxes[node, 1] - y, y - tree.boxes[node, 4], 0.0)
    dz = max(tree.boxes[node, 2] - z, z - tree.boxes[node, 5], 0.0)
    return float(dx * dx + dy * dy + dz * dz)


def closest_on_side(
    x: float, y: float, z: float, t: int, start: int, end: int, tree: TriangleTree
) -> FourNumbers:
    """Return the squared distance of a side of a triangle, and the closest point on it."""
    ax, ay, az = corner(t, start, tree)
    ux, uy, uz = side_vector(t, start, end, tree)
    square = ux * ux + uy * uy + uz * uz
    along = ux * (x - ax) + uy * (y - ay) + uz * (z - az)
    s = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
    px = ax + s * ux
    py = ay + s * uy
    pz = az + s * uz
    return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, px, py, pz


def closest_on_triangle(x: float, y: float, z: float, t: int, tree: TriangleTree) -> FourNumbers:
    """Return the squared distance [m²] of a triangle, and the closest point on it [m]."""
    ax, ay, az = corner(t, 0, tree)
    ux, uy, uz = side_vector(t, 0, 3, tree)
    vx, vy, vz = side_vector(t, 0, 6, tree)
    wx = x - ax
    wy = y - ay
    wz = z - az
    uu = ux * ux + uy * uy + uz * uz
    uv = ux * vx + uy * vy + uz * vz
    vv = vx * vx + vy * vy + vz * vz
    uw = ux * wx + uy * wy + uz * wz
    vw = vx * wx + vy * wy + vz * wz
    area = uu * vv - uv * uv
    b = vv * uw - uv * vw
    c = uu * vw - uv * uw
    if area > _NEEDLE * uu * vv and b >= 0.0 and c >= 0.0 and b + c <= area:
        b /= area
        c /= area
        px = ax + b * ux + c * vx
        py = ay + b * uy + c * vy
        pz = az + b * uz + c * vz
        return (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2, px, py, pz
    best = closest_on_side(x, y, z, t, 0, 3, tree)
    other = closest_on_side(x, y, z, t, 3, 6, tree)
    if other[0] < best[0]:
        best = other
    other = closest_on_side(x, y, z, t, 6, 0, tree)
    return other if other[0] < best[0] else best


def tree_closest(
    x: float, y: float, z: float, limit: float, near: int, tree: TriangleTree
) -> FoundPoint:
    """Return the squared distance [m²] of the mesh, the closest point [m] and its triangle.

    Args:
        x: of the point [m].
        y: likewise.
        z: likewise.
        limit: squared distance [m²] beyond which nothing is searched.
        near: a triangle that may be close.
        tree: the mesh.

    Returns:
        The limit, the point itself and -1 if nothing is closer than the limit.
    """
    square_bound, cx, cy, cz = closest_on_triangle(x, y, z, near, tree)
    triangle = near
    if square_bound >= limit:
        square_bound = limit
        cx = x
        cy = y
        cz = z
        triangle = -1
    stack = local_array((64, 2))
    stack[0, 0] = 0.0
    stack[0, 1] = box_distance(x, y, z, 0, tree)
    size = 1
    while size > 0:
        size -= 1
        if stack[size, 1] >= square_bound:
            continue
        node = int(stack[size, 0])
        if node >= tree.leaves - 1:
            first = (node - tree.leaves + 1) * LEAF_SIZE
            for t in range(first, min(first + LEAF_SIZE, tree.corners.shape[0])):
                square, px, py, pz = closest_on_triangle(x, y, z, t, tree)
                if square < square_bound:
                    square_bound = square
                    cx = px
                    cy = py
                    cz = pz
                    triangle = t
            continue
        left = box_distance(x, y, z, 2 * node + 1, tree)
        right = box_distance(x, y, z, 2 * node + 2, tree)
        swap = 1 if left < right else 0  # the closer one is searched first
        stack[size + swap, 0] = 2 * node + 1
        stack[size + swap, 1] = left
        stack[size + 1 - swap, 0] = 2 * node + 2
        stack[size + 1 - swap, 1] = right
        size += 2
    return square_bound, cx, cy, cz, triangle


def side_crossing(x: float, y: float, t: int, start: int, end: int, tree: TriangleTree) -> int:
    """Return 1 or -1 where a projected side crosses the ray from (x, y) along +x, else 0."""
    ax, ay, _az = corner(t, start, tree)
    bx, by, _bz = corner(t, end, tree)
    if (ay <= y) == (by <= y):
        return 0
    sign = 1
    if ay > by:  # the same numbers in the same order from either triangle
        ax, ay, bx, by = bx, by, ax, ay
        sign = -1
    return sign if (bx - ax) * (y - ay) > (by - ay) * (x - ax) else 0


def triangle_crossing(x: float, y: float, t: int, tree: TriangleTree) -> tuple[int, float]:
    """Return the winding number of a projected triangle around (x, y), and z there [m]."""
    turns = side_crossing(x, y, t, 0, 3, tree) + side_crossing(x, y, t, 3, 6, tree)
    turns += side_crossing(x, y, t, 6, 0, tree)
    if turns == 0:
        return 0, 0.0
    ax, ay, az = corner(t, 0, tree)
    ux, uy, uz = side_vector(t, 0, 3, tree)
    vx, vy, vz = side_vector(t, 0, 6, tree)
    area = ux * vy - uy * vx
    if area == 0.0:
        return turns, az
    b = ((x - ax) * vy - (y - ay) * vx) / area
    c = (ux * (y - ay) - uy * (x - ax)) / area
    low = min(az, az + uz, az + vz)
    return turns, min(max(az + b * uz + c * vz, low), max(az, az + uz, az + vz))


def insert_crossing(z: float, turns: int, count: int, out: FloatArray) -> None:
    """Insert a crossing into rows of z and winding number, sorted from the greatest z down."""
    place = count
    while place > 0 and out[place - 1, 0] < z:
        out[place, 0] = out[place - 1, 0]
        out[place, 1] = out[place - 1, 1]
        place -= 1
    out[place, 0] = z
    out[place, 1] = turns


def tree_crossings(x: float, y: float, out: FloatArray, tree: TriangleTree) -> int:
    """Write the crossings of a vertical line: z [m] and winding number, the greatest z first.

    Args:
        x: of the line [m].
        y: likewise.
        out: result, rows of two numbers.
        tree: the mesh.

    Returns:
        Their number; no more than ``out`` holds are written.
    """
    stack = local_array((64,))
    stack[0] = 0.0
    size = 1
    count = 0
    while size > 0:
        size -= 1
        node = int(stack[size])
        box = tree.boxes
        if x < box[node, 0] or x > box[node, 3] or y < box[node, 1] or y > box[node, 4]:
            continue
        if node < tree.leaves - 1:
            stack[size] = 2 * node + 1
            stack[size + 1] = 2 * node + 2
            size += 2
            continue
        first = (node - tree.leaves + 1) * LEAF_SIZE
        for t in range(first, min(first + LEAF_SIZE, tree.corners.shape[0])):
            turns, z = triangle_crossing(x, y, t, tree)
            if turns != 0:
                if count < out.shape[0]:
                    insert_crossing(z, turns, count, out)
                count += 1
    return count


def winding_above(z: float, count: int, crossings: FloatArray) -> int:
    """Return the winding number at height z of a vertical line with its crossings."""
    total = 0
    for k in range(min(count, crossings.shape[0])):
        if crossings[k, 0] <= z:
            break
        total += int(crossings[k, 1])
    return total


def opposite_walls(atoms: FloatArray, count: int, y: FloatArray) -> float:
    """Return the least cosine of the directions from y to two of the atoms."""
    cosine = 1.0
    for i in range(count):
        for j in range(i):
            dot = ii = jj = 0.0
            for d in range(3):
                a = atoms[i, d] - y[d]
                b = atoms[j, d] - y[d]
                dot += a * b
                ii += a * a
                jj += b * b
            cosine = min(cosine, dot / math.sqrt(max(ii * jj, 1e-300)))
    return cosine
