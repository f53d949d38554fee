"""What is proved about single laws: closed forms on a sinusoid, and simpler problems.

The closed forms are characteristic numbers for h = A sin(2πx/l) and depths in [0, D]; G₁ = 2πA/l is
the greatest slope, y = 4π²AD/l² the greatest curvature times the depth. All are proved in
docs/theory/numbers.md; the tests compare them with the symbolic definition.

The problems are suprema over cells: of slope, change of the normal and crest curvature, which
depend on the surface alone, and for law F of a norm of two entries.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import NORM, ONE_SIDED
from asperity.analysis.bounds.branch_and_bound import Contacts, Problem, Supremum
from asperity.analysis.bounds.problems import RESOLUTION, Entries, MatrixProblem, stack_entries
from asperity.analysis.bounds.sampling import worst_deflection
from asperity.core.checks import FloatArray
from asperity.enclosures.cells import DERIVATIVE_NAMES, Cells
from asperity.enclosures.taylor import TaylorMath, TaylorModel, TaylorNumber
from asperity.surface import Surface
from asperity.textures.plane_waves import SingleWave

WaveFormula = Callable[[SingleWave, float], float]
# More bisections than double precision allows.
_MAX_ITERATIONS = 200


def _max_slope(wave: SingleWave) -> float:
    return 2.0 * math.pi * wave.amplitude / wave.period


def _max_curvature_depth(wave: SingleWave, depth: float) -> float:
    return 4.0 * math.pi**2 * wave.amplitude * depth / wave.period**2


def q_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """q_A = √(1 + G₁²); the paper's (10)."""
    return math.hypot(1.0, _max_slope(wave))


def q_b(wave: SingleWave, depth: float) -> float:
    """q_B = max(√(1 + G₁²), y)."""
    return max(math.hypot(1.0, _max_slope(wave)), _max_curvature_depth(wave, depth))


def q_c(wave: SingleWave, depth: float) -> float:
    """q_C = max(y, λ) with λ the feasible root of the cubic, if there is one.

    λ³ - (1 + G₁² + E²/4) λ² + (E²/2) λ - E²/4 = 0 with E = 2πD/l; a root is feasible if λ > 1 and
    E (λ - 1) <= 2 G₁ λ. Without one, y = G₁ E > 1 + 2 G₁².
    """
    return max(_max_curvature_depth(wave, depth), _feasible_root(wave, depth))


def _feasible_root(wave: SingleWave, depth: float) -> float:
    """Return the feasible root, 0 for none, by t = 1/λ: (E²/4) t (1 - t)² + (1 + G₁²) t = 1.

    Feasible are t >= 1 - 2 G₁/E. Where the left side is stationary there, it exceeds 1, so it
    crosses 1 at most once before it reaches 1 + G₁² at t = 1.
    """
    g = _max_slope(wave)
    e = 2.0 * math.pi * depth / wave.period
    quarter = e * e / 4.0
    rate = 1.0 + g * g
    low = max(1.0 - 2.0 * g / e, 0.0)
    high = 1.0
    if (quarter * (1.0 - low) ** 2 + rate) * low > 1.0:
        return 0.0
    t = max(1.0 / rate, low)
    for _ in range(_MAX_ITERATIONS):
        off = (quarter * (1.0 - t) ** 2 + rate) * t - 1.0
        if off <= 0.0:
            low = t
        else:
            high = t
        slope = quarter * (1.0 - t) * (1.0 - 3.0 * t) + rate
        step = low
        if slope > 0.0:
            step = t - off / slope
        if not low < step < high:
            step = 0.5 * (low + high)
        if abs(step - t) <= 1e-16 * t:
            break
        t = step
    return 1.0 / t


def q_d(wave: SingleWave, depth: float) -> float:
    """q_D = 1 if y <= 1/2, y/(1 - y) if y < 1, infinite from y = 1 on."""
    return norm_from_curvature(_max_curvature_depth(wave, depth))


def norm_from_curvature(y: float) -> float:
    """Return ‖J‖/k of law D at a product y of depth and curvature, and at least 1."""
    if y >= 1.0:
        return math.inf
    return max(1.0, y / (1.0 - y))


def q_g(wave: SingleWave, depth: float) -> float:
    """q_G = max(1, y)."""
    return max(1.0, _max_curvature_depth(wave, depth))


def one_sided_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """q⁺_A = (1 + √(1 + G₁²))/2: the symmetric part of e_z wᵀ has that eigenvalue."""
    return 0.5 * (1.0 + math.hypot(1.0, _max_slope(wave)))


def phase_steepest(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Return the phase where the flank is steepest."""
    return 0.0


def phase_trough(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Return the phase of the trough."""
    return -0.5 * math.pi


def phase_b(wave: SingleWave, depth: float) -> float:
    """Return the phase at which q_B is attained: on the flank or in the trough."""
    if math.hypot(1.0, _max_slope(wave)) >= _max_curvature_depth(wave, depth):
        return phase_steepest(wave, depth)
    return phase_trough(wave, depth)


def phase_c(wave: SingleWave, depth: float) -> float:
    """sin(phase) = -E (λ - 1)/(2 G₁ λ): there λ is stationary along the profile."""
    root = _feasible_root(wave, depth)
    if root <= _max_curvature_depth(wave, depth):
        return phase_trough(wave, depth)
    e = 2.0 * math.pi * depth / wave.period
    return math.asin(max(-1.0, -0.5 * e * (root - 1.0) / (root * _max_slope(wave))))


def curl_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Sup |curl f_A|/k = G₁: the curl of k δ e_z has the length of k ∇h."""
    return _max_slope(wave)


def curl_e(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Sup |curl f_E|/k = G₁/√(1 + G₁²): the curl of k δₙ e_z has the length of k (n_x, n_y)."""
    return _max_slope(wave) / math.hypot(1.0, _max_slope(wave))


class SurfaceProblem(MatrixProblem):
    """The greatest measure of a matrix that is a formula in derivatives of the height alone."""

    @abstractmethod
    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """Return rows of entries from derivatives and a square root, of models or of arrays.

        Entries that are left out are zero.
        """

    def matrices(self, models: dict[str, TaylorNumber]) -> list[Entries]:
        """See :class:`MatrixProblem`."""
        return [self.formula([models[name] for name in self._names], TaylorMath.sqrt)]

    def exact_matrices(self, coordinates: FloatArray) -> list[FloatArray]:
        """See :class:`MatrixProblem`."""
        derivatives = self.cells.derivatives(coordinates).T[1 : 1 + len(self._names)]
        return [stack_entries(self.formula(list(derivatives), np.sqrt), len(coordinates), 0)[0]]


class SlopeProblem(SurfaceProblem):
    """The greatest slope |∇h|.

    Args:
        cells: of the texture.
        offset: the 1 in √(1 + |∇h|²), whose gap counts; 0 for the slope alone.
    """

    def __init__(self, cells: Cells, offset: float) -> None:
        self._offset = offset
        super().__init__(cells, DERIVATIVE_NAMES[1:3], NORM)

    def formula(self, derivatives: Sequence[Any], _root: Callable[[Any], Any]) -> Entries:
        """See :class:`SurfaceProblem`."""
        return [[part] for part in derivatives]

    def prune_threshold(self, best: float, tolerance: float) -> float:
        """See :class:`Problem`."""
        whole = math.hypot(self._offset, best) * (1.0 + tolerance)
        return math.sqrt((whole - self._offset) * (whole + self._offset))


class NormalChangeProblem(SurfaceProblem):
    """The greatest ‖∂n/∂(x, y)‖, the change of the surface normal [1/m]."""

    def __init__(self, cells: Cells, floor: float) -> None:
        super().__init__(cells, DERIVATIVE_NAMES[1:], NORM, floor)

    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """∂n/∂x and ∂n/∂y as columns: (∂w - n (n · ∂w))/s with w = (-h_x, -h_y, 1)."""
        hx, hy, hxx, hxy, hyy = derivatives
        s = root(1.0 + hx * hx + hy * hy)
        square = 1.0 / (s * s)
        columns = []
        for a, b in ((hxx, hxy), (hxy, hyy)):
            along = (hx * a + hy * b) * square
            columns.append([(hx * along - a) / s, (hy * along - b) / s, -along / s])
        return [[column[row] for column in columns] for row in range(3)]


class CrestProblem(SurfaceProblem):
    """The greatest downward curvature of the surface [1/m].

    Args:
        cells: of the texture.
        depth: depth [m] if only law D's number down to it is needed; then curvatures up to
            1/(2 depth), and differences that do not change the number, are irrelevant.
    """

    def __init__(self, cells: Cells, depth: float | None = None) -> None:
        self._depth = depth
        floor = RESOLUTION if depth is None else 0.5 / depth
        # The missing third curvature is zero, which is never the greatest at a crest.
        super().__init__(cells, DERIVATIVE_NAMES[1:], ONE_SIDED, floor)

    def formula(self, derivatives: Sequence[Any], root: Callable[[Any], Any]) -> Entries:
        """G^(-1/2) H G^(-1/2)/s, whose eigenvalues are the principal curvatures; G = I + g gᵀ.

        G^(-1/2) = I - g gᵀ/(s (1 + s)).
        """
        hx, hy, hxx, hxy, hyy = derivatives
        square = 1.0 + hx * hx + hy * hy
        s = root(square)
        share = 1.0 / (square + s)
        a = 1.0 - hx * hx * share
        b = -(hx * hy * share)
        c = 1.0 - hy * hy * share
        # Columns of H G^(-1/2), then G^(-1/2) from the left.
        p = hxx * a + hxy * b
        q = hxx * b + hxy * c
        r = hxy * a + hyy * b
        t = hxy * b + hyy * c
        return [
            [(a * p + b * r) / s, (a * q + b * t) / s],
            [(b * p + c * r) / s, (b * q + c * t) / s],
        ]

    def upper_bounds(self, centres: FloatArray, half: FloatArray, threshold: float) -> FloatArray:
        """See :class:`Problem`: S = G⁻¹ H / s with G >= 1, s >= 1, so no curvature is above ‖H‖."""
        return np.minimum(super().upper_bounds(centres, half, threshold), self.cells.hessian_bound)

    def prune_threshold(self, best: float, tolerance: float) -> float:
        """See :class:`Problem`: y/(1 - y) within the tolerance, y = depth times curvature."""
        if self._depth is None:
            return super().prune_threshold(best, tolerance)
        y = self._depth * best
        if y >= 1.0:
            return math.inf
        number = max(y / (1.0 - y), 1.0) * (1.0 + tolerance)
        return number / (1.0 + number) / self._depth


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
        entries = self._entries(height * np.sin(angles), slope * np.cos(angles))
        best = int(entries.argmax())
        at = np.array([angles[best] - wave.phase])
        return Supremum(float(entries[best]), upper, at, len(corner), converged=True)


@lru_cache(maxsize=1)
def _half_circle(count: int = 1024) -> tuple[FloatArray, FloatArray, float]:
    """Return the angles where tangents touch a half circle and where they meet, and that radius."""
    touch = np.linspace(-0.5 * math.pi, 0.5 * math.pi, count + 1)
    return touch, 0.5 * (touch[1:] + touch[:-1]), 1.0 / math.cos(0.5 * math.pi / count)
