"""Sentences of an analysis: verdict, criteria of passivity and assumptions."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from asperity.analysis.passivity.criteria import LEAK, BuzzBound, Criterion
from asperity.analysis.passivity.device_loop import (
    DeviceLoop,
    Obstacle,
    critical_speed,
    max_proved_delay,
)
from asperity.analysis.passivity.verdict import Ground, StabilityLimit
from asperity.analysis.results import Analysis
from asperity.analysis.sentences.surface_sentences import (
    SCOPE_SENTENCE,
    default_depth_text,
    depth_range_text,
    law_parameter_sentences,
    unverified_sentences,
)
from asperity.core.arguments import DEFAULT_STIFFNESS
from asperity.core.units import format_quantity, round_down
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture


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


# Device data used by the criteria of passivity.
_PASSIVITY_FIELDS = (
    *("max_stiffness", "update_rate", "damping", "delay_samples", "virtual_damping"),
    *("position_resolution", "force_resolution", "least_friction"),
)


def surface_width(texture: Texture) -> float:
    """Return the shorter side of a finite surface [m]; infinity for an unbounded one."""
    if not texture.is_mirrored:
        return math.inf
    return float(np.hypot(*texture.domain.spans.T).min())


def analysis_summary(result: Analysis) -> str:
    """Return the verdict in one sentence."""
    surface, passivity = result.surface, result.passivity
    depth = format_quantity(surface.max_depth, "m")
    subject = f"law {surface.law.letter} at {surface.stiffness:g} N/m, pressed to {depth}, "
    subject += f"on the {result.device.name}"
    title = subject[:1].upper() + subject[1:]
    rule = passivity.criterion(passivity.decided_by)
    limit = stiffness_limit_text(rule.limit or 0.0)
    if passivity.verdict == "passive":
        text = f"{title} is passive by {rule.formula}, whose limit is {limit}"
    elif passivity.verdict == "plausible":
        text = f"That {subject} is passive is plausible, not proved: {rule.formula}, limit {limit}"
    elif passivity.verdict == "bounded" and passivity.buzz is not None:
        text = f"{title} is passive but for steps: {buzz_text(passivity.buzz)}"
    elif passivity.verdict == "not passive":
        reason = passivity.reason
        if rule.name == LEAK:
            speed = passivity.critical_speed
            gain = energy_gained_text(result.leak.energy, speed)
            reason = f"{gain}; {stability_limit_text(passivity.stability_limit, speed)}"
        text = f"{title} is not passive: {reason}"
    else:
        text = f"Whether {subject} is passive is undecided: {passivity.reason}"
    return f"{text}; {_jumps_clause(result)}."


def _jumps_clause(result: Analysis) -> str:
    force = result.continuity
    if force.continuous:
        return "its force is continuous"
    if not force.jumps:
        return f"its force is not continuous ({force.reason})"
    largest = format_quantity(max(jump.size for jump in force.jumps), "N")
    return f"its force jumps, by up to {largest} where that was located"


def analysis_assumptions(result: Analysis, extent: tuple[float, float] | None) -> tuple[str, ...]:
    """Return the assumptions of an analysis, in sentences.

    Args:
        result: the analysis.
        extent: the searched part of the plane [m], if one was given.
    """
    surface, leak = result.surface, result.leak
    texture, depth = surface.texture, format_quantity(surface.max_depth, "m")
    sentences = [*texture.preparation, *_default_sentences(surface)]
    region = texture.domain.description
    if extent is not None:
        region = " x ".join(format_quantity(side, "m") for side in extent) + " from the origin"
    sentences.append(f"The numbers are suprema over {region} and {depth_range_text(surface)}")
    if surface.effective_clamp.changes_force:
        clamp = f"The {surface.effective_clamp} clamp holds the depth from {depth} down"
        lowest = format_quantity(surface.clamped_depth, "m")
        sentences.append(f"{clamp}; loops are compared down to depths of {lowest}")
    x, y = (float(part) for part in leak.line.direction)
    sentences.append(f"Loops in the vertical plane along ({x:g}, {y:g}) are compared")
    bounds = (result.q, result.one_sided, result.curl)
    if any(bound is not None and math.isinf(bound.upper - bound.lower) for bound in bounds):
        sentences.append("A number without an upper bound is the greatest one found, not a proof")
    if not result.continuity.continuous:
        sentences.append("Jumps are located where contact begins and below the sharpest crest only")
    sentences += unverified_sentences(result.device, _PASSIVITY_FIELDS)
    return (*sentences, SCOPE_SENTENCE)


def _default_sentences(surface: Surface) -> list[str]:
    sentences = []
    if surface.stiffness == DEFAULT_STIFFNESS:
        sentences.append(f"Default stiffness {surface.stiffness:g} N/m")
    if surface.max_depth == default_max_depth(surface.texture):
        sentences.append(default_depth_text(surface))
    if surface.max_depth > surface_width(surface.texture):
        width = format_quantity(surface_width(surface.texture), "m")
        sentences.append(
            f"Below {width}, the surface's width, only its mirror images are in contact"
        )
    return sentences + law_parameter_sentences(surface)
