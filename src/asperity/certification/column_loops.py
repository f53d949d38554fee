"""Grids of planes: circulations of their cells, and the loops that pass their columns.

A loop passes the columns forwards at one height and backwards at another.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.certification.region import Region, RendererCalls
from asperity.core.checks import FloatArray, IntArray


def random_ends(region: Region, count: int, random: np.random.Generator) -> FloatArray:
    """Return two points for each vertical plane, half of these along an axis, (n, 2, 3)."""
    ends = region.points(random.uniform(size=(count, 2, 3)))
    for pair in ends:
        across = int(random.integers(2))
        along = 1 - across
        if random.uniform() < 0.5:
            pair[1, across] = pair[0, across]
        pair[:, along] = region.low[along], region.high[along]
    return ends


def vertical_planes(region: Region, ends: FloatArray) -> FloatArray:
    """Return corners and sides of rectangles above lines, as high as the region, (n, 3, 3)."""
    corners = ends[:, 0].copy()
    corners[:, 2] = region.low[2]
    sides = ends[:, 1] - ends[:, 0]
    sides[:, 2] = 0.0
    heights = np.broadcast_to(region.size * [0.0, 0.0, 1.0], corners.shape)
    return np.stack([corners, sides, heights], axis=1)


def horizontal_planes(region: Region, shares: FloatArray) -> FloatArray:
    """Return corners and sides of rectangles at shares of the height of the region, (n, 3, 3)."""
    planes = np.zeros((len(shares), 3, 3))
    planes[:, 0] = region.low
    planes[:, 0, 2] += region.size[2] * shares
    planes[:, 1, 0] = region.size[0]
    planes[:, 2, 1] = region.size[1]
    return planes


def find_circulations(calls: RendererCalls, plane: FloatArray, cells: int) -> FloatArray:
    """Return the work around each cell of a grid, NaN outside of the region, shape (n, m)."""
    corner, side, height = plane
    # About square cells, as many in all.
    ratio = min(max(math.sqrt(math.hypot(*side) / math.hypot(*height)), 1 / 3), 3.0)
    columns = int(cells * ratio)
    rows = int(cells / ratio)
    x = np.arange(columns + 1.0)[:, None, None] / columns * side
    z = np.arange(rows + 1.0)[:, None] / rows * height
    along = corner + x[:-1] + 0.5 / columns * side + z
    up = corner + x + z[:-1] + 0.5 / rows * height
    corners = corner + x + z
    inside = calls.region.contains(corners.reshape(-1, 3)).reshape(columns + 1, rows + 1)
    whole = inside[:-1, :-1] & inside[1:, :-1] & inside[:-1, 1:] & inside[1:, 1:]
    beside = np.pad(whole, 1)
    is_along = beside[1:-1, :-1] | beside[1:-1, 1:]
    is_up = beside[:-1, 1:-1] | beside[1:, 1:-1]
    forces = calls.at(np.concatenate([along[is_along], up[is_up]]))
    work_along = np.full(is_along.shape, np.nan)
    work_up = np.full(is_up.shape, np.nan)
    count = np.count_nonzero(is_along)
    work_along[is_along] = forces[:count] @ side / columns
    work_up[is_up] = forces[count:] @ height / rows
    work = work_along[:, :-1] + work_up[1:] - work_along[:, 1:] - work_up[:-1]
    return np.where(whole, work, np.nan)


@dataclass(frozen=True)
class ColumnLoops:
    """Loops that pass the columns of a plane forwards at one height and backwards at another.

    Attributes:
        plane: corner and two sides [m], shape (3, 3).
        works: work in each column [J], shape (n,).
        forwards: heights of the way forwards as shares of the column, shape (n,).
        backwards: those of the way backwards.
    """

    plane: FloatArray
    works: FloatArray
    forwards: FloatArray
    backwards: FloatArray

    def path(self, first: int, end: int) -> FloatArray:
        """Return the loop through some columns, from side to side of them [m], shape (m, 3)."""
        way = np.arange(first, end)
        across = np.concatenate([[first], way + 0.5, [end]])
        passed = np.concatenate([way[:1], way, way[-1:]])
        columns = np.concatenate([across, across[::-1]])
        heights = np.concatenate([self.forwards[passed], self.backwards[passed[::-1]]])
        shares = np.column_stack([columns / len(self.works), heights])
        return np.asarray(self.plane[0] + shares @ self.plane[1:])

    def encloses_area(self, first: int, end: int) -> bool:
        """Return whether the ways through some columns differ."""
        return bool(np.any(self.forwards[first:end] != self.backwards[first:end]))

    def densest_columns(self, density: float) -> tuple[int, int]:
        """Return the columns whose work exceeds most what a density takes on their length [N]."""
        taken = 2.0 * density * math.hypot(*self.plane[1]) / len(self.works)
        sums = np.concatenate([np.zeros(1), np.cumsum(self.works - taken)])
        end = int(np.argmax(sums - np.minimum.accumulate(sums)))
        before = sums[: end + 1]
        return int(np.flatnonzero(before == before.min())[-1]), end


def find_column_loops(plane: FloatArray, circulations: FloatArray) -> ColumnLoops:
    """Return the loops between the heights of the greatest work in each column of a grid.

    Args:
        plane: corner and two sides of the grid [m], shape (3, 3).
        circulations: work around each cell [J], shape (n, m); NaN outside of the region.

    Returns:
        A way along the outermost cells of the region is a cell farther out, beyond its border.
    """
    is_inside = np.isfinite(circulations)
    # No sum across a gap of the region is positive.
    barriers = -1.0 - np.nansum(np.abs(circulations), axis=1, keepdims=True)
    sums = np.pad(np.cumsum(np.where(is_inside, circulations, barriers), axis=1), ((0, 0), (1, 0)))
    is_reached = np.pad(is_inside, ((0, 0), (0, 1))) | np.pad(is_inside, ((0, 0), (1, 0)))
    least = np.minimum.accumulate(np.where(is_reached, sums, np.inf), axis=1)
    works = np.where(is_reached, sums - least, 0.0)
    highest = np.argmax(works, axis=1)
    columns = np.arange(len(sums))
    lowest = np.argmax(is_reached & (sums == least[columns, highest][:, None]), axis=1)
    works = works[columns, highest]
    bottom = np.argmax(is_inside, axis=1)
    lowest, highest = np.where(works > 0.0, [lowest, highest], bottom)
    groups = np.cumsum(_crosses_gap(lowest, is_inside) | _crosses_gap(highest, is_inside))
    works = np.where(groups == np.argmax(np.bincount(groups, works)), works, 0.0)
    forwards = _way_heights(lowest, is_inside, works)
    backwards = _way_heights(highest, is_inside, works)
    return ColumnLoops(plane, works, forwards, backwards)


def _crosses_gap(rows: IntArray, is_inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether a way leaves the region on its way to each column from the one before.

    Args:
        rows: of nodes at which the way passes the columns, shape (n,).
        is_inside: whether each cell is in the region, shape (n, m).
    """
    either = np.copy(is_inside)
    either[1:] |= is_inside[:-1]
    gaps = np.pad(np.cumsum(~either, axis=1), ((0, 0), (1, 0)))
    columns = np.arange(len(rows))
    before = rows[np.maximum(columns - 1, 0)]
    return np.asarray(gaps[columns, rows] != gaps[columns, before])


def _way_heights(rows: IntArray, is_inside: NDArray[np.bool_], works: FloatArray) -> FloatArray:
    """Return heights of rows of nodes: at the border of the region a cell beyond it.

    Where there is no work they are in the middles of the outermost cells.
    """
    count = is_inside.shape[1]
    first = np.argmax(is_inside, axis=1) + 0.5
    last = count - np.argmax(is_inside[:, ::-1], axis=1) - 0.5
    columns = np.arange(len(rows))
    padded = np.pad(is_inside, ((0, 0), (1, 1)))
    outwards = 1.0 * padded[columns, rows] - padded[columns, rows + 1]
    heights = np.where(works > 0.0, rows + outwards, np.clip(rows, first, last))
    return np.asarray(heights / count)
