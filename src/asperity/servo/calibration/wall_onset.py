"""The stiffest stable smooth wall: raised until it cycles, then bisected."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

STIFFNESS_FACTOR = 1.3
"""Factor between stiffnesses until a wall cycles."""
BRACKET_RATIO = 1.03
"""Ratio of the bracket at which the bisection ends."""
MIN_STIFFNESS, MAX_STIFFNESS = 50.0, 50e3
"""Range of the search [N/m]."""
STEADY_RATIO = 0.99
"""Ratio of the amplitudes of two halves above which an oscillation persists."""
FLOOR_STEPS = 3.0
"""Multiple of step and noise below which an oscillation is that of the device itself."""


@dataclass(frozen=True)
class WallOnset(Serializable):
    """The walls that held along an axis.

    Attributes:
        stable_stiffness: largest stiffness below ``cycling_stiffness`` that held [N/m]; 0 if the
            lowest one cycled already.
        cycling_stiffness: least stiffness that cycled [N/m]; ``None`` if none did.
        trials: number of walls tried.
    """

    stable_stiffness: float
    cycling_stiffness: float | None
    trials: int


@dataclass(frozen=True)
class Oscillation:
    """The oscillation after a step of a wall.

    Attributes:
        first_amplitude: amplitude in the first half of the time [m].
        last_amplitude: amplitude in the second half [m].
    """

    first_amplitude: float
    last_amplitude: float

    def is_limit_cycle(self, floor: float) -> bool:
        """Return whether the oscillation persists, above the floor of steps and noise [m]."""
        return (
            self.last_amplitude > floor
            and self.last_amplitude >= STEADY_RATIO * self.first_amplitude
        )


def measure_oscillation(positions: FloatArray, period: float, frequency: float) -> Oscillation:
    """Return the amplitudes of an oscillation in the two halves of a record.

    Each is the product with a wave at the frequency of the highest peak of the spectrum, between a
    third and three times the expected one, in a Hann window, which suppresses steps and noise.

    Args:
        positions: positions (n,) [m].
        period: T [s].
        frequency: expected frequency [Hz].
    """
    count = len(positions)
    centred = positions - positions.mean()
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(count), 8 * count))
    frequencies = np.fft.rfftfreq(8 * count, period)
    near = (frequencies > frequency / 3.0) & (frequencies < 3.0 * frequency)
    peak = frequencies[near][np.argmax(spectrum[near])] if near.any() else frequency
    half = count // 2
    window = np.hanning(half)
    wave = window * np.exp(-2j * math.pi * peak * period * np.arange(half))
    first, last = (
        2.0 * abs(np.dot(part - part.mean(), wave)) / window.sum()
        for part in (centred[:half], centred[-half:])
    )
    return Oscillation(float(first), float(last))


def find_wall_onset(
    cycles: Callable[[float], bool], highest: float, lowest: float = MIN_STIFFNESS
) -> WallOnset:
    """Find the stiffest wall that holds: upwards from the lowest, then by bisection.

    Args:
        cycles: whether a wall of a stiffness [N/m] keeps cycling.
        highest: largest stiffness tried [N/m].
        lowest: least stiffness tried [N/m].
    """
    stable, cycling, trials = 0.0, math.inf, 0
    stiffness = lowest
    while math.isinf(cycling) and stiffness <= highest:
        trials += 1
        if cycles(stiffness):
            cycling = stiffness
        else:
            stable, stiffness = stiffness, stiffness * STIFFNESS_FACTOR
    while stable > 0.0 and math.isfinite(cycling) and cycling > BRACKET_RATIO * stable:
        trials += 1
        middle = math.sqrt(stable * cycling)
        if cycles(middle):
            cycling = middle
        else:
            stable = middle
    return WallOnset(stable, cycling if math.isfinite(cycling) else None, trials)
