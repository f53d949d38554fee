"""Cubic B-spline weights and border folding, shared by heightmap and profile."""

import math

# fused from here


def fold(u: float, cells: int, periodic: bool) -> tuple[float, float]:
    """Return the coordinate inside [0, cells] and the sign of its derivative.

    Periodic maps repeat; finite ones are mirrored at their border nodes.
    """
    if 0.0 <= u <= cells:
        return u, 1.0
    if periodic:
        u -= cells * math.floor(u / cells)
        return min(u, float(cells)), 1.0
    u -= 2.0 * cells * math.floor(u / (2.0 * cells))
    if u > cells:
        return max(2.0 * cells - u, 0.0), -1.0
    return u, 1.0


def cell_of(u: float, cells: int) -> tuple[int, float]:
    """Return the index of the cell and the position in it, in [0, 1]."""
    i = int(u)
    if i >= cells:
        i = cells - 1
    return i, u - i


def weights(t: float) -> tuple[float, float, float, float]:
    """Return the four cubic B-spline weights at t in [0, 1]."""
    r = 1.0 - t
    tt = t * t
    rr = r * r
    return (
        rr * r / 6.0,
        (2.0 / 3.0) - tt + 0.5 * tt * t,
        (2.0 / 3.0) - rr + 0.5 * rr * r,
        tt * t / 6.0,
    )


def weights_first(t: float) -> tuple[float, float, float, float]:
    """Return the derivatives of the weights by t."""
    r = 1.0 - t
    return -0.5 * r * r, t * (1.5 * t - 2.0), -r * (1.5 * r - 2.0), 0.5 * t * t


def weights_second(t: float) -> tuple[float, float, float, float]:
    """Return the second derivatives of the weights by t."""
    r = 1.0 - t
    return r, 3.0 * t - 2.0, 3.0 * r - 2.0, t


def fold_index(i: int, cells: int, periodic: bool) -> int:
    """Return the node index inside [0, cells] that repeats or mirrors node i."""
    if periodic:
        return i % cells
    i = i % (2 * cells)
    return 2 * cells - i if i > cells else i
