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


# Unknowns that are left to the direct solver.
_COARSEST = 3000
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
    shape: tuple[int, int],
    weights: tuple[float, float],
    tolerance: float,
) -> FloatArray:
    """Solve the five-point equation on the unknown points of a grid.

    Each coarser grid has every second point (of the stronger direction only, where the pitches
    differ much); corrections are interpolated bilinearly and the coarse matrices are PᵀAP, so
    that the V-cycle is symmetric and positive definite for a hole of any form.

    Args:
        matrix: symmetric positive definite, one row for each unknown point.
        right: right side.
        where: row and column of each unknown point.
        shape: (ny, nx) of the grid.
        weights: of the second differences along x and y.
        tolerance: of the residual, relative to the right side.

    Returns:
        The unknown values.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    levels = _levels(matrix, where, shape, weights)
    bottom = _direct(levels[-1].matrix)
    cycle = LinearOperator(
        matrix.shape, matvec=lambda rest: _cycle(levels, 0, rest, bottom), dtype=np.float64
    )
    solution, _ = cg(matrix, right, M=cycle, rtol=tolerance, maxiter=500)
    return np.asarray(solution)


def _direct(matrix: csr_array) -> Callable[[FloatArray], FloatArray]:
    from scipy.sparse.linalg import splu

    return splu(matrix.tocsc()).solve


def _levels(
    matrix: csr_array,
    where: tuple[Indices, Indices],
    shape: tuple[int, int],
    weights: tuple[float, float],
) -> list[_Level]:
    levels: list[_Level] = []
    wx, wy = weights
    while True:
        inverse = 1.0 / matrix.diagonal()
        halve = (wy >= _STRONG * wx, wx >= _STRONG * wy)
        p, coarse = _interpolation(where, shape, halve)
        if matrix.shape[0] <= _COARSEST or not 0 < p.shape[1] < 0.9 * matrix.shape[0]:
            levels.append(_Level(matrix, inverse, None))
            return levels
        levels.append(_Level(matrix, inverse, p))
        matrix = (p.T @ (matrix @ p)).tocsr()
        where = coarse
        shape = (_halved(shape[0], halve[0]), _halved(shape[1], halve[1]))
        wx, wy = wx / (4.0 if halve[1] else 1.0), wy / (4.0 if halve[0] else 1.0)


def _halved(count: int, halve: bool) -> int:
    return (count + 1) // 2 if halve else count


def _interpolation(
    where: tuple[Indices, Indices], shape: tuple[int, int], halve: tuple[bool, bool]
) -> tuple[csr_array, tuple[Indices, Indices]]:
    """Return the bilinear interpolation from the unknowns at even places, and these places."""
    from scipy.sparse import csr_array

    rows, columns = where
    kept = np.ones(len(rows), dtype=bool)
    for index, half in ((rows, halve[0]), (columns, halve[1])):
        if half:
            kept &= index % 2 == 0
    step = [2 if half else 1 for half in halve]
    coarse = (rows[kept] // step[0], columns[kept] // step[1])
    width = _halved(shape[1], halve[1])
    known = coarse[0] * width + coarse[1]  # sorted, because the unknowns are
    sources = [
        (row, column, by_row * by_column)
        for row, by_row in _neighbours(rows, shape[0], halve[0])
        for column, by_column in _neighbours(columns, shape[1], halve[1])
    ]
    places = np.full((len(rows), len(sources)), -1, dtype=np.int32)
    values = np.zeros(places.shape)
    for k, (row, column, weight) in enumerate(sources):
        flat = row * width + column
        place = np.minimum(np.searchsorted(known, flat), max(len(known) - 1, 0))
        found = (weight > 0.0) & (len(known) > 0)
        found[found] = known[place[found]] == flat[found]
        places[found, k] = place[found]
        values[:, k] = weight
    del sources
    used = places >= 0
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    matrix = csr_array((values[used], places[used], starts), shape=(len(rows), len(known)))
    return matrix, coarse


def _neighbours(index: Indices, count: int, halve: bool) -> list[tuple[Indices, FloatArray]]:
    """Return the coarse places that a fine place takes its value from, with their weights."""
    if not halve:
        return [(index, np.ones(len(index)))]
    odd = index % 2 == 1
    # Beyond the outer border, where the slope is zero, the last even place stands for both.
    lonely = odd & (index == count - 1)
    first = np.where(odd & ~lonely, 0.5, 1.0)
    second = np.where(odd & ~lonely, 0.5, 0.0)
    return [(index // 2, first), (index // 2 + 1, second)]


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
