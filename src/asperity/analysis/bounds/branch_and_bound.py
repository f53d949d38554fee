"""Certified suprema by branch and bound: cells that may hold the supremum are subdivided.

A cell is pruned when its proved upper bound exceeds the best attained value by no more than the
tolerance. The greatest bound of all cells pruned, or left at the work limit, is the certificate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.enclosures.cells import Cells

DEFAULT_WORK_LIMIT = 20_000_000
# Cells of each chunk whose value is computed: those with the greatest upper bounds.
_PROBED_CELLS = 4
# Evaluating fewer cells than this costs no more than one.
_MIN_CELLS = 128
_POLISH_STEPS = 50
# Step sizes tried together, and the step below which the search stops.
_POLISH_SCALES = 4.0 ** -np.arange(5.0)
_MIN_POLISH_STEP = 1e-10
_MIN_HALF_WIDTH = 1e-12
# Relative error by which rounding may raise an attained value above its bound: a kernel and an
# eigenvalue are a few hundred operations, 2⁸ units of round-off; a second derivative is a
# difference of heights of neighbouring nodes, which amplifies it by (n/2π)² at n nodes a wave,
# 2¹⁶ at 1600.
ROUNDING_ERROR = 2.0**8 * float(np.finfo(np.float64).eps)
DIFFERENCE_AMPLIFICATION = 2.0**16
# The cost of this many cells is negligible.
_CHEAP_CELLS = 4096


@dataclass(frozen=True)
class Contacts:
    """Depths [m], (n,), and deflections [m], (n, 2), of an anchor that sticks or is dragged."""

    depth: FloatArray
    deflection: FloatArray
    sliding: bool


class Problem(ABC):
    """A function on cells whose supremum is computed.

    Attributes:
        cells: the domain.
        floor: a value that is attained, or below which the supremum is irrelevant.
    """

    cells: Cells
    floor: float = 0.0

    def upper_bounds(
        self,
        centres: FloatArray,
        half: FloatArray,  # noqa: ARG002 - of a default
        threshold: float,  # noqa: ARG002 - of a default
    ) -> FloatArray:
        """Return proved upper bounds on cells, shape (n,), coarse ones below ``threshold``.

        Infinite for a problem that is only sampled.
        """
        return np.full(len(centres), np.inf)

    @abstractmethod
    def values(self, coordinates: FloatArray) -> FloatArray:
        """Return the value at coordinates (n, d), shape (n,)."""

    def prune_threshold(self, best: float, tolerance: float) -> float:
        """Return the upper bound at which a cell can be pruned."""
        return best * (1.0 + tolerance)

    def contacts(self, coordinates: FloatArray) -> list[Contacts]:  # noqa: ARG002 - of a default
        """Return the contacts that may attain the value at coordinates (n, d).

        Empty where the value depends on the surface alone: either end of the depth range may.
        """
        return []

    def direct_bound(self) -> Supremum | None:
        """Return bounds over the whole plane that need no search, if available."""
        return None


@dataclass(frozen=True)
class Supremum:
    """The result of branch and bound.

    Attributes:
        lower: the greatest value attained, or the floor of the problem.
        upper: a proved bound.
        at: coordinates where ``lower`` is attained; ``None`` for the floor.
        cell_count: number of evaluated cells.
        converged: whether the tolerance was reached within the work limit.
    """

    lower: float
    upper: float
    at: FloatArray | None
    cell_count: int
    converged: bool


def supremum(
    problem: Problem,
    tolerance: float,
    work_limit: int = DEFAULT_WORK_LIMIT,
    cheap_gap: float | None = None,
) -> Supremum:
    """Return proved bounds of the supremum of a problem.

    Errors shrink with the square of the cell size, so a much smaller gap often costs little more.

    Args:
        problem: the function on its cells.
        tolerance: relative gap at which to stop.
        work_limit: greatest number of cells to evaluate; the bounds reached by then are returned.
        cheap_gap: a smaller gap to reach as long as few cells remain.

    Raises:
        InternalError: if a value is above the proved bound, so that nothing is proved.
    """
    goal = tolerance if cheap_gap is None else min(cheap_gap, tolerance)
    limit = min(work_limit, problem.cells.max_cells or work_limit)
    chunks, half = problem.cells.initial_cells()
    # A few samples first, so that most cells are pruned at once.
    best = _BestValue(problem)
    best.try_points(problem.cells.sample_coordinates())
    pruned = problem.floor
    evaluated = 0
    while True:
        remaining = []
        bounds = []
        for centres in chunks:
            evaluated += len(centres)
            upper = problem.upper_bounds(centres, half, problem.prune_threshold(best.value, goal))
            upper = np.where(np.isnan(upper), np.inf, upper)
            best.try_cells(centres, half, upper)
            keep = upper > problem.prune_threshold(best.value, goal)
            pruned = max(pruned, float(upper[~keep].max(initial=0.0)))
            remaining.append(centres[keep])
            bounds.append(upper[keep])
        centres = np.concatenate(remaining)
        upper = np.concatenate(bounds)
        keep = upper > problem.prune_threshold(best.value, goal)
        pruned = max(pruned, float(upper[~keep].max(initial=0.0)))
        centres = centres[keep]
        upper = upper[keep]
        left = float(upper.max(initial=0.0))
        parts = _subdivision_count(len(centres), problem.cells.dimensions)
        children = len(centres) * parts**problem.cells.dimensions
        converged = left <= problem.prune_threshold(best.value, tolerance)
        done = len(centres) == 0 or (converged and children > _CHEAP_CELLS)
        if done or evaluated + children > limit or float(half.max()) < _MIN_HALF_WIDTH:
            break
        half = half / parts
        chunks = _subdivide(centres, half, parts, problem.cells.chunk_size())
    value = best.value
    at = best.at
    if at is not None:
        value, at = polish(problem, at, half, value)
    proved = max(pruned, left)
    if value > proved + ROUNDING_ERROR * DIFFERENCE_AMPLIFICATION * abs(proved):
        cause = "the enclosures, or the bounds declared by the texture, are wrong"
        raise InternalError(f"{value:g} is attained, above the proved bound {proved:g}: {cause}")
    return Supremum(value, max(value, proved), at, evaluated, converged)


class _BestValue:
    """The greatest value attained so far, and where."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.value = problem.floor
        self.at: FloatArray | None = None

    def try_cells(self, centres: FloatArray, half: FloatArray, upper: FloatArray) -> None:
        """Evaluate the most promising cells."""
        top = np.argpartition(-upper, min(_PROBED_CELLS, len(upper) - 1))[:_PROBED_CELLS]
        top = top[upper[top] > self.value]
        if len(top):
            points = centres[top, None] + _cell_stencil(len(half)) * half
            self.try_points(self.problem.cells.clip_to_region(points.reshape(-1, len(half))))

    def try_points(self, points: FloatArray) -> None:
        """Evaluate some points."""
        values = self.problem.values(points)
        first = _argmax_ignoring_nan(values)
        if values[first] > self.value:
            self.value = float(values[first])
            self.at = points[first]


def _argmax_ignoring_nan(values: FloatArray) -> int:
    """Return the index of the greatest value; NaN is smaller than any."""
    return int(np.where(np.isnan(values), -np.inf, values).argmax())


@lru_cache(maxsize=8)
def _cell_stencil(dimensions: int) -> FloatArray:
    """Return the centre and the corners of a cell in units of its half widths."""
    corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * dimensions, indexing="ij"), axis=-1)
    return np.concatenate([np.zeros((1, dimensions)), corners.reshape(-1, dimensions)])


def _subdivision_count(cells: int, dimensions: int) -> int:
    """Return the number of parts of a cell along every coordinate, more than 2 for few cells."""
    parts = 2
    while max(cells, 1) * (2 * parts) ** dimensions <= _MIN_CELLS:
        parts *= 2
    return parts


def _subdivide(
    centres: FloatArray, half: FloatArray, parts: int, chunk: int
) -> Iterator[FloatArray]:
    """Yield the subcells, of half widths ``half``, of cells, chunk by chunk."""
    ticks = 2.0 * np.arange(parts) + 1.0 - parts
    grid = np.stack(np.meshgrid(*[ticks] * len(half), indexing="ij"), axis=-1)
    offsets = grid.reshape(-1, len(half)) * half
    step = max(1, chunk // len(offsets))
    for first in range(0, len(centres), step):
        yield (centres[first : first + step, None] + offsets).reshape(-1, len(half))


def polish(
    problem: Problem, at: FloatArray, half: FloatArray, best: float
) -> tuple[float, FloatArray]:
    """Return the local maximum near a point, by pattern search with several step sizes."""
    size = len(half)
    offsets = np.concatenate([_cell_stencil(size)[1:], np.eye(size), -np.eye(size)])
    offsets = (_POLISH_SCALES[:, None, None] * offsets).reshape(-1, size)
    scale = np.repeat(_POLISH_SCALES, len(offsets) // len(_POLISH_SCALES))
    step = 2.0
    for _ in range(_POLISH_STEPS):
        points = problem.cells.clip_to_region(at + offsets * (step * half))
        values = problem.values(points)
        first = _argmax_ignoring_nan(values)
        if values[first] > best:
            best = float(values[first])
            at = points[first]
            step *= min(2.0 * float(scale[first]), 1.0)
        else:
            step *= 0.5 * float(_POLISH_SCALES[-1])
        if step < _MIN_POLISH_STEP:
            break
    return best, at
