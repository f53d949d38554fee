"""The texture of a named surface, and the synthetic patch that it is made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.textures.spline.heightmap import HeightMap
from asperity.textures.synthetic import MIN_NODES_PER_WAVE, low_pass


@dataclass(frozen=True)
class SyntheticPatch:
    """One period of a synthetic surface, before the low-pass filter.

    Attributes:
        heights: [m], shape (ny, nx).
        pitch: (p_x, p_y) [m].
    """

    heights: FloatArray
    pitch: tuple[float, float]


class NamedSurface(HeightMap):
    """A surface of the library: a periodic height map with a name and parameters.

    Created by :func:`named_surface`. Waves shorter than 4 nodes are removed from the patch, and its
    mean height is set to zero.

    Args:
        name: name in the library.
        parameters: all parameters of the surface, SI units.
        patch: one period.
    """

    kind: ClassVar[str] = "named"

    def __init__(self, name: str, parameters: Mapping[str, Any], patch: SyntheticPatch) -> None:
        smooth = low_pass(patch.heights)
        super().__init__(
            smooth - smooth.mean(),
            patch.pitch,
            periodic=True,
            preparation=(f"{name} is synthetic, with typical dimensions, not measured",),
        )
        self.name = name
        self.parameters = dict(parameters)

    @property
    def cutoff(self) -> tuple[float, float]:
        """Shortest wavelength along x and y [m]."""
        return MIN_NODES_PER_WAVE * self.pitch[0], MIN_NODES_PER_WAVE * self.pitch[1]

    def __repr__(self) -> str:
        given = "".join(f", {name}={value!r}" for name, value in self.parameters.items())
        return f"named_surface({self.name!r}{given})"

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`; the kind is the name."""
        own = {"kind": self.name, "cutoff": list(self.cutoff)}
        return super().describe() | own | self.parameters


def nodes_around(position: float, half_width: float, count: int, pitch: float) -> NDArray[np.intp]:
    """Return the indices of the nodes within half_width of a position, also beyond the period.

    Modulo the count they are nodes; times the pitch they are positions around the given one, to add
    a feature across the border of a period.
    """
    first = int(np.ceil((position - half_width) / pitch))
    last = int(np.floor((position + half_width) / pitch))
    # A feature longer than the period would overlap itself: it is cut to one period.
    return np.arange(first, min(last, first + count - 1) + 1, dtype=np.intp)
