"""The contacts: nominal, vertical, nearest and split.

Nominal: the smooth wall z < 0; the texture changes the force, not where contact begins. Vertical:
the textured surface z < h(x, y), with the contact point straight above the probe. Nearest: the
god-object, the globally closest point of the textured surface. Split: the mean z̄ of a god-object
that has split into several surface points.
"""

from __future__ import annotations

from types import ModuleType
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


class NearestContact(Contact):
    """Depth |p - p_h|, contact point p_h; p_h jumps at the medial axis, where two points tie."""

    name = "nearest"
    relative_cost = 100.0
    has_warm_start = True
    max_evaluations = 1500.0

    def derivatives(self) -> ContactDerivatives:
        """Return ∇depth = -n and, by the implicit function theorem, ∂(X, Y)/∂p = Q⁻¹ [I g].

        Q = I + g gᵀ + (h - z) H, where h - z = depth / s because p_h - p is along the normal
        (docs/theory/jacobians.md).
        """
        import sympy as sp

        from asperity.contacts.symbols import DEPTH, HX, HXX, HXY, HY, HYY

        root = sp.sqrt(1 + HX**2 + HY**2)
        q11, q12, q22, r = sp.symbols("q11 q12 q22 r", real=True)
        definitions = (
            (q11, 1 + HX**2 + DEPTH / root * HXX),
            (q12, HX * HY + DEPTH / root * HXY),
            (q22, 1 + HY**2 + DEPTH / root * HYY),
            (r, 1 / (q11 * q22 - q12**2)),
        )
        inverse = r * sp.Matrix([[q22, -q12], [-q12, q11]])
        return ContactDerivatives(
            depth_gradient=sp.Matrix([[HX, HY, -1]]) / root,
            point_derivative=inverse * sp.Matrix([[1, 0, HX], [0, 1, HY]]),
            definitions=definitions,
        )

    def inward_direction(self) -> Any:
        """Return the downward normal at the closest point."""
        from asperity.contacts.symbols import unit_normal

        return -unit_normal()

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the warm-started search, with a fallback for a search without a budget."""
        from asperity.contacts import warm_search

        return (warm_search,)

    def detection_code(self, needed: frozenset[str]) -> tuple[list[str], str]:
        """Return the comparison with the height at the probe: no search out of contact."""
        return [], "sample_height(x, y, texture) - z > 0.0"

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return the search, which also returns the slopes at the closest point."""
        return self._closest_point_code("closest_point(x, y, z, texture)", needed)

    def warm_start_code(self, needed: frozenset[str]) -> list[str]:
        """Return the search that starts from the last closest point, within a budget."""
        return self._closest_point_code("closest_point_warm(x, y, z, warm_start, texture)", needed)

    def depth_code(self) -> list[str]:
        """Return the distance found with half the budget of a tick; it is never too short."""
        lines, condition = self.detection_code(frozenset())
        search_call = (
            f"closest_point_within_budget(x, y, z, x, y, {0.5 * self.max_evaluations}, texture)"
        )
        return [
            *[*lines, f"if not {condition}:", "    return 0.0"],
            f"closest_x, closest_y, h, _hx, _hy, _error_bound, _evaluations = {search_call}",
            "return math.sqrt((x - closest_x)**2 + (y - closest_y)**2 + (z - h)**2)",
        ]

    @staticmethod
    def _closest_point_code(call: str, needed: frozenset[str]) -> list[str]:
        return [
            f"closest_x, closest_y, h, hx, hy = {call}",
            *sampler_call(needed & {"hxx", "hxy", "hyy"}, "closest_x, closest_y"),
            "depth = math.sqrt((x - closest_x)**2 + (y - closest_y)**2 + (z - h)**2)",
        ]

    def contact_height(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """Return the heights of the texture."""
        return texture.height(xy)

    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """Return the distance to the surface, negative outside of the body."""
        import numpy as np

        closest = texture.nearest(points)
        below = points[:, 2] < texture.height(np.ascontiguousarray(points[:, :2]))
        return np.asarray(np.where(below, 1.0, -1.0) * np.linalg.norm(closest - points, axis=1))

    def depth_axis(self, texture: HeightField, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the normal line through the closest point, into the body."""
        import numpy as np

        closest = texture.nearest(point[None])[0]
        hx, hy = texture.gradient(closest[None, :2])[0]
        inward = np.array([hx, hy, -1.0])
        return closest, inward / np.linalg.norm(inward)

    def exact_contact(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """Return the closest point, by Newton's method from the one of the kernels.

        Solves (X - x) + (h - z) h_x = 0, (Y - y) + (h - z) h_y = 0.
        """
        import mpmath

        def conditions(fx: Any, fy: Any) -> list[Any]:
            gap = h(fx, fy, 0, 0) - p[2]
            return [fx - p[0] + gap * h(fx, fy, 1, 0), fy - p[1] + gap * h(fx, fy, 0, 1)]

        start = texture.nearest([[float(c) for c in p]])[0]
        fx, fy = mpmath.findroot(conditions, start[:2].tolist(), verify=False)
        away = [fx - p[0], fy - p[1], h(fx, fy, 0, 0) - p[2]]
        distance = mpmath.sqrt(sum(part**2 for part in away))
        return (distance if h(p[0], p[1], 0, 0) > p[2] else -distance), fx, fy

    def probe_positions(
        self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray
    ) -> FloatArray:
        """Return the points below the closest point along its normal."""
        import numpy as np

        h, hx, hy = derivatives[:, :3].T
        below = depth / np.sqrt(1.0 + hx * hx + hy * hy)
        return np.column_stack([xy[:, 0] + below * hx, xy[:, 1] + below * hy, h - below])

    def depth_at_height(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Return the depths at which the normal line reaches the height."""
        import numpy as np

        above = derivatives[:, 0] - height
        return np.asarray(above * np.sqrt(1.0 + derivatives[:, 1] ** 2 + derivatives[:, 2] ** 2))


NEAREST = NearestContact()


class SplitContact(NearestContact):
    """A law receives the vector to the mean and its derivative.

    Down to the fraction c/(1 + c) of the distance to the medial axis the mean is the closest point,
    and has its properties (docs/theory/split.md).
    """

    name = "split"
    relative_cost = 1000.0
    max_evaluations = 2800.0
    bounds_force_error = True
    single_valued = True
    is_determined_by_depth = False
    has_potential_field = True
    parameters = ("continuity",)
    height_names = frozenset({"tz"})
    height_expression = "(z + tz)"

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the general solver; a texture kind may provide ``split_contact`` etc. itself."""
        from asperity.contacts import split_evaluation, split_optimality, split_solver

        return split_evaluation, split_solver, split_optimality, *super().kernels()

    def exact_contact(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """Return None: the definition is a supremum over space; its theorems are tested instead."""
        return None

    def warm_start_code(self, needed: frozenset[str]) -> list[str]:
        """Return the vector to the mean and the energy, from the atoms of the last tick."""
        arguments = "x, y, z, param_continuity, warm_start, texture"
        return [f"tx, ty, tz, energy_tk = split_contact_energy({arguments})"]

    def sampling_code(self, needed: frozenset[str]) -> list[str]:
        """Return the vector to the mean, with its derivative or energy if needed."""
        if "energy_tk" in needed:
            return ["energy_tk, _count, _gap = split_energy(x, y, z, param_continuity, texture)"]
        if "mxx" in needed:
            derivative = "tx, ty, tz, mxx, mxy, mxz, myy, myz, mzz"
            return [f"{derivative} = split_derivative(x, y, z, param_continuity, texture)"]
        return ["tx, ty, tz = split_contact(x, y, z, param_continuity, texture)"]

    def derivatives(self) -> ContactDerivatives:
        """Return zeros; see :meth:`jacobian_contribution`."""
        import sympy as sp

        return ContactDerivatives(sp.zeros(1, 3), sp.zeros(2, 3))

    def formula_symbols(self) -> tuple[Any, ...]:
        """Return the components of the vector from the probe to the mean."""
        from asperity.contacts.symbols import CONTACT_VECTOR

        return tuple(CONTACT_VECTOR)

    def potential(self, force: Any) -> Any:
        """Return k U of a force that is k times the vector to the mean."""
        import sympy as sp

        from asperity.contacts.symbols import CONTACT_ENERGY, CONTACT_VECTOR

        k = force[0].coeff(CONTACT_VECTOR[0])
        spring = k != 0 and not k.free_symbols & set(CONTACT_VECTOR)
        return k * CONTACT_ENERGY if spring and force == k * sp.Matrix(CONTACT_VECTOR) else None

    def contact_vector(self) -> Any:
        """Return z̄ - p [m]."""
        import sympy as sp

        from asperity.contacts.symbols import CONTACT_VECTOR

        return sp.Matrix(CONTACT_VECTOR)

    def jacobian_contribution(self, force: Any) -> Any:
        """Return ∂f/∂(z̄ - p) ∂(z̄ - p)/∂p."""
        from asperity.contacts.symbols import CONTACT_VECTOR, CONTACT_VECTOR_DERIVATIVE

        return force.jacobian(list(CONTACT_VECTOR)) * CONTACT_VECTOR_DERIVATIVE


SPLIT = SplitContact()
