"""The number of law F as the supremum of a norm of two entries."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from asperity.analysis.bounds.branch_and_bound import Contacts, Problem, Supremum
from asperity.analysis.bounds.sampling import worst_deflection
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.enclosures.taylor import TaylorModel
from asperity.surface import Surface

# With α = μ δ₀ (1 - m)/d_max, β = μ δ₀ |d| |∇m|/d_max, γ = μ (1 - m) |d|/d_max and unit vectors e
# of -d and e' of ∇m, minus the Jacobian maps (a, c) to (α S a + (β e' · a + γ c) e, c), S being the
# identity while the anchor sticks and a projection while it slides. Its first part is at most
# (α + β)|a| + γ|c| long, so its norm is at most that of [[α + β, γ], [0, 1]], which is attained
# where the anchor sticks, e = e' and |d| = d_max: the deflection against the slope of m. The
# same holds for the symmetric part. In the depth all entries grow.

EntryMeasure = Callable[[FloatArray, FloatArray], FloatArray]


def largest_singular_value(a: FloatArray, b: FloatArray) -> FloatArray:
    """‖[[a, b], [0, 1]]‖₂ = √((T + √(T² - 4a²))/2), T = 1 + a² + b²."""
    t = 1.0 + a * a + b * b
    # T² - 4a² as a product: no cancellation.
    root = np.sqrt(np.maximum((t - 2.0 * a) * (t + 2.0 * a), 0.0))
    return np.asarray(np.sqrt(0.5 * (t + root)))


def largest_symmetric_eigenvalue(a: FloatArray, b: FloatArray) -> FloatArray:
    """λ_max of the symmetric part of [[a, b], [0, 1]]."""
    return np.asarray(0.5 * (1.0 + a + np.hypot(1.0 - a, b)))


def norm_bound_f(surface: Surface) -> float:
    """Return the bound of q_F from the greatest entries that |∇h| <= M allows."""
    swing = surface.parameter("modulation_depth")
    friction = surface.parameter("friction")
    low, high = surface.texture.extremes
    steep = swing * surface.texture.bounds[0] / max(high - low, 1e-300)
    still = 0.5 * (1.0 + swing)
    a = friction * surface.max_depth * (still / surface.parameter("max_deflection") + steep)
    return float(largest_singular_value(np.array([a]), np.array([friction * still]))[0])


class FrictionProblem(Problem):
    """Law F's number, which is that of [[a, b], [0, 1]].

    The worst deflection is opposite to the slope and of greatest length;
    a = μ D ((1 - m)/d_max + |∇m|), b = μ (1 - m). Both numbers of the matrix grow with a and b
    and are convex in them, and a and b are convex in (m, ∇m).
    """

    def __init__(self, surface: Surface, cells: Cells, measure: EntryMeasure) -> None:
        self.cells = cells
        self._measure = measure
        self._surface = surface
        self._texture = surface.texture
        _k, middle, half = surface.law_arguments[:3]
        swing = surface.parameter("modulation_depth")
        self._offset = 0.5 * (1.0 + swing * middle / half)
        self._share = 0.5 * swing / half
        self._friction = surface.parameter("friction")
        self._depth = surface.max_depth
        self._max_deflection = surface.parameter("max_deflection")

    def _entries(self, h: FloatArray, slope: FloatArray) -> FloatArray:
        still = np.maximum(self._offset - self._share * h, 0.0)
        a = self._friction * self._depth * (still / self._max_deflection + self._share * slope)
        return self._measure(a, self._friction * still)

    def upper_bounds(
        self,
        centres: FloatArray,
        half: FloatArray,
        threshold: float,  # noqa: ARG002 - the only bound is cheap
    ) -> FloatArray:
        """See :class:`Problem`."""
        models = self.cells.enclosures(centres, half, ("h", "hx", "hy"))
        n = len(centres)
        d = len(half)
        zero = TaylorModel(np.zeros(n), np.zeros((d, n)), np.zeros(n))
        h, x, y = (m if isinstance(m, TaylorModel) else zero for m in models.values())
        rest = np.hypot(x.e, y.e) * (1.0 + 1e-12)
        best = np.zeros(n)
        for corner in range(2**d):
            signs = np.array([1.0 if corner >> axis & 1 else -1.0 for axis in range(d)])
            slope = np.hypot(x.c + signs @ x.g, y.c + signs @ y.g) + rest
            best = np.maximum(best, self._entries(h.c + signs @ h.g - h.e, slope))
        return np.asarray(best * (1.0 + 1e-13))

    def values(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Problem`."""
        derivatives = self.cells.derivatives(coordinates)
        return self._entries(derivatives[:, 0], np.hypot(derivatives[:, 1], derivatives[:, 2]))

    def contacts(self, coordinates: FloatArray) -> list[Contacts]:
        """See :class:`Problem`: at full depth, with the deflection opposite to the slope."""
        slope = self._texture.gradient(self.cells.to_plane(coordinates))
        depth = np.full(len(coordinates), self._depth)
        return [Contacts(depth, worst_deflection(self._surface, slope), sliding=False)]

    def direct_bound(self) -> Supremum | None:
        """See :class:`Problem`: on a single wave.

        There (h, |∇h|) runs along half an ellipse, which a polygon of tangents encloses; a convex
        number that grows with |∇h| is greatest at its corners, or where they touch.
        """
        wave = self._texture.single_wave
        if wave is None:
            return None
        touch, corner, radius = _half_circle()
        height = wave.amplitude
        slope = self._texture.bounds[0]
        values = self._entries(height * np.sin(touch), slope * np.cos(touch))
        beyond = self._entries(height * radius * np.sin(corner), slope * radius * np.cos(corner))
        upper = max(float(values.max()), float(beyond.max())) * (1.0 + 1e-13)
        index = min(max(int(values.argmax()), 1), len(values) - 2)
        before, here, after = values[index - 1 : index + 2]
        second = before - 2.0 * here + after
        shift = 0.5 * (before - after) / second if second < 0.0 else 0.0
        step = float(touch[1] - touch[0])
        angles = np.array(
            [touch[values.argmax()], touch[index] + step * min(max(shift, -1.0), 1.0)]
        )
        found = self._entries(height * np.sin(angles), slope * np.cos(angles))
        best = int(found.argmax())
        at = np.array([angles[best] - wave.phase])
        return Supremum(float(found[best]), upper, at, len(corner), converged=True)


@lru_cache(maxsize=1)
def _half_circle(count: int = 1024) -> tuple[FloatArray, FloatArray, float]:
    """Return the angles where tangents touch a half circle and where they meet, and that radius."""
    touch = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count + 1)
    return touch, 0.5 * (touch[1:] + touch[:-1]), 1.0 / math.cos(0.5 * math.pi / count)
