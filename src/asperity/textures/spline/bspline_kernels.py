"""Cubic B-spline weights, mirrored borders and pyramid boxes, shared by profiles and maps."""

import math

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import EVERY_FUNCTION, SQRT_EPS, Kernels

KERNELS = Kernels(provides=EVERY_FUNCTION)


SIXTH = 1.0 / 6.0

Vector4 = tuple[float, float, float, float]


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


def tile_transform(
    tile: int, cells: int, per_metre: float, start: float, periodic: bool
) -> tuple[float, float]:
    """Return t, s such that x -> t x + s maps a copy of the cells onto the cells themselves."""
    length = cells / per_metre
    if periodic or tile % 2 == 0:
        return 1.0, -tile * length
    return -1.0, 2.0 * start + (tile + 1) * length


def box_bounds(boxes: NDArray[np.float32], k: int) -> Vector4:
    """Return the least and greatest height and the bounds K, T of box k of the pyramid."""
    return float(boxes[k, 0]), float(boxes[k, 1]), float(boxes[k, 2]), float(boxes[k, 3])


def lateral_reach(z: float, best: float, boxes: NDArray[np.float32]) -> float:
    """Return the lateral distance beyond which no surface point is closer than the best one [m].

    It follows from the extremes of the whole surface, which are in the last box.
    """
    low, high, _hessian, _third = box_bounds(boxes, boxes.shape[0] - 1)
    gap = max(low - z, z - high, 0.0)
    return math.sqrt(max(best - gap * gap, 0.0))


def max_copy_distance(length: float, periodic: bool) -> float:
    """Return the greatest distance of the closest copy of a point along a tiled axis [m].

    Mirrored copies may all be one length away; the factor allows for rounding.
    """
    return length * (0.5 if periodic else 1.0) * (1.0 + 0.07 * SQRT_EPS)


def is_taylor_conclusive(
    z: float,
    low: float,
    high: float,
    hessian_bound: float,
    third_derivative_bound: float,
    side: float,
    per_metre: float,
) -> bool:
    """Return whether Taylor's formula at its centre may decide a box of several cells.

    That is, whether Q of ``plane_search`` changes by less than 1 there on a surface that is not
    very steep.
    """
    gap = max(abs(low - z), abs(high - z)) * per_metre
    return (gap * third_derivative_bound + 3.0 * hessian_bound) * side < 1.0
