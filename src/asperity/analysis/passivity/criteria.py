"""The criteria of passivity, one by one: a stiffness against what the damping takes away.

The force of sample i - d is held over the step p_i -> p_{i+1} of duration T; the damping takes at
least σ₀|Δp|²/T of it. Proofs are on the page "Passivity" of the documentation. Limits are computed
in exact rational arithmetic from the numbers given, and rounded down. A criterion of one's own is
added with :func:`register`.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

from asperity.analysis.passivity.device_loop import HALF, Loop, Number, Obstacle, leaks
from asperity.errors import ParameterError
from asperity.files import record

PAPER = "paper (1)"
ONE_SIDED = "one-sided"
DELAY = "delay"
VIRTUAL = "virtual damping"
WALL = "smooth-wall rule"
WALL_ONE_SIDED = "smooth-wall rule, one-sided"
LEAK = "leak"


@dataclass(frozen=True)
class Criterion:
    """One criterion of passivity.

    Attributes:
        name: what it is called.
        formula: q, q⁺ and the device's numbers are the ones given.
        holds: whether the surface's stiffness fulfils it; ``None`` if that cannot be decided.
        limit: the greatest stiffness that it allows [N/m], never overstated; ``None`` if unknown.
        margin: limit over the surface's stiffness [1]; ``None`` if the limit is unknown.
        assumptions: what it rests on, in one line, with the device's numbers that it used.
        missing: fields of the device that are needed and not known.
        says: the answer in words; made from the other fields where it is empty.
        at_most: a stiffness above which it surely does not hold [N/m]; ``None`` if unknown.
        obstacle: why it does not apply to the law; ``None`` if it does.
        uses: fields of the device that it looked at.
    """

    name: str
    formula: str
    holds: bool | None = None
    limit: float | None = None
    margin: float | None = None
    assumptions: str = ""
    missing: tuple[str, ...] = ()
    says: str = ""
    at_most: float | None = None
    obstacle: Obstacle | None = None
    uses: tuple[str, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units; an unbounded number is written as the string "inf"."""
        return record(self, without=("at_most", "obstacle", "uses"))


# --- rules of the form k (w⁺ q⁺ + w q) <= budget --------------------------------------------------


@dataclass(frozen=True)
class Rule:
    """k (plus · q⁺ + full · q) <= budget [N/m], with the fields of the device that it needs."""

    name: str
    formula: str
    plus: Fraction
    full: Fraction
    budget: Fraction | None
    needs: tuple[str, ...]
    assumptions: str
    obstacle: Obstacle | None = None
    uses: tuple[str, ...] = ()


def judge(loop: Loop, rule: Rule) -> Criterion:
    """Return what a rule says of a surface on a device."""
    missing = tuple(field for field in rule.needs if loop.device.value(field) is None)
    uses = (*rule.needs, *rule.uses)
    said = Criterion(rule.name, rule.formula, assumptions=rule.assumptions, uses=uses)
    if rule.obstacle is not None:
        return replace(said, obstacle=rule.obstacle)
    if missing or rule.budget is None:
        return replace(said, missing=missing)
    upper = loop.number(rule.plus, rule.full, "upper")
    proved = _greatest(rule.budget, upper)
    possible = _greatest(rule.budget, loop.number(rule.plus, rule.full, "lower"))
    # Infinity over a finite lower end: the number was only sampled, so no limit is proved.
    known = upper != math.inf or possible == 0
    return replace(
        said,
        holds=True if loop.stiffness <= proved else False if loop.stiffness > possible else None,
        limit=_down(proved) if known else None,
        margin=_down(proved / loop.stiffness) if known else None,
        at_most=_down(possible),
    )


def _greatest(budget: Fraction, number: Number) -> Number:
    """Return the greatest k with k · number <= budget."""
    if budget <= 0 or number == math.inf:
        return Fraction(0)
    return budget / number if number > 0 else math.inf


def _down(value: Number) -> float:
    """Return the greatest float that is not above the value."""
    if value == math.inf:
        return math.inf
    near = float(min(value, Fraction(sys.float_info.max)))
    return near if Fraction(near) <= value else math.nextafter(near, -math.inf)


_SIMPLE = "conservative law, zero-order hold, symmetric damping >= σ₀ wherever the force acts"


def _paper(loop: Loop) -> Rule:
    budget = None if loop.loss is None else loop.loss / 2
    note = "zero-order hold; no certificate for a field with curl, nor from 2 samples of delay on"
    needs = ("update_rate", "damping")
    return Rule(PAPER, "k q <= σ₀/(2T)", Fraction(0), Fraction(1), budget, needs, note)


def _one_sided(loop: Loop) -> Rule:
    budget = None if loop.loss is None else 2 * loop.loss
    note = f"{_SIMPLE}, no delay, no virtual damping"
    needs = ("update_rate", "damping")
    one, none = Fraction(1), Fraction(0)
    return Rule(ONE_SIDED, "k q⁺ <= 2σ₀/T", one, none, budget, needs, note, loop.obstacle)


def _delay(loop: Loop) -> Rule:
    note = f"{_SIMPLE}, d whole samples of delay, no virtual damping, no quantisation"
    needs = ("update_rate", "damping", "delay_samples")
    formula = "k (q⁺/2 + d q) <= σ₀/T"
    return Rule(DELAY, formula, HALF, loop.samples, loop.loss, needs, note, loop.obstacle)


def _virtual(loop: Loop) -> Rule:
    """Colgate and Schenkel's b > K T/2 + |b_v| is the case of a plain wall without delay."""
    budget = None if loop.loss is None else loop.loss - abs(loop.damper)
    delay = "no delay" if loop.delay is None else "d whole samples of delay"
    note = f"{_SIMPLE}, {delay}, b_v on the last step's mean velocity"
    needs = ("update_rate", "damping", "virtual_damping")
    formula = "k q⁺ T/2 + |b_v| <= σ₀" if not loop.delay else "k (q⁺/2 + d q) T + |b_v| <= σ₀"
    uses = ("delay_samples",)
    return Rule(
        VIRTUAL, formula, HALF, loop.samples, budget, needs, note, loop.obstacle, uses
    )  # fmt: skip


def _walls(loop: Loop) -> tuple[Rule, Rule]:
    """What a smooth wall K₀ that is passive on the device says of the texture.

    It shows σ₀/T >= K₀ (1/2 + d), whatever d is; q⁺ <= q does the rest.
    """
    note = "the smooth wall K₀ is passive on the device, whose damping is alike in all directions"
    delay = "no delay" if loop.delay is None else "d whole samples of delay"
    own = f"{note}; conservative law, {delay}"
    both = f"{note}; for a conservative law with any delay, else the paper's III.B as printed"
    needs, budget = ("max_stiffness",), loop.wall
    wide = None if budget is None else budget * (HALF + loop.samples)
    formula = "k q⁺ <= K₀" if not loop.delay else "k (q⁺/2 + d q) <= K₀ (1/2 + d)"
    uses = ("delay_samples",)
    return (
        Rule(WALL, "k q <= K₀", Fraction(0), Fraction(1), budget, needs, both),
        Rule(WALL_ONE_SIDED, formula, HALF, loop.samples, wide, needs, own, loop.obstacle, uses),
    )


# --- the leak -------------------------------------------------------------------------------------


def _leak(loop: Loop) -> Criterion:
    """A field that gains energy on a loop does so however slowly it is turned: no k is safe."""
    formula = "W <= 0 for every loop"
    if loop.conservative:
        note = "the law's curl is zero identically; nothing is asked of the device"
        return Criterion(LEAK, formula, True, math.inf, math.inf, note)
    note = f"one slow turn of the loop ({loop.leak.method}); dry friction is not counted"
    if not leaks(loop):
        return Criterion(LEAK, formula, assumptions=note, uses=("damping",))
    missing = () if loop.damping is not None else ("damping",)
    return Criterion(LEAK, formula, False, 0.0, 0.0, note, missing, uses=("damping",))


# --- all of them ----------------------------------------------------------------------------------

Judge = Callable[[Loop], Criterion]
CRITERIA: dict[str, Judge] = {
    PAPER: lambda loop: judge(loop, _paper(loop)),
    ONE_SIDED: lambda loop: judge(loop, _one_sided(loop)),
    DELAY: lambda loop: judge(loop, _delay(loop)),
    VIRTUAL: lambda loop: judge(loop, _virtual(loop)),
    WALL: lambda loop: judge(loop, _walls(loop)[0]),
    WALL_ONE_SIDED: lambda loop: judge(loop, _walls(loop)[1]),
    LEAK: _leak,
}
"""What judges a surface on a device, by the name of the criterion, in the order of the tables."""


def register(name: str, judge_loop: Judge) -> None:
    """Add a criterion of one's own: it stands in every analysis, but decides nothing.

    Args:
        name: what it is called.
        judge_loop: what it says of a :class:`~asperity.analysis.passivity.device_loop.Loop`; the
            sentence, the region and the device's numbers are put into words after it.

    Raises:
        ParameterError: for a name that is taken.

    Example:
        >>> from asperity.analysis.passivity.criteria import CRITERIA, Criterion, register
        >>> register("soft", lambda loop: Criterion("soft", "k <= 100 N/m", loop.stiffness <= 100))
        >>> del CRITERIA["soft"]
    """
    if name in CRITERIA:
        raise ParameterError("name", "is the name of another criterion", name)
    CRITERIA[name] = judge_loop


def criteria(loop: Loop) -> tuple[Criterion, ...]:
    """Return every criterion, judged."""
    return tuple(replace(judge_loop(loop), name=name) for name, judge_loop in CRITERIA.items())
