"""What the criteria of passivity say, and on what a verdict rests."""

from __future__ import annotations

import math
from dataclasses import replace

from asperity.analysis.passivity.criteria import LEAK, Criterion
from asperity.analysis.passivity.device_loop import (
    Loop,
    Obstacle,
    critical_speed,
    greatest_delay,
)
from asperity.analysis.passivity.judgement import Ground
from asperity.units import engineering, rounded_down


def worded(loop: Loop, criterion: Criterion) -> Criterion:
    """Return a criterion with its answer in words, and with all that it assumed."""
    says = criterion.says or (_leak_says if criterion.name == LEAK else _says)(loop, criterion)
    return replace(criterion, says=says, assumptions=_assumptions(loop, criterion))


def reason(loop: Loop, criterion: Criterion, ground: Ground) -> str:
    """Return what the verdict rests on, in one sentence.

    Args:
        loop: the surface on the device.
        criterion: the one that decides, in words.
        ground: of the verdict.
    """
    if ground is Ground.PROVED:
        return f"{criterion.formula} at {loop.surface.stiffness:g} N/m; {criterion.says}"
    if ground is Ground.CRITERION:
        return criterion.says
    if ground is Ground.DEVICE_UNKNOWN:
        fields = ("update_rate", "damping", "delay_samples")
        needs = ", ".join(field for field in fields if loop.device.value(field) is None)
        return f"{criterion.formula} {criterion.says}; to decide: {needs}"
    tail = "whatever the damping" if ground is Ground.SHAKEN_ANYHOW else "if damping there is σ₀"
    return f"a hand that shakes where q⁺ or q is attained gains energy, {tail}"


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
        Obstacle.LATERAL_CLAMP: "the lateral clamp makes the law leak below max_depth",
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
    return f"does not hold: {gained(loop.leak.energy, critical_speed(loop))}"


def _assumptions(loop: Loop, criterion: Criterion) -> str:
    """Return the assumptions with the region and the numbers used, the unverified ones marked."""
    if criterion.name == LEAK and criterion.holds:
        return criterion.assumptions
    depth = f"no deeper than {engineering(loop.surface.max_depth, 'm')}"
    used = [
        (field, loop.device.data[field]) for field in criterion.uses if field in loop.device.data
    ]
    numbers = [
        f"{field} {datum.text}{'' if datum.verified else ' (not verified)'}"
        for field, datum in used
    ]
    parts = [criterion.assumptions, depth, ", ".join(numbers)]
    return "; ".join(part for part in parts if part)
