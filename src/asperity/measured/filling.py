"""Fill missing points by harmonic interpolation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.measured.multigrid import solve_multigrid

if TYPE_CHECKING:
    from scipy.sparse import csr_array

# Points of holes that are solved together, directly; a larger hole is solved by itself.
_DIRECT = 100_000
# Relative residual of the iterative solver.
_TOLERANCE = 1e-10


def fill_in_place(heights: FloatArray, pitch: tuple[float, ...]) -> None:
    """Replace NaN by the harmonic function that the valid neighbours determine.

    The five-point Laplace equation h_xx + h_yy = 0 holds at each missing point, the valid
    points are kept, and the slope across the outer border is zero (natural border). Inside
    a hole the result has no extremum, and a plane around an interior hole is continued
    exactly. On a profile this is linear interpolation, constant beyond the ends.

    Holes do not know of each other: they are solved in groups, directly, and each large one by
    conjugate gradients with a multigrid preconditioner.

    Args:
        heights: [m], shape (ny, nx) or (n,), with at least one valid point; they are changed.
        pitch: (px, py) [m]; only the ratio matters.

    Example:
        >>> heights = np.array([0.0, np.nan, 2.0, np.nan])
        >>> fill_in_place(heights, (1.0,))
        >>> heights
        array([0., 1., 2., 2.])
    """
    missing = np.isnan(heights)
    if not missing.any():
        return
    if heights.ndim == 1:
        index = np.arange(len(heights), dtype=np.float64)
        heights[missing] = np.interp(index[missing], index[~missing], heights[~missing])
        return
    # A small middle value keeps the solver's tolerance relative to the range of heights.
    middle = float(np.nanmean(heights))
    weights = (1.0, (pitch[0] / pitch[1]) ** 2)
    values = heights.reshape(-1)
    for points in _groups(missing):
        values[points] = _solve(heights, missing, points, weights, middle)


def _groups(missing: NDArray[np.bool_]) -> Iterator[NDArray[np.int64]]:
    """Yield sorted flat indices of missing points: whole holes, several if they are small."""
    from scipy.ndimage import label

    labels, _count = label(missing)  # neighbours along the axes only, as in the equation
    points = np.flatnonzero(missing).astype(np.int64)
    hole = labels.reshape(-1)[points]
    del labels
    order = np.argsort(hole, kind="stable")
    sizes = np.bincount(hole)[1:]
    first = 0
    size = 0
    for count in sizes:
        if size and size + count > _DIRECT:
            yield np.sort(points[order[first : first + size]])
            first, size = first + size, 0
        size += int(count)
    yield np.sort(points[order[first : first + size]])


def _solve(
    heights: FloatArray,
    missing: NDArray[np.bool_],
    points: NDArray[np.int64],
    weights: tuple[float, float],
    middle: float,
) -> FloatArray:
    """Return the heights at the points of one group."""
    from scipy.sparse.linalg import spsolve

    matrix, right = _laplace(heights, missing, points, weights, middle)
    if len(points) <= _DIRECT:
        solution = spsolve(matrix.tocsc(), right, permc_spec="MMD_AT_PLUS_A")
        return np.asarray(solution) + middle
    ny, nx = heights.shape
    where = (points // nx, points % nx)
    return solve_multigrid(matrix, right, where, (ny, nx), weights, _TOLERANCE) + middle


def _laplace(
    heights: FloatArray,
    missing: NDArray[np.bool_],
    points: NDArray[np.int64],
    weights: tuple[float, float],
    middle: float,
) -> tuple[csr_array, FloatArray]:
    """Return the symmetric positive definite system of whole holes."""
    from scipy.sparse import csr_array

    count, (ny, nx) = len(points), heights.shape
    row, column = points // nx, points % nx
    small = np.int32 if 5 * count < 2**31 else np.int64
    columns = np.full((count, 5), -1, dtype=small)  # neighbours and, last, the point itself
    values = np.empty((count, 5))
    right = np.zeros(count)
    values[:, 4] = 0.0
    columns[:, 4] = np.arange(count)
    sides = (
        (column > 0, -1, weights[0]),
        (column < nx - 1, 1, weights[0]),
        (row > 0, -nx, weights[1]),
        (row < ny - 1, nx, weights[1]),
    )
    for k, (inside, step, weight) in enumerate(sides):
        values[:, 4] += weight * inside
        values[:, k] = -weight
        here = np.flatnonzero(inside)
        there = points[here] + step
        unknown = missing.reshape(-1)[there]
        columns[here[unknown], k] = np.searchsorted(points, there[unknown])
        right[here[~unknown]] += weight * (heights.reshape(-1)[there[~unknown]] - middle)
    used = columns >= 0
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    matrix = csr_array((values[used], columns[used], starts), shape=(count, count))
    return matrix, right
