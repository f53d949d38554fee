"""Fill missing points by harmonic interpolation.

Solve Laplace's equation on a large hole: conjugate gradients, preconditioned by multigrid.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray

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
    where = (points // heights.shape[1], points % heights.shape[1])
    return solve_multigrid(matrix, right, where, weights) + middle


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


# Unknowns that are left to the direct solver.
_COARSEST = 3000
# Points along the side of a group that one unknown of the next grid stands for.
_SIDE = 3
# A direction much weaker than the other is not coarsened: smoothing does not reach along it.
_STRONG = 0.3
_DAMPING = 0.7
_SWEEPS = 2

Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Level:
    """A grid: its matrix, its diagonal's inverse, and the interpolation from the next one."""

    matrix: csr_array
    inverse: FloatArray
    interpolation: csr_array | None


def solve_multigrid(
    matrix: csr_array,
    right: FloatArray,
    where: tuple[Indices, Indices],
    weights: tuple[float, float],
) -> FloatArray:
    """Solve the five-point equation on the unknown points of a grid.

    An unknown of a coarser grid stands for a square of points (for a line along the stronger
    direction, where the pitches differ much); corrections are interpolated by smoothing what is
    constant on each, and the coarse matrices are PᵀAP, so that the V-cycle is symmetric and
    positive definite for a hole of any form.

    Args:
        matrix: symmetric positive definite, one row for each unknown point.
        right: right side.
        where: row and column of each unknown point.
        weights: of the second differences along x and y.

    Returns:
        The unknown values.

    Reference:
        Vaněk, Mandel and Brezina, Computing 56 (1996) 179 (smoothed aggregation).
    """
    from scipy.sparse.linalg import LinearOperator, cg, splu

    levels = _levels(matrix, where, weights)
    bottom = splu(levels[-1].matrix.tocsc()).solve
    cycle = LinearOperator(
        matrix.shape, matvec=lambda rest: _cycle(levels, 0, rest, bottom), dtype=np.float64
    )
    solution, _ = cg(matrix, right, M=cycle, rtol=_TOLERANCE, maxiter=500)
    return np.asarray(solution)


def _levels(
    matrix: csr_array, where: tuple[Indices, Indices], weights: tuple[float, float]
) -> list[_Level]:
    levels: list[_Level] = []
    wx, wy = weights
    while True:
        inverse = 1.0 / matrix.diagonal()
        side = (_SIDE if wy >= _STRONG * wx else 1, _SIDE if wx >= _STRONG * wy else 1)
        p, where = _interpolation(matrix, inverse, where, side)
        if matrix.shape[0] <= _COARSEST or p.shape[1] >= 0.9 * matrix.shape[0]:
            levels.append(_Level(matrix, inverse, None))
            return levels
        levels.append(_Level(matrix, inverse, p))
        matrix = (p.T @ (matrix @ p)).tocsr()
        wx, wy = wx / side[1] ** 2, wy / side[0] ** 2


def _interpolation(
    matrix: csr_array, inverse: FloatArray, where: tuple[Indices, Indices], side: tuple[int, int]
) -> tuple[csr_array, tuple[Indices, Indices]]:
    """Return the interpolation from groups of points, and the row and column of each group."""
    from scipy.sparse import csr_array, diags_array

    count, width = len(inverse), int(where[1].max()) // side[1] + 1
    place = where[0] // side[0] * width + where[1] // side[1]
    groups, group = np.unique(place, return_inverse=True)
    constant = csr_array((np.ones(count), group, np.arange(count + 1)), shape=(count, len(groups)))
    smoothed = constant - diags_array(_DAMPING * inverse) @ (matrix @ constant)
    return smoothed.tocsr(), (groups // width, groups % width)


def _cycle(
    levels: list[_Level],
    depth: int,
    rest: FloatArray,
    bottom: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """One V-cycle from zero: smooth, correct on the coarser grid, smooth as before."""
    level = levels[depth]
    if level.interpolation is None:
        return bottom(rest)
    step = _DAMPING * level.inverse
    values = step * rest
    for _ in range(_SWEEPS - 1):
        values += step * (rest - level.matrix @ values)
    coarse = level.interpolation.T @ (rest - level.matrix @ values)
    values += level.interpolation @ _cycle(levels, depth + 1, coarse, bottom)
    for _ in range(_SWEEPS):
        values += step * (rest - level.matrix @ values)
    return values
