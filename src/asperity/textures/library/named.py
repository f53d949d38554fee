"""The texture that a named surface is, and what drawing one hands over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.textures.heightmap import HeightMap
from asperity.textures.waves import LEAST_NODES_PER_WAVE, low_pass


@dataclass(frozen=True)
class Drawing:
    """One period of a surface as it was drawn, before the low-pass.

    Attributes:
        heights: [m], shape (ny, nx).
        pitch: (p_x, p_y) [m].
    """

    heights: FloatArray
    pitch: tuple[float, float]


class NamedSurface(HeightMap):
    """A surface of the library: a periodic height map that remembers its name and parameters.

    Made by :func:`named_surface`. The drawing is freed of waves shorter than 4 nodes and shifted
    to a mean height of zero.

    Args:
        name: in the library.
        parameters: every parameter of the surface, SI units.
        drawing: one period.
    """

    kind: ClassVar[str] = "named"

    def __init__(self, name: str, parameters: Mapping[str, Any], drawing: Drawing) -> None:
        smooth = low_pass(drawing.heights)
        super().__init__(
            smooth - smooth.mean(),
            drawing.pitch,
            periodic=True,
            preparation=(f"{name} was drawn by rules with typical sizes, not measured",),
        )
        self.name = name
        self._parameters = dict(parameters)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Every parameter of the surface, SI units."""
        return MappingProxyType(self._parameters)

    @property
    def cutoff(self) -> tuple[float, float]:
        """Shortest wavelength along x and y [m]: no power below."""
        return LEAST_NODES_PER_WAVE * self.pitch[0], LEAST_NODES_PER_WAVE * self.pitch[1]

    def __repr__(self) -> str:
        given = "".join(f", {name}={value!r}" for name, value in self.parameters.items())
        return f"named_surface({self.name!r}{given})"

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`; the kind is the name."""
        own = {"kind": self.name, "cutoff": list(self.cutoff)}
        return super().describe() | own | dict(self.parameters)


def around(position: float, half_width: float, count: int, pitch: float) -> NDArray[np.intp]:
    """Return the indices of the nodes within half_width of a position, beyond the period too.

    Taken modulo the count they are nodes; times the pitch they are positions next to the one
    given, which is how a thing is painted across the border of a period.
    """
    first = int(np.ceil((position - half_width) / pitch))
    last = int(np.floor((position + half_width) / pitch))
    # A thing longer than the period would meet itself: it is painted over one period only.
    return np.arange(first, min(last, first + count - 1) + 1, dtype=np.intp)
