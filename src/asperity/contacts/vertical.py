"""The vertical contact: the textured surface straight above or below the probe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.contacts.contact import Contact, ContactDerivatives, ExactHeight, HeightField
from asperity.contacts.sampler import sampled

if TYPE_CHECKING:
    from asperity.checks import FloatArray


class Vertical(Contact):
    """Depth h(x, y) - z, contact point (x, y)."""

    name = "vertical"
    single_valued = True
    above_probe = True
    cost = 1.0
    clampable = True

    def derivatives(self) -> ContactDerivatives:
        """Depth h - z: ∇depth = (h_x, h_y, -1), (X, Y) = (x, y)."""
        import sympy as sp

        from asperity.contacts.symbols import HX, HY

        return ContactDerivatives(sp.Matrix([[HX, HY, -1]]), sp.Matrix([[1, 0, 0], [0, 1, 0]]))

    def inward(self) -> Any:
        """Straight down."""
        import sympy as sp

        return sp.Matrix([0, 0, -1])

    def begin_code(self, wanted: frozenset[str]) -> tuple[list[str], str]:
        """Below the height at the probe; what is wanted besides is sampled with it."""
        return [*sampled(wanted | {"h"}, "x, y"), "depth = h - z"], "depth > 0.0"

    def sample_code(self, wanted: frozenset[str]) -> list[str]:
        """All is known."""
        return []

    def begin(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """At the textured surface."""
        return texture.height(xy)

    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """H - z."""
        import numpy as np

        return np.asarray(texture.height(np.ascontiguousarray(points[:, :2])) - points[:, 2])

    def exact_point(self, texture: HeightField, h: ExactHeight, p: list[Any]) -> tuple[Any, ...]:
        """H - z, x, y."""
        return h(p[0], p[1], 0, 0) - p[2], p[0], p[1]

    def probe(self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray) -> FloatArray:
        """(X, Y, h - depth)."""
        import numpy as np

        return np.column_stack([xy, derivatives[:, 0] - depth])

    def greatest_depth(self, height: float, derivatives: FloatArray) -> FloatArray:
        """H less the height."""
        import numpy as np

        return np.asarray(derivatives[:, 0] - height)

    def margin(self, max_depth: float) -> float:
        """0: the point is straight above the probe."""
        return 0.0

    def coordinate_size(self, xy: FloatArray, height: float) -> float:
        """|h|."""
        return abs(height)


VERTICAL = Vertical()
