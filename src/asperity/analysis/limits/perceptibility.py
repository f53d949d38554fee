"""Perceptibility of a texture: the motion of the held tool against what a hand notices.

The texture force is the oscillating force of a straight scan, without form and waviness, in the
waves that the device resolves at that speed; friction that varies along the scan is part of it.
Each wave moves the apparent mass of the device and the hand that holds it (docs/theory/limits.md);
the amplitude of this motion is compared with the detection thresholds of the grip at the frequency
of the wave, its harmonics too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.energy.straight_scan import scan_force
from asperity.analysis.limits.limit_rules import LIMIT_RULES, LimitCase, holds_for_waves
from asperity.analysis.limits.wave_scan import MASKING_FIELDS, WaveScan, scan_waves
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.core.units import round_down, round_up
from asperity.devices import Device
from asperity.perception.grip import Grip, load_grip
from asperity.surface import Surface, default_max_depth
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.texture import Texture, TexturePart

DEFAULT_APPARENT_MASS = 0.1
"""Apparent mass [kg] assumed for a device that does not state it."""

MIN_SAMPLES = 2.0
"""Least samples of a wave by the sampling theorem; with more, but fewer than α and β, the wave is
distorted and borderline at best."""


MAX_SPEED = 0.5
"""Greatest scanning speed [m/s] that a remedy asks for."""

# The limits that decide whether a wave is resolved: all limits on waves but that on its force.
_SAMPLING_RULES = tuple(rule for rule in LIMIT_RULES if rule.number in {1, 2, 3, 6})
_HAND_FIELDS = "apparent_mass", "damping"
# Factors by which a quantity is changed in the search for a remedy.
_FACTORS = 1.05 ** np.arange(1, 189)
# A magnification found by scaling is confirmed, and increased by these factors where depth or form
# do not scale with it.
_MAGNIFICATION_TRIES = 1.0, 1.5, 2.5
MAX_CONTACT_LOST = 0.5
"""Greatest share of the scan without contact of a magnified texture that counts as a remedy."""


def assess_perceptibility(
    surface: Surface,
    device: Device,
    part: TexturePart,
    *,
    rms: float,
    explicit_depth: bool = False,
    grip: Grip | None = None,
    find_remedies: bool = True,
    **scan: float,
) -> Perceptibility:
    """Assess whether the texture of a surface is felt on a device.

    Args:
        surface: texture, law and stiffness.
        device: device with apparent mass, damping, force and position resolution, update rate and
            bandwidth; unknown data mask nothing, an unknown mass is assumed.
        part: the part of the surface that is texture, not form.
        rms: RMS of the oscillating force of the surface without its friction [N].
        explicit_depth: whether max_depth was given; by default the texture without form is
            pressed as deep as it is high.
        grip: the hand; by default a tool held like a pen.
        find_remedies: whether to search for changes that make it felt.
        **scan: speed [m/s], time_samples, position_samples and force_steps, as in
            :class:`~asperity.analysis.limits.limit_rules.LimitCase`.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=5e-6, period=1e-3)
        >>> surface = Surface(wave, "A", stiffness=500.0)
        >>> part, touch = TexturePart(wave), load_device("touch")
        >>> result = assess_perceptibility(surface, touch, part, rms=0.00177)
        >>> result.tier, f"{result.level:.2f}", f"{result.frequency:.0f} Hz"
        ('borderline', '0.36', '100 Hz')
        >>> [f"{remedy.kind} {remedy.value:.3g}" for remedy in result.remedies]
        ['magnify 2.5', 'apparent_mass 0.017']
    """
    hand = grip or load_grip()
    waves, doubtful, texture_rms, _scanned = scan_waves(
        surface, device, part, hand, rms=rms, explicit_depth=explicit_depth, points=None, **scan
    )
    result = classify_perceptibility(
        waves, doubtful, max(rms, texture_rms), texture_rms, part.nesting
    )
    if not find_remedies or result.tier == "felt" or texture_rms == 0.0:
        return result
    options = {"explicit_depth": explicit_depth, "grip": grip, **scan}
    is_felt = partial(_is_felt_magnified, surface, device, options)
    return replace(result, remedies=tuple(_find_remedies(waves, is_felt)))


def _is_felt_magnified(
    surface: Surface, device: Device, options: Mapping[str, Any], factor: float
) -> bool:
    """Return whether the surface, magnified by a factor, is felt, touched and within reach."""
    texture = prepare_texture(surface.texture, magnify=factor)
    size = texture_length(texture)
    scaled = factor * surface.max_depth
    if texture.is_mirrored and size > device.workspace_size:
        return False
    depth = scaled if options["explicit_depth"] else default_max_depth(texture)
    larger = surface.to_texture(texture, depth)
    scanned = scan_force(larger)
    part = texture.texture_part()
    rms = scanned.ripple * larger.stiffness
    assessed = assess_perceptibility(larger, device, part, rms=rms, find_remedies=False, **options)
    return assessed.tier == "felt" and scanned.contact_lost <= MAX_CONTACT_LOST


def texture_length(texture: Texture) -> float:
    """Return the longer side of a texture, or its period [m]."""
    return float(np.hypot(*texture.domain.spans.T).max())


def classify_perceptibility(
    waves: WaveScan,
    doubtful: Mapping[str, float],
    rms: float,
    texture_rms: float,
    nesting_index: float | None,
) -> Perceptibility:
    """Return the perceptibility of a texture from the forces of its waves.

    Args:
        waves: the waves of the texture on a scan, with the trusted numbers of the device.
        doubtful: numbers of the device from unverified sources; they never hide a texture.
        rms: RMS of the oscillating force of the whole surface [N].
        texture_rms: RMS of the force of its texture [N].
        nesting_index: wavelength that separates texture from waviness [m].
    """
    known = waves.case.device
    data = {**known, **doubtful}
    response = respond(waves)
    complete = respond(replace(waves, case=replace(waves.case, device=data)))
    masking: list[str] = []
    if complete.tier == response.tier:
        response = complete
    else:
        tiers = {name: respond(waves.with_device(name, data[name])).tier for name in doubtful}
        # Numbers may hide a texture together that none of them hides alone.
        masking = [field for field in doubtful if tiers[field] != response.tier] or list(doubtful)
    forces = waves.case.forces
    resolved = response.is_resolved
    motions = np.where(resolved, response.motions, 0.0)
    total = float(forces @ forces)
    levels = np.where(response.is_known, motions / response.felt, 0.0)
    step = known.get("force_resolution", 0.0)
    amplitude = math.sqrt(float(np.square(forces[resolved]).sum()))
    rendered = response.frequencies[resolved & (forces > 0.0)]
    is_stepped = amplitude < waves.case.force_steps * step
    return Perceptibility(
        tier=response.tier,
        rms=rms,
        texture_rms=texture_rms,
        nesting_index=nesting_index,
        resolved=amplitude**2 / total if total > 0.0 else 1.0,
        amplitude=amplitude,
        hand_motion=float(np.linalg.norm(motions)),
        hand_force=float(np.linalg.norm(motions / waves.grip.compliance(response.frequencies))),
        level=float(np.linalg.norm(levels)),
        frequency=float(response.frequencies[np.argmax(levels)]) if levels.any() else 0.0,
        masked_by=MaskingSource.STEPS if is_stepped else MaskingSource.HAND,
        force_step=step,
        speed=waves.case.speed,
        apparent_mass=response.apparent_mass,
        extrapolated=not waves.grip.is_known(rendered).all(),
        known_frequencies=(waves.grip.frequency[0], waves.grip.frequency[-1]),
        missing_data=tuple(
            field for field in (*MASKING_FIELDS, *_HAND_FIELDS) if field not in data
        ),
        unverified=tuple(masking),
        remedies=(),
        spectrum=response,
    )


def respond(waves: WaveScan) -> HandSpectrum:
    """Return what reaches the hand on a scan.

    The contact stiffness acts along the normal of the wall alone, and dry friction F_c there as
    damping F_c/v; see :meth:`~asperity.perception.grip.Grip.compliance`.

    Felt: root of the sum of squares of motion over the felt amplitude at least 1, and an amplitude
    of force of at least γ steps. Not felt: the same with the unnoticed amplitude below 1, or less
    than one step of force, in waves with at least two samples. Waves at whose frequencies the grip
    has no thresholds count for neither; unknown: with them it may be noticed, without them not.
    """
    response = respond_felt(waves)
    if response.tier == "felt":
        return response
    return replace(response, tier=_lower_tier(waves, response))


def respond_felt(waves: WaveScan) -> HandSpectrum:
    """Return what :func:`respond` does, in a fraction of its time: all below felt is "not felt"."""
    case = waves.case
    grip = waves.grip
    frequencies = case.speed / case.wavelengths
    damping = case.device.get("damping", 0.0)
    # To a motion across the stroke, dry friction of constant size is viscous.
    across = damping + case.device.get("friction", 0.0) / case.speed
    mass = case.device.get("apparent_mass", DEFAULT_APPARENT_MASS)
    along = grip.compliance(frequencies, mass, damping)
    normal = grip.compliance(frequencies, mass, across, waves.contact_stiffness)
    motions = np.hypot(waves.components[:, 0] * along, waves.components[:, 1] * normal)
    unnoticed, felt = grip.threshold(frequencies)
    resolved = _is_sampled(case, waves.reach)
    known = grip.is_known(frequencies)
    response = HandSpectrum(
        "not felt", frequencies, motions, unnoticed, felt, resolved, known, mass
    )
    if felt_ratio(waves, response) >= 1.0:
        return replace(response, tier="felt")
    return response


def _lower_tier(waves: WaveScan, response: HandSpectrum) -> Tier:
    """Return the tier of a texture that is not felt for certain."""
    case = replace(waves.case, time_samples=MIN_SAMPLES, position_samples=MIN_SAMPLES)
    sampled = _is_sampled(case, waves.reach)
    noticed = response.motions / response.unnoticed
    if np.linalg.norm(noticed[sampled]) < 1.0:
        return "not felt"
    if np.linalg.norm(case.forces[sampled]) < case.device.get("force_resolution", 0.0):
        return "not felt"
    is_certain = np.linalg.norm(noticed[sampled & response.is_known]) >= 1.0
    return "borderline" if is_certain else "unknown"


def _is_sampled(case: LimitCase, reach: float) -> NDArray[np.bool_]:
    """Return whether the limits on waves hold for each wave within a workspace, shape (n,)."""
    sampled = case.wavelengths <= reach
    for rule in _SAMPLING_RULES:
        sampled &= holds_for_waves(rule, case)
    return np.asarray(sampled)


def felt_ratio(waves: WaveScan, response: HandSpectrum) -> float:
    """Return by which factor a texture exceeds what it needs to be felt; it is felt from 1 on.

    The lesser of the ratio of motion and felt amplitude, root of the sum of squares, and of that
    of the amplitude of the force and γ force steps, over the waves that the device resolves; the
    first over those at whose frequencies the grip has thresholds.
    """
    return min(felt_level(response), force_step_ratio(waves.case, response.is_resolved))


def felt_level(response: HandSpectrum) -> float:
    """Return the ratio of motion and felt amplitude over the waves that the device resolves."""
    known = response.is_resolved & response.is_known
    return float(np.linalg.norm((response.motions / response.felt)[known]))


def force_step_ratio(case: LimitCase, resolved: NDArray[np.bool_]) -> float:
    """Return the amplitude of the force of resolved waves over γ force steps of the device.

    Infinite where the device has no steps that are known.
    """
    needed = case.force_steps * case.device.get("force_resolution", 0.0)
    if not needed:
        return math.inf
    return float(np.linalg.norm(case.forces[resolved])) / needed


def _find_remedies(waves: WaveScan, is_felt_magnified: Callable[[float], bool]) -> list[Remedy]:
    """Return the changes that make a texture felt, each by itself and confirmed."""
    case = waves.case
    remedies = []
    first = _first_felt(_FACTORS, waves.magnified)
    if first is not None:
        tries = (round_up(first * share, 2) for share in _MAGNIFICATION_TRIES)
        if factor := next((factor for factor in tries if is_felt_magnified(factor)), None):
            remedies.append(Remedy("magnify", factor))
    # What is printed is confirmed: values are rounded before they are tried.
    slower = (round_down(case.speed / factor, 2) for factor in _FACTORS)
    faster = (min(round_up(case.speed * factor, 2), MAX_SPEED) for factor in _FACTORS)
    tried = (_first_felt(values, waves.at_speed) for values in (slower, faster))
    if speeds := [speed for speed in tried if speed is not None]:
        nearest = min(speeds, key=lambda speed: abs(math.log(speed / case.speed)))
        remedies.append(Remedy("speed", nearest))
    for name in ("apparent_mass", "force_resolution", "position_resolution"):
        assumed = DEFAULT_APPARENT_MASS if name == "apparent_mass" else 0.0
        value = case.device.get(name, assumed)
        finer = (round_down(value / factor, 2) for factor in _FACTORS if value)
        if (enough := _first_felt(finer, partial(waves.with_device, name))) is not None:
            remedies.append(Remedy(name, enough))
    return remedies


def _first_felt(values: Iterable[float], change: Callable[[float], WaveScan]) -> float | None:
    """Return the first value of a change at which a texture is felt; ``None`` if there is none."""
    return next(
        (float(value) for value in values if respond_felt(change(value)).tier == "felt"), None
    )


Tier = Literal["felt", "borderline", "unknown", "not felt"]


class MaskingSource(Enum):
    """What a texture has to exceed to be felt."""

    HAND = "hand"
    STEPS = "force_resolution"


@dataclass(frozen=True)
class Remedy(Serializable):
    """A change that makes the texture felt.

    Attributes:
        kind: ``"magnify"``: magnification in all directions by a further factor; ``"speed"``: a
            scan at a speed [m/s]; ``"apparent_mass"``, ``"force_resolution"`` or
            ``"position_resolution"``: a device with at most that value [SI].
        value: the factor, speed or device value.
    """

    kind: str
    value: float


@dataclass(frozen=True)
class HandSpectrum(Serializable):
    """What reaches the hand of each wave, and whether it is felt.

    Attributes:
        tier: whether the texture is felt.
        frequencies: v/l [Hz], shape (n,).
        motions: amplitudes of the motion of the held tool [m], shape (n,).
        unnoticed: amplitudes that nobody notices below [m], shape (n,).
        felt: amplitudes that are felt [m], shape (n,).
        is_resolved: whether the device resolves the wave and is as wide, shape (n,).
        is_known: whether the grip has thresholds at its frequency, shape (n,).
        apparent_mass: of the device, or the assumed one [kg].
    """

    tier: Tier
    frequencies: FloatArray
    motions: FloatArray
    unnoticed: FloatArray
    felt: FloatArray
    is_resolved: NDArray[np.bool_]
    is_known: NDArray[np.bool_]
    apparent_mass: float


@dataclass(frozen=True)
class Perceptibility(Serializable):
    """Perceptibility of a texture on a device.

    Attributes:
        tier: ``"felt"``, ``"borderline"``, ``"not felt"``, or ``"unknown"``: waves at frequencies
            without known thresholds decide.
        rms: RMS of the oscillating force of the whole surface on a scan [N].
        texture_rms: RMS of the same without form and waviness [N], with friction that varies.
        nesting_index: wavelength above which waves count as waviness [m]; ``None`` where nothing
            was removed.
        resolved: share of the texture force's variance in waves that the device resolves at this
            speed: limits 1, 2, 3 and 6, as far as they can be decided, and the workspace's width.
        amplitude: √2 RMS of the resolved part [N].
        hand_motion: amplitude of the motion of the held tool, √2 RMS, of the resolved part [m].
        hand_force: amplitude of the force on the hand, √2 RMS, of the resolved part [N].
        level: that motion over the amplitude that is felt, wave by wave, root of the sum of
            squares [1]; felt from 1 on.
        frequency: frequency of the wave that contributes most to ``level`` [Hz].
        masked_by: whether the hand or the force steps of the device hide the texture.
        force_step: force steps of the device [N], γ of which are needed; 0 if unknown.
        speed: speed of the scan [m/s].
        apparent_mass: mass of the device that was used [kg].
        extrapolated: whether waves are outside of the frequencies of the thresholds.
        known_frequencies: first and last frequency of the thresholds [Hz].
        missing_data: unknown fields of the device that could mask the texture.
        unverified: fields of the device from unverified sources that would mask the texture; the
            tier leaves them out.
        remedies: changes that make it felt; empty where it is felt.
        spectrum: what reaches the hand of each wave.
    """

    tier: Tier
    rms: float
    texture_rms: float
    nesting_index: float | None
    resolved: float
    amplitude: float
    hand_motion: float
    hand_force: float
    level: float
    frequency: float
    masked_by: MaskingSource
    force_step: float
    speed: float
    apparent_mass: float
    extrapolated: bool
    known_frequencies: tuple[float, float]
    missing_data: tuple[str, ...]
    unverified: tuple[str, ...]
    remedies: tuple[Remedy, ...]
    spectrum: HandSpectrum = field(compare=False)

    @property
    def resolved_rms(self) -> float:
        """RMS of the texture's force that the device resolves [N]."""
        return self.amplitude / math.sqrt(2.0)

    @property
    def is_mostly_form(self) -> bool:
        """Whether less than half of the force is texture; the rest is form and waviness."""
        return self.texture_rms < 0.5 * self.rms
