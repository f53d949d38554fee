"""The nominal and the vertical contact, whose contact point is straight above or below the probe.

Nominal: the smooth wall z < 0; the texture changes the force, not where contact begins. Vertical:
the textured surface z < h(x, y).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from asperity.contacts.contact import Contact, ContactDerivatives, ExactHeight, HeightField
from asperity.contacts.sampler_interface import sampler_call

if TYPE_CHECKING:
    from asperity.core.checks import FloatArray


class VerticalContact(Contact):
    """Depth h(x, y) - z, contact point (x, y)."""

    name = "vertical"
    single_valued = True
    is_above_probe = True
    relative_cost = 1.0
    clampable = True

    def derivatives(self) -> ContactDerivatives:
        """Return ∇depth = (h_x, h_y, -1) and ∂(X, Y)/∂p of (X, Y) = (x, y)."""
        import sympy as sp

        from asperity.contacts.symbols import HX, HY

        return ContactDerivatives(sp.Matrix([[HX, HY, -1]]), sp.eye(2, 3))

    def inward_direction(self) -> Any:
        """Return -e_z."""
        import sympy as sp

        return sp.Matrix([0, 0, -1])

    def detection_code(self, needed: frozenset[str]) -> tuple[list[str], str]:
        """Return the comparison with the height at the probe, sampled with its derivatives."""
        return [*sampler_call(needed | {"h"}, "x, y"), "depth = h - z"], "depth > 0.0"

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return no lines: :meth:`detection_code` samples everything."""
        return []

    def contact_height(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Return the heights of the texture."""
        return texture.height(xy)

    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """Return the height of the surface less z."""
        import numpy as np

        top = self.contact_height(texture, np.ascontiguousarray(points[:, :2]))
        return np.asarray(top - points[:, 2])

    def exact_contact(self, texture: HeightField, h: ExactHeight, p: list[Any]) -> tuple[Any, ...]:
        """Return h - z, x, y."""
        return h(p[0], p[1], 0, 0) - p[2], p[0], p[1]

    def probe_positions(
        self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray
    ) -> FloatArray:
        """Return (X, Y, h - depth)."""
        import numpy as np

        return np.column_stack([xy, derivatives[:, 0] - depth])

    def depth_at_height(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Return h - height."""
        return derivatives[:, 0] - height

    def lateral_reach(self, max_depth: float) -> float:
        """Return 0."""
        return 0.0

    def coordinate_scale(self, xy: FloatArray, height: float) -> float:
        """Return |h|."""
        return abs(height)


class NominalContact(VerticalContact):
    """Depth -z, contact point (x, y): the vertical contact with a flat surface at z = 0."""

    name = "nominal"
    begins_on_texture = False
    supports_state = True

    def derivatives(self) -> ContactDerivatives:
        """Return ∇depth = (0, 0, -1) and ∂(X, Y)/∂p of (X, Y) = (x, y)."""
        import sympy as sp

        return ContactDerivatives(sp.Matrix([[0, 0, -1]]), sp.eye(2, 3))

    def detection_code(self, needed: frozenset[str]) -> tuple[list[str], str]:
        """Return the comparison of z with 0."""
        return ["depth = -z"], "depth > 0.0"

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return the lines that sample the texture at the probe."""
        return sampler_call(needed, "x, y")

    def contact_height(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Return zeros."""
        import numpy as np

        return np.zeros(len(xy))

    def extremes(self, texture: HeightField) -> tuple[float, float]:
        """Return 0 and 0."""
        return 0.0, 0.0

    def exact_contact(self, texture: HeightField, h: ExactHeight, p: list[Any]) -> tuple[Any, ...]:
        """Return -z, x, y."""
        return -p[2], p[0], p[1]

    def probe_positions(
        self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray
    ) -> FloatArray:
        """Return (X, Y, -depth)."""
        return super().probe_positions(xy, depth, 0.0 * derivatives)

    def depth_at_height(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Return -height."""
        return super().depth_at_height(height, 0.0 * derivatives)

    def coordinate_scale(self, xy: FloatArray, height: float) -> float:
        """Return 0: the depth is not a difference."""
        return 0.0


VERTICAL = VerticalContact()
NOMINAL = NominalContact()
