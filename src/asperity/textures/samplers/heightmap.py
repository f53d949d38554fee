"""h = Σ c_ij β(x/p_x - j) β(y/p_y - i), a bicubic B-spline."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.textures.samplers.spline import (
    Four,
    cell_at,
    dot4,
    weights,
    weights_first,
    weights_second,
)

KERNELS = Kernels(
    provides=("cells_of", "curvature", "height", "slope"),
    requires=("cell_at", "dot4", "weights", "weights_first", "weights_second"),
)


class HeightMapArguments(NamedTuple):
    """What the functions below receive of a map.

    Attributes:
        c: coefficients [m], with one extra row and column before the first cell and two after the
            last.
        ix: nodes per metre along x.
        iy: along y.
        x0: the first node [m].
        y0: likewise.
        periodic: whether the map repeats.
        nodes: bounds of the boxes of the pyramid, see :mod:`asperity.textures.pyramid`.
        levels: where its levels begin in them.
    """

    c: FloatArray
    ix: float
    iy: float
    x0: float
    y0: float
    periodic: bool
    nodes: NDArray[np.float32]
    levels: NDArray[np.int64]


def cells_of(c: FloatArray) -> tuple[int, int]:
    """Return the number of cells along x and y."""
    return c.shape[1] - 3, c.shape[0] - 3


def row_of(c: FloatArray, i: int, j: int, w: Four) -> float:
    """Return the weighted sum of four coefficients of row i from column j on."""
    return dot4(w, (c[i, j], c[i, j + 1], c[i, j + 2], c[i, j + 3]))


def rows_of(c: FloatArray, i: int, j: int, w: Four) -> Four:
    """Return the weighted sums of four rows from i on."""
    return (
        row_of(c, i, j, w), row_of(c, i + 1, j, w), row_of(c, i + 2, j, w), row_of(c, i + 3, j, w),
    )  # fmt: skip


def height(x: float, y: float, texture: HeightMapArguments) -> float:
    """Return h [m]."""
    nx, ny = cells_of(texture.c)
    j, t, _sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, _sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    return dot4(weights(r), rows_of(texture.c, i, j, weights(t)))


def slope(x: float, y: float, texture: HeightMapArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = rows_of(texture.c, i, j, weights(t))
    w = weights(r)
    hx = sx * texture.ix * dot4(w, rows_of(texture.c, i, j, weights_first(t)))
    return dot4(w, rows), hx, sy * texture.iy * dot4(weights_first(r), rows)


def curvature(
    x: float, y: float, texture: HeightMapArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = cell_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = cell_at(y, texture.y0, texture.iy, ny, texture.periodic)
    rows = rows_of(texture.c, i, j, weights(t))
    first = rows_of(texture.c, i, j, weights_first(t))
    second = rows_of(texture.c, i, j, weights_second(t))
    w = weights(r)
    d = weights_first(r)
    return (
        dot4(w, rows),
        sx * texture.ix * dot4(w, first),
        sy * texture.iy * dot4(d, rows),
        texture.ix * texture.ix * dot4(w, second),
        sx * sy * texture.ix * texture.iy * dot4(d, first),
        texture.iy * texture.iy * dot4(weights_second(r), rows),
    )
