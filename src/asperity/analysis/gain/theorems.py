"""Theorems about laws beyond their formula: one table, keyed by the law object.

A law that reuses a letter does not inherit its theorem.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from asperity.analysis.bounds.bound import (
    CURL,
    NORM,
    ONE_SIDED,
    Bound,
    JacobianMeasure,
    scale_upper_bound,
)
from asperity.analysis.bounds.branch_and_bound import Problem
from asperity.analysis.gain import medial_axis, proofs
from asperity.analysis.gain.proofs import (
    NormalChangeProblem,
    SlopeProblem,
    WaveFormula,
    curl_a,
    curl_e,
    one_sided_a,
    phase_b,
    phase_c,
    phase_steepest,
    phase_trough,
    q_a,
    q_b,
    q_c,
    q_g,
)
from asperity.enclosures.cells import Cells
from asperity.laws import LAWS, Law
from asperity.laws.clamps import BACKED, LATERAL, WHOLE, Clamp
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

    value: WaveFormula
    phase: WaveFormula


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
        residual: for a law with curl, |r|/(k δ) at most, f = -∇U + r with a potential U of
            choice, as a function of the angle of the steepest slope; see docs/theory/friction.md.
    """

    constants: Mapping[JacobianMeasure, Constant] = field(default_factory=dict)
    closed_forms: Mapping[JacobianMeasure, ClosedForm] = field(default_factory=dict)
    special_proofs: Mapping[
        JacobianMeasure, Callable[[Surface, medial_axis.SearchOptions], Bound]
    ] = field(default_factory=dict)
    reductions: Mapping[JacobianMeasure, Reduction] = field(default_factory=dict)
    norm_bound: Callable[[Surface], float] | None = None
    gain_above_height: Callable[[Surface, float], float] | None = None
    holds_beyond_medial_axis: bool = False
    is_infimum: bool = False
    detects_medial_axis: bool = False
    holds_at_any_depth: Callable[[Surface], bool] = lambda _surface: False
    not_raised_by_clamp: Mapping[Clamp, tuple[JacobianMeasure, ...]] = field(default_factory=dict)
    residual: Callable[[float], float] | None = None


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
    """Return a bound of q from M >= |∇h| and DK, D the depth, K >= ‖Hess h‖."""

    def of(surface: Surface) -> float:
        slope, hessian = surface.texture.bounds
        return bound(slope, hessian * surface.max_depth)

    return of


# Why no number is greater where a clamp acts. A: the Jacobian is zero, the wall's, or as above.
# B and G, whole: the remaining columns are those of J, to which the others are orthogonal or zero.
# C: the positive semidefinite w wᵀ is omitted, and 1 <= q⁺. F: blocks of J remain.
_ALL_CLAMPS = (WHOLE, LATERAL, BACKED)


def _friction_reduction(entries: proofs.EntryMeasure) -> Reduction:
    return Reduction(lambda surface, cells: proofs.FrictionProblem(surface, cells, entries))


THEOREMS: dict[Law, Theorem] = {
    LAWS["W"]: Theorem(
        constants={NORM: _UNIT_NORM, ONE_SIDED: Constant(1.0, "-J = k e_z e_zᵀ")},
        gain_above_height=lambda _surface, _height: 1.0,
        is_infimum=True,
        holds_at_any_depth=lambda _surface: True,
    ),
    LAWS["A"]: Theorem(
        closed_forms={
            NORM: ClosedForm(q_a, phase_steepest),
            ONE_SIDED: ClosedForm(one_sided_a, phase_steepest),
            CURL: ClosedForm(curl_a, phase_steepest),
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
        residual=math.sin,
    ),
    LAWS["B"]: Theorem(
        closed_forms={NORM: ClosedForm(q_b, phase_b)},
        norm_bound=_norm_bound_from(lambda slope, curvature: math.hypot(1.0, slope) + curvature),
        not_raised_by_clamp={WHOLE: (NORM,)},
        residual=lambda angle: math.tan(0.5 * angle) ** 2,
    ),
    LAWS["C"]: Theorem(
        closed_forms={NORM: ClosedForm(q_c, phase_c), ONE_SIDED: ClosedForm(q_c, phase_c)},
        norm_bound=_norm_bound_from(lambda slope, curvature: 1.0 + slope * slope + curvature),
        not_raised_by_clamp=dict.fromkeys((WHOLE, BACKED), (ONE_SIDED,)),
    ),
    LAWS["D"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SQUARED_DISTANCE_REASON)},
        special_proofs={NORM: medial_axis.crest_number},
        gain_above_height=medial_axis.gain_above_crest,
        is_infimum=True,
        detects_medial_axis=True,
    ),
    LAWS["E"]: Theorem(
        constants={NORM: _UNIT_NORM, ONE_SIDED: Constant(1.0, _LEVEL_REASON)},
        closed_forms={CURL: ClosedForm(curl_e, phase_steepest)},
        reductions={
            CURL: Reduction(
                _slope_problem(0.0), lambda _surface, slope: slope / math.hypot(1.0, slope)
            )
        },
        gain_above_height=lambda _surface, _height: 1.0,
        holds_beyond_medial_axis=True,
        residual=math.sin,
    ),
    LAWS["F"]: Theorem(
        reductions={
            NORM: _friction_reduction(proofs.largest_singular_value),
            ONE_SIDED: _friction_reduction(proofs.largest_symmetric_eigenvalue),
        },
        norm_bound=proofs.norm_bound_f,
        not_raised_by_clamp=dict.fromkeys(_ALL_CLAMPS, (NORM, ONE_SIDED)),
    ),
    LAWS["G"]: Theorem(
        closed_forms={NORM: ClosedForm(q_g, phase_trough)},
        reductions={
            NORM: Reduction(
                lambda surface, cells: NormalChangeProblem(cells, 1.0 / surface.max_depth),
                lambda surface, change: max(1.0, surface.max_depth * change),
            )
        },
        norm_bound=_norm_bound_from(lambda _slope, curvature: max(1.0, curvature)),
        not_raised_by_clamp={WHOLE: (NORM,)},
        residual=math.sin,
    ),
    LAWS["H"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SPLIT_REASON)},
        special_proofs={NORM: medial_axis.split_number},
        gain_above_height=lambda surface, _height: max(1.0, surface.parameter("continuity")),
        is_infimum=True,
        # With c <= 1 both are 1 by theorem; with more, q is c only where the god-object splits.
        holds_at_any_depth=lambda surface: surface.parameter("continuity") <= 1.0,
    ),
}


_NO_THEOREM = Theorem()


def _baked_number(
    measure: JacobianMeasure,
) -> Callable[[Surface, medial_axis.SearchOptions], Bound]:
    def number(surface: Surface, _options: medial_axis.SearchOptions) -> Bound:
        baked = surface.texture.baked_numbers[measure.name]
        note = "hull of the second differences of the field; attained on one side of a knot"
        return Bound(baked.lower, baked.upper, "certified", baked.at, note)

    return number


# A baked field: its numbers are those of its coefficients, in all of space. The field of a body
# ends within it.
_BAKED = Theorem(
    special_proofs={measure: _baked_number(measure) for measure in (NORM, ONE_SIDED)},
    gain_above_height=lambda surface, _height: surface.texture.baked_numbers[NORM.name].upper,
    holds_at_any_depth=lambda surface: not surface.texture.is_body,
)


def theorem_on(surface: Surface) -> Theorem:
    """Return the theorem of the force that is rendered: of its law, or of a baked field.

    It is empty for a law without an entry.
    """
    if surface.texture.baked_numbers:
        return _BAKED
    return THEOREMS.get(surface.law, _NO_THEOREM)


def derivative_bound(surface: Surface, measure: JacobianMeasure) -> float:
    """Return a bound from |∇h| <= M and ‖Hess h‖ <= K alone; infinite where none is proved.

    q⁺ is at most the norm, |curl| at most twice the norm.
    """
    norm_bound = theorem_on(surface).norm_bound
    if norm_bound is None:
        return math.inf
    if measure is CURL:
        return 2.0 * norm_bound(surface)
    return norm_bound(surface)


def residual_bound(surface: Surface) -> float:
    """Return a proved bound of |r| [N], f = -∇U + r; infinite where none is proved.

    Dry friction of that size absorbs what the field gains on every closed path. It also holds below
    max_depth for a clamp that holds the whole force there.
    """
    clamp = surface.effective_clamp
    residual = theorem_on(surface).residual
    if residual is None or (clamp.changes_force and not clamp.holds_whole_force):
        return math.inf
    angle = math.atan(surface.texture.bounds[0])
    return scale_upper_bound(residual(angle) * (1.0 + 1e-12), surface.stiffness * surface.max_depth)
