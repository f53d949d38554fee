"""Will the texture be felt? Its force against what hides it, in three tiers, with the cure.

What is felt is the oscillating force of a straight scan, without form and waviness, in the waves
that the device resolves at that speed. It is hidden by the device's steps of force, by its dry
friction, and by what a hand does not notice.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Literal

import numpy as np

from asperity.analysis.energy.merit import merit
from asperity.analysis.limits.limit_rules import RULES, Case, Decision, decide
from asperity.analysis.limits.spectrum import spectrum
from asperity.analysis.limits.wave_force import wave_forces
from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.files import Record
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import TexturePart
from asperity.units import rounded_up

DEFAULT_SPEED = 0.1  # [m/s], a brisk stroke
DEFAULT_SAMPLES = 5.0  # "typically 5 to 10"
LEAST_SAMPLES = 2.0
"""Samples of a wave without which nothing of it arrives, by the sampling theorem; with more, but
less than α and β, it arrives distorted, and is borderline at best."""

NOTICED = 0.01
"""Amplitude of an oscillating force [N] below which a hand is taken to notice nothing.

A choice. Thresholds measured with a stylus depend on frequency, direction and grip (Israr, Choi
and Tan, IROS 2006).
"""

CLEARLY = 2.0
"""An amplitude is taken as felt, no longer borderline, at so many times what a hand notices, or
the dry friction. Of steps of force it needs γ, as in the paper's limit 4."""

# Which of the six limits say whether a wave comes through: all on waves but that on its force.
_ON_TIME_AND_PLACE = (1, 2, 3, 6)
_MOST_MAGNIFIED = 1e9
_MAY_HIDE = (
    "force_resolution", "friction", "bandwidth", "update_rate", "position_resolution",
)  # fmt: skip

Tier = Literal["felt", "borderline", "not felt"]


class Hides(Enum):
    """What hides a texture: the highest of the levels that its force has to pass."""

    HAND = "hand"
    FRICTION = "friction"
    STEPS = "force_resolution"


@dataclass(frozen=True)
class Cure(Record):
    """What would make the texture felt, with the number.

    Attributes:
        kind: ``"magnify"``: times so much, in all directions; ``"slower"``: a scan below that
            speed [m/s]; ``"friction"``, ``"force_resolution"`` or ``"position_resolution"``: a
            device with at most that [SI].
        value: the number.
    """

    kind: Literal["magnify", "slower", "friction", "force_resolution", "position_resolution"]
    value: float


@dataclass(frozen=True)
class Felt(Record):
    """Whether a texture is felt on a device.

    Attributes:
        tier: ``"felt"``, ``"borderline"`` or ``"not felt"``.
        rms: RMS of the oscillating force of the whole surface on a scan [N].
        texture: RMS of what is left of it without form and waviness [N].
        nesting: the wavelength from which on waves count as waviness [m]; ``None`` where nothing
            was taken away.
        resolved: share of the texture force's variance, in waves that the device resolves at this
            speed: limits 1, 2, 3 and 6, as far as they can be decided.
        amplitude: √2 RMS of that part [N].
        clear: amplitude from which it is felt [N].
        level: amplitude below which nothing is felt [N]; waves with at least two samples count for
            that. In between it is borderline.
        hides: what sets ``clear``.
        speed: of the scan [m/s].
        unknown: fields of the device that could hide it, and are not known.
        cures: what would make it felt; empty where it is.
    """

    tier: Tier
    rms: float
    texture: float
    nesting: float | None
    resolved: float
    amplitude: float
    clear: float
    level: float
    hides: Hides
    speed: float
    unknown: tuple[str, ...]
    cures: tuple[Cure, ...]

    @property
    def shown(self) -> float:
        """RMS of the texture's force that the device resolves [N]."""
        return self.amplitude / math.sqrt(2.0)

    @property
    def mostly_form(self) -> bool:
        """Whether less than half of the force is texture: the rest is form and waviness."""
        return self.texture < 0.5 * self.rms


def texture_felt(
    surface: Surface,
    device: Device,
    part: TexturePart,
    *,
    rms: float,
    speed: float = DEFAULT_SPEED,
    time_samples: float = DEFAULT_SAMPLES,
    position_samples: float = DEFAULT_SAMPLES,
    force_steps: float = DEFAULT_SAMPLES,
    deep: bool = False,
) -> Felt:
    """Return whether the texture of a surface is felt on a device.

    Args:
        surface: texture, law and stiffness.
        device: its force and position steps, update rate, friction and bandwidth count; what is
            not known hides nothing.
        part: what of its texture is texture, not form.
        rms: of the oscillating force of the surface [N].
        speed: of the scan [m/s].
        time_samples: α, updates that a wave needs.
        position_samples: β, position steps that a wave needs.
        force_steps: γ, steps of force that an amplitude needs to be felt clearly.
        deep: whether max_depth is one that was asked for; else the texture that is left is
            pressed as deep as it is high.

    Example:
        >>> from asperity.devices import load_device
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=1e-4, period=1e-3)
        >>> surface = Surface(wave, "A", stiffness=500.0)
        >>> found = texture_felt(surface, load_device("touch"), TexturePart(wave), rms=0.035)
        >>> found.tier, found.hides.value, [f"{one.kind} {one.value:.3g}" for one in found.cures]
        ('not felt', 'friction', ['magnify 11', 'friction 0.0247'])
    """
    alone = texture_alone(surface, part, deep=deep)
    texture = rms if part.nesting is None else merit(alone).ripple * surface.stiffness
    waves = spectrum(part.texture)
    case = Case(
        {field: datum.value for field, datum in device.data.items()},
        speed, time_samples, position_samples, force_steps, waves.wavelengths,
        wave_forces(alone, waves), np.array([wave.share for wave in waves.waves]),
        math.nan, surface.stiffness,
    )  # fmt: skip
    return judge(case, rms, texture, part.nesting)


def texture_alone(surface: Surface, part: TexturePart, *, deep: bool) -> Surface:
    """Return the surface without form and waviness; see :func:`texture_felt`."""
    if part.nesting is None:
        return surface
    depth = surface.max_depth if deep else default_max_depth(part.texture)
    return surface.to_texture(part.texture, depth)


def judge(case: Case, rms: float, texture: float, nesting: float | None) -> Felt:
    """Return the tier of a texture whose waves push with given forces.

    Args:
        case: device, speed, samples, and the waves of the texture with their forces.
        rms: RMS of the oscillating force of the whole surface [N].
        texture: RMS of its texture [N].
        nesting: the wavelength that parts texture from waviness [m].
    """
    level, clear, hides = _levels(case)
    resolved = _resolved(case)
    amplitude = math.sqrt(2.0 * resolved) * texture
    coarsely = replace(case, time_samples=LEAST_SAMPLES, position_samples=LEAST_SAMPLES)
    arrives = math.sqrt(2.0 * _resolved(coarsely)) * texture
    tier: Tier = "not felt" if arrives < level else "borderline"
    tier = "felt" if amplitude >= clear else tier
    cures = () if tier == "felt" else tuple(_cures(case, amplitude, texture))
    unknown = tuple(field for field in _MAY_HIDE if field not in case.device)
    return Felt(tier, rms, texture, nesting, resolved, amplitude, clear, level, hides, case.speed,
                unknown, cures)  # fmt: skip


def _decided(case: Case) -> list[Decision]:
    """Return what the limits on waves say that can be decided."""
    decisions = [decide(rule, case) for rule in RULES if rule.number in _ON_TIME_AND_PLACE]
    return [one for one in decisions if one.holds is not None]


def _resolved(case: Case) -> float:
    """Return the share of the force's variance that the device resolves; 1 of no force."""
    squares = case.forces**2
    total = float(squares.sum())
    comes = np.ones(len(squares), dtype=bool)
    for one in _decided(case):
        comes &= one.holds
    return float(squares[comes].sum()) / total if total > 0.0 else 1.0


def _clears(case: Case) -> dict[Hides, float]:
    """Return the amplitude [N] from which each leaves a texture felt."""
    return {
        Hides.HAND: CLEARLY * NOTICED,
        Hides.FRICTION: CLEARLY * _friction(case),
        Hides.STEPS: case.force_steps * case.device.get("force_resolution", 0.0),
    }


def _friction(case: Case) -> float:
    return max(case.device.get("friction", 0.0), case.device.get("least_friction", 0.0))


def _levels(case: Case) -> tuple[float, float, Hides]:
    """Return the amplitudes from which a texture is borderline and felt [N], and what sets them."""
    level = max(NOTICED, _friction(case), case.device.get("force_resolution", 0.0))
    clears = _clears(case)
    hides = max(clears, key=lambda what: clears[what])
    return level, clears[hides], hides


def _clear_without(hides: Hides, case: Case) -> float:
    return max(clear for what, clear in _clears(case).items() if what is not hides)


def _cures(case: Case, amplitude: float, texture: float) -> list[Cure]:
    """Return what would make a texture felt, each by itself."""
    _level, clear, hides = _levels(case)
    cures = []
    times = _magnified(case, texture)
    if times is not None:
        cures.append(Cure("magnify", rounded_up(times, 2)))
    whole = math.sqrt(2.0) * texture
    if whole >= clear:  # strong enough, if it only came through
        cures.append(_come_through(case, (clear / whole) ** 2))
    elif hides is not Hides.HAND and amplitude >= _clear_without(hides, case):
        needed = CLEARLY if hides is Hides.FRICTION else case.force_steps
        kind: Literal["friction", "force_resolution"] = (
            "friction" if hides is Hides.FRICTION else "force_resolution"
        )
        cures.append(Cure(kind, amplitude / needed))
    return cures


def _magnified(case: Case, texture: float) -> float | None:
    """Return by how much to magnify a texture until it is felt; ``None`` if nothing is there.

    Magnified g times in all directions, slopes and with them q stay as they are; the force at the
    same stiffness grows g times, and every wave is g times longer, so that no fewer come through.
    """
    clear = _levels(case)[1]

    def enough(times: float) -> bool:
        larger = replace(case, wavelengths=times * case.wavelengths)
        return math.sqrt(2.0 * _resolved(larger)) * times * texture >= clear

    high = 1.0
    while not enough(high):
        high *= 2.0
        if high > _MOST_MAGNIFIED:
            return None
    low = 0.5 * high
    while high > (1.0 + 1e-13) * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _come_through(case: Case, share: float) -> Cure:
    """Return how slow a scan, or how fine steps of position, bring a share of the force through."""
    squares = case.forces**2
    tops = [one.top for one in _decided(case) if one.top is not None]
    fastest = np.min(tops, axis=0)  # of what comes through whole, nothing has to be cured
    speed = _reached(fastest, squares, share)
    if speed > 0.0:
        return Cure("slower", speed)
    longest = _reached(case.wavelengths, squares, share)
    samples = max(case.position_samples, case.time_samples)
    return Cure("position_resolution", longest / samples)


def _reached(values: FloatArray, squares: FloatArray, share: float) -> float:
    """Return the value at or above which that share of the squares lies."""
    order = np.argsort(-values)
    sums = np.cumsum(squares[order]) / squares.sum()
    return float(values[order][min(int(np.searchsorted(sums, share)), len(order) - 1)])
