"""Perceptibility of a texture: its force against the thresholds that mask it, and remedies.

The texture force is the oscillating force of a straight scan, without form and waviness, in the
waves that the device resolves at that speed. It is masked by the device's force resolution, by its
dry friction, and by the threshold of the hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal

import numpy as np

from asperity.analysis.energy.merit import merit
from asperity.analysis.limits.limit_rules import LIMIT_RULES, LimitCase, evaluate_limit
from asperity.analysis.limits.spectrum import compute_spectrum, wave_forces
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.core.units import format_quantity, round_down, round_up
from asperity.devices import Device
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import TexturePart

MIN_SAMPLES = 2.0
"""Least samples of a wave by the sampling theorem; with more, but fewer than α and β, the wave is
distorted and borderline at best."""

HAND_THRESHOLD = 0.01
"""Amplitude of an oscillating force [N] below which a hand is assumed to notice nothing.

A choice: thresholds measured with a stylus depend on frequency, direction and grip (Israr, Choi
and Tan, IROS 2006).
"""

CLEAR_RATIO = 2.0
"""An amplitude counts as felt, not borderline, at this multiple of the threshold of the hand and of
the dry friction. Of force steps it needs γ, as in the paper's limit 4."""

# The limits that decide whether a wave is resolved: all limits on waves but that on its force.
_SAMPLING_RULES = tuple(rule for rule in LIMIT_RULES if rule.number in {1, 2, 3, 6})
_MAX_MAGNIFICATION = 1e9
_MASKING_FIELDS = "force_resolution", "friction", "bandwidth", "update_rate", "position_resolution"

Tier = Literal["felt", "borderline", "not felt"]


class MaskingSource(Enum):
    """The source with the highest threshold that the force of a texture has to exceed."""

    HAND = "hand"
    FRICTION = "friction"
    STEPS = "force_resolution"


@dataclass(frozen=True)
class Remedy(Serializable):
    """A change that would make the texture felt.

    Attributes:
        kind: ``"magnify"``: magnification in all directions by a factor; ``"slower"``: a scan
            below a speed [m/s]; ``"friction"``, ``"force_resolution"`` or
            ``"position_resolution"``: a device with at most that value [SI].
        value: the factor, speed or device value.
    """

    kind: str
    value: float


@dataclass(frozen=True)
class Perceptibility(Serializable):
    """Perceptibility of a texture on a device.

    Attributes:
        tier: ``"felt"``, ``"borderline"`` or ``"not felt"``.
        rms: RMS of the oscillating force of the whole surface on a scan [N].
        texture_rms: RMS of the same without form and waviness [N].
        nesting_index: wavelength above which waves count as waviness [m]; ``None`` where nothing
            was removed.
        resolved: share of the texture force's variance in waves that the device resolves at this
            speed: limits 1, 2, 3 and 6, as far as they can be decided.
        amplitude: √2 RMS of the resolved part [N].
        clear_threshold: amplitude from which the texture is felt [N].
        detection_threshold: amplitude below which the texture is not felt [N], of waves with at
            least two samples; in between it is borderline.
        masked_by: the source that sets ``clear_threshold``.
        speed: speed of the scan [m/s].
        missing_data: unknown fields of the device that could mask the texture.
        remedies: changes that would make it felt; empty where it is felt.
    """

    tier: Tier
    rms: float
    texture_rms: float
    nesting_index: float | None
    resolved: float
    amplitude: float
    clear_threshold: float
    detection_threshold: float
    masked_by: MaskingSource
    speed: float
    missing_data: tuple[str, ...]
    remedies: tuple[Remedy, ...]

    @property
    def resolved_rms(self) -> float:
        """RMS of the texture's force that the device resolves [N]."""
        return self.amplitude / math.sqrt(2.0)

    @property
    def is_mostly_form(self) -> bool:
        """Whether less than half of the force is texture; the rest is form and waviness."""
        return self.texture_rms < 0.5 * self.rms


def assess_perceptibility(
    surface: Surface,
    device: Device,
    part: TexturePart,
    *,
    rms: float,
    explicit_depth: bool = False,
    **scan: float,
) -> Perceptibility:
    """Assess whether the texture of a surface is felt on a device.

    Args:
        surface: texture, law and stiffness.
        device: device with force and position resolution, update rate, friction and bandwidth;
            unknown data mask nothing.
        part: the part of the surface that is texture, not form.
        rms: RMS of the oscillating force of the surface [N].
        explicit_depth: whether max_depth was given; by default the texture without form is
            pressed as deep as it is high.
        **scan: speed [m/s], time_samples, position_samples and force_steps, as in
            :class:`~asperity.analysis.limits.limit_rules.LimitCase`.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=1e-4, period=1e-3)
        >>> surface = Surface(wave, "A", stiffness=500.0)
        >>> part, touch = TexturePart(wave), load_device("touch")
        >>> result = assess_perceptibility(surface, touch, part, rms=0.035)
        >>> result.tier, result.masked_by.value
        ('not felt', 'friction')
        >>> [f"{remedy.kind} {remedy.value:.3g}" for remedy in result.remedies]
        ['magnify 11', 'friction 0.0247']
    """
    texture_rms = rms
    if part.nesting is not None:
        depth = surface.max_depth if explicit_depth else default_max_depth(part.texture)
        surface = surface.to_texture(part.texture, depth)
        texture_rms = merit(surface).ripple * surface.stiffness
    spectrum = compute_spectrum(part.texture)
    case = LimitCase(
        {field: datum.value for field, datum in device.data.items()},
        spectrum.wavelengths,
        wave_forces(surface, spectrum),
        spectrum.shares,
        **scan,
    )
    return classify_perceptibility(case, rms, texture_rms, part.nesting)


def classify_perceptibility(
    case: LimitCase, rms: float, texture_rms: float, nesting_index: float | None
) -> Perceptibility:
    """Return the perceptibility of a texture from the forces of its waves.

    Args:
        case: device, speed, samples, and the waves of the texture with their forces.
        rms: RMS of the oscillating force of the whole surface [N].
        texture_rms: RMS of the force of its texture [N].
        nesting_index: wavelength that separates texture from waviness [m].
    """
    friction = max(case.device.get("friction", 0.0), case.device.get("least_friction", 0.0))
    step = case.device.get("force_resolution", 0.0)
    clear_by_source = {
        MaskingSource.HAND: CLEAR_RATIO * HAND_THRESHOLD,
        MaskingSource.FRICTION: CLEAR_RATIO * friction,
        MaskingSource.STEPS: case.force_steps * step,
    }
    masked_by = max(clear_by_source, key=lambda source: clear_by_source[source])
    clear, detection = clear_by_source[masked_by], max(HAND_THRESHOLD, friction, step)
    resolved = _resolved_share(case)
    amplitude = math.sqrt(2.0 * resolved) * texture_rms
    coarse = replace(case, time_samples=MIN_SAMPLES, position_samples=MIN_SAMPLES)
    coarse_amplitude = math.sqrt(2.0 * _resolved_share(coarse)) * texture_rms
    tier: Tier = "not felt" if coarse_amplitude < detection else "borderline"
    tier = "felt" if amplitude >= clear else tier
    remedies = []
    if tier != "felt" and texture_rms > 0.0:
        remedies = _find_remedies(case, amplitude, texture_rms, clear_by_source)
    return Perceptibility(
        tier=tier,
        rms=rms,
        texture_rms=texture_rms,
        nesting_index=nesting_index,
        resolved=resolved,
        amplitude=amplitude,
        clear_threshold=clear,
        detection_threshold=detection,
        masked_by=masked_by,
        speed=case.speed,
        missing_data=tuple(field for field in _MASKING_FIELDS if field not in case.device),
        remedies=tuple(remedies),
    )


def _resolved_share(case: LimitCase) -> float:
    """Return the share of the force's variance that the device resolves; 1 without force."""
    squares = case.forces**2
    total = float(squares.sum())
    is_resolved = np.all([evaluate_limit(rule, case).holds for rule in _SAMPLING_RULES], axis=0)
    return float(squares[is_resolved].sum()) / total if total > 0.0 else 1.0


def _find_remedies(
    case: LimitCase, amplitude: float, texture_rms: float, clear: dict[MaskingSource, float]
) -> list[Remedy]:
    """Return the changes that would make a texture felt, each by itself."""
    masked_by = max(clear, key=lambda source: clear[source])
    remedies = []
    magnification = _required_magnification(case, texture_rms, clear[masked_by])
    if magnification is not None:
        remedies.append(Remedy("magnify", round_up(magnification, 2)))
    whole = math.sqrt(2.0) * texture_rms
    if whole >= clear[masked_by]:  # strong enough, if the device resolved it
        remedies.append(_resolution_remedy(case, (clear[masked_by] / whole) ** 2))
    elif masked_by is not MaskingSource.HAND:
        others = max(clear[source] for source in clear if source is not masked_by)
        ratio = CLEAR_RATIO if masked_by is MaskingSource.FRICTION else case.force_steps
        if amplitude >= others:
            remedies.append(Remedy(masked_by.value, amplitude / ratio))
    return remedies


def _required_magnification(case: LimitCase, texture_rms: float, clear: float) -> float | None:
    """Return the magnification from which a texture is felt; ``None`` without texture.

    Magnified g times in all directions, slopes and with them q stay the same; the force at the
    same stiffness grows g times, and every wave is g times longer, so no fewer are resolved.
    """

    def is_felt(factor: float) -> bool:
        larger = replace(case, wavelengths=factor * case.wavelengths)
        return math.sqrt(2.0 * _resolved_share(larger)) * factor * texture_rms >= clear

    high = 1.0
    while not is_felt(high):
        high *= 2.0
        if high > _MAX_MAGNIFICATION:
            return None
    low = 0.5 * high
    while high > (1.0 + 1e-13) * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if is_felt(middle) else (middle, high)
    return high


def _resolution_remedy(case: LimitCase, share: float) -> Remedy:
    """Return the scan speed, or the position resolution, that resolves a share of the force."""
    squares = case.forces**2
    tops = [evaluate_limit(rule, case).top_speeds for rule in _SAMPLING_RULES]
    speed = _weighted_quantile(np.min(tops, axis=0), squares, share)
    if speed > 0.0:
        return Remedy("slower", speed)
    longest = _weighted_quantile(case.wavelengths, squares, share)
    return Remedy("position_resolution", longest / max(case.position_samples, case.time_samples))


def _weighted_quantile(values: FloatArray, squares: FloatArray, share: float) -> float:
    """Return the value at or above which that share of the squares lies."""
    order = np.argsort(-values)
    sums = np.cumsum(squares[order]) / squares.sum()
    return float(values[order][min(int(np.searchsorted(sums, share)), len(order) - 1)])


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
