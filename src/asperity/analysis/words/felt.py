"""From a texture's force to words: is it felt, what hides it, and what would help."""

from __future__ import annotations

from asperity.analysis.limits.felt import Cure, Felt, Hides
from asperity.devices import Device
from asperity.units import engineering, rounded_down

_NO_HEIGHT = 1e-12  # [m], far below an atom: what rounding leaves


def speed_text(speed: float) -> str:
    """Return a speed for reading.

    Example:
        >>> speed_text(0.1), speed_text(0.00034)
        ('0.1 m/s', '0.34 mm/s')
    """
    return f"{speed:.3g} m/s" if speed >= 0.01 else f"{1e3 * speed:.3g} mm/s"


def millinewtons(force: float) -> str:
    """Return a force for reading, with two digits.

    Example:
        >>> millinewtons(0.1063), millinewtons(2.51e-4)
        ('110 mN', '250 µN')
    """
    return engineering(force, "N", digits=2)


def amount(felt: Felt) -> str:
    """Return how much texture there is: RMS of its force, and what of it is no texture.

    Example:
        >>> parts = ("felt", 0.139, 0.0116, 8e-3, 1.0, 0.0164, 0.02, 0.01)
        >>> amount(Felt(*parts, Hides.HAND, 0.1, (), ()))
        '140 mN RMS, of which 12 mN is texture'
    """
    if felt.mostly_form:
        text = f"{millinewtons(felt.rms)} RMS, of which {millinewtons(felt.texture)} is texture"
    else:
        text = f"{millinewtons(felt.texture)} RMS of texture"
    if felt.resolved < 0.5:
        shown, speed = millinewtons(felt.shown), speed_text(felt.speed)
        text += f", of which the device resolves {shown} at {speed}"
    return text


def hidden_by(felt: Felt, device: Device) -> str:
    """Return what hides a texture that is not felt, with the force [RMS] that it takes."""
    needed = f"felt from {millinewtons(felt.clear / 2**0.5)} RMS on"
    if felt.hides is Hides.HAND:
        return f"{needed}, what a hand notices"
    if felt.hides is Hides.FRICTION:
        known = [device.value(field) or 0.0 for field in ("friction", "least_friction")]
        return f"{needed}, for the device's dry friction of {millinewtons(max(known))}"
    step = millinewtons(device.value("force_resolution") or 0.0)
    return f"{needed}, for the device's force steps of {step}"


def cures_text(felt: Felt) -> str:
    """Return what would make a texture felt, in a sentence; empty if nothing is known to.

    Example:
        >>> one = (Cure("magnify", 11.0), Cure("friction", 0.025))
        >>> parts = ("not felt", 0.1, 0.1, None, 1.0, 0.1, 2.0, 1.0)
        >>> cures_text(Felt(*parts, Hides.FRICTION, 0.1, (), one))
        'To feel it, magnify 11 times, or use a device with less than 25 mN of dry friction.'
    """
    if not felt.cures:
        return ""
    return f"To feel it, {', or '.join(_cure(one) for one in felt.cures)}."


def _cure(cure: Cure) -> str:
    value = cure.value
    return {
        "magnify": f"magnify {value:.10g} times",
        "slower": f"scan slower than {speed_text(rounded_down(value))}",
        "friction": f"use a device with less than {millinewtons(value)} of dry friction",
        "force_resolution": f"use a device with force steps below {millinewtons(value)}",
        "position_resolution": f"use a device with position steps below {engineering(value, 'm')}",
    }[cure.kind]


def tier_text(felt: Felt | None) -> str:
    """Return the tier, "–" where there is no stiffness."""
    return "–" if felt is None else felt.tier


def form_removed(felt: Felt | None, form: float, waviness: float) -> list[str]:
    """Return what was taken for form and waviness, in a sentence, if anything was.

    Args:
        felt: of any of the laws.
        form: range of the form [m].
        waviness: range of the waviness [m].
    """
    if felt is None or felt.nesting is None:
        return []
    return [
        f"What counts as texture is what a form of second degree and a Gaussian L-filter of "
        f"{engineering(felt.nesting, 'm')} leave; they take {_taken('form', form)} and "
        f"{_taken('waviness', waviness)}"
    ]


def _taken(part: str, height: float) -> str:
    return f"no {part}" if height < _NO_HEIGHT else f"{part} {engineering(height, 'm')} high"
