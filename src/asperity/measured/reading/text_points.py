"""A list of x, y, z points on a regular grid, in any order, as the map that it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.errors import SurfaceFileError
from asperity.measured.reading.spacing import spacing

# A list that names fewer of its grid's points than one in so many is no grid.
_SPARSEST = 4
_EXPECTED = (
    "three columns: a list of x, y, z points must lie on a regular grid, in any order; a matrix of"
    " heights or two columns (position, height) are read, too"
)


@dataclass(frozen=True)
class Grid:
    """Heights of points sorted onto their grid.

    Attributes:
        heights: shape (ny, nx), NaN where the list names no point.
        pitch: (p_x, p_y), in the unit of the positions; 0 along an axis with one point.
    """

    heights: NDArray[np.float64]
    pitch: tuple[float, float]


def refuse_missing_positions(points: NDArray[np.float64]) -> None:
    """Refuse a list (n, 3) in which a point has no x or no y.

    Raises:
        SurfaceFileError: for such a list.
    """
    if np.isnan(points[:, :2]).any():
        raise SurfaceFileError(f"a position is missing; {_EXPECTED}")


def grid_of(
    points: NDArray[np.float64], resolution: tuple[NDArray[np.float64], NDArray[np.float64]]
) -> Grid:
    """Return the grid of a list of points.

    Args:
        points: x, y, z, shape (n, 3).
        resolution: value of the last printed digit of each x and each y, shape (n,).

    Raises:
        SurfaceFileError: for points that are on no regular grid, or named twice.

    Example:
        >>> points = np.array([[0, 0, 1.0], [0, 2, 3.0], [1, 0, 2.0], [1, 2, 4.0]])
        >>> grid_of(points, (np.ones(4), np.ones(4))).heights
        array([[1., 2.],
               [3., 4.]])
    """
    x, column = np.unique(points[:, 0], return_inverse=True)
    y, row = np.unique(points[:, 1], return_inverse=True)
    if len(x) * len(y) > _SPARSEST * len(points):
        raise SurfaceFileError(f"the points are on no regular grid; {_EXPECTED}")
    if len(np.unique(row * len(x) + column)) < len(points):
        raise SurfaceFileError(f"two points have the same position; {_EXPECTED}")
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    return Grid(heights, (_step("x", x, resolution[0]), _step("y", y, resolution[1])))


def _step(axis: str, positions: NDArray[np.float64], resolution: NDArray[np.float64]) -> float:
    if len(positions) == 1:
        return 0.0
    result = spacing(positions, float(resolution.max()))
    if not result.uniform:
        raise SurfaceFileError(
            f"the {axis} positions are not uniform: one is {result.deviation:.3g} from a grid of"
            f" {result.step:.3g}; {_EXPECTED}"
        )
    return result.step
