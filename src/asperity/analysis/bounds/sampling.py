"""The fallback where nothing is proved: many samples, the best of which are climbed from."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from asperity.analysis.bounds.branch_and_bound import Problem, Supremum, polish
from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.textures.texture import Texture

_CANDIDATES = 12
_SAMPLES = 65_536


def sampled(problem: Problem) -> Supremum:
    """Return the greatest value found, without an upper bound."""
    points = problem.cells.samples(_SAMPLES)
    values = np.concatenate([problem.values(part) for part in np.array_split(points, 16)])
    _chunks, half = problem.cells.start()
    best, at = problem.floor, None
    for index in np.argsort(-values)[:_CANDIDATES]:
        top, where = polish(problem, points[index], half, float(values[index]))
        if top > best:
            best, at = top, where
    return Supremum(best, math.inf, at, len(points), reached=False)


def sampled_supremum(texture: Texture, build: Callable[[Cells], Problem]) -> tuple[Cells, Supremum]:
    """Return the cells that were sampled and the greatest value found of a problem on them."""
    cells = texture.sampling_cells()
    return cells, sampled(build(cells))


class HeightProblem(Problem):
    """The height itself [m]; only its values are asked for."""

    floor = -np.inf

    def __init__(self, cells: Cells) -> None:
        self.cells = cells

    def at_most(self, centres: FloatArray, half: FloatArray, above: float) -> FloatArray:  # noqa: ARG002 - of the problem
        """See :class:`Problem`; no bound is known, extremes are certified by the textures."""
        return np.full(len(centres), np.inf)

    def values(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Problem`."""
        return self.cells.derivatives(coordinates)[:, 0]


@lru_cache(maxsize=16)
def highest_point(texture: Texture) -> FloatArray:
    """Return a point of the plane (2,) [m] that is higher than all around it."""
    cells, found = sampled_supremum(texture, HeightProblem)
    assert found.at is not None
    return np.asarray(cells.plane(found.at[None])[0])
