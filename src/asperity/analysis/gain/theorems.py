"""What is proved of a law beyond its formula: one table, keyed by the law object.

A law that borrows a letter borrows no theorem. An entry of one's own, for a law of one's own:

    register_theorem(MY_LAW, Theorem(constants={ONE_SIDED: Constant(1.0, "the reason")}))
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.branch_and_bound import Problem
from asperity.analysis.bounds.measures import CURL, NORM, ONE_SIDED, Number
from asperity.analysis.bounds.problems import SlopeProblem, normal_problem
from asperity.analysis.gain import closed_forms as forms
from asperity.analysis.gain.friction import (
    Entries,
    FrictionProblem,
    largest_singular_value,
    largest_symmetric_eigenvalue,
    most_f,
)
from asperity.analysis.gain.god_object import crest_number, gain_above_crest, split_number
from asperity.analysis.gain.search import Search
from asperity.enclosures.cells import Cells
from asperity.errors import ParameterError
from asperity.kernels.probe import ClampName
from asperity.laws import LAWS, Law
from asperity.surface import Surface


@dataclass(frozen=True)
class Constant:
    """A number that is the same on every surface, attained just inside the highest point.

    Attributes:
        value: of the number [1].
        reason: why, in one line.
    """

    value: float
    reason: str


@dataclass(frozen=True)
class ClosedForm:
    """A number on h = A sin(2πx/l) in closed form, attained at full depth.

    Attributes:
        value: from the wave and the depth [m].
        phase: 2πx/l where it is attained, from the same.
    """

    value: forms.ClosedForm
    phase: forms.ClosedForm


@dataclass(frozen=True)
class Reduction:
    """A number that is a function of the supremum of something simpler than the Jacobian.

    Attributes:
        problem: the simpler thing, over cells.
        step: the number from that supremum; it does not fall.
    """

    problem: Callable[[Surface, Cells], Problem]
    step: Callable[[Surface, float], float] = lambda _surface, value: value


@dataclass(frozen=True)
class Theorem:
    """What is proved of one law; whatever is left out follows from its formula alone.

    Attributes:
        constants: numbers that are the same on every surface.
        on_a_wave: numbers on a single wave in closed form.
        own_way: numbers that a proof of their own gives.
        reductions: numbers that a simpler problem gives.
        norm_at_most: proved bound of q from the bounds of the height's derivatives alone.
        gain_above: sup‖J‖/k over the body above a height [m].
        on_every_foot: whether the numbers are the same above and below the medial axis.
        infimum: whether the potential is an infimum of functions with Hessian k I. Then
            U(p + Δ) <= U(p) + ∇U · Δ + k|Δ|²/2 holds across jumps of the force too.
        knows_medial_axis: whether q is infinite exactly where the depth reaches the medial axis,
            at the onset.
        at_any_depth: whether q and q⁺ of a surface, and the rules that rest on them, hold however
            deep the probe is, not down to max_depth alone.
        held: by depth clamp, numbers that are nowhere greater where the clamp acts than above
            max_depth.
    """

    constants: Mapping[Number, Constant] = field(default_factory=dict)
    on_a_wave: Mapping[Number, ClosedForm] = field(default_factory=dict)
    own_way: Mapping[Number, Callable[[Surface, Search], Bound]] = field(default_factory=dict)
    reductions: Mapping[Number, Reduction] = field(default_factory=dict)
    norm_at_most: Callable[[Surface], float] | None = None
    gain_above: Callable[[Surface, float], float] | None = None
    on_every_foot: bool = False
    infimum: bool = False
    knows_medial_axis: bool = False
    at_any_depth: Callable[[Surface], bool] = lambda _surface: False
    held: Mapping[ClampName, tuple[Number, ...]] = field(default_factory=dict)


# --- the table ------------------------------------------------------------------------------------

_UNIT = Constant(1.0, "‖J‖ is exactly k everywhere")
_SPLIT = "the potential is an infimum of functions whose Hessian is the identity"
_SQUARE = "the potential is half a squared distance, whose Hessian is at most the identity"
_LEVEL = "λ_max of the symmetric part of e_z nᵀ is (1 + n_z)/2, 1 where the surface is level"


def _slope(beside: float) -> Callable[[Surface, Cells], Problem]:
    return lambda _surface, cells: SlopeProblem(cells, beside)


def _at_most(bound: Callable[[float, float], float]) -> Callable[[Surface], float]:
    """Return a bound of q from M >= |∇h| and DK, D the depth, K >= ‖Hess h‖ (MATH section 4)."""

    def of(surface: Surface) -> float:
        slope, bend = surface.texture.bounds
        return bound(slope, bend * surface.max_depth)

    return of


# Why nothing is greater where a clamp acts. A: the Jacobian is zero, the wall's, or as above. B and
# G, whole: the columns that are left are those of J, whose others are at right angles or left out.
# C: the positive w wᵀ is left out, and 1 <= q⁺. F: blocks of J are left.
_EVERY_CLAMP: tuple[ClampName, ...] = ("whole", "lateral", "backed")


def _friction(entries: Entries) -> Reduction:
    return Reduction(lambda surface, cells: FrictionProblem(surface, cells, entries))


THEOREMS: dict[Law, Theorem] = {
    LAWS["W"]: Theorem(
        constants={NORM: _UNIT, ONE_SIDED: Constant(1.0, "-J = k e_z e_zᵀ")},
        gain_above=lambda _surface, _height: 1.0,
        infimum=True,
        at_any_depth=lambda _surface: True,
    ),
    LAWS["A"]: Theorem(
        on_a_wave={
            NORM: ClosedForm(forms.q_a, forms.steepest),
            ONE_SIDED: ClosedForm(forms.one_sided_a, forms.steepest),
            CURL: ClosedForm(forms.curl_a, forms.steepest),
        },
        reductions={
            NORM: Reduction(_slope(1.0), lambda _surface, slope: math.hypot(1.0, slope)),
            ONE_SIDED: Reduction(
                _slope(1.0), lambda _surface, slope: 0.5 * (1.0 + math.hypot(1.0, slope))
            ),
            CURL: Reduction(_slope(0.0)),
        },
        norm_at_most=_at_most(lambda slope, _bend: math.hypot(1.0, slope)),
        held=dict.fromkeys(_EVERY_CLAMP, (NORM, ONE_SIDED, CURL)),
    ),
    LAWS["B"]: Theorem(
        on_a_wave={NORM: ClosedForm(forms.q_b, forms.phase_b)},
        norm_at_most=_at_most(lambda slope, bend: math.hypot(1.0, slope) + bend),
        held={"whole": (NORM,)},
    ),
    LAWS["C"]: Theorem(
        on_a_wave={
            NORM: ClosedForm(forms.q_c, forms.phase_c),
            ONE_SIDED: ClosedForm(forms.q_c, forms.phase_c),
        },
        norm_at_most=_at_most(lambda slope, bend: 1.0 + slope * slope + bend),
        held=dict.fromkeys(("whole", "backed"), (ONE_SIDED,)),
    ),
    LAWS["D"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SQUARE)},
        own_way={NORM: crest_number},
        gain_above=gain_above_crest,
        infimum=True,
        knows_medial_axis=True,
    ),
    LAWS["E"]: Theorem(
        constants={NORM: _UNIT, ONE_SIDED: Constant(1.0, _LEVEL)},
        on_a_wave={CURL: ClosedForm(forms.curl_e, forms.steepest)},
        reductions={
            CURL: Reduction(_slope(0.0), lambda _surface, slope: slope / math.hypot(1.0, slope))
        },
        gain_above=lambda _surface, _height: 1.0,
        on_every_foot=True,
    ),
    LAWS["F"]: Theorem(
        reductions={
            NORM: _friction(largest_singular_value),
            ONE_SIDED: _friction(largest_symmetric_eigenvalue),
        },
        norm_at_most=most_f,
        held=dict.fromkeys(_EVERY_CLAMP, (NORM, ONE_SIDED)),
    ),
    LAWS["G"]: Theorem(
        on_a_wave={NORM: ClosedForm(forms.q_g, forms.trough)},
        reductions={
            NORM: Reduction(
                lambda surface, cells: normal_problem(cells, 1.0 / surface.max_depth),
                lambda surface, change: max(1.0, surface.max_depth * change),
            )
        },
        norm_at_most=_at_most(lambda _slope, bend: max(1.0, bend)),
        held={"whole": (NORM,)},
    ),
    LAWS["H"]: Theorem(
        constants={ONE_SIDED: Constant(1.0, _SPLIT)},
        own_way={NORM: split_number},
        gain_above=lambda surface, _height: max(1.0, surface.parameter("continuity")),
        infimum=True,
        # With c <= 1 both are 1 by theorem; with more, q is c only where the god-object splits.
        at_any_depth=lambda surface: surface.parameter("continuity") <= 1.0,
    ),
}


_NOTHING = Theorem()


def theorem_of(law: Law) -> Theorem:
    """Return what is proved of a law: of one without an entry, nothing."""
    return THEOREMS.get(law, _NOTHING)


def register_theorem(law: Law, theorem: Theorem) -> None:
    """Add what is proved of a law of one's own.

    Raises:
        ParameterError: for anything but a :class:`~asperity.laws.Law`, or a law with an entry.
    """
    if not isinstance(law, Law):
        raise ParameterError("law", "must be a Law: theorems belong to laws, not to letters", law)
    if law in THEOREMS:
        raise ParameterError("law", f"has its theorem already: {law}")
    THEOREMS[law] = theorem


def safe_bound(surface: Surface, number: Number) -> float:
    """Return a bound from |∇h| <= M and ‖Hess h‖ <= K alone; infinite where none is proved.

    q⁺ is at most the norm, |curl| at most twice the norm.
    """
    bound = theorem_of(surface.law).norm_at_most
    norm = math.inf if bound is None else bound(surface)
    return 2.0 * norm if number is CURL else norm
