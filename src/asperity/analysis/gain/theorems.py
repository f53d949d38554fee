"""Theorems about laws beyond their formula: one table, keyed by the law object.

A law that reuses a letter does not inherit its theorem. An entry for a user-defined law:

    register_theorem(MY_LAW, Theorem(constants={ONE_SIDED: Constant(1.0, "the reason")}))
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from asperity.analysis.bounds.bound import CURL, NORM, ONE_SIDED, Bound, JacobianMeasure
from asperity.analysis.bounds.branch_and_bound import Contacts, Problem, Supremum
from asperity.analysis.bounds.sampling import worst_deflection
from asperity.analysis.bounds.surface_problems import NormalChangeProblem, SlopeProblem
from asperity.analysis.gain import closed_forms as forms
from asperity.analysis.gain.medial_axis import (
    SearchOptions,
    crest_number,
    gain_above_crest,
    split_number,
)
from asperity.clamps import BACKED, LATERAL, WHOLE, Clamp
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.enclosures.cells import Cells
from asperity.enclosures.taylor import TaylorModel
from asperity.laws import LAWS, Law
from asperity.surface import Surface


@dataclass(frozen=True)
class Constant:
    """A number that is the same on every surface, attained just inside the highest point.

    Attributes:
        value: the number [1].
        reason: the reason, in one line.
    """

    value: float
    reason: str


@dataclass(frozen=True)
class ClosedForm:
    """A number on h = A sin(2πx/l) in closed form, attained at full depth.

    Attributes:
        value: the number as a function of the wave and the depth [m].
        phase: 2πx/l where it is attained, as a function of the same.
    """

    value: forms.WaveFormula
    phase: forms.WaveFormula


@dataclass(frozen=True)
class Reduction:
    """A number that is a function of the supremum of something simpler than the Jacobian.

    Attributes:
        problem: the simpler problem, over cells.
        to_number: the number as a non-decreasing function of that supremum.
    """

    problem: Callable[[Surface, Cells], Problem]
    to_number: Callable[[Surface, float], float] = lambda _surface, value: value


@dataclass(frozen=True)
class Theorem:
    """Results proved for one law; all others follow from its formula alone.

    Attributes:
        constants: numbers that are the same on every surface.
        closed_forms: numbers on a single wave in closed form.
        special_proofs: numbers with a proof specific to this law, which needs no search on a
            single wave without an extent.
        reductions: numbers given by a simpler problem.
        norm_bound: proved bound of q from the bounds of the height's derivatives alone.
        gain_above_height: sup‖J‖/k over the body above a height [m].
        holds_beyond_medial_axis: whether the numbers are the same above and below the medial axis.
        is_infimum: whether the potential is an infimum of functions with Hessian k I. Then
            U(p + Δ) <= U(p) + ∇U · Δ + k|Δ|²/2 holds across jumps of the force too.
        detects_medial_axis: whether q is infinite exactly where the depth reaches the medial axis,
            at the onset.
        holds_at_any_depth: whether q and q⁺, and the rules that use them, hold at any depth, not
            only down to max_depth.
        not_raised_by_clamp: by depth clamp, numbers that are nowhere greater where the clamp acts
            than above max_depth.
    """

    constants: Mapping[JacobianMeasure, Constant] = field(default_factory=dict)
    closed_forms: Mapping[JacobianMeasure, ClosedForm] = field(default_factory=dict)
    special_proofs: Mapping[JacobianMeasure, Callable[[Surface, SearchOptions], Bound]] = field(
        default_factory=dict
    )
    reductions: Mapping[JacobianMeasure, Reduction] = field(default_factory=dict)
    norm_bound: Callable[[Surface], float] | None = None
    gain_above_height: Callable[[Surface, float], float] | None = None
    holds_beyond_medial_axis: bool = False
    is_infimum: bool = False
    detects_medial_axis: bool = False
    holds_at_any_depth: Callable[[Surface], bool] = lambda _surface: False
    not_raised_by_clamp: Mapping[Clamp, tuple[JacobianMeasure, ...]] = field(default_factory=dict)


# --- law F reduced to two entries -----------------------------------------------------------------
#
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
    swing, friction = surface.parameter("modulation_depth"), surface.parameter("friction")
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
        self.cells, self._measure = cells, measure
        self._surface, self._texture = surface, surface.texture
        _k, middle, half = surface.law_arguments[:3]
        swing = surface.parameter("modulation_depth")
        self._offset, self._share = 0.5 * (1.0 + swing * middle / half), 0.5 * swing / half
        self._friction, self._depth = surface.parameter("friction"), surface.max_depth
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
        n, d = len(centres), len(half)
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
        height, slope = wave.amplitude, self._texture.bounds[0]
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


# --- the table ------------------------------------------------------------------------------------

_UNIT_NORM = Constant(1.0, "‖J‖ is exactly k everywhere")
_SPLIT_REASON = "the potential is an infimum of functions whose Hessian is the identity"
_SQUARED_DISTANCE_REASON = (
    "the potential is half a squared distance, whose Hessian is at most the identity"
)
_LEVEL_REASON = "λ_max of the symmetric part of e_z nᵀ is (1 + n_z)/2, 1 where the surface is level"


def _slope_problem(offset: float) -> Callable[[Surface, Cells], Problem]:
    return lambda _surface, cells: SlopeProblem(cells, offset)


def _norm_bound_from(bound: Callable[[float, float], float]) -> Callable[[Surface], float]:
    """Return a bound of q from M >= |∇h| and DK, D the depth, K >= ‖Hess h‖ (MATH section 4)."""

    def of(surface: Surface) -> float:
        slope, hessian = surface.texture.bounds
        return bound(slope, hessian * surface.max_depth)

    return of


# Why no number is greater where a clamp acts. A: the Jacobian is zero, the wall's, or as above.
# B and G, whole: the remaining columns are those of J, to which the others are orthogonal or zero.
# C: the positive semidefinite w wᵀ is omitted, and 1 <= q⁺. F: blocks of J remain.
_ALL_CLAMPS = (WHOLE, LATERAL, BACKED)


def _friction_reduction(entries: EntryMeasure) -> Reduction:
    return Reduction(lambda surface, cells: FrictionProblem(surface, cells, entries))


THEOREMS: dict[Law, Theorem] = {
    LAWS["W"]: Theorem(
        constants={NORM: _UNIT_NORM, ONE_SIDED: Constant(1.0, "-J = k e_z e_zᵀ")},
        gain_above_height=lambda _surface, _height: 1.0,
        is_infimum=True,
        holds_at_any_depth=lambda _surface: True,
    ),
    LAWS["A"]: Theorem(
        closed_forms={
            NORM: ClosedForm(forms.q_a, forms.phase_steepest),
            ONE_SIDED: ClosedForm(forms.one_sided_a, forms.phase_steepest),
            CURL: ClosedForm(forms.curl_a, forms.phase_steepest),
        },
        reductions={
            NORM: Reduction(_slope_problem(1.0), lambda _surface, slope: math.hypot(1.0, slope)),
            ONE_SIDED: Reduction(
                _slope_problem(1.0), lambda _surface, slope: 0.5 * (1.0 + math.hypot(1.0, slope))
            ),
            CURL: Reduction(_slope_problem(0.0)),
        },
        norm_bound=_norm_bound_from(lambda slope, _curvature: math.hypot(1.0, slope)),
        not_raised_by_clamp=dict.fromkeys(_ALL_CLAMPS, (NORM, ONE_SIDED, CURL)),
    ),
    LAWS["B"]: Theorem(
        closed_forms={NORM: ClosedForm(forms.q_b, forms.phase_b)},
        norm_bound=_norm_bound_from(lambda slope, curvature: math.hypot(1.0, slope) + curvature),
        not_raised_by_clamp={WHOLE: (NORM,)},
    ),
    LAWS["C"]: Theorem(
        closed_forms={
            NORM: ClosedForm(forms.q_c, forms.phase_c),
            ONE_SIDED: ClosedForm(forms.q_c, forms.phase_c),
        },
        norm_bound=_norm_bound_from(lambda slope, curvature: 1.0 + slope * slope + curvature),
        not_raised_by_clamp=dict.fromkeys((WHOLE, BACKED), (ONE_SIDED,)),
    ),
    LAWS["D"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SQUARED_DISTANCE_REASON)},
        special_proofs={NORM: crest_number},
        gain_above_height=gain_above_crest,
        is_infimum=True,
        detects_medial_axis=True,
    ),
    LAWS["E"]: Theorem(
        constants={NORM: _UNIT_NORM, ONE_SIDED: Constant(1.0, _LEVEL_REASON)},
        closed_forms={CURL: ClosedForm(forms.curl_e, forms.phase_steepest)},
        reductions={
            CURL: Reduction(
                _slope_problem(0.0), lambda _surface, slope: slope / math.hypot(1.0, slope)
            )
        },
        gain_above_height=lambda _surface, _height: 1.0,
        holds_beyond_medial_axis=True,
    ),
    LAWS["F"]: Theorem(
        reductions={
            NORM: _friction_reduction(largest_singular_value),
            ONE_SIDED: _friction_reduction(largest_symmetric_eigenvalue),
        },
        norm_bound=norm_bound_f,
        not_raised_by_clamp=dict.fromkeys(_ALL_CLAMPS, (NORM, ONE_SIDED)),
    ),
    LAWS["G"]: Theorem(
        closed_forms={NORM: ClosedForm(forms.q_g, forms.phase_trough)},
        reductions={
            NORM: Reduction(
                lambda surface, cells: NormalChangeProblem(cells, 1.0 / surface.max_depth),
                lambda surface, change: max(1.0, surface.max_depth * change),
            )
        },
        norm_bound=_norm_bound_from(lambda _slope, curvature: max(1.0, curvature)),
        not_raised_by_clamp={WHOLE: (NORM,)},
    ),
    LAWS["H"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SPLIT_REASON)},
        special_proofs={NORM: split_number},
        gain_above_height=lambda surface, _height: max(1.0, surface.parameter("continuity")),
        is_infimum=True,
        # With c <= 1 both are 1 by theorem; with more, q is c only where the god-object splits.
        holds_at_any_depth=lambda surface: surface.parameter("continuity") <= 1.0,
    ),
}


_NO_THEOREM = Theorem()


def _baked_number(measure: JacobianMeasure) -> Callable[[Surface, SearchOptions], Bound]:
    def number(surface: Surface, _options: SearchOptions) -> Bound:
        found = surface.texture.baked_numbers[measure.name]
        note = "hull of the second differences of the field; attained on one side of a knot"
        return Bound(found.lower, found.upper, "certified", found.at, note)

    return number


_BAKED = Theorem(
    special_proofs={measure: _baked_number(measure) for measure in (NORM, ONE_SIDED)},
    gain_above_height=lambda surface, _height: surface.texture.baked_numbers[NORM.name].upper,
)
"""A baked field: its numbers are those of its coefficients."""


def theorem_on(surface: Surface) -> Theorem:
    """Return the theorem of the force that is rendered: of its law, or of a baked field.

    It is empty for a law without an entry.
    """
    return _BAKED if surface.texture.baked_numbers else THEOREMS.get(surface.law, _NO_THEOREM)


def register_theorem(law: Law, theorem: Theorem) -> None:
    """Add the theorem of a user-defined law.

    Raises:
        ParameterError: if this is not a :class:`~asperity.laws.Law`, or has an entry.
    """
    if not isinstance(law, Law):
        raise ParameterError("law", "must be a Law: theorems belong to laws, not to letters", law)
    if law in THEOREMS:
        raise ParameterError("law", f"already has a theorem: {law}")
    THEOREMS[law] = theorem


def derivative_bound(surface: Surface, measure: JacobianMeasure) -> float:
    """Return a bound from |∇h| <= M and ‖Hess h‖ <= K alone; infinite where none is proved.

    q⁺ is at most the norm, |curl| at most twice the norm.
    """
    bound = theorem_on(surface).norm_bound
    norm = math.inf if bound is None else bound(surface)
    return 2.0 * norm if measure is CURL else norm
