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
from asperity.devices import WallTest
from asperity.errors import ParameterError
from asperity.files import record

PAPER = "paper (1)"
ONE_SIDED = "one-sided"
DELAY = "delay"
VIRTUAL = "virtual damping"
STEPS = "steps and friction"
WALL = "smooth-wall rule"
WALL_TEST = "wall test"
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


def _wall(loop: Loop) -> Rule:
    note = (
        "the paper's III.B as printed, for every law; a rule of thumb: that a wall did not cycle "
        "proves no damping, and no norm bounds what a field with curl gains"
    )
    return Rule(WALL, "k q <= K₀", Fraction(0), Fraction(1), loop.wall, ("max_stiffness",), note)


def _wall_test(loop: Loop) -> Rule:
    """The least limit over all pairs of damping and delay that the test of a wall admits.

    For a delay d the test admits σ₀/T >= K₀ (1/2 + d), so the delay rule allows
    K₀ (1/2 + d)/(q⁺/2 + d q). That falls with d, since q⁺ <= q: to K₀/q if d may be anything.
    """
    needs = ("max_stiffness",)
    longest = loop.longest_delay
    note = (
        "plausible, not proved: the wall was about to cycle at K₀, as a heavy handle in a loose "
        f"grip does; and {evenly(loop.test)}; conservative law"
    )
    uses = ("delay_samples", "damping", "update_rate")
    formula, one, budget = "k q <= K₀", Fraction(1), loop.wall
    if longest is None:
        budget = None
        note = "no delay fits: a wall of K₀ needs more damping than the device is said to have"
    if loop.virtual and loop.delay != 0:
        longest, budget = None, None
        note = "no limit: with delay, the wall's test does not show what virtual damping does"
    if longest is None or longest == math.inf:
        return Rule(
            WALL_TEST, formula, Fraction(0), one, budget, needs, note, loop.obstacle, uses
        )  # fmt: skip
    delay = Fraction(longest)
    budget = None if loop.wall is None else loop.wall * (HALF + delay)
    if budget is not None and loop.loss is not None:
        budget = min(budget, loop.loss)  # the one pair that is admissible is known
    formula = "k (q⁺/2 + d q) <= K₀ (1/2 + d)"
    return Rule(WALL_TEST, formula, HALF, delay, budget, needs, note, loop.obstacle, uses)


def evenly(test: WallTest | None) -> str:
    """Return what is assumed of the directions along which no wall was tried."""
    if test is not None and test.lightest is not None:
        return f"no direction is damped less than {test.lightest:g} of the one tried"
    tried = ", ".join(test.directions) if test is not None else ""
    return f"damping is alike in all directions, tried along {tried or 'one that is not said'}"


# --- steps of positions and forces ----------------------------------------------------------------


def _steps(loop: Loop) -> Criterion:
    """What rounding adds against what dry friction takes (MATH section 7).

    A position read in steps is off by at most |δ|/2, so a held force is by φ = k q |δ|/2 + |b|/2,
    and by |b_v| |δ|/T more where the controller damps; friction takes f_c per metre of way.
    """
    formula = "k q |δ|/2 + |b|/2 <= f_c"
    note = f"{_SIMPLE}; |δ|, |b|: a step along three axes at once; f_c: least_friction"
    fields = ("position_resolution", "force_resolution")
    if loop.test is not None and loop.test.positions == "stepped" and not loop.step:
        missing = ("position_resolution",)
        return Criterion(STEPS, formula, assumptions=note, missing=missing, uses=fields)
    if not (loop.step or loop.force_step):
        note = "positions and forces are taken as exact: no steps of them are known"
        return Criterion(STEPS, formula, True, math.inf, math.inf, note, uses=fields)
    fixed = loop.force_step / 2 + abs(loop.damper) * loop.step
    rule = Rule(
        STEPS, formula, Fraction(0), loop.step / 2, loop.friction - fixed, (), note,
        loop.obstacle, (*fields, "least_friction", "virtual_damping"),
    )  # fmt: skip
    if loop.step or loop.obstacle:
        return judge(loop, rule)
    holds = fixed <= loop.friction
    limit = math.inf if holds else 0.0
    return Criterion(STEPS, formula, holds, limit, limit, note, at_most=limit, uses=rule.uses)


@dataclass(frozen=True)
class Buzz:
    """What a motion that repeats itself may be at most, where silence is not proved.

    Attributes:
        speed: RMS, by way per sample over the period [m/s].
        power: that the hand is fed [W].
    """

    speed: float
    power: float


def greatest_buzz(loop: Loop) -> Buzz | None:
    """Return the bound of the buzz that steps may cause; ``None`` if there is none.

    Each step Δ gains at most (φ - f_c)|Δ| - m|Δ|², m = σ₀/T - |b_v|/T - k (q⁺/2 + d q), so a
    motion that repeats itself has RMS speed (φ - f_c)/(m T) and draws (φ - f_c)²/(4 m T) at most.

    Reference:
        MATH section 7.
    """
    if loop.obstacle or loop.loss is None or loop.delay is None or loop.rate is None:
        return None
    q = loop.number(Fraction(0), Fraction(1), "upper")
    both = loop.number(HALF, loop.samples, "upper")
    if math.inf in (q, both):
        return None
    margin = loop.loss - abs(loop.damper) - loop.stiffness * Fraction(both)
    force = loop.stiffness * Fraction(q) * loop.step / 2 + loop.force_step / 2
    excess = max(force + abs(loop.damper) * loop.step - loop.friction, Fraction(0))
    if margin <= 0:
        return None
    speed, power = excess * loop.rate / margin, excess**2 * loop.rate / (4 * margin)
    return Buzz(_up(speed), _up(power))


def _up(value: Fraction) -> float:
    """Return the least float that is not below the value."""
    near = float(value)
    return near if Fraction(near) >= value else math.nextafter(near, math.inf)


# --- the leak -------------------------------------------------------------------------------------


def _leak(loop: Loop) -> Criterion:
    """A field that gains energy on a loop does so however slowly it is turned: no k is safe."""
    formula = "W <= 0 for every loop"
    if loop.conservative:
        note = "the law's curl is zero identically; nothing is asked of the device"
        return Criterion(LEAK, formula, True, math.inf, math.inf, note)
    turned = "" if loop.leak is None else f" ({loop.leak.method})"
    note = f"one slow turn of the loop{turned}; dry friction is not counted"
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
    STEPS: _steps,
    WALL: lambda loop: judge(loop, _wall(loop)),
    WALL_TEST: lambda loop: judge(loop, _wall_test(loop)),
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
