"""Whether a texture is felt on a device, and what would make it felt: the result."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

Tier = Literal["felt", "borderline", "not felt"]


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
        apparent_mass: of the device, or the assumed one [kg].
    """

    tier: Tier
    frequencies: FloatArray
    motions: FloatArray
    unnoticed: FloatArray
    felt: FloatArray
    is_resolved: NDArray[np.bool_]
    apparent_mass: float


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
