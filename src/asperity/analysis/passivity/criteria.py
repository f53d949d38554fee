"""The criteria of passivity: a stiffness against the energy that damping dissipates.

The force of sample i - d is held over the step p_i -> p_{i+1} of duration T; the damping dissipates
at least σ₀|Δp|²/T of it. Proofs are on the page "Passivity" of the documentation. Limits are
computed in exact rational arithmetic and rounded down. :func:`register_criterion` adds a
user-defined criterion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from fractions import Fraction

from asperity.analysis.gain.theorems import residual_bound
from asperity.analysis.passivity.device_loop import (
    HALF,
    DeviceLoop,
    Number,
    Obstacle,
    add_friction,
    friction_steps,
    has_known_leak,
    presliding,
    round_down_exactly,
)
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable

PAPER = "paper (1)"
ONE_SIDED = "one-sided"
DELAY = "delay"
VIRTUAL = "virtual damping"
QUANTIZATION = "steps and friction"
WALL = "smooth-wall rule"
WALL_TEST = "wall test"
LEAK = "leak"
DRY_FRICTION = "dry friction"


@dataclass(frozen=True)
class Criterion(Serializable):
    """One criterion of passivity.

    Attributes:
        name: name of the criterion.
        formula: the inequality, in q, q⁺ and the numbers of the device.
        holds: whether the surface's stiffness fulfils it; ``None`` if that cannot be decided.
        limit: greatest stiffness that it allows [N/m], never overstated; ``None`` if unknown.
        margin: limit over the surface's stiffness [1]; ``None`` if the limit is unknown.
        assumptions: assumptions of a user-defined criterion, in one line.
        missing: fields of the device that it requires and that are unknown.
        conclusion: the conclusion of a user-defined criterion in words; by default derived from
            the other fields.
        upper_limit: stiffness above which it does not hold for certain [N/m]; ``None`` if unknown.
        obstacle: why it does not apply to the law; ``None`` if it does.
        used_fields: fields of the device that it uses.
    """

    name: str
    formula: str
    holds: bool | None = None
    limit: float | None = None
    margin: float | None = None
    assumptions: str = ""
    missing: tuple[str, ...] = ()
    conclusion: str = ""
    upper_limit: float | None = field(default=None, metadata=OMITTED)
    obstacle: Obstacle | None = field(default=None, metadata=OMITTED)
    used_fields: tuple[str, ...] = field(default=(), metadata=OMITTED)


# --- rules of the form k (w⁺ q⁺ + w q) <= budget --------------------------------------------------


@dataclass(frozen=True)
class StiffnessRule:
    """k (w⁺ q⁺ + w q) <= budget [N/m], with the fields of the device that it requires.

    With friction k (w⁺ q⁺ + w q) + w_f κ <= budget, where w_f is w⁺ + 3 w/2 by default.
    """

    name: str
    formula: str
    one_sided_weight: Fraction
    norm_weight: Fraction
    budget: Fraction | None
    required_fields: tuple[str, ...]
    assumptions: str = ""
    obstacle: Obstacle | None = None
    used_fields: tuple[str, ...] = ()
    friction_weight: Fraction | None = None
    friction_term: str = "(3d + 1)/2 κ"
    further_gain: Number = Fraction(0)


def evaluate_rule(loop: DeviceLoop, rule: StiffnessRule) -> Criterion:
    """Return the criterion of a rule for a surface on a device."""
    missing = tuple(name for name in rule.required_fields if loop.device.value(name) is None)
    fields = (*rule.required_fields, *rule.used_fields)
    formula = rule.formula
    if any(presliding(loop.surface)):
        sign = " +" if loop.surface.depends_on_texture else ","
        formula = formula.replace(" <=", f"{sign} {rule.friction_term} <=", 1)
    result = Criterion(rule.name, formula, assumptions=rule.assumptions, used_fields=fields)
    if rule.obstacle is not None:
        return replace(result, obstacle=rule.obstacle)
    if missing or rule.budget is None:
        return replace(result, missing=missing)
    weights = rule.one_sided_weight, rule.norm_weight
    weight = rule.friction_weight
    if weight is None:
        weight = rule.one_sided_weight + Fraction(3, 2) * rule.norm_weight
    upper = loop.weighted_gain(*weights, "upper") + rule.further_gain
    upper, budget = add_friction(loop.surface, upper, rule.budget, weight)
    lower = loop.weighted_gain(*weights, "lower")
    proved = _max_stiffness(budget, upper)
    possible = _max_stiffness(*add_friction(loop.surface, lower, rule.budget, weight)[::-1])
    # Infinity over a finite lower end: the number was only sampled, so no limit is proved.
    if upper != math.inf or possible == 0:
        limit = round_down_exactly(proved)
        margin = round_down_exactly(proved / loop.stiffness)
        result = replace(result, limit=limit, margin=margin)
    if loop.stiffness <= proved:
        result = replace(result, holds=True)
    elif loop.stiffness > possible:
        result = replace(result, holds=False)
    return replace(result, upper_limit=round_down_exactly(possible))


def _max_stiffness(budget: Fraction, gain: Number) -> Number:
    """Return the greatest k with k · gain <= budget."""
    if budget <= 0 or gain == math.inf:
        return Fraction(0)
    if gain <= 0:
        return math.inf
    return budget / gain


_ZERO = Fraction(0)
_ONE = Fraction(1)
_DAMPING_FIELDS = ("update_rate", "damping")


def _paper_rule(loop: DeviceLoop) -> StiffnessRule:
    """With friction, |Δf| <= (k q + κ + l) |Δp|, l the greatest slope of the slip limit."""
    share, fixed = presliding(loop.surface)
    budget = loop.damping_gain
    if budget is not None:
        budget -= 2 * fixed
    return StiffnessRule(
        PAPER,
        "k q <= σ₀/(2T)",
        _ZERO,
        Fraction(2),
        budget,
        _DAMPING_FIELDS,
        friction_weight=_ZERO,
        friction_term="κ + l",
        further_gain=2 * (share + loop.slip_slope),
    )


def _one_sided_rule(loop: DeviceLoop) -> StiffnessRule:
    return StiffnessRule(
        ONE_SIDED,
        "k q⁺ <= 2σ₀/T",
        HALF,
        _ZERO,
        loop.damping_gain,
        _DAMPING_FIELDS,
        obstacle=loop.obstacle,
        friction_term="κ",
    )


def _delay_rule(loop: DeviceLoop) -> StiffnessRule:
    return StiffnessRule(
        DELAY,
        "k (q⁺/2 + d q) <= σ₀/T",
        HALF,
        loop.known_delay,
        loop.damping_gain,
        (*_DAMPING_FIELDS, "delay_samples"),
        obstacle=loop.obstacle,
    )


def _virtual_damping_rule(loop: DeviceLoop) -> StiffnessRule:
    """Colgate and Schenkel's b > K T/2 + |b_v| is the case of a plain wall without delay."""
    budget = loop.damping_gain
    if budget is not None:
        budget -= abs(loop.virtual_damping_gain)
    formula = "k q⁺ T/2 + |b_v| <= σ₀"
    friction_term = "κ T/2"
    if loop.delay:
        formula = "k (q⁺/2 + d q) T + |b_v| <= σ₀"
        friction_term = "(3d + 1)/2 κ T"
    return StiffnessRule(
        VIRTUAL,
        formula,
        HALF,
        loop.known_delay,
        budget,
        (*_DAMPING_FIELDS, "virtual_damping"),
        obstacle=loop.obstacle,
        used_fields=("delay_samples",),
        friction_term=friction_term,
    )


def _wall_rule(loop: DeviceLoop) -> StiffnessRule:
    """The paper's rule has no delay: it is that of a loop with the delay d₀ of the wall test."""
    formula = "k q <= K₀"
    if loop.delayed_wall_stiffness != loop.wall_stiffness:
        formula += " (1/2 + d₀)/(1/2 + d)"
    return StiffnessRule(
        WALL,
        formula,
        _ZERO,
        _ONE,
        loop.delayed_wall_stiffness,
        ("max_stiffness",),
        used_fields=("delay_samples",),
        friction_term="3/2 κ",
    )


def _wall_test_rule(loop: DeviceLoop) -> StiffnessRule:
    """The least limit over all pairs of damping and delay that the wall test admits.

    A test at the delay d₀ admits σ₀/T >= K₀ (1/2 + d₀), so the delay rule allows
    K₀ (1/2 + d₀)/(q⁺/2 + d q). Where neither delay is known they are equal; then it falls with d,
    since q⁺ <= q: to K₀/q for unbounded d. With delay, the test does not show the effect of virtual
    damping: there is no limit.
    """
    longest = loop.longest_delay
    budget = loop.wall_stiffness
    formula = "k q <= K₀"
    friction_term = "3/2 κ"
    one_sided_weight = _ZERO
    norm_weight = _ONE
    if longest != math.inf:
        friction_term = StiffnessRule.friction_term
        formula = "k (q⁺/2 + d q) <= K₀ (1/2 + d₀)"
        one_sided_weight = HALF
        norm_weight = Fraction(longest)
        if budget is not None:
            tested = norm_weight if loop.delay is None else loop.wall_delay
            budget *= HALF + tested
            if loop.damping_gain is not None:
                budget = min(budget, loop.damping_gain)
    if loop.virtual_damping and loop.delay != 0:
        budget = None
    return StiffnessRule(
        WALL_TEST,
        formula,
        one_sided_weight,
        norm_weight,
        budget,
        ("max_stiffness",),
        obstacle=loop.obstacle,
        used_fields=("delay_samples", "damping", "update_rate"),
        friction_term=friction_term,
    )


# --- quantisation of positions and forces ---------------------------------------------------------


def _quantization_criterion(loop: DeviceLoop) -> Criterion:
    """Energy added by quantisation against energy dissipated by dry friction.

    A quantised position is off by at most |δ|/2, so a held force is off by φ = k q |δ|/2 + |b|/2,
    and by |b_v| |δ|/T more with virtual damping; friction dissipates f_c per metre.
    """
    formula = "k q |δ|/2 + |b|/2 <= f_c"
    fields: tuple[str, ...] = ("position_resolution", "force_resolution")
    result = Criterion(QUANTIZATION, formula, used_fields=fields)
    test = loop.wall_test
    step = loop.position_step
    if test is not None and test.positions == "stepped" and not step:
        return replace(result, missing=("position_resolution",))
    if not (step or loop.force_step):
        return replace(result, holds=True, limit=math.inf, margin=math.inf)
    friction = loop.friction - loop.force_step / 2 - abs(loop.virtual_damping_gain) * step
    fields = (*fields, "least_friction", "virtual_damping")
    if step or loop.obstacle:
        rule = StiffnessRule(
            QUANTIZATION,
            formula,
            _ZERO,
            step / 2,
            friction,
            (),
            obstacle=loop.obstacle,
            used_fields=fields,
            friction_weight=friction_steps(loop),
            friction_term="κ |δ|" if loop.delay == 0 else "4 κ |δ|",
        )
        return evaluate_rule(loop, rule)
    limit = math.inf if friction >= 0 else 0.0
    return replace(
        result,
        holds=friction >= 0,
        limit=limit,
        margin=limit,
        upper_limit=limit,
        used_fields=fields,
    )


# --- the leak -------------------------------------------------------------------------------------


def _leak_criterion(loop: DeviceLoop) -> Criterion:
    """A field that gains energy on a loop gains it at any speed: no k is safe."""
    result = Criterion(LEAK, "W <= 0 for every loop")
    fields = ("damping",)
    if loop.conservative:
        return replace(result, holds=True, limit=math.inf, margin=math.inf)
    result = replace(result, used_fields=fields)
    if not has_known_leak(loop):
        return result
    missing = () if loop.damping is not None else fields
    return replace(result, holds=False, limit=0.0, margin=0.0, missing=missing)


def dry_friction_criterion(loop: DeviceLoop) -> Criterion:
    """Dry friction that absorbs what a field gains on closed paths, at every speed.

    It holds where the friction is at least the proved bound of W/length, and does not where a path
    exceeds it.
    """
    result = Criterion(DRY_FRICTION, "W <= f_c length for every loop")
    if loop.conservative:
        return replace(result, holds=True, limit=math.inf, margin=math.inf)
    fields = ("least_friction",)
    missing = () if loop.device.value("least_friction") is not None else fields
    result = replace(result, used_fields=fields, missing=missing)
    if missing or loop.leak is None:
        return result
    bound = residual_bound(loop.surface)
    proved: Number = Fraction(0)
    if math.isfinite(bound):
        proved = _max_stiffness(loop.friction, Fraction(bound) / loop.stiffness)
        margin = round_down_exactly(proved / loop.stiffness)
        result = replace(result, limit=round_down_exactly(proved), margin=margin)
    density = Fraction(loop.leak.absorbing.found) / loop.stiffness
    possible = _max_stiffness(loop.friction, density)
    result = replace(result, upper_limit=round_down_exactly(possible))
    if loop.stiffness <= proved:
        return replace(result, holds=True)
    return replace(result, holds=False if loop.stiffness > possible else None)


# --- all of them ----------------------------------------------------------------------------------

CriterionFunction = Callable[[DeviceLoop], Criterion | StiffnessRule]
CRITERIA: dict[str, CriterionFunction] = {
    PAPER: _paper_rule,
    ONE_SIDED: _one_sided_rule,
    DELAY: _delay_rule,
    VIRTUAL: _virtual_damping_rule,
    QUANTIZATION: _quantization_criterion,
    WALL: _wall_rule,
    WALL_TEST: _wall_test_rule,
    LEAK: _leak_criterion,
    DRY_FRICTION: dry_friction_criterion,
}
"""The criteria by name, in the order of the tables: a criterion, or a rule, of a loop."""


def register_criterion(name: str, evaluate: CriterionFunction) -> None:
    """Add a user-defined criterion: it is part of every analysis, but decides nothing.

    Args:
        name: name of the criterion.
        evaluate: returns the criterion, or the rule, of a
            :class:`~asperity.analysis.passivity.device_loop.DeviceLoop`; its conclusion, region
            and device numbers are put into words afterwards.

    Raises:
        ParameterError: for a name that is taken.

    Example:
        >>> from asperity.analysis.passivity import criteria
        >>> def soft(loop):
        ...     return criteria.Criterion("soft", "k <= 100 N/m", loop.stiffness <= 100)
        >>> criteria.register_criterion("soft", soft)
        >>> del criteria.CRITERIA["soft"]
    """
    if name in CRITERIA:
        raise ParameterError("name", "is the name of another criterion", name)
    CRITERIA[name] = evaluate


def evaluate_criteria(loop: DeviceLoop) -> dict[str, Criterion]:
    """Return every criterion of a surface on a device, by name."""
    criteria = {}
    for name, evaluate in CRITERIA.items():
        result = evaluate(loop)
        if isinstance(result, StiffnessRule):
            result = evaluate_rule(loop, result)
        criteria[name] = replace(result, name=name)
    return criteria


def main_rule(loop: DeviceLoop) -> str:
    """Return the name of the criterion for the known data of the device."""
    if loop.virtual_damping is not None:
        return VIRTUAL
    if loop.delay == 0:
        return ONE_SIDED
    return DELAY
