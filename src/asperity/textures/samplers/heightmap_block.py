"""A map at a block of points: the coefficients of all points first, then sums of many at a time.

The sums are those of :mod:`asperity.textures.samplers.heightmap`, in the same order.
"""

from typing import Any, NamedTuple

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.textures.samplers.heightmap import HeightMapArguments, cells_of
from asperity.textures.samplers.spline import Four, dot4, weights, weights_first, weights_second

KERNELS = Kernels(
    provides=("block_point", "curvature", "height", "sample_block", "slope"),
    requires=("cells_of", "dot4", "weights", "weights_first", "weights_second"),
)

# Rows of a block: sixteen coefficients, then of each axis place in the cell, sign and cell.
ALONG = 16
ACROSS = 19


class MapPoint(NamedTuple):
    """What the functions below receive: a point of a block, in place of the map.

    Attributes:
        known: the block.
        k: which point.
        ix: nodes per metre along x.
        iy: along y.
    """

    known: FloatArray
    k: int
    ix: float
    iy: float


def block_point(known: FloatArray, k: int, texture: HeightMapArguments) -> MapPoint:
    """Return what is known of a point of a block."""
    return MapPoint(known, k, texture.ix, texture.iy)


def sample_block(
    where: FloatArray, count: int, known: FloatArray, texture: HeightMapArguments
) -> None:
    """Write what height, slope and curvature at the points take from the map."""
    nx, ny = cells_of(texture.c)
    place_axis(where, 0, count, known, ALONG, texture.x0, texture.ix, nx, texture.periodic)
    place_axis(where, 1, count, known, ACROSS, texture.y0, texture.iy, ny, texture.periodic)
    c = texture.c
    for k in range(count):
        # Numbers without a sign are not looked at for being below zero.
        j: Any = np.uint64(known[ALONG + 2, k])
        i: Any = np.uint64(known[ACROSS + 2, k])
        if j > np.uint64(nx):
            break  # never; a loop that may end is not made one of gathers, which are slow
        for row in range(4):
            at: Any = i + np.uint64(row)
            known[4 * row, k] = c[at, j]
            known[4 * row + 1, k] = c[at, j + np.uint64(1)]
            known[4 * row + 2, k] = c[at, j + np.uint64(2)]
            known[4 * row + 3, k] = c[at, j + np.uint64(3)]


def place_axis(
    where: FloatArray, axis: int, count: int, known: FloatArray, row: int, start: float,
    per_metre: float, cells: int, periodic: bool,
) -> None:  # fmt: skip
    """Write places in cells, signs of derivatives and cells; see ``cell_at``, without branches."""
    length = float(cells) if periodic else 2.0 * cells
    turns = 1.0 / length
    for k in range(count):
        u = (where[axis, k] - start) * per_metre
        u = u - length * np.floor(u * turns)
        back = u > cells
        u = length - u if back else u
        u = max(u, 0.0)
        cell = min(np.floor(u), cells - 1.0)
        known[row, k] = u - cell
        known[row + 1, k] = -1.0 if back else 1.0
        known[row + 2, k] = cell


def rows_at(at: MapPoint, w: Four) -> Four:
    """Return the weighted sums of four rows of coefficients."""
    c = at.known
    k = at.k
    return (
        dot4(w, (c[0, k], c[1, k], c[2, k], c[3, k])),
        dot4(w, (c[4, k], c[5, k], c[6, k], c[7, k])),
        dot4(w, (c[8, k], c[9, k], c[10, k], c[11, k])),
        dot4(w, (c[12, k], c[13, k], c[14, k], c[15, k])),
    )


def height(x: float, y: float, texture: MapPoint) -> float:
    """Return h [m]."""
    t = texture.known[ALONG, texture.k]
    return dot4(weights(texture.known[ACROSS, texture.k]), rows_at(texture, weights(t)))


def slope(x: float, y: float, texture: MapPoint) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    t = texture.known[ALONG, texture.k]
    r = texture.known[ACROSS, texture.k]
    sx = texture.known[ALONG + 1, texture.k]
    sy = texture.known[ACROSS + 1, texture.k]
    rows = rows_at(texture, weights(t))
    w = weights(r)
    hx = sx * texture.ix * dot4(w, rows_at(texture, weights_first(t)))
    return dot4(w, rows), hx, sy * texture.iy * dot4(weights_first(r), rows)


def curvature(
    x: float, y: float, texture: MapPoint
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    t = texture.known[ALONG, texture.k]
    r = texture.known[ACROSS, texture.k]
    sx = texture.known[ALONG + 1, texture.k]
    sy = texture.known[ACROSS + 1, texture.k]
    ix = texture.ix
    iy = texture.iy
    rows = rows_at(texture, weights(t))
    first = rows_at(texture, weights_first(t))
    second = rows_at(texture, weights_second(t))
    w = weights(r)
    d = weights_first(r)
    return (
        dot4(w, rows),
        sx * ix * dot4(w, first),
        sy * iy * dot4(d, rows),
        ix * ix * dot4(w, second),
        sx * sy * ix * iy * dot4(d, first),
        iy * iy * dot4(weights_second(r), rows),
    )
