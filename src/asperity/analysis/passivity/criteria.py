"""The criteria of passivity, one by one: a stiffness against what the damping takes away.

The force of sample i - d is held over the step p_i -> p_{i+1} of duration T; the damping takes at
least σ₀|Δp|²/T of it. Proofs are on the page "Passivity" of the documentation. Limits are computed
in exact rational arithmetic from the numbers given, and rounded down.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

from asperity.analysis.passivity.device_loop import (
    HALF,
    Loop,
    Number,
    critical_speed,
    greatest_delay,
    leaks,
)
from asperity.files import Record
from asperity.units import engineering, rounded_down

PAPER = "paper (1)"
ONE_SIDED = "one-sided"
DELAY = "delay"
VIRTUAL = "virtual damping"
WALL = "smooth-wall rule"
WALL_ONE_SIDED = "smooth-wall rule, one-sided"
LEAK = "leak"


@dataclass(frozen=True)
class Criterion(Record):
    """One criterion of passivity.

    Attributes:
        name: what it is called.
        formula: q, q⁺ and the device's numbers are the ones given.
        holds: whether the surface's stiffness fulfils it; ``None`` if that cannot be decided.
        limit: the greatest stiffness that it allows [N/m], never overstated; ``None`` if unknown.
        margin: limit over the surface's stiffness [1]; ``None`` if the limit is unknown.
        assumptions: what it rests on, in one line, with the device's numbers that it used.
        missing: fields of the device that are needed and not known.
        says: the answer in words.
    """

    name: str
    formula: str
    holds: bool | None
    limit: float | None
    margin: float | None
    assumptions: str
    missing: tuple[str, ...]
    says: str


# --- rules of the form k (w⁺ q⁺ + w q) <= budget --------------------------------------------------


@dataclass(frozen=True)
class _Rule:
    """k (plus · q⁺ + full · q) <= budget [N/m], with the fields of the device that it needs."""

    name: str
    formula: str
    plus: Fraction
    full: Fraction
    budget: Fraction | None
    needs: tuple[str, ...]
    assumptions: str
    obstacle: str = ""
    uses: tuple[str, ...] = ()


def criteria(loop: Loop) -> tuple[Criterion, ...]:
    """Return every criterion, judged."""
    rules = (_paper(loop), _one_sided(loop), _delay(loop), _virtual(loop), *_walls(loop))
    return (*(_judge(loop, rule) for rule in rules), _leak(loop))


def _judge(loop: Loop, rule: _Rule) -> Criterion:
    assumptions = _one_line(loop, rule.assumptions, (*rule.needs, *rule.uses))
    missing = tuple(field for field in rule.needs if loop.device.value(field) is None)
    if rule.obstacle or missing or rule.budget is None:
        says = f"not applicable: {rule.obstacle}" if rule.obstacle else _needs(loop, missing)
        left = () if rule.obstacle else missing
        return Criterion(rule.name, rule.formula, None, None, None, assumptions, left, says)
    upper = loop.number(rule.plus, rule.full, "upper")
    proved = _greatest(rule.budget, upper)
    possible = _greatest(rule.budget, loop.number(rule.plus, rule.full, "lower"))
    holds = True if loop.stiffness <= proved else False if loop.stiffness > possible else None
    # Infinity over a finite lower end: the number was only sampled, so no limit is proved.
    known = upper != math.inf or possible == 0
    return Criterion(
        name=rule.name,
        formula=rule.formula,
        holds=holds,
        limit=_down(proved) if known else None,
        margin=_down(proved / loop.stiffness) if known else None,
        assumptions=assumptions,
        missing=(),
        says=_says(holds, proved, possible, known),
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


def _says(holds: bool | None, proved: Number, possible: Number, known: bool) -> str:
    answer = {True: "holds", False: "does not hold", None: "not decidable"}[holds]
    if not known:
        return f"{answer}: the number was only sampled; the limit is at most {_newtons(possible)}"
    if holds is None:
        return f"{answer}: the limit is between {_newtons(proved)} and {_newtons(possible)}"
    return f"{answer}: the limit is {_newtons(proved)}"


def _newtons(stiffness: Number) -> str:
    if stiffness == math.inf:
        return "infinite"
    return f"{rounded_down(_down(stiffness)):.10g} N/m"


def _needs(loop: Loop, missing: Sequence[str]) -> str:
    text = f"not decidable: needs {', '.join(missing)}"
    if tuple(missing) != ("delay_samples",):
        return text
    most = greatest_delay(loop)
    if most is None:
        return f"{text}; at this stiffness not even d = 0 is proved"
    return f"{text}; at this stiffness d <= {most} is proved"


def _one_line(loop: Loop, assumptions: str, fields: Sequence[str]) -> str:
    """Return the assumptions with the region and the numbers used, the unverified ones marked."""
    depth = f"no deeper than {engineering(loop.surface.max_depth, 'm')}"
    used = [(field, loop.device.data[field]) for field in fields if field in loop.device.data]
    numbers = [
        f"{field} {datum.text}{'' if datum.verified else ' (not verified)'}"
        for field, datum in used
    ]
    return "; ".join([assumptions, depth, *([", ".join(numbers)] if numbers else [])])


_SIMPLE = "conservative law, zero-order hold, symmetric damping >= σ₀ wherever the force acts"


def _paper(loop: Loop) -> _Rule:
    budget = None if loop.loss is None else loop.loss / 2
    note = "zero-order hold; no certificate for a field with curl, nor from 2 samples of delay on"
    needs = ("update_rate", "damping")
    return _Rule(PAPER, "k q <= σ₀/(2T)", Fraction(0), Fraction(1), budget, needs, note)


def _one_sided(loop: Loop) -> _Rule:
    budget = None if loop.loss is None else 2 * loop.loss
    note = f"{_SIMPLE}, no delay, no virtual damping"
    needs = ("update_rate", "damping")
    one, none = Fraction(1), Fraction(0)
    return _Rule(ONE_SIDED, "k q⁺ <= 2σ₀/T", one, none, budget, needs, note, loop.obstacle)


def _delay(loop: Loop) -> _Rule:
    note = f"{_SIMPLE}, d whole samples of delay, no virtual damping, no quantisation"
    needs = ("update_rate", "damping", "delay_samples")
    formula = "k (q⁺/2 + d q) <= σ₀/T"
    return _Rule(DELAY, formula, HALF, loop.samples, loop.loss, needs, note, loop.obstacle)


def _virtual(loop: Loop) -> _Rule:
    """Colgate and Schenkel's b > K T/2 + |b_v| is the case of a plain wall without delay."""
    budget = None if loop.loss is None else loop.loss - abs(loop.damper)
    delay = "no delay" if loop.delay is None else "d whole samples of delay"
    note = f"{_SIMPLE}, {delay}, b_v on the last step's mean velocity"
    needs = ("update_rate", "damping", "virtual_damping")
    formula = "k q⁺ T/2 + |b_v| <= σ₀" if not loop.delay else "k (q⁺/2 + d q) T + |b_v| <= σ₀"
    uses = ("delay_samples",)
    return _Rule(
        VIRTUAL, formula, HALF, loop.samples, budget, needs, note, loop.obstacle, uses
    )  # fmt: skip


def _walls(loop: Loop) -> tuple[_Rule, _Rule]:
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
        _Rule(WALL, "k q <= K₀", Fraction(0), Fraction(1), budget, needs, both),
        _Rule(WALL_ONE_SIDED, formula, HALF, loop.samples, wide, needs, own, loop.obstacle, uses),
    )


# --- the leak -------------------------------------------------------------------------------------


def _leak(loop: Loop) -> Criterion:
    """A field that gains energy on a loop does so however slowly it is turned: no k is safe."""
    formula = "W <= 0 for every loop"
    if loop.conservative:
        note = "the law's curl is zero identically; nothing is asked of the device"
        return Criterion(LEAK, formula, True, math.inf, math.inf, note, (), "holds: no loop gains")
    missing = () if loop.damping is not None else ("damping",)
    note = f"one slow turn of the loop ({loop.leak.method}); dry friction is not counted"
    assumptions = _one_line(loop, note, ("damping",))
    if not leaks(loop):
        says = "not decidable: no loop found that gains energy, and no proof that none does"
        return Criterion(LEAK, formula, None, None, None, assumptions, (), says)
    gain = f"does not hold: a loop gains {engineering(loop.leak.energy, 'J')}, in proportion to k"
    speed = critical_speed(loop)
    tail = (
        "; the speed below which damping does not absorb it is not decidable: needs damping"
        if speed is None
        else f"; damping absorbs it only above {engineering(speed, 'm/s')}"
    )
    return Criterion(LEAK, formula, False, 0.0, 0.0, assumptions, missing, gain + tail)
