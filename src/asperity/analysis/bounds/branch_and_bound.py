"""Certified suprema: halve the cells that may hold the greatest value until none is left.

A cell is dropped when a proved upper bound on it is not above what is already attained, but for
the tolerance. The greatest bound of all cells dropped, or left over at the work limit, is the
certificate.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.errors import InternalError

DEFAULT_WORK_LIMIT = 20_000_000
# Cells of each chunk at which the value itself is computed: the most promising ones.
_TRIED = 4
# Fewer cells than this cost no more than one.
_SMALL = 128
_POLISH_STEPS = 50
# Steps that are tried at once, and the change of a step below which nothing is gained.
_SCALES = 4.0 ** -np.arange(5.0)
_FINEST = 1e-10
_LEAST_HALF = 1e-12
# What rounding may put an attained value above its bound by: a kernel and an eigenvalue are a few
# hundred operations, 2⁸ units of the round-off; a second derivative is a difference of heights of
# neighbouring nodes, which costs (n/2π)² more at n nodes a wave, 2¹⁶ at 1600 of them.
OPERATIONS = 2.0**8 * float(np.finfo(np.float64).eps)
DIFFERENCES = 2.0**16
# So many cells cost next to nothing.
_FEW = 4096


@dataclass(frozen=True)
class Contacts:
    """Depths [m], (n,), and deflections [m], (n, 2), of an anchor that sticks or is dragged."""

    depth: FloatArray
    deflection: FloatArray
    sliding: bool


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

    def contacts(self, coordinates: FloatArray) -> list[Contacts]:  # noqa: ARG002 - of a default
        """Return the contacts that may attain the value at coordinates (n, d).

        None where the value is one of the surface alone: then either end of the depth may.
        """
        return []

    def at_once(self) -> Supremum | None:
        """Return bounds over the whole plane that need no search, where there are some."""
        return None


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


def supremum(
    problem: Problem,
    tolerance: float,
    work_limit: int = DEFAULT_WORK_LIMIT,
    cheap_gap: float | None = None,
) -> Supremum:
    """Return proved bounds of the supremum of a problem.

    Errors shrink with the square of the cells, so a much smaller gap often costs little more.

    Args:
        problem: the function on its cells.
        tolerance: relative gap at which to stop.
        work_limit: greatest number of cells to look at; the bounds reached by then are returned.
        cheap_gap: a smaller gap, to be reached as long as few cells are left.

    Raises:
        InternalError: if a value is above the proved bound, so that nothing is proved.
    """
    goal = tolerance if cheap_gap is None else min(cheap_gap, tolerance)
    limit = min(work_limit, problem.cells.most or work_limit)
    chunks, half = problem.cells.start()
    # Of a few samples, so that most cells are dropped at first sight.
    best, at = _better(problem, problem.cells.samples(), problem.floor, None)
    dropped, looked = problem.floor, 0
    while True:
        kept, bounds = [], []
        for centres in chunks:
            looked += len(centres)
            upper = problem.at_most(centres, half, problem.enough(best, goal))
            upper = np.where(np.isnan(upper), np.inf, upper)
            best, at = _try(problem, centres, half, upper, best, at)
            keep = upper > problem.enough(best, goal)
            dropped = max(dropped, float(upper[~keep].max(initial=0.0)))
            kept.append(centres[keep])
            bounds.append(upper[keep])
        centres, upper = np.concatenate(kept), np.concatenate(bounds)
        keep = upper > problem.enough(best, goal)
        dropped = max(dropped, float(upper[~keep].max(initial=0.0)))
        centres, upper = centres[keep], upper[keep]
        left = float(upper.max(initial=0.0))
        parts = _parts(len(centres), problem.cells.dimensions)
        children = len(centres) * parts**problem.cells.dimensions
        good = left <= problem.enough(best, tolerance)
        done = len(centres) == 0 or (good and children > _FEW)
        if done or looked + children > limit or float(half.max()) < _LEAST_HALF:
            break
        half = half / parts
        chunks = _split(centres, half, parts, problem.cells.chunk())
    if at is not None:
        best, at = polish(problem, at, half, best)
    proved = max(dropped, left)
    if best > proved + OPERATIONS * DIFFERENCES * abs(proved):
        words = "the enclosures, or the bounds that the texture claims, are wrong"
        raise InternalError(f"{best:g} is attained, above the proved bound {proved:g}: {words}")
    return Supremum(best, max(best, proved), at, looked, good)


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
    points = centres[top, None] + _star(len(half)) * half
    return _better(problem, problem.cells.inside(points.reshape(-1, len(half))), best, at)


def _better(
    problem: Problem, points: FloatArray, best: float, at: FloatArray | None
) -> tuple[float, FloatArray | None]:
    """Return the best value and where it is, after a look at some points."""
    values = problem.values(points)
    first = _greatest(values)
    return (float(values[first]), points[first]) if values[first] > best else (best, at)


def _greatest(values: FloatArray) -> int:
    """Return the index of the greatest value; what is no number is smaller than any."""
    return int(np.where(np.isnan(values), -np.inf, values).argmax())


@lru_cache(maxsize=8)
def _star(dimensions: int) -> FloatArray:
    """Return the centre and the corners of a cell in units of its half widths."""
    corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * dimensions, indexing="ij"), axis=-1)
    return np.concatenate([np.zeros((1, dimensions)), corners.reshape(-1, dimensions)])


def _parts(cells: int, dimensions: int) -> int:
    """Return into how many parts to cut along every coordinate: more than halves of few cells."""
    parts = 2
    while max(cells, 1) * (2 * parts) ** dimensions <= _SMALL:
        parts *= 2
    return parts


def _split(centres: FloatArray, half: FloatArray, parts: int, chunk: int) -> Iterator[FloatArray]:
    """Return the parts, of half widths ``half``, of cells, chunk by chunk."""
    ticks = 2.0 * np.arange(parts) + 1.0 - parts
    grid = np.stack(np.meshgrid(*[ticks] * len(half), indexing="ij"), axis=-1)
    offsets = grid.reshape(-1, len(half)) * half
    step = max(1, chunk // len(offsets))
    for first in range(0, len(centres), step):
        yield (centres[first : first + step, None] + offsets).reshape(-1, len(half))


def polish(
    problem: Problem, at: FloatArray, half: FloatArray, best: float
) -> tuple[float, FloatArray]:
    """Climb to the top near a point, by steps of several sizes at once."""
    size = len(half)
    offsets = np.concatenate([_star(size)[1:], np.eye(size), -np.eye(size)])
    offsets = (_SCALES[:, None, None] * offsets).reshape(-1, size)
    scale, step = np.repeat(_SCALES, len(offsets) // len(_SCALES)), 2.0
    for _ in range(_POLISH_STEPS):
        points = problem.cells.inside(at + offsets * (step * half))
        values = problem.values(points)
        first = _greatest(values)
        if values[first] > best:
            best, at = float(values[first]), points[first]
            step *= min(2.0 * float(scale[first]), 1.0)
        else:
            step *= 0.5 * float(_SCALES[-1])
        if step < _FINEST:
            break
    return best, at
