"""Sentences of perceptibility: the texture force, the source that masks it, and remedies."""

from __future__ import annotations

from asperity.analysis.limits.perceptibility import MaskingSource, Perceptibility, Remedy
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
