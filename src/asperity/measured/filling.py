"""Fill missing points by harmonic interpolation (Laplace's equation)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_GROUP_SIZE = 100_000  # points solved together; larger holes one by one
_MAX_HOLE = 2_000_000  # points of a hole: some 20 s and 3 GB

Indices = NDArray[np.int64]


def fill_in_place(heights: FloatArray, pitch: Pitch) -> None:
    """Replace NaN by the harmonic function determined by the valid neighbours.

    The five-point Laplace equation h_xx + h_yy = 0 holds at each missing point, the valid
    points are unchanged, and the slope across the outer border is zero (natural border). Inside
    a hole the result has no extremum, and a plane around an interior hole is continued
    exactly. On a profile this is linear interpolation, constant beyond the ends.

    Holes are independent of each other: small ones are solved in groups, each large one by itself.

    Args:
        heights: [m], shape (ny, nx) or (n,), with at least one valid point; changed in place.
        pitch: (px, py) [m]; only the ratio matters.

    Raises:
        ParameterError: a hole is too large.

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
        if len(points) > _MAX_HOLE:
            words = f"has a hole of {len(points)} points; at most {_MAX_HOLE} are filled: crop it"
            raise ParameterError("surface", words)
        matrix, right = _laplace_system(heights, points, weights, mean)
        solution = spsolve(matrix.tocsc(), right, permc_spec="MMD_AT_PLUS_A")
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
        if size and size + count > _GROUP_SIZE:
            yield np.sort(points[order[first : first + size]])
            first = first + size
            size = 0
        size += int(count)
    yield np.sort(points[order[first : first + size]])


def _laplace_system(
    heights: FloatArray, points: Indices, weights: tuple[float, float], mean: float
) -> tuple[csr_array, FloatArray]:
    """Return the symmetric positive definite system of whole holes."""
    from scipy.sparse import csr_array

    count = len(points)
    (ny, nx) = heights.shape
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
