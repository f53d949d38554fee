"""Sentences of passivity: conclusions of the criteria, the reason of a verdict, the limits."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.analysis.passivity.criteria import LEAK, BuzzBound, Criterion
from asperity.analysis.passivity.device_loop import (
    DeviceLoop,
    Obstacle,
    critical_speed,
    max_proved_delay,
)
from asperity.analysis.passivity.verdict import Ground, StabilityLimit
from asperity.analysis.sentences.surface_sentences import depth_range_text
from asperity.core.units import format_quantity, round_down


def with_sentences(loop: DeviceLoop, criterion: Criterion) -> Criterion:
    """Return a criterion with its conclusion in words and its complete assumptions."""
    conclude = _leak_conclusion if criterion.name == LEAK else _conclusion
    conclusion = criterion.conclusion or conclude(loop, criterion)
    assumptions = _criterion_assumptions(loop, criterion)
    return replace(criterion, conclusion=conclusion, assumptions=assumptions)


def verdict_reason(
    loop: DeviceLoop, criterion: Criterion, ground: Ground, buzz: BuzzBound | None
) -> str:
    """Return the reason of the verdict, in one sentence.

    Args:
        loop: the surface on the device.
        criterion: the deciding criterion, with its sentences.
        ground: ground of the verdict.
        buzz: bound of the motion that quantisation may cause, if there is one.
    """
    formula, conclusion = criterion.formula, criterion.conclusion
    at = f"{formula} at {loop.surface.stiffness:g} N/m; {conclusion}"
    cycling = loop.cycling_stiffness
    wall = "" if cycling is None else f"a smooth wall of {float(cycling):g} N/m cycled"
    fields = ("update_rate", "damping", "delay_samples")
    unknown = ", ".join(field for field in fields if loop.device.value(field) is None)
    bound = "no bound of the buzz is known" if buzz is None else buzz_text(buzz)
    steps = f"silence is not proved, {formula} {conclusion}; {bound}"
    return {
        Ground.PROVED: at,
        Ground.CRITERION: conclusion,
        Ground.BOUNDED: steps,
        Ground.UNBOUNDED: steps,
        Ground.WALL_HELD: f"{at}; {criterion.assumptions}",
        Ground.WALL_CYCLED: f"{wall}, so {_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.CONTRADICTION: f"{wall}, which damping and delay prove passive: one is wrong",
        Ground.GAINS_ENERGY: f"{_GAINS_ENERGY}, {_IF_DAMPED}",
        Ground.GAINS_ENERGY_REGARDLESS: f"{_GAINS_ENERGY}, whatever the damping",
        Ground.DEVICE_UNKNOWN: f"{formula} {conclusion}; to decide: {unknown}",
    }[ground]


_GAINS_ENERGY = "a small oscillation where q⁺ or q is attained gains energy"
_IF_DAMPED = "if damping there is σ₀"


def buzz_text(buzz: BuzzBound) -> str:
    """Return the bound of the motion that steps of positions and forces may cause."""
    speed, power = format_quantity(buzz.speed, "m/s"), format_quantity(buzz.power, "W")
    return f"a sustained buzz moves at {speed} RMS and draws {power} at most"


def critical_speed_text(speed: float | None) -> str:
    """Return v* [m/s] with its value, where it is known."""
    return "v*" if speed is None else f"v* = {format_quantity(speed, 'm/s')}"


def stability_limit_text(limit: StabilityLimit, speed: float | None = None) -> str:
    """Return the stability limit and its basis.

    Args:
        limit: the limit.
        speed: v* [m/s] of a law with curl, where it is known.

    Example:
        >>> stability_limit_text(StabilityLimit(1999.9, "plausible", "wall test", math.inf))
        'plausible up to 1990 N/m, with any delay'
        >>> stability_limit_text(StabilityLimit(None, "none"))
        'no stable stiffness is known: the device data are insufficient'
        >>> stability_limit_text(StabilityLimit(0.0, "none"))
        'no stable stiffness is known'
    """
    if limit.stiffness is None:
        return "no stable stiffness is known: the device data are insufficient"
    if limit.basis == "none":
        return "no stable stiffness is known"
    at_most = f"{'at most ' if limit.sampled else ''}{stiffness_limit_text(limit.stiffness)}"
    if limit.basis == "quiet against buzz":
        delivers = f"delivers energy below the speed {critical_speed_text(speed)}"
        return f"no buzz expected up to {at_most}, {delivers}"
    if limit.basis == "proved" or limit.delay is None:
        return f"{limit.basis} up to {at_most}"
    delay = "any delay" if math.isinf(limit.delay) else f"a delay up to {limit.delay:.3g} samples"
    return f"plausible up to {at_most}, with {delay}"


def stiffness_limit_text(stiffness: float) -> str:
    """Return a stiffness limit for reading: rounded down, never overstated.

    Example:
        >>> stiffness_limit_text(1234.5), stiffness_limit_text(math.inf)
        ('1230 N/m', 'infinite')
    """
    return "infinite" if stiffness == math.inf else f"{round_down(stiffness):.10g} N/m"


def energy_gained_text(energy: float, speed: float | None) -> str:
    """Return the energy gained on a loop, and the speed [m/s] above which damping absorbs it."""
    absorbed = "the speed below which damping does not absorb it is not decidable: needs damping"
    if speed is not None:
        absorbed = f"damping absorbs it only above {format_quantity(speed, 'm/s')}"
    return f"a loop gains {format_quantity(energy, 'J')}, in proportion to k; {absorbed}"


_HOLDS_TEXT = {True: "holds", False: "does not hold", None: "not decidable"}


def _conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the conclusion of a criterion in words."""
    if criterion.obstacle is not None:
        return f"not applicable: {_obstacle_text(loop, criterion.obstacle)}"
    answer, limit, most = _HOLDS_TEXT[criterion.holds], criterion.limit, criterion.upper_limit
    if criterion.holds is None and criterion.missing:
        missing = ", ".join(criterion.missing)
        return f"{answer}: needs {missing}{_proved_delays_text(loop, criterion)}"
    if limit is None and most is None:
        return answer
    if limit is None:
        at_most = stiffness_limit_text(most or 0.0)
        return f"{answer}: the number was only sampled; the limit is at most {at_most}"
    limit_text = stiffness_limit_text(limit)
    if criterion.holds is None and most is not None:
        return f"{answer}: the limit is between {limit_text} and {stiffness_limit_text(most)}"
    return f"{answer}: the limit is {limit_text}"


def _obstacle_text(loop: DeviceLoop, obstacle: Obstacle) -> str:
    return {
        Obstacle.CURL: f"the law is not conservative ({loop.reason})",
        Obstacle.JUMPS: f"the force is not continuous: {loop.reason}",
    }[obstacle]


def _proved_delays_text(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the proved delays, if the delay is all that is missing."""
    if criterion.missing != ("delay_samples",):
        return ""
    most = max_proved_delay(loop)
    if most is None:
        return "; at this stiffness not even d = 0 is proved"
    return f"; at this stiffness d <= {most} is proved"


def _leak_conclusion(loop: DeviceLoop, criterion: Criterion) -> str:
    if criterion.holds is None:
        return "not decidable: no loop found that gains energy, and no proof that none does"
    if criterion.holds:
        return "holds: no loop gains"
    energy = 0.0 if loop.leak is None else loop.leak.energy
    return f"does not hold: {energy_gained_text(energy, critical_speed(loop))}"


def _criterion_assumptions(loop: DeviceLoop, criterion: Criterion) -> str:
    """Return the assumptions with the region and the numbers used, unverified ones marked."""
    if criterion.name == LEAK and criterion.holds:
        return criterion.assumptions
    depth = depth_range_text(loop.surface)
    depth = depth.replace("depths to", "no deeper than").replace("every", "at every")
    data = loop.device.data
    numbers = ", ".join(
        f"{field} {data[field].text}{'' if data[field].verified else ' (not verified)'}"
        for field in criterion.used_fields
        if field in data
    )
    return "; ".join(filter(None, (criterion.assumptions, depth, numbers)))
