"""Sentences of an analysis: its verdict in one sentence, and its assumptions."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.passivity.criteria import LEAK
from asperity.analysis.sentences.passivity_sentences import (
    buzz_text,
    energy_gained_text,
    stability_limit_text,
    stiffness_limit_text,
)
from asperity.analysis.sentences.surface_sentences import (
    SCOPE_SENTENCE,
    default_depth_text,
    depth_range_text,
    law_parameter_sentences,
    unverified_sentences,
)
from asperity.core.arguments import DEFAULT_STIFFNESS
from asperity.core.units import format_quantity
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture

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
