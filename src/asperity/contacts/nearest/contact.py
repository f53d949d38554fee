"""The nearest contact: the god-object, the globally nearest point of the textured surface."""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

from asperity.contacts.contact import Contact, ContactDerivatives, ExactHeight, HeightField
from asperity.contacts.sampler import sampled

if TYPE_CHECKING:
    from asperity.checks import FloatArray


class Nearest(Contact):
    """Depth |p - p_h|, contact point p_h; two points tie on the medial axis, where it jumps."""

    name = "nearest"
    cost = 100.0
    remembers = True
    looks = 600.0

    def derivatives(self) -> ContactDerivatives:
        """Return ∇depth = -n and, by the implicit function theorem, ∂(X, Y)/∂p = Q⁻¹ [I g].

        Q = I + g gᵀ + (h - z) H, where h - z = depth / s because the foot lies along the normal
        (MATH section 3).
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

    def inward(self) -> Any:
        """Against the normal at the foot."""
        from asperity.contacts.symbols import unit_normal

        return -unit_normal()

    def kernels(self) -> tuple[ModuleType, ...]:
        """The query that is asked tick after tick, and a search without a budget."""
        from asperity.contacts.nearest import again, whole_within

        return again, whole_within

    def begin_code(self, wanted: frozenset[str]) -> tuple[list[str], str]:
        """Below the height at the probe: no search out of contact."""
        return [], "height(x, y, texture) - z > 0.0"

    def sample_code(self, wanted: frozenset[str]) -> list[str]:
        """The search knows the slopes at the foot."""
        return self._code("foot(x, y, z, texture)", wanted)

    def again_code(self, wanted: frozenset[str]) -> list[str]:
        """The search starts from the last foot, and has a budget."""
        return self._code("foot_again(x, y, z, memory, texture)", wanted)

    def depth_code(self) -> list[str]:
        """The distance, of half as many looks as a tick: never too short, no limit is missed."""
        lines, condition = self.begin_code(frozenset())
        found = f"foot_within(x, y, z, x, y, {0.5 * self.looks}, texture)"
        return [
            *lines,
            f"if not {condition}:",
            "    return 0.0",
            f"foot_x, foot_y, h, _hx, _hy, _gap, _looks = {found}",
            "return math.sqrt((x - foot_x)**2 + (y - foot_y)**2 + (z - h)**2)",
        ]

    @staticmethod
    def _code(call: str, wanted: frozenset[str]) -> list[str]:
        return [
            f"foot_x, foot_y, h, hx, hy = {call}",
            *sampled(wanted & {"hxx", "hxy", "hyy"}, "foot_x, foot_y"),
            "depth = math.sqrt((x - foot_x)**2 + (y - foot_y)**2 + (z - h)**2)",
        ]

    def begin(self, texture: HeightField, xy: FloatArray) -> FloatArray:
        """At the textured surface."""
        return texture.height(xy)

    def depth(self, texture: HeightField, points: FloatArray) -> FloatArray:
        """Distance to the surface, negative outside of the body."""
        import numpy as np

        feet = texture.nearest(points)
        below = points[:, 2] < texture.height(np.ascontiguousarray(points[:, :2]))
        return np.asarray(np.where(below, 1.0, -1.0) * np.linalg.norm(feet - points, axis=1))

    def column(self, texture: HeightField, point: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Along the normal at the foot, into the body."""
        import numpy as np

        foot = texture.nearest(point[None])[0]
        hx, hy = texture.gradient(foot[None, :2])[0]
        inward = np.array([hx, hy, -1.0])
        return foot, inward / np.linalg.norm(inward)

    def exact_point(
        self, texture: HeightField, h: ExactHeight, p: list[Any]
    ) -> tuple[Any, ...] | None:
        """The foot, by Newton's method from the kernels' own.

        Solves (X - x) + (h - z) h_x = 0, (Y - y) + (h - z) h_y = 0.
        """
        import mpmath

        start = texture.nearest([[float(c) for c in p]])[0]
        fx, fy = mpmath.mpf(start[0]), mpmath.mpf(start[1])
        for _ in range(60):
            gap, hx, hy = h(fx, fy, 0, 0) - p[2], h(fx, fy, 1, 0), h(fx, fy, 0, 1)
            hxx, hxy, hyy = h(fx, fy, 2, 0), h(fx, fy, 1, 1), h(fx, fy, 0, 2)
            a, b = fx - p[0] + gap * hx, fy - p[1] + gap * hy
            qxx, qxy, qyy = 1 + hx * hx + gap * hxx, hx * hy + gap * hxy, 1 + hy * hy + gap * hyy
            det = qxx * qyy - qxy * qxy
            sx, sy = (qxy * b - qyy * a) / det, (qxy * a - qxx * b) / det
            fx, fy = fx + sx, fy + sy
            if abs(sx) + abs(sy) <= mpmath.eps * (abs(fx) + abs(fy) + abs(gap)):
                break
        away = [fx - p[0], fy - p[1], h(fx, fy, 0, 0) - p[2]]
        distance = mpmath.sqrt(sum(part**2 for part in away))
        return (distance if h(p[0], p[1], 0, 0) > p[2] else -distance), fx, fy

    def probe(self, xy: FloatArray, depth: FloatArray, derivatives: FloatArray) -> FloatArray:
        """Below the foot along its normal."""
        import numpy as np

        h, hx, hy = derivatives[:, :3].T
        below = depth / np.sqrt(1.0 + hx * hx + hy * hy)
        return np.column_stack([xy[:, 0] + below * hx, xy[:, 1] + below * hy, h - below])

    def greatest_depth(self, height: float, derivatives: FloatArray) -> FloatArray:
        """Where the foot's normal line sinks below the height."""
        import numpy as np

        above = derivatives[:, 0] - height
        return np.asarray(above * np.sqrt(1.0 + derivatives[:, 1] ** 2 + derivatives[:, 2] ** 2))


NEAREST = Nearest()
