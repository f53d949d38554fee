"""Certified suprema: halve the cells that may hold the greatest value until none is left.

A cell is dropped when a proved upper bound on it is not above what is already attained, but for
the tolerance. The greatest bound of all cells dropped, or left over at the work limit, is the
certificate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from asperity.analysis.cells import Cells
from asperity.checks import FloatArray

DEFAULT_WORK_LIMIT = 20_000_000
# Cells of each chunk at which the value itself is computed: the most promising ones.
_TRIED = 4
_POLISH_STEPS = 50
_LEAST_HALF = 1e-12


class Problem(ABC):
    """A function on cells whose supremum is wanted.

    Attributes:
        cells: where it lives.
        floor: a value that is attained, or that does not matter below.
    """

    cells: Cells
    floor: float = 0.0

    @abstractmethod
    def at_most(self, centres: FloatArray, half: FloatArray, above: float) -> FloatArray:
        """Return proved upper bounds on cells, shape (n,); rough ones where below ``above``."""

    @abstractmethod
    def values(self, coordinates: FloatArray) -> FloatArray:
        """Return the value at coordinates (n, d), shape (n,)."""

    def enough(self, best: float, tolerance: float) -> float:
        """Return the bound at which a cell can be dropped."""
        return best * (1.0 + tolerance)


@dataclass(frozen=True)
class Supremum:
    """What branch and bound found.

    Attributes:
        lower: the greatest value attained, or the floor of the problem.
        upper: a proved bound.
        at: coordinates where ``lower`` is attained; ``None`` for the floor.
        cells: how many cells were looked at.
        reached: whether the tolerance was reached within the work limit.
    """

    lower: float
    upper: float
    at: FloatArray | None
    cells: int
    reached: bool


def supremum(problem: Problem, tolerance: float, work_limit: int = DEFAULT_WORK_LIMIT) -> Supremum:
    """Return proved bounds of the supremum of a problem.

    Args:
        problem: the function on its cells.
        tolerance: relative gap at which to stop.
        work_limit: greatest number of cells to look at; the bounds reached by then are returned.
    """
    chunks, half = problem.cells.start()
    best, at = _first(problem)
    dropped, looked = problem.floor, 0
    while True:
        kept, bounds = [], []
        for centres in chunks:
            looked += len(centres)
            upper = problem.at_most(centres, half, problem.enough(best, tolerance))
            best, at = _try(problem, centres, half, upper, best, at)
            keep = upper > problem.enough(best, tolerance)
            dropped = max(dropped, float(upper[~keep].max(initial=0.0)))
            kept.append(centres[keep])
            bounds.append(upper[keep])
        centres, upper = np.concatenate(kept), np.concatenate(bounds)
        keep = upper > problem.enough(best, tolerance)
        dropped = max(dropped, float(upper[~keep].max(initial=0.0)))
        centres, upper = centres[keep], upper[keep]
        children = len(centres) * 2**problem.cells.dimensions
        done = len(centres) == 0
        if done or looked + children > work_limit or float(half.max()) < _LEAST_HALF:
            break
        half = 0.5 * half
        chunks = _halves(centres, half, problem.cells.chunk())
    left = float(upper.max(initial=0.0))
    if at is not None:
        best, at = polish(problem, at, half, best)
    return Supremum(best, max(best, dropped, left), at, looked, done)


def _first(problem: Problem) -> tuple[float, FloatArray | None]:
    """Return the greatest of a few samples, so that most cells are dropped at first sight."""
    points = problem.cells.samples()
    values = problem.values(points)
    first = int(np.argmax(values))
    if values[first] > problem.floor:
        return float(values[first]), points[first]
    return problem.floor, None


def _try(
    problem: Problem,
    centres: FloatArray,
    half: FloatArray,
    upper: FloatArray,
    best: float,
    at: FloatArray | None,
) -> tuple[float, FloatArray | None]:
    """Return the best value and where it is, after a look at the most promising cells."""
    top = np.argpartition(-upper, min(_TRIED, len(upper) - 1))[:_TRIED]
    top = top[upper[top] > best]
    if len(top) == 0:
        return best, at
    points = problem.cells.inside(
        (centres[top, None] + _star(len(half)) * half).reshape(-1, len(half))
    )
    values = problem.values(points)
    first = int(np.argmax(values))
    if values[first] > best:
        return float(values[first]), points[first]
    return best, at


def _star(dimensions: int) -> FloatArray:
    """Return the centre and the corners of a cell in units of its half widths."""
    corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * dimensions, indexing="ij"), axis=-1)
    return np.concatenate([np.zeros((1, dimensions)), corners.reshape(-1, dimensions)])


def _halves(centres: FloatArray, half: FloatArray, chunk: int) -> Iterator[FloatArray]:
    """Return the halves of cells along every coordinate, chunk by chunk."""
    corners = _star(len(half))[1:] * half
    step = max(1, chunk // len(corners))
    parts: Iterable[FloatArray] = (
        (centres[first : first + step, None] + corners).reshape(-1, len(half))
        for first in range(0, len(centres), step)
    )
    return iter(parts)


def polish(
    problem: Problem, at: FloatArray, half: FloatArray, best: float
) -> tuple[float, FloatArray]:
    """Climb to the top near a point: the step is halved where no neighbour is higher."""
    step = 2.0 * half
    offsets = _star(len(half))[1:]
    offsets = np.concatenate([offsets, np.eye(len(half)), -np.eye(len(half))])
    for _ in range(_POLISH_STEPS):
        points = problem.cells.inside(at + offsets * step)
        values = problem.values(points)
        first = int(np.argmax(values))
        if values[first] > best:
            best, at = float(values[first]), points[first]
        else:
            step = 0.5 * step
    return best, at
