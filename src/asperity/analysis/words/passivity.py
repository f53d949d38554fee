"""What the criteria of passivity say, and on what a verdict rests."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.analysis.passivity.criteria import LEAK, Buzz, Criterion
from asperity.analysis.passivity.device_loop import (
    Loop,
    Obstacle,
    critical_speed,
    greatest_delay,
)
from asperity.analysis.passivity.judgement import Allowed, Ground
from asperity.analysis.words.surface import depths
from asperity.units import engineering, rounded_down


def worded(loop: Loop, criterion: Criterion) -> Criterion:
    """Return a criterion with its answer in words, and with all that it assumed."""
    says = criterion.says or (_leak_says if criterion.name == LEAK else _says)(loop, criterion)
    return replace(criterion, says=says, assumptions=_assumptions(loop, criterion))


def reason(loop: Loop, criterion: Criterion, ground: Ground, buzz: Buzz | None) -> str:
    """Return what the verdict rests on, in one sentence.

    Args:
        loop: the surface on the device.
        criterion: the one that decides, in words.
        ground: of the verdict.
        buzz: the most that steps may cause, if that is known.
    """
    at, says = f"{criterion.formula} at {loop.surface.stiffness:g} N/m", criterion.says
    wall = "" if loop.cycled is None else f"a smooth wall of {float(loop.cycled):g} N/m cycled"
    fields = ("update_rate", "damping", "delay_samples")
    needs = ", ".join(field for field in fields if loop.device.value(field) is None)
    most = "no bound of the buzz is known" if buzz is None else buzz_text(buzz)
    return {
        Ground.PROVED: f"{at}; {says}",
        Ground.CRITERION: says,
        Ground.BOUNDED: f"silence is not proved, {criterion.formula} {says}; {most}",
        Ground.UNBOUNDED: f"silence is not proved, {criterion.formula} {says}; {most}",
        Ground.WALL_HELD: f"{at}; {says}; {criterion.assumptions}",
        Ground.WALL_CYCLED: f"{wall}, so {_SHAKES}, {_IF}",
        Ground.CONTRADICTION: f"{wall}, which damping and delay prove passive: one is wrong",
        Ground.SHAKEN: f"{_SHAKES}, {_IF}",
        Ground.SHAKEN_ANYHOW: f"{_SHAKES}, whatever the damping",
        Ground.DEVICE_UNKNOWN: f"{criterion.formula} {says}; to decide: {needs}",
    }[ground]


_SHAKES = "a hand that shakes where q⁺ or q is attained gains energy"
_IF = "if damping there is σ₀"


def buzz_text(buzz: Buzz) -> str:
    """Return the most that steps of positions and forces may cause."""
    speed, power = engineering(buzz.speed, "m/s"), engineering(buzz.power, "W")
    return f"a buzz that lasts moves at {speed} RMS and draws {power} at most"


def allowed_text(allowed: Allowed, speed: float | None = None) -> str:
    """Return up to which stiffness a law may be rendered, and how well that is known.

    Args:
        allowed: the answer.
        speed: v* [m/s] of a law with curl, where it is known.

    Example:
        >>> allowed_text(Allowed(1999.9, "plausible", "wall test", math.inf))
        'plausible up to 1990 N/m, with any delay'
        >>> allowed_text(Allowed(None, "none")), allowed_text(Allowed(0.0, "none"))
        ('no stiffness is known: the device says too little', 'no stiffness is known to do')
    """
    if allowed.stiffness is None:
        return "no stiffness is known: the device says too little"
    if allowed.basis == "none":
        return "no stiffness is known to do"
    at_most = f"{'at most ' if allowed.sampled else ''}{newtons(allowed.stiffness)}"
    if allowed.basis == "quiet against buzz":
        below = "v*" if speed is None else f"v* = {engineering(speed, 'm/s')}"
        return f"quiet against buzz up to {at_most}, feeds below {below}"
    if allowed.basis == "proved" or allowed.delay is None:
        return f"{allowed.basis} up to {at_most}"
    delay = (
        "any delay" if math.isinf(allowed.delay) else f"a delay up to {allowed.delay:.3g} samples"
    )
    return f"plausible up to {at_most}, with {delay}"


def newtons(stiffness: float) -> str:
    """Return a limit of the stiffness for reading: rounded down, never overstated.

    Example:
        >>> newtons(1234.5), newtons(math.inf)
        ('1230 N/m', 'infinite')
    """
    return "infinite" if stiffness == math.inf else f"{rounded_down(stiffness):.10g} N/m"


def gained(energy: float, speed: float | None) -> str:
    """Return what a loop gains, and above which speed [m/s] damping absorbs it."""
    tail = (
        "the speed below which damping does not absorb it is not decidable: needs damping"
        if speed is None
        else f"damping absorbs it only above {engineering(speed, 'm/s')}"
    )
    return f"a loop gains {engineering(energy, 'J')}, in proportion to k; {tail}"


_ANSWERS = {True: "holds", False: "does not hold", None: "not decidable"}


def _says(loop: Loop, criterion: Criterion) -> str:
    """Return the answer of a criterion in words."""
    if criterion.obstacle is not None:
        return f"not applicable: {_obstacle(loop, criterion.obstacle)}"
    answer, limit, most = _ANSWERS[criterion.holds], criterion.limit, criterion.at_most
    if criterion.holds is None and criterion.missing:
        return f"{answer}: needs {', '.join(criterion.missing)}{_delays(loop, criterion)}"
    if limit is None:
        sampled = f"the number was only sampled; the limit is at most {newtons(most or 0.0)}"
        return answer if most is None else f"{answer}: {sampled}"
    if criterion.holds is None and most is not None:
        return f"{answer}: the limit is between {newtons(limit)} and {newtons(most)}"
    return f"{answer}: the limit is {newtons(limit)}"


def _obstacle(loop: Loop, obstacle: Obstacle) -> str:
    return {
        Obstacle.CURL: f"the law is not conservative ({loop.reason})",
        Obstacle.JUMPS: f"the force is not continuous: {loop.reason}",
    }[obstacle]


def _delays(loop: Loop, criterion: Criterion) -> str:
    """Return which delays are proved, if the delay is all that is missing."""
    if criterion.missing != ("delay_samples",):
        return ""
    most = greatest_delay(loop)
    if most is None:
        return "; at this stiffness not even d = 0 is proved"
    return f"; at this stiffness d <= {most} is proved"


def _leak_says(loop: Loop, criterion: Criterion) -> str:
    if criterion.holds is None:
        return "not decidable: no loop found that gains energy, and no proof that none does"
    if criterion.holds:
        return "holds: no loop gains"
    energy = 0.0 if loop.leak is None else loop.leak.energy
    return f"does not hold: {gained(energy, critical_speed(loop))}"


def _assumptions(loop: Loop, criterion: Criterion) -> str:
    """Return the assumptions with the region and the numbers used, the unverified ones marked."""
    if criterion.name == LEAK and criterion.holds:
        return criterion.assumptions
    depth = depths(loop.surface).replace("depths to", "no deeper than").replace("every", "at every")
    used = [
        (field, loop.device.data[field]) for field in criterion.uses if field in loop.device.data
    ]
    numbers = [
        f"{field} {datum.text}{'' if datum.verified else ' (not verified)'}"
        for field, datum in used
    ]
    parts = [criterion.assumptions, depth, ", ".join(numbers)]
    return "; ".join(part for part in parts if part)
