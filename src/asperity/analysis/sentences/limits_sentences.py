"""Sentences of the six limits and of perceptibility."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.perceptibility import MaskingSource, Perceptibility, Remedy
from asperity.analysis.sentences.analysis_sentences import stability_limit_text
from asperity.analysis.sentences.surface_sentences import (
    default_depth_text,
    law_parameter_sentences,
    unverified_sentences,
)
from asperity.core.units import format_quantity, round_down
from asperity.devices import Device

_ZERO_HEIGHT = 1e-12  # [m], far below the size of an atom: rounding


def speed_text(speed: float) -> str:
    """Return a speed for reading.

    Example:
        >>> speed_text(0.1), speed_text(0.00034)
        ('0.1 m/s', '0.34 mm/s')
    """
    return f"{speed:.3g} m/s" if speed >= 0.01 else f"{1e3 * speed:.3g} mm/s"


def force_magnitude_text(force: float) -> str:
    """Return a force for reading, with two digits.

    Example:
        >>> force_magnitude_text(0.1063), force_magnitude_text(2.51e-4)
        ('110 mN', '250 µN')
    """
    return format_quantity(force, "N", digits=2)


def texture_amount_text(texture: Perceptibility) -> str:
    """Return the RMS of the oscillating force, and the part of it that is texture.

    Example:
        >>> forces = ("felt", 0.139, 0.0116, 8e-3, 1.0, 0.0164, 0.02, 0.01)
        >>> texture_amount_text(Perceptibility(*forces, MaskingSource.HAND, 0.1, (), ()))
        '140 mN RMS, of which 12 mN is texture'
    """
    texture_force = force_magnitude_text(texture.texture_rms)
    text = f"{texture_force} RMS of texture"
    if texture.is_mostly_form:
        text = f"{force_magnitude_text(texture.rms)} RMS, of which {texture_force} is texture"
    if texture.resolved < 0.5:
        resolved, speed = force_magnitude_text(texture.resolved_rms), speed_text(texture.speed)
        text += f", of which the device resolves {resolved} at {speed}"
    return text


def masking_text(texture: Perceptibility, device: Device) -> str:
    """Return the force [RMS] from which a texture is felt, and the source that masks it below."""
    needed = f"felt from {force_magnitude_text(texture.clear_threshold / 2**0.5)} RMS on"
    if texture.masked_by is MaskingSource.HAND:
        return f"{needed}, the threshold of the hand"
    if texture.masked_by is MaskingSource.FRICTION:
        friction = max(device.value(field) or 0.0 for field in ("friction", "least_friction"))
        return f"{needed}, for the device's dry friction of {force_magnitude_text(friction)}"
    step = force_magnitude_text(device.value("force_resolution") or 0.0)
    return f"{needed}, for the device's force steps of {step}"


def remedies_text(texture: Perceptibility) -> str:
    """Return the changes that would make a texture felt, in a sentence; empty without any.

    Example:
        >>> remedies = (Remedy("magnify", 11.0), Remedy("friction", 0.025))
        >>> forces = ("not felt", 0.1, 0.1, None, 1.0, 0.1, 2.0, 1.0)
        >>> remedies_text(Perceptibility(*forces, MaskingSource.FRICTION, 0.1, (), remedies))
        'To feel it, magnify 11 times, or use a device with less than 25 mN of dry friction.'
    """
    if not texture.remedies:
        return ""
    return f"To feel it, {', or '.join(_remedy_text(remedy) for remedy in texture.remedies)}."


def _remedy_text(remedy: Remedy) -> str:
    value, force = remedy.value, force_magnitude_text(remedy.value)
    return {
        "magnify": f"magnify {value:.10g} times",
        "slower": f"scan slower than {speed_text(round_down(value))}",
        "friction": f"use a device with less than {force} of dry friction",
        "force_resolution": f"use a device with force steps below {force}",
        "position_resolution": f"use a device with position steps below "
        f"{format_quantity(value, 'm')}",
    }[remedy.kind]


def tier_text(texture: Perceptibility | None) -> str:
    """Return the tier, "–" without a stable stiffness."""
    return "–" if texture is None else texture.tier


def form_removal_sentences(
    texture: Perceptibility | None, form: float, waviness: float
) -> list[str]:
    """Return the removed form and waviness, in a sentence, if anything was removed.

    Args:
        texture: perceptibility of any of the laws.
        form: range of the form [m].
        waviness: range of the waviness [m].
    """
    if texture is None or texture.nesting_index is None:
        return []
    removed = " and ".join(
        f"no {part}" if height < _ZERO_HEIGHT else f"{part} {format_quantity(height, 'm')} high"
        for part, height in (("form", form), ("waviness", waviness))
    )
    return [
        "The texture is what remains after removing a form of second degree and a Gaussian "
        f"L-filter of {format_quantity(texture.nesting_index, 'm')}; they take {removed}"
    ]


def limits_summary(result: Limits) -> str:
    """Return which limits hold and whether the texture is felt, in a few sentences."""
    if not result.waves:
        return "The surface is flat: there is no texture to feel."
    speed = speed_text(result.speed)
    failing = [limit for limit in result.limits if limit.holds is False]
    undecided = [limit for limit in result.limits if limit.holds is None]
    if failing:
        failures = "; ".join(_failure_text(limit) for limit in failing)
        advice = _speed_advice(result, failing)
        text = f"{_met_share_text(result, failing)} at {speed}: {failures}.{advice}"
    elif len(undecided) == len(result.limits):
        text = "No limit can be decided."
    elif undecided:
        holding = [limit for limit in result.limits if limit.holds]
        verb = "hold" if len(holding) > 1 else "holds"
        text = f"As far as can be decided: {_limit_numbers(holding)} {verb} at {speed}."
    else:
        text = f"Yes: all six limits hold at {speed}."
    if undecided:
        missing = dict.fromkeys(data for limit in undecided for data in limit.missing_data)
        text += f" Not decidable: {_limit_numbers(undecided)}; missing: {_join_words([*missing])}."
    return f"{text} {texture_force_text(result)}"


def speeds_text(speeds: tuple[float, float] | None) -> str:
    """Return an interval of speeds for reading, its end rounded down.

    Example:
        >>> speeds_text((0.0, 0.4)), speeds_text((0.0, math.inf)), speeds_text((0.0, 0.0))
        ('below 0.4 m/s', 'all', 'none')
    """
    if speeds is None:
        return "–"
    if math.isinf(speeds[1]):
        return "all"
    if speeds[1] == 0.0:
        return "none"
    return f"below {speed_text(round_down(speeds[1]))}"


def _met_share_text(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the share of the texture that meets the limits that can be decided."""
    if any(limit.share is None for limit in failing) or result.resolved_share == 0.0:
        return "Not as it is"
    share = percent(result.resolved_share)
    return f"Not all of it, only waves with {share} of the height variance,"


def _failure_text(limit: Limit) -> str:
    """Return both sides of a limit that fails, for the wave that violates it most."""
    left, right = (
        format_quantity(side, limit.unit) if side is not None else "–"
        for side in (limit.left, limit.right)
    )
    return f"limit {limit.number} ({limit.name}) fails, {left} against {right}"


def _speed_advice(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the speeds at which all limits hold, or the limits that hold at no speed."""
    top = result.speeds[1]
    if top == 0.0:
        at_none = [limit for limit in failing if limit.speeds and limit.speeds[1] == 0.0]
        return f" No speed satisfies {_limit_numbers(at_none)}."
    return f" {speeds_text(result.speeds).capitalize()} they hold."


def texture_force_text(result: Limits) -> str:
    """Return the texture force, its perceptibility, and remedies."""
    texture, law = result.perceptibility, result.surface.law.letter
    text = f"At {stiffness_text(result)} law {law} gives {texture_amount_text(texture)}: "
    if texture.tier == "felt":
        return f"{text}felt."
    masking = masking_text(texture, result.device)
    return f"{text}{texture.tier}; {masking}. {remedies_text(texture)}".rstrip()


def stiffness_text(result: Limits) -> str:
    """Return the stiffness of the force for reading, rounded down."""
    return format_quantity(round_down(result.surface.stiffness), "N/m")


def percent(share: float) -> str:
    """Return a share for reading, never rounded to none or to all.

    Example:
        >>> percent(0.5), percent(1e-5), percent(0.9999), percent(1.0)
        ('50 %', '< 0.1 %', '> 99.9 %', '100 %')
    """
    if 0.0 < share < 1e-3:
        return "< 0.1 %"
    if 0.999 < share < 1.0 - 1e-12:
        return "> 99.9 %"
    return f"{100.0 * share:.3g} %"


def _limit_numbers(limits: Sequence[Limit]) -> str:
    word = "limit" if len(limits) == 1 else "limits"
    return f"{word} {_join_words([str(limit.number) for limit in limits])}"


def _join_words(words: Sequence[str]) -> str:
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]])) if words else "none"


def limits_assumptions(
    result: Limits, defaults: Mapping[str, bool], contact_lost: float
) -> tuple[str, ...]:
    """Return the assumptions of the limits, in sentences.

    Args:
        result: the limits.
        defaults: whether speed, stiffness, max_depth and samples are defaults.
        contact_lost: fraction of the scan without contact.
    """
    surface = result.surface
    sentences = [*surface.texture.preparation, *_default_sentences(result, defaults)]
    sentences.append(f"Waves: {result.spectrum.description}")
    left_out = len(result.spectrum.waves) - len(result.waves)
    if left_out:
        sentences.append(
            f"{left_out} bands with less than 0.1 % of the variance of height and of force are "
            "left out of the limits"
        )
    depth = format_quantity(surface.max_depth, "m")
    sentences.append(f"Forces are those of a scan at constant height, pressed to {depth}")
    if contact_lost > 0.0:
        sentences.append(f"No contact on {percent(contact_lost)} of that scan")
    if result.gain.method == "sampled":
        sentences.append(f"{result.gain_symbol} = {result.gain.value:.4g} is sampled, not proved")
    used = [*dict.fromkeys(limit.device_field for limit in result.limits), "friction"]
    sentences += unverified_sentences(result.device, used)
    sentences.append("The limits are necessary, not sufficient; they were not tested with people")
    return tuple(sentences)


def _default_sentences(result: Limits, defaults: Mapping[str, bool]) -> list[str]:
    sentences = []
    if defaults["speed"]:
        sentences.append(f"Default speed {speed_text(result.speed)}")
    if defaults["samples"]:
        counts = (result.time_samples, result.position_samples, result.force_steps)
        shown = ", ".join(f"{name} = {n:g}" for name, n in zip("αβγ", counts, strict=True))
        sentences.append(f"Samples in a wave: {shown}; the paper recommends 5 to 10")
    if defaults["stiffness"]:
        share, why = result.margin.factor, stability_limit_text(result.stability_limit)
        default = "" if result.safe_stiffness else ", a default"
        part = f"{share:g} of what is " if result.safe_stiffness and share < 1.0 else ""
        sentences.append(f"Stiffness {stiffness_text(result)}{default}: {part}{why}")
    if defaults["max_depth"]:
        sentences.append(default_depth_text(result.surface))
    return sentences + law_parameter_sentences(result.surface)
