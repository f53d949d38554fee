"""Closest points of a spline from those of a lattice of nodes, for searches without a proof.

A lattice holds heights of the surface at nodes. For each place, every few nodes and levels, it also
holds the node of the surface nearest to it: the lower envelope of the parabolas
|X - x|² + max(h - z, 0)², first along the rows and then along the columns, in linear time [1]. The
closest point of a probe is then found by descents from the best of the nodes stored around it, and
from others apart from it, of which a thorough search tries more. It is always a point of the
surface, and mostly the closest one.

[1] P. F. Felzenszwalb, D. P. Huttenlocher. Distance transforms of sampled functions. Theory of
Computing 8 (2012), 415-428.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.distance_bounds import descend_within_budget
from asperity.contacts.sampler_interface import sample_height
from asperity.core.compiled import FloatArray, Kernels, local_array

KERNELS = Kernels(loops=("nearest_nodes",), provides=("closest_point_within_budget",))

# Places on either side of a probe above the surface that may be near its closest point.
OUTSIDE_PLACES = 3
# Distance of the starts of descents [nodes] from earlier starts and from what these led to.
CLEAR = 2.0
MOST_DESCENTS = 8
# How much farther away than the first the starts of a thorough search may be [nodes].
THOROUGH_SLACK = 2.0


class LatticeArguments(NamedTuple):
    """Record of a spline with a lattice: that of the spline and the following.

    Attributes:
        c: see :class:`~asperity.textures.spline.bspline_kernels.SplineArguments`, as the next ones.
        heights: of the surface at the nodes [m], (rows, columns).
        nearest: number of the node nearest to a place, (levels, rows, columns of places).
        first_x: the first node [m].
        first_y: likewise.
        z: of the levels, rising [m].
        stride: the places are every so many nodes along each axis.
        side_x: distance of the nodes [m].
        side_y: likewise; that of a profile is positive, too.
        beyond: how many places beyond those around a probe inside are looked at.
        descents: greatest number of descents for such a probe, at most MOST_DESCENTS.
        slack: how much farther away than the first the other starts may be [nodes].
    """

    c: FloatArray
    ix: float
    iy: float
    x0: float
    y0: float
    periodic: bool
    boxes: NDArray[np.float32]
    levels: NDArray[np.int64]
    heights: FloatArray
    nearest: NDArray[np.int32]
    first_x: float
    first_y: float
    z: FloatArray
    stride: int
    side_x: float
    side_y: float
    beyond: int = 0
    descents: int = 3
    slack: float = 1.0


def nearest_nodes(
    heights: FloatArray,
    z: float,
    stride: int,
    side_x: float,
    side_y: float,
    squares: FloatArray,
    first: NDArray[np.int32],
    vertices: NDArray[np.int32],
    borders: FloatArray,
    nearest: NDArray[np.int32],
) -> None:
    """Write the number of the node of the surface nearest to each of the places at a level.

    Args:
        heights: at the nodes [m], (rows, columns).
        z: the level [m].
        stride: the places are every so many nodes along each axis.
        side_x: distance of the nodes [m].
        side_y: likewise.
        squares: workspace, one more row than the heights, as many columns as the longer axis.
        first: workspace, rows of the heights and columns of the result.
        vertices: workspace, as long as the longer axis.
        borders: workspace, one longer.
        nearest: result, rows and columns of places.
    """
    rows, columns = heights.shape
    for i in range(rows):
        for j in range(columns):
            squares[rows, j] = max(heights[i, j] - z, 0.0) ** 2
        lower_envelope(squares, rows, columns, side_x, vertices, borders)
        k = 0
        for place in range(nearest.shape[1]):
            j = place * stride
            while borders[k + 1] < j * side_x:
                k += 1
            vertex = vertices[k]
            squares[i, place] = squares[rows, vertex] + ((j - vertex) * side_x) ** 2
            first[i, place] = vertex
    for place in range(nearest.shape[1]):
        for i in range(rows):
            squares[rows, i] = squares[i, place]
        lower_envelope(squares, rows, rows, side_y, vertices, borders)
        k = 0
        for row in range(nearest.shape[0]):
            while borders[k + 1] < row * stride * side_y:
                k += 1
            vertex = vertices[k]
            nearest[row, place] = vertex * columns + first[vertex, place]


def lower_envelope(
    squares: FloatArray,
    row: int,
    count: int,
    side: float,
    vertices: NDArray[np.int32],
    borders: FloatArray,
) -> None:
    """Write the parabolas of the lower envelope of (x - i side)² + squares[row, i].

    ``vertices`` are those of the parabolas, from left to right; each is the lowest one between its
    own entry of ``borders`` [m] and the next.
    """
    k = 0
    vertices[0] = 0
    borders[0] = -np.inf
    borders[1] = np.inf
    for i in range(1, count):
        value = squares[row, i] + (i * side) ** 2
        border = 0.0
        while True:
            vertex = vertices[k]
            before = squares[row, vertex] + (vertex * side) ** 2
            border = (value - before) / (2.0 * side * (i - vertex))
            if border > borders[k]:
                break
            k -= 1
        k += 1
        vertices[k] = i
        borders[k] = border
        borders[k + 1] = np.inf


def closest_point_within_budget(
    x: float,
    y: float,
    z: float,
    start_x: float,
    start_y: float,
    budget: float,
    texture: LatticeArguments,
) -> tuple[float, float, float, float, float, float, float]:
    """Return a close point of the surface as if it were the closest, with the error bound 0."""
    height = sample_height(start_x, start_y, texture)
    square = (start_x - x) ** 2 + (start_y - y) ** 2 + (height - z) ** 2
    if z >= sample_height(x, y, texture):
        start_x, start_y = nearest_outside(x, y, z, start_x, start_y, square, texture)
        best, left = descend_within_budget(x, y, z, start_x, start_y, budget, texture)
        return best[0], best[1], best[3], best[4], best[5], 0.0, budget - left
    tried = local_array((16, 2))
    left = budget
    best = (start_x, start_y, np.inf, height, 0.0, 0.0)
    limit = square
    for descent in range(texture.descents):
        count = 2 * descent
        from_x, from_y, other = nearest_stored(
            x, y, z, start_x, start_y, limit, tried, count, texture
        )
        if other >= limit and descent > 0:
            break
        found, left = descend_within_budget(x, y, z, from_x, from_y, left, texture)
        tried[count, 0] = from_x
        tried[count, 1] = from_y
        tried[count + 1, 0] = found[0]
        tried[count + 1, 1] = found[1]
        if found[2] < best[2]:
            best = found
        if descent == 0:
            # A point in another basin may be closer if its node is not much farther.
            limit = (math.sqrt(other) + texture.slack * max(texture.side_x, texture.side_y)) ** 2
    return best[0], best[1], best[3], best[4], best[5], 0.0, budget - left


def nearest_stored(
    x: float,
    y: float,
    z: float,
    best_x: float,
    best_y: float,
    square: float,
    tried: FloatArray,
    count: int,
    texture: LatticeArguments,
) -> tuple[float, float, float]:
    """Return the best of the nodes stored around a probe, if closer than a squared distance.

    Nodes near the first rows of ``tried`` do not count.
    """
    rows, columns = texture.heights.shape
    clear = (CLEAR * max(texture.side_x, texture.side_y)) ** 2
    places_y, places_x = texture.nearest.shape[1:]
    j = node_below((x - texture.first_x) / (texture.side_x * texture.stride), places_x)
    i = node_below((y - texture.first_y) / (texture.side_y * texture.stride), places_y)
    m = level_below(z, texture.z)
    beyond = texture.beyond
    for level in range(max(m - beyond, 0), min(m + 2 + beyond, texture.nearest.shape[0])):
        for row in range(max(i - beyond, 0), min(i + 2 + beyond, places_y)):
            for column in range(max(j - beyond, 0), min(j + 2 + beyond, places_x)):
                node = texture.nearest[level, row, column]
                node_row = node // columns
                node_column = node - node_row * columns
                px = texture.first_x + node_column * texture.side_x
                py = texture.first_y + node_row * texture.side_y if rows > 1 else y
                pz = max(texture.heights[node_row, node_column], z)
                distance = (px - x) ** 2 + (py - y) ** 2 + (pz - z) ** 2
                if distance < square:
                    is_new = True
                    for k in range(count):
                        beside = (px - tried[k, 0]) ** 2 + (py - tried[k, 1]) ** 2
                        is_new &= beside >= clear
                    if is_new:
                        best_x = px
                        best_y = py
                        square = distance
    return best_x, best_y, square


def nearest_outside(
    x: float,
    y: float,
    z: float,
    best_x: float,
    best_y: float,
    square: float,
    texture: LatticeArguments,
) -> tuple[float, float]:
    """Return the node of the surface that is closest to a probe above it, if close enough."""
    rows, columns = texture.heights.shape
    j = node_below((x - texture.first_x) / texture.side_x, columns)
    i = node_below((y - texture.first_y) / texture.side_y, rows)
    reach = OUTSIDE_PLACES * texture.stride
    for row in range(max(i - reach, 0), min(i + reach + 2, rows)):
        for column in range(max(j - reach, 0), min(j + reach + 2, columns)):
            px = texture.first_x + column * texture.side_x
            py = texture.first_y + row * texture.side_y if rows > 1 else y
            distance = (px - x) ** 2 + (py - y) ** 2 + (texture.heights[row, column] - z) ** 2
            if distance < square:
                best_x = px
                best_y = py
                square = distance
    return best_x, best_y


def node_below(position: float, count: int) -> int:
    """Return the last node before a position, in nodes, that has another one after it."""
    return min(max(int(position), 0), max(count - 2, 0))


def level_below(z: float, levels: FloatArray) -> int:
    """Return the last of rising levels below z [m], or the first one."""
    low = 0
    high = len(levels)
    while high - low > 1:
        middle = (low + high) // 2
        if z >= levels[middle]:
            low = middle
        else:
            high = middle
    return low
