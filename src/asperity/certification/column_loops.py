"""Loops that pass the columns of a plane grid forwards at one height and backwards at another."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, IntArray


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
        """Return the loop through some columns [m], shape (m, 3)."""
        way = np.arange(first, end)
        columns = np.concatenate([way, way[::-1]]) + 0.5
        heights = np.concatenate([self.forwards[way], self.backwards[way[::-1]]])
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
        return int(np.argmin(sums[: end + 1])), end


def find_column_loops(plane: FloatArray, circulations: FloatArray) -> ColumnLoops:
    """Return the loops between the heights of the greatest work in each column of a grid.

    Args:
        plane: corner and two sides of the grid [m], shape (3, 3).
        circulations: work around each cell [J], shape (n, m); NaN outside of the region.

    Returns:
        Their heights are no farther out than the middle of a cell of the region.
    """
    is_inside = np.isfinite(circulations)
    sums = np.pad(np.cumsum(np.where(is_inside, circulations, 0.0), axis=1), ((0, 0), (1, 0)))
    is_reached = np.pad(is_inside, ((0, 0), (0, 1))) | np.pad(is_inside, ((0, 0), (1, 0)))
    least = np.minimum.accumulate(np.where(is_reached, sums, np.inf), axis=1)
    works = np.where(is_reached, sums - least, 0.0)
    highest = np.argmax(works, axis=1)
    columns = np.arange(len(sums))
    is_lowest = is_reached & (sums == least[columns, highest][:, None])
    forwards = _inner_heights(np.argmax(is_lowest, axis=1), is_inside)
    backwards = _inner_heights(highest, is_inside)
    return ColumnLoops(plane, works[columns, highest], forwards, backwards)


def _inner_heights(rows: IntArray, is_inside: NDArray[np.bool_]) -> FloatArray:
    """Return heights of borders of cells within the middles of the outermost cells inside."""
    count = is_inside.shape[1]
    first = np.argmax(is_inside, axis=1) + 0.5
    last = count - np.argmax(is_inside[:, ::-1], axis=1) - 0.5
    return np.asarray(np.clip(rows, first, last) / count)
