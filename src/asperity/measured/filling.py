"""Fill missing points by harmonic interpolation (Laplace's equation)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.measured.lengths import Pitch

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_DIRECT_LIMIT = 100_000  # points solved together by the direct solver; larger holes one by one
_TOLERANCE = 1e-10  # relative residual of the iterative solver

Indices = NDArray[np.int64]


def fill_in_place(heights: FloatArray, pitch: Pitch) -> None:
    """Replace NaN by the harmonic function determined by the valid neighbours.

    The five-point Laplace equation h_xx + h_yy = 0 holds at each missing point, the valid
    points are unchanged, and the slope across the outer border is zero (natural border). Inside
    a hole the result has no extremum, and a plane around an interior hole is continued
    exactly. On a profile this is linear interpolation, constant beyond the ends.

    Holes are independent of each other: small ones are solved directly in groups, each large one by
    conjugate gradients with a multigrid preconditioner.

    Args:
        heights: [m], shape (ny, nx) or (n,), with at least one valid point; changed in place.
        pitch: (px, py) [m]; only the ratio matters.

    Example:
        >>> heights = np.array([0.0, np.nan, 2.0, np.nan])
        >>> fill_in_place(heights, (1.0,))
        >>> heights
        array([0., 1., 2., 2.])
    """
    from scipy.sparse.linalg import spsolve

    missing = np.isnan(heights)
    if not missing.any():
        return
    if heights.ndim == 1:
        index = np.arange(len(heights), dtype=np.float64)
        heights[missing] = np.interp(index[missing], index[~missing], heights[~missing])
        return
    # Without the mean, the solver's tolerance is relative to the range of heights.
    mean = float(np.nanmean(heights))
    weights = (1.0, (pitch[0] / pitch[1]) ** 2)
    for points in _hole_groups(missing):
        matrix, right = _laplace_system(heights, points, weights, mean)
        if len(points) <= _DIRECT_LIMIT:
            solution = spsolve(matrix.tocsc(), right, permc_spec="MMD_AT_PLUS_A")
        else:
            solution = solve_multigrid(matrix, right, divmod(points, heights.shape[1]), weights)
        heights.reshape(-1)[points] = solution + mean


def _hole_groups(missing: NDArray[np.bool_]) -> Iterator[Indices]:
    """Yield sorted flat indices of the points of a large hole, or of several small ones."""
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
        if size and size + count > _DIRECT_LIMIT:
            yield np.sort(points[order[first : first + size]])
            first, size = first + size, 0
        size += int(count)
    yield np.sort(points[order[first : first + size]])


def _laplace_system(
    heights: FloatArray, points: Indices, weights: tuple[float, float], mean: float
) -> tuple[csr_array, FloatArray]:
    """Return the symmetric positive definite system of whole holes."""
    from scipy.sparse import csr_array

    count, (ny, nx) = len(points), heights.shape
    row, column = divmod(points, nx)
    small = np.int32 if 5 * count < 2**31 else np.int64
    columns = np.full((count, 5), -1, dtype=small)  # neighbours and, last, the point itself
    values = np.empty((count, 5))
    right = np.zeros(count)
    values[:, 4] = 0.0
    columns[:, 4] = np.arange(count)
    insides = (column > 0, column < nx - 1, row > 0, row < ny - 1)
    for k, (inside, step) in enumerate(zip(insides, (-1, 1, -nx, nx), strict=True)):
        weight = weights[k // 2]
        values[:, 4] += weight * inside
        values[:, k] = -weight
        rows = np.flatnonzero(inside)
        neighbours = points[rows] + step
        their_heights = heights.reshape(-1)[neighbours]
        unknown = np.isnan(their_heights)
        columns[rows[unknown], k] = np.searchsorted(points, neighbours[unknown])
        right[rows[~unknown]] += weight * (their_heights[~unknown] - mean)
    used = columns >= 0
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    matrix = csr_array((values[used], columns[used], starts), shape=(count, count))
    return matrix, right


_COARSEST_SIZE = 3000  # unknowns of the coarsest grid, solved directly
_AGGREGATE_SIDE = 3  # points along the side of a group that becomes one unknown of the next grid
_STRONG_RATIO = 0.3  # a direction with less than this weight ratio is not coarsened
_DAMPING = 0.7
_SWEEPS = 2


@dataclass(frozen=True, eq=False)
class _Level:
    """A grid: its matrix, the inverse of its diagonal, and the interpolation from the next one."""

    matrix: csr_array
    inverse_diagonal: FloatArray
    interpolation: csr_array | None


def solve_multigrid(
    matrix: csr_array,
    rhs: FloatArray,
    indices: tuple[Indices, Indices],
    weights: tuple[float, float],
) -> FloatArray:
    """Solve the five-point equation on the unknown points of a grid.

    An unknown of a coarser grid represents a square of points (a line along the stronger direction
    if the pitches differ much); the interpolation P is the smoothed constant on each group, and the
    coarse matrices are PᵀAP, so that the V-cycle is symmetric and positive definite for a hole of
    any shape.

    Args:
        matrix: symmetric positive definite, one row for each unknown point.
        rhs: right side.
        indices: row and column of each unknown point.
        weights: weights of the second differences along x and y.

    Returns:
        The unknown values.

    Reference:
        Vaněk, Mandel and Brezina, Computing 56 (1996) 179 (smoothed aggregation).
    """
    from scipy.sparse.linalg import LinearOperator, cg, splu

    levels = _build_levels(matrix, indices, weights)
    bottom = splu(levels[-1].matrix.tocsc()).solve
    cycle = LinearOperator(
        matrix.shape, matvec=lambda rest: _v_cycle(levels, 0, rest, bottom), dtype=np.float64
    )
    solution, _ = cg(matrix, rhs, M=cycle, rtol=_TOLERANCE, maxiter=500)
    return np.asarray(solution)


def _build_levels(
    matrix: csr_array, indices: tuple[Indices, Indices], weights: tuple[float, float]
) -> list[_Level]:
    levels: list[_Level] = []
    wx, wy = weights
    while True:
        inverse = 1.0 / matrix.diagonal()
        side = (
            _AGGREGATE_SIDE if wy >= _STRONG_RATIO * wx else 1,
            _AGGREGATE_SIDE if wx >= _STRONG_RATIO * wy else 1,
        )
        p, indices = _build_interpolation(matrix, inverse, indices, side)
        if matrix.shape[0] <= _COARSEST_SIZE or p.shape[1] >= 0.9 * matrix.shape[0]:
            levels.append(_Level(matrix, inverse, None))
            return levels
        levels.append(_Level(matrix, inverse, p))
        matrix = (p.T @ (matrix @ p)).tocsr()
        wx, wy = wx / side[1] ** 2, wy / side[0] ** 2


def _build_interpolation(
    matrix: csr_array, inverse: FloatArray, indices: tuple[Indices, Indices], side: tuple[int, int]
) -> tuple[csr_array, tuple[Indices, Indices]]:
    """Return the interpolation from groups of points, and the row and column of each group."""
    from scipy.sparse import csr_array, diags_array

    count, width = len(inverse), int(indices[1].max()) // side[1] + 1
    aggregate = indices[0] // side[0] * width + indices[1] // side[1]
    groups, group = np.unique(aggregate, return_inverse=True)
    constant = csr_array((np.ones(count), group, np.arange(count + 1)), shape=(count, len(groups)))
    smoothed = constant - diags_array(_DAMPING * inverse) @ (matrix @ constant)
    return smoothed.tocsr(), (groups // width, groups % width)


def _v_cycle(
    levels: list[_Level],
    depth: int,
    residual: FloatArray,
    solve_coarsest: Callable[[FloatArray], FloatArray],
) -> FloatArray:
    """Return one V-cycle from zero: smooth, correct on the coarser grid, smooth again."""
    level = levels[depth]
    if level.interpolation is None:
        return solve_coarsest(residual)
    step = _DAMPING * level.inverse_diagonal
    values = step * residual
    for _ in range(_SWEEPS - 1):
        values += step * (residual - level.matrix @ values)
    coarse = level.interpolation.T @ (residual - level.matrix @ values)
    values += level.interpolation @ _v_cycle(levels, depth + 1, coarse, solve_coarsest)
    for _ in range(_SWEEPS):
        values += step * (residual - level.matrix @ values)
    return values
