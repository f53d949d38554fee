"""Cubic B-spline weights, border folding, and boxes of the pyramid, shared by both splines."""

import math

import numpy as np
from numpy.typing import NDArray

from asperity.compiled import ROOT_EPS, Kernels

KERNELS = Kernels(
    provides=(
        "box_bounds", "cell_at", "dot4", "foreseeable", "nearest_copy", "reach_of",
        "tile_frame", "weights", "weights_first", "weights_second",
    )
)  # fmt: skip


SIXTH = 1.0 / 6.0

Four = tuple[float, float, float, float]


def cell_at(
    x: float, start: float, per_metre: float, cells: int, periodic: bool
) -> tuple[int, float, float]:
    """Return the index of the cell of x, the place in it, in [0, 1], and the sign of derivatives.

    Periodic maps repeat; finite ones are mirrored at their border nodes.
    """
    u = (x - start) * per_metre
    sign = 1.0
    if periodic and not 0.0 <= u <= cells:
        u = min(u - cells * math.floor(u / cells), float(cells))
    elif not 0.0 <= u <= cells:
        u -= 2.0 * cells * math.floor(u / (2.0 * cells))
        if u > cells:
            u = max(2.0 * cells - u, 0.0)
            sign = -1.0
    i = min(int(u), cells - 1)
    return i, u - i, sign


def dot4(a: Four, b: Four) -> float:
    """Return the sum of four products."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]


def weights(t: float) -> Four:
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


def weights_first(t: float) -> Four:
    """Return the derivatives of the weights by t."""
    r = 1.0 - t
    return -0.5 * r * r, t * (1.5 * t - 2.0), -r * (1.5 * r - 2.0), 0.5 * t * t


def weights_second(t: float) -> Four:
    """Return the second derivatives of the weights by t."""
    r = 1.0 - t
    return r, 3.0 * t - 2.0, 3.0 * r - 2.0, t


def tile_frame(
    tile: int, cells: int, per_metre: float, start: float, periodic: bool
) -> tuple[float, float]:
    """Return t, s with which x -> t x + s moves a copy of the cells onto the cells themselves."""
    length = cells / per_metre
    if periodic or tile % 2 == 0:
        return 1.0, -tile * length
    return -1.0, 2.0 * start + (tile + 1) * length


def box_bounds(nodes: NDArray[np.float32], k: int) -> Four:
    """Return the least and greatest height and the bounds K and T of box k of the pyramid."""
    return float(nodes[k, 0]), float(nodes[k, 1]), float(nodes[k, 2]), float(nodes[k, 3])


def reach_of(z: float, best: float, nodes: NDArray[np.float32]) -> float:
    """Return the lateral distance beyond which no surface point is nearer than the best [m].

    From the least and greatest height of all, which the last box knows.
    """
    low, high, _bend, _twist = box_bounds(nodes, nodes.shape[0] - 1)
    gap = max(low - z, z - high, 0.0)
    return math.sqrt(max(best - gap * gap, 0.0))


def nearest_copy(length: float, periodic: bool) -> float:
    """Return how far the nearest copy of a point is at most, along an axis of the tiled plane [m].

    Copies that are mirrored may all lie a length away; the factor leaves room for rounding.
    """
    return length * (0.5 if periodic else 1.0) * (1.0 + 0.07 * ROOT_EPS)


def foreseeable(
    z: float, low: float, high: float, bend: float, twist: float, side: float, per_metre: float
) -> bool:
    """Return whether Taylor's formula at its centre may decide a box of several cells.

    Whether Q (see ``search``) changes by less than 1 there, if the surface is not very steep.
    """
    gap = max(abs(low - z), abs(high - z)) * per_metre
    return (gap * twist + 3.0 * bend) * side < 1.0
