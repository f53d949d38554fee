"""The nominal contact: the smooth wall z < 0; texture changes the force, not where it begins."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.contacts.contact import Contact, ContactDerivatives, ExactHeight, HeightField
from asperity.contacts.sampler import sampled

if TYPE_CHECKING:
    from asperity.checks import FloatArray


class Nominal(Contact):
    """Depth -z, contact point (x, y)."""

    name = "nominal"
    single_valued = True
    above_probe = True
    begins_on_texture = False
    cost = 1.0
    clampable = True
    holds_anchor = True

    def derivatives(self) -> ContactDerivatives:
        """Depth -z: ∇depth = (0, 0, -1), (X, Y) = (x, y)."""
        import sympy as sp

        return ContactDerivatives(sp.Matrix([[0, 0, -1]]), sp.Matrix([[1, 0, 0], [0, 1, 0]]))

    def inward(self) -> Any:
        """Straight down."""
        import sympy as sp

        return sp.Matrix([0, 0, -1])

    def begin_code(self, wanted: frozenset[str]) -> tuple[list[str], str]:
        """Below the wall, whatever the texture."""
        return ["depth = -z"], "depth > 0.0"

    def sample_code(self, wanted: frozenset[str]) -> list[str]:
        """At the probe."""
        return sampled(wanted, "x, y")

    def begin(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Everywhere at 0."""
        import numpy as np

        return np.zeros(len(xy))

    def extremes(self, texture: HeightField) -> tuple[float, float]:
        """0 and 0."""
        return 0.0, 0.0

    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """-z."""
        import numpy as np

        return np.asarray(-points[:, 2])

    def exact_point(self, texture: HeightField, h: ExactHeight, p: list[Any]) -> tuple[Any, ...]:
        """-z, x, y."""
        return -p[2], p[0], p[1]

    def probe(self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray) -> FloatArray:
        """(X, Y, -depth)."""
        import numpy as np

        return np.column_stack([xy, -depth])

    def greatest_depth(self, height: float, derivatives: FloatArray) -> FloatArray:
        """-height."""
        import numpy as np

        return np.full(len(derivatives), -height)

    def margin(self, max_depth: float) -> float:
        """0: the point is the probe's own."""
        return 0.0

    def coordinate_size(self, xy: FloatArray, height: float) -> float:
        """0: the depth is no difference."""
        return 0.0


NOMINAL = Nominal()
