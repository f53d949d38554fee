"""Sentences about what a device renders: perceptibility of a texture, and the six limits."""

from __future__ import annotations

import math
from collections.abc import Sequence

from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.perceptibility import MaskingSource, Perceptibility, Remedy
from asperity.analysis.limits.spectrum import Spectrum
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_quantity, round_down
from asperity.devices import Device
from asperity.perception.grip import Grip
from asperity.report.sentences.texts import side_text

_ZERO_HEIGHT = 1e-12  # [m], far below the size of an atom: rounding


def speed_text(speed: float) -> str:
    """Return a speed for reading.

    Example:
        >>> speed_text(0.1), speed_text(0.00034)
        ('0.1 m/s', '0.34 mm/s')
    """
    if speed >= 0.01:
        return f"{speed:.3g} m/s"
    return f"{1e3 * speed:.3g} mm/s"


def force_magnitude_text(force: float) -> str:
    """Return a force for reading, with two digits.

    Example:
        >>> force_magnitude_text(0.1063), force_magnitude_text(2.51e-4)
        ('110 mN', '250 µN')
    """
    return format_quantity(force, "N", digits=2)


def press_text(row: LawRow) -> str:
    """Return up to which mean normal force of a hand the numbers of a row hold."""
    press = format_quantity(row.press, "N", digits=2)
    depth = format_quantity(row.surface.max_depth, "m")
    if row.holds_at_any_press and row.is_textureless:
        return "at any press"
    if row.holds_at_any_press:
        return f"at any press (texture taken at {press}, {depth} deep)"
    return f"up to a press of {press} ({depth} deep)"


def mass_text(mass: float) -> str:
    """Return a mass in grams."""
    return format_quantity(1e3 * mass, "g")


def grip_text(grip: Grip) -> str:
    """Return the impedance of a grip for reading.

    Example:
        >>> from asperity.perception.grip import load_grip
        >>> grip_text(load_grip("pen-grip"))
        'tool held like a pen (200 N/m, 2 N·s/m)'
    """
    numbers = f"{format_quantity(grip.stiffness, 'N/m')}, {grip.damping:g} N·s/m"
    return f"{grip.name} ({numbers})"


def _field_names(fields: Sequence[str]) -> list[str]:
    return [field.replace("_", " ") for field in fields]


# --- perceptibility -------------------------------------------------------------------------------


def tier_text(texture: Perceptibility | None) -> str:
    """Return the tier, "–" without a stable stiffness."""
    return "–" if texture is None else texture.tier


def unknown_frequencies_text(texture: Perceptibility) -> str:
    """Return at which frequencies it is not known what is felt.

    Example:
        >>> from types import SimpleNamespace
        >>> unknown_frequencies_text(SimpleNamespace(known_frequencies=(40.0, 500.0)))
        'below 40 Hz and above 500 Hz'
    """
    low, high = [format_quantity(frequency, "Hz") for frequency in texture.known_frequencies]
    return f"below {low} and above {high}"


def texture_amount_text(texture: Perceptibility) -> str:
    """Return the RMS of the oscillating force, the part that is texture, and what is resolved."""
    texture_force = force_magnitude_text(texture.texture_rms)
    text = f"{texture_force} RMS of texture"
    if texture.is_mostly_form:
        text = f"{force_magnitude_text(texture.rms)} RMS, of which {texture_force} is texture"
    resolved = force_magnitude_text(texture.resolved_rms)
    if resolved != texture_force:
        text += f", of which the device resolves {resolved} at {speed_text(texture.speed)}"
    return text


def masking_text(texture: Perceptibility) -> str:
    """Return what hides a texture, with the motion of the held tool or the force that is needed."""
    motion = format_quantity(texture.hand_motion, "m", digits=2)
    if texture.masked_by is MaskingSource.STEPS:
        step = force_magnitude_text(texture.force_step)
        return f"the device's force steps of {step} hide it"
    if texture.tier == "unknown":
        return (
            f"it moves the held tool by {motion}, but {unknown_frequencies_text(texture)}, where "
            "waves of it are, no threshold is known; their harmonics are not counted"
        )
    place = "in waves that it resolves"
    if texture.level:
        place = f"above all at {texture.frequency:.3g} Hz"
    share = f"{texture.level:.2g} of the amplitude that is felt"
    return (
        f"it moves the held tool ({mass_text(texture.apparent_mass)}) by {motion}, {share}, {place}"
    )


def unverified_text(texture: Perceptibility) -> str:
    """Return which unverified numbers of the device would hide the texture; empty without any."""
    if not texture.unverified:
        return ""
    names = " and ".join(_field_names(texture.unverified))
    return f"If the unverified {names} of this device is right, less is felt."


def remedies_text(texture: Perceptibility) -> str:
    """Return the changes that make a texture felt, in a sentence; says so if there are none."""
    if texture.tier == "felt" or texture.texture_rms == 0.0:
        return ""
    if not texture.remedies:
        return "No magnification within the workspace, speed or finer device alone makes it felt."
    remedies = ", or ".join([_remedy_text(remedy) for remedy in texture.remedies])
    return f"To feel it, {remedies}."


def _remedy_text(remedy: Remedy) -> str:
    value = remedy.value
    if remedy.kind == "magnify":
        return f"magnify it {value:.10g} times more"
    if remedy.kind == "speed":
        return f"scan at {speed_text(value)}"
    if remedy.kind == "apparent_mass":
        return f"use a device with less than {mass_text(value)} of apparent mass"
    if remedy.kind == "force_resolution":
        return f"use a device with force steps below {force_magnitude_text(value)}"
    return f"use a device with position steps below {format_quantity(value, 'm')}"


def perceptibility_assumptions(texture: Perceptibility, device: Device, grip: Grip) -> list[str]:
    """Return what a tier of perceptibility assumes of the hand and of the device, in sentences."""
    assumed = "" if "apparent_mass" in device.data else ", assumed"
    extrapolated = ""
    if texture.extrapolated:
        ends = unknown_frequencies_text(texture)
        extrapolated = f"; {ends} no threshold is known, and nothing counts as felt"
    sentences = [
        f"Felt: the texture moves the held tool, at {speed_text(texture.speed)}, by more than a "
        f"person notices at its frequencies{extrapolated}; apparent mass "
        f"{mass_text(texture.apparent_mass)}{assumed}, {grip_text(grip)}",
        f"Thresholds of the hand: {grip.sources['thresholds']}",
    ]
    unknown = [field for field in texture.missing_data if field != "apparent_mass"]
    if unknown:
        names = ", ".join(_field_names(unknown))
        sentences.append(f"Unknown and assumed to hide nothing: {names}")
    friction = max(device.value("friction") or 0.0, device.value("least_friction") or 0.0)
    if friction:
        sentences.append(
            f"The device's dry friction of {force_magnitude_text(friction)} only damps the tool "
            "while it slides; near rest, at reversals and under a lighter push it holds the tool"
        )
    return sentences


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
    parts = " and ".join(
        [_removed_part_text("form", form), _removed_part_text("waviness", waviness)]
    )
    return [
        "The texture is what remains after removing a form of second degree and a Gaussian "
        f"L-filter of {format_quantity(texture.nesting_index, 'm')}; they take {parts}"
    ]


def _removed_part_text(name: str, height: float) -> str:
    if height < _ZERO_HEIGHT:
        return f"no {name}"
    return f"{name} {format_quantity(height, 'm')} high"


# --- the six limits -------------------------------------------------------------------------------


def spectrum_description(spectrum: Spectrum) -> str:
    """Return how the waves of a spectrum were found."""
    if spectrum.exact:
        return "the waves of the sum"
    if not spectrum.waves:
        return "flat"
    radially = ", radially" if spectrum.is_radial else ""
    window = ", Hann window" if spectrum.is_windowed else ""
    return f"third-octave bands of the periodogram{radially}{window}"


def limits_answer(result: Limits) -> str:
    """Return which limits hold and whether the texture is felt, in a few sentences."""
    if not result.waves:
        return "The surface is flat: there is no texture to feel."
    sentences = [_outcome_text(result)]
    undecided = [limit for limit in result.limits if limit.holds is None]
    if undecided:
        missing = dict.fromkeys([field for limit in undecided for field in limit.missing_data])
        numbers = _limit_numbers(undecided)
        sentences.append(f"Not decidable: {numbers}; missing: {_join_words([*missing])}.")
    sentences.append(texture_force_text(result))
    return " ".join(sentences)


def _outcome_text(result: Limits) -> str:
    speed = speed_text(result.speed)
    failing = [limit for limit in result.limits if limit.holds is False]
    holding = [limit for limit in result.limits if limit.holds]
    if failing:
        failures = "; ".join([_failure_text(limit) for limit in failing])
        share = _met_share_text(result, failing)
        return f"{share} at {speed}: {failures}. {_speed_advice(result, failing)}"
    if not holding:
        return "No limit can be decided."
    if len(holding) < len(result.limits):
        verb = "hold" if len(holding) > 1 else "holds"
        return f"As far as can be decided: {_limit_numbers(holding)} {verb} at {speed}."
    return f"Yes: all six limits hold at {speed}."


def _met_share_text(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the share of the texture that meets the limits that can be decided."""
    concerns_all = [limit for limit in failing if limit.share is None]
    if concerns_all or result.resolved_share == 0.0:
        return "Not as it is"
    share = percent(result.resolved_share)
    return f"Not all of it, only waves with {share} of the height variance,"


def _failure_text(limit: Limit) -> str:
    """Return both sides of a limit that fails, for the wave that violates it most."""
    left = side_text(limit.left, limit.unit)
    right = side_text(limit.right, limit.unit)
    return f"limit {limit.number} ({limit.name}) fails, {left} against {right}"


def _speed_advice(result: Limits, failing: Sequence[Limit]) -> str:
    """Return the speeds at which all limits hold, or the limits that hold at no speed."""
    if result.speeds[1] == 0.0:
        unsatisfied = [limit for limit in failing if limit.speeds and limit.speeds[1] == 0.0]
        return f"No speed satisfies {_limit_numbers(unsatisfied)}."
    return f"{speeds_text(result.speeds).capitalize()} they hold."


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


def texture_force_text(result: Limits) -> str:
    """Return the texture force, its perceptibility, and remedies."""
    texture = result.perceptibility
    law = result.surface.law.letter
    text = f"At {stiffness_text(result)} law {law} gives {texture_amount_text(texture)}: "
    if texture.tier == "felt":
        return f"{text}felt."
    return f"{text}{texture.tier}; {masking_text(texture)}. {remedies_text(texture)}".rstrip()


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
    if not words:
        return "none"
    if len(words) == 1:
        return words[0]
    return f"{', '.join(words[:-1])} and {words[-1]}"
