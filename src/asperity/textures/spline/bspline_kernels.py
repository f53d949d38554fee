"""Records of splines, cubic B-spline weights and mirrored borders, shared by profiles and maps."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.sampler_interface import Ball
from asperity.core.compiled import EPS, EVERY_FUNCTION, FloatArray, Kernels

KERNELS = Kernels(provides=EVERY_FUNCTION)


SIXTH = 1.0 / 6.0

Vector4 = tuple[float, float, float, float]


class SplineArguments(NamedTuple):
    """Record of a map passed to the functions below.

    Attributes:
        c: coefficients [m], with one extra row and column before the first cell and two after the
            last.
        ix: nodes per metre along x.
        iy: along y.
        x0: the first node [m].
        y0: likewise.
        periodic: whether the map repeats.
        boxes: bounds of the boxes of the pyramid, see :mod:`asperity.textures.spline.pyramid`.
        levels: index of the first box and numbers of rows and columns of each level.
    """

    c: FloatArray
    ix: float
    iy: float
    x0: float
    y0: float
    periodic: bool
    boxes: NDArray[np.float32]
    levels: NDArray[np.int64]


def cell_counts(texture: SplineArguments) -> tuple[int, int]:
    """Return the number of cells along x and y; a profile has one along y."""
    return texture.c.shape[1] - 3, max(texture.c.shape[0] - 3, 1)


def cell_sides(texture: SplineArguments) -> tuple[float, float]:
    """Return the sides of a cell [m]; that of a profile is 0 along y."""
    return 1.0 / texture.ix, 0.0 if texture.c.shape[0] == 1 else 1.0 / texture.iy


def fold_coordinate(u: float, cells: int, periodic: bool) -> tuple[float, float]:
    """Return the coordinate inside [0, cells], in cells, and the sign of its derivative.

    Periodic maps repeat; finite ones are mirrored at their border nodes. Where rounding leaves
    nothing of a place far away, and for NaN, the coordinate is 0: never outside of a table.
    """
    if 0.0 <= u <= cells:
        return u, 1.0
    sign = 1.0
    length = float(cells) if periodic else 2.0 * cells
    u -= length * math.floor(u / length)
    if u > cells and not periodic:
        u = length - u
        sign = -1.0
    return u if 0.0 <= u <= cells else 0.0, sign


def find_cell(
    x: float, start: float, per_metre: float, cells: int, periodic: bool
) -> tuple[int, float, float]:
    """Return the cell of x, the position in it, in [0, 1], and the sign of derivatives by x."""
    u, sign = fold_coordinate((x - start) * per_metre, cells, periodic)
    i = min(int(u), cells - 1)
    return i, u - i, sign


def fold_cells(
    low: float, high: float, cells: int, periodic: bool
) -> tuple[int, int, float, float]:
    """Return the first and last cell of a range in the map itself, and the sign and shift.

    The coordinate in the map is sign times that of the box, plus the shift. A range across a border
    of copies has all cells and the sign 0, and so has one far away, where cells are below rounding.
    """
    if low >= 0.0 and high <= cells:
        return int(low), max(math.ceil(high) - 1, 0), 1.0, 0.0
    copy = float(math.floor(low / cells))
    if high > (copy + 1.0) * cells or abs(low) * EPS >= 1.0:
        return 0, cells - 1, 0.0, 0.0
    if periodic or copy == 2.0 * math.floor(0.5 * copy):
        shift = -copy * cells
        return int(low + shift), max(math.ceil(high + shift) - 1, 0), 1.0, shift
    shift = (copy + 1.0) * cells
    return int(shift - high), max(math.ceil(shift - low) - 1, 0), -1.0, shift


def unfold_cells(first: int, last: int, sign: float, shift: float) -> tuple[float, float]:
    """Return the range of box coordinates of cells of the map."""
    start = sign * (first - shift)
    end = sign * (last + 1 - shift)
    return min(start, end), max(start, end)


def probe_cells(ball: Ball, texture: SplineArguments) -> tuple[float, float]:
    """Return the box coordinates of the probe."""
    return (ball[0] - texture.x0) * texture.ix, (ball[1] - texture.y0) * texture.iy


def dot4(a: Vector4, b: Vector4) -> float:
    """Return the sum of four products."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


def bspline_weights(t: float) -> Vector4:
    """Return the four cubic B-spline weights at t in [0, 1]."""
    r = 1.0 - t
    tt = t * t
    rr = r * r
    return (
        rr * r * SIXTH,
        (2.0 / 3.0) - tt + 0.5 * tt * t,
        (2.0 / 3.0) - rr + 0.5 * rr * r,
        tt * t * SIXTH,
    )


def bspline_first_weights(t: float) -> Vector4:
    """Return the derivatives of the weights by t."""
    r = 1.0 - t
    return -0.5 * r * r, t * (1.5 * t - 2.0), -r * (1.5 * r - 2.0), 0.5 * t * t


def bspline_second_weights(t: float) -> Vector4:
    """Return the second derivatives of the weights by t."""
    r = 1.0 - t
    return r, 3.0 * t - 2.0, 3.0 * r - 2.0, t
