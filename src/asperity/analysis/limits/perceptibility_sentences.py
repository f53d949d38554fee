"""Sentences about the perceptibility of a texture: amounts, remedies, assumptions."""

from __future__ import annotations

from asperity.analysis.limits.perceptibility import MaskingSource, Perceptibility, Remedy
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.perception.grip import Grip, grip_text

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
    if texture.masked_by is MaskingSource.STEPS:
        step = force_magnitude_text(texture.force_step)
        return f"the device's force steps of {step} hide it"
    motion = format_quantity(texture.hand_motion, "m", digits=2)
    frequency = texture.frequency
    at = f"above all at {frequency:.3g} Hz" if texture.level else "in waves that it resolves"
    share = f"{texture.level:.2g} of the amplitude that is felt"
    mass = format_quantity(1e3 * texture.apparent_mass, "g")
    return f"it moves the held tool ({mass}) by {motion}, {share}, {at}"


def unverified_text(texture: Perceptibility) -> str:
    """Return which unverified numbers of the device would hide the texture; empty without any."""
    if not texture.unverified:
        return ""
    names = " and ".join(field.replace("_", " ") for field in texture.unverified)
    return f"If the unverified {names} of this device is right, less is felt."


def perceptibility_assumptions(texture: Perceptibility, device: Device, grip: Grip) -> list[str]:
    """Return what a tier of perceptibility assumes of the hand and of the device, in sentences."""
    mass = format_quantity(1e3 * texture.apparent_mass, "g")
    assumed = "" if "apparent_mass" in device.data else ", assumed"
    limited = "; thresholds are extrapolated" if texture.extrapolated else ""
    sentences = [
        f"Felt: the texture moves the held tool, at {speed_text(texture.speed)}, by more than a "
        f"person notices at its frequencies{limited}; apparent mass {mass}{assumed}, "
        f"{grip_text(grip)}",
        f"Thresholds of the hand: {grip.sources['thresholds']}",
    ]
    if unknown := [one for one in texture.missing_data if one != "apparent_mass"]:
        names = ", ".join(field.replace("_", " ") for field in unknown)
        sentences.append(f"Unknown and assumed to hide nothing: {names}")
    friction = max(device.value(field) or 0.0 for field in ("friction", "least_friction"))
    if friction:
        sentences.append(
            f"The device's dry friction of {force_magnitude_text(friction)} only damps the tool "
            "while it slides; near rest, at reversals and under a lighter push it holds the tool"
        )
    return sentences


def remedies_text(texture: Perceptibility) -> str:
    """Return the changes that make a texture felt, in a sentence; says so if there are none."""
    if texture.tier == "felt" or texture.texture_rms == 0.0:
        return ""
    if not texture.remedies:
        return "No magnification within the workspace, speed or finer device alone makes it felt."
    return f"To feel it, {', or '.join(_remedy_text(remedy) for remedy in texture.remedies)}."


def _remedy_text(remedy: Remedy) -> str:
    value = remedy.value
    return {
        "magnify": f"magnify it {value:.10g} times more",
        "speed": f"scan at {speed_text(value)}",
        "apparent_mass": f"use a device with less than {format_quantity(1e3 * value, 'g')} of "
        "apparent mass",
        "force_resolution": f"use a device with force steps below {force_magnitude_text(value)}",
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
