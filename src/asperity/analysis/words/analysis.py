"""The verdict on one law in one sentence, and what was assumed."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.passivity.criteria import LEAK
from asperity.analysis.words.passivity import allowed_text, buzz_text, gained, newtons
from asperity.analysis.words.surface import default_depth, depths, law_parameters, unverified
from asperity.arguments import DEFAULT_STIFFNESS
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture
from asperity.units import engineering

# What the criteria of passivity look at.
_USED = (
    "max_stiffness", "update_rate", "damping", "delay_samples", "virtual_damping",
    "position_resolution", "force_resolution", "least_friction",
)  # fmt: skip


def surface_width(texture: Texture) -> float:
    """Return how wide a finite surface is, the shorter way [m]; infinite where it goes on."""
    if not texture.ends:
        return math.inf
    return float(np.hypot(*texture.domain.spans.T).min())


def answer(result: Analysis) -> str:
    """Return the verdict in one sentence."""
    surface, judged = result.surface, result.passivity
    depth = engineering(surface.max_depth, "m")
    subject = f"law {surface.law.letter} at {surface.stiffness:g} N/m, pressed to {depth}, "
    subject += f"on the {result.device.name}"
    rule = judged.criterion(judged.decided_by)
    limit = newtons(rule.limit or 0.0)
    if judged.verdict == "passive":
        said = f"{_capital(subject)} is passive by {rule.formula}, whose limit is {limit}"
    elif judged.verdict == "plausible":
        said = f"That {subject} is passive is plausible, not proved: {rule.formula}, limit {limit}"
    elif judged.verdict == "bounded" and judged.buzz is not None:
        said = f"{_capital(subject)} is passive but for steps: {buzz_text(judged.buzz)}"
    elif judged.verdict == "not passive":
        gain = gained(result.leak.energy, judged.critical_speed)
        leaks = f"{gain}; {allowed_text(judged.allowed, judged.critical_speed)}"
        reason = leaks if rule.name == LEAK else judged.reason
        said = f"{_capital(subject)} is not passive: {reason}"
    else:
        said = f"Whether {subject} is passive is undecided: {judged.reason}"
    return f"{said}; {_of_jumps(result)}."


def _of_jumps(result: Analysis) -> str:
    smooth = result.continuity
    if smooth.continuous:
        return "its force is continuous"
    if not smooth.jumps:
        return f"its force is not continuous ({smooth.reason})"
    largest = engineering(max(jump.size for jump in smooth.jumps), "N")
    return f"its force jumps, by up to {largest} where that was located"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def assumptions(result: Analysis, extent: tuple[float, float] | None) -> tuple[str, ...]:
    """Return what was assumed, in sentences.

    Args:
        result: the analysis.
        extent: the part of the plane that counted [m], if one was given.
    """
    surface, leak = result.surface, result.leak
    texture, depth = surface.texture, engineering(surface.max_depth, "m")
    said = [*texture.preparation, *_defaults(surface)]
    region = texture.domain.description
    if extent is not None:
        region = " x ".join(engineering(side, "m") for side in extent) + " from the origin"
    said.append(f"The numbers are suprema over {region} and {depths(surface)}")
    if surface.acting_clamp != "none":
        clamp = f"The {surface.acting_clamp} clamp holds the depth from {depth} down"
        lowest = engineering(surface.clamped_depth, "m")
        said.append(f"{clamp}; loops are compared down to depths of {lowest}")
    x, y = (float(part) for part in leak.line.direction)
    said.append(f"Loops in the vertical plane along ({x:g}, {y:g}) are compared")
    bounds = (result.q, result.one_sided, result.curl)
    if any(bound is not None and math.isinf(bound.upper - bound.lower) for bound in bounds):
        said.append("A number without an upper bound is the greatest one found, not a proof")
    if not result.continuity.continuous:
        said.append("Jumps are located where contact begins and below the sharpest crest only")
    said += unverified(result.device, _USED)
    said.append("What is said is of energy and forces; no person was asked what they feel")
    return tuple(said)


def _defaults(surface: Surface) -> list[str]:
    """Return which numbers are the ones taken unless told otherwise."""
    said = []
    if surface.stiffness == DEFAULT_STIFFNESS:
        said.append(f"Default stiffness {surface.stiffness:g} N/m")
    if surface.max_depth == default_max_depth(surface.texture):
        said.append(default_depth(surface))
    if surface.max_depth > surface_width(surface.texture):
        width = engineering(surface_width(surface.texture), "m")
        said.append(f"Below {width}, the surface's width, only its mirror images are felt")
    return said + law_parameters(surface)
