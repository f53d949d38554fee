"""A highest point of a texture, where the surface is level."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from asperity.analysis.bounds.branch_and_bound import Problem
from asperity.analysis.bounds.sampling import sampled_supremum
from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.textures.texture import Texture


class HeightProblem(Problem):
    """The height itself [m]; only its values are asked for."""

    floor = -np.inf

    def __init__(self, cells: Cells) -> None:
        self.cells = cells

    def at_most(self, centres: FloatArray, half: FloatArray, above: float) -> FloatArray:
        """See :class:`Problem`; extremes are certified by the textures."""
        raise NotImplementedError

    def values(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Problem`."""
        return self.cells.derivatives(coordinates)[:, 0]


@lru_cache(maxsize=16)
def highest_point(texture: Texture) -> FloatArray:
    """Return a point of the plane (2,) [m] that is higher than all around it."""
    cells, found = sampled_supremum(texture, HeightProblem)
    assert found.at is not None
    return np.asarray(cells.plane(found.at[None])[0])
