"""A map for blocks of points: without branches, and where it is in the coefficients one number.

Then the compiler takes many points at a time and gathers their coefficients. Products and sums are
rounded once where the processor can; all else is as in :mod:`asperity.textures.samplers.heightmap`.
"""

from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, multiply_add, number_at
from asperity.textures.samplers.heightmap import HeightMapArguments, cells_of
from asperity.textures.samplers.spline import Four, weights, weights_first, weights_second

KERNELS = Kernels(
    provides=("curvature", "height", "slope"),
    requires=("cells_of", "weights", "weights_first", "weights_second"),
    in_blocks=True,
)

Sixteen = tuple[Four, Four, Four, Four]


def place_at(
    x: float, start: float, per_metre: float, cells: int, periodic: bool
) -> tuple[float, float, float]:
    """Return the cell of x, the place in it and the sign of derivatives; see ``cell_at``."""
    length = float(cells) if periodic else 2.0 * cells
    u = (x - start) * per_metre
    u = multiply_add(-length, np.floor(u * (1.0 / length)), u)
    back = u > cells
    u = length - u if back else u
    u = u if u > 0.0 else 0.0  # what is no number, too: x may be beyond all cells
    cell = min(np.floor(u), cells - 1.0)
    return cell, u - cell, -1.0 if back else 1.0


def sum4(a: Four, b: Four) -> float:
    """Return the sum of four products."""
    first = multiply_add(a[1], b[1], a[0] * b[0])
    return multiply_add(a[3], b[3], multiply_add(a[2], b[2], first))


def four_at(c: FloatArray, at: Any) -> Four:
    """Return four coefficients side by side."""
    # Numbers without a sign are not looked at for being counted from the end.
    one = number_at(c, at + np.uint64(1))
    return number_at(c, at), one, number_at(c, at + np.uint64(2)), number_at(c, at + np.uint64(3))


def around(c: FloatArray, i: float, j: float) -> Sixteen:
    """Return the coefficients of cell j of row i."""
    row = np.uint64(c.shape[1])
    at = np.uint64(np.int64(multiply_add(i, c.shape[1], j)))
    return (
        four_at(c, at),
        four_at(c, at + row),
        four_at(c, at + (row + row)),
        four_at(c, at + (row + row + row)),
    )


def rows_at(c: Sixteen, w: Four) -> Four:
    """Return the weighted sums of four rows."""
    return sum4(w, c[0]), sum4(w, c[1]), sum4(w, c[2]), sum4(w, c[3])


def height(x: float, y: float, texture: HeightMapArguments) -> float:
    """Return h [m]."""
    nx, ny = cells_of(texture.c)
    j, t, _sx = place_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, _sy = place_at(y, texture.y0, texture.iy, ny, texture.periodic)
    return sum4(weights(r), rows_at(around(texture.c, i, j), weights(t)))


def slope(x: float, y: float, texture: HeightMapArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = place_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = place_at(y, texture.y0, texture.iy, ny, texture.periodic)
    c = around(texture.c, i, j)
    rows = rows_at(c, weights(t))
    w = weights(r)
    hx = sx * texture.ix * sum4(w, rows_at(c, weights_first(t)))
    return sum4(w, rows), hx, sy * texture.iy * sum4(weights_first(r), rows)


def curvature(
    x: float, y: float, texture: HeightMapArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    nx, ny = cells_of(texture.c)
    j, t, sx = place_at(x, texture.x0, texture.ix, nx, texture.periodic)
    i, r, sy = place_at(y, texture.y0, texture.iy, ny, texture.periodic)
    c = around(texture.c, i, j)
    rows = rows_at(c, weights(t))
    first = rows_at(c, weights_first(t))
    w = weights(r)
    d = weights_first(r)
    return (
        sum4(w, rows),
        sx * texture.ix * sum4(w, first),
        sy * texture.iy * sum4(d, rows),
        texture.ix * texture.ix * sum4(w, rows_at(c, weights_second(t))),
        sx * sy * texture.ix * texture.iy * sum4(d, first),
        texture.iy * texture.iy * sum4(weights_second(r), rows),
    )
