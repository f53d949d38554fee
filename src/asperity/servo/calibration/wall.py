"""The stiffest smooth wall that holds: raised from below until it begins to cycle, then between."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record

RISE = 1.3
"""Factor from one stiffness to the next while nothing cycles."""
BRACKET = 1.03
"""Where the least that cycled is less than this times the greatest that held, it is enough."""
LOWEST, HIGHEST = 50.0, 50e3
"""[N/m] between which a wall is looked for."""
STEADY = 0.99
"""An oscillation that is not less than this times what it was half of the time ago goes on."""
STEPS = 3.0
"""Steps of position, or times the noise, below which an oscillation is the device's own buzz."""


@dataclass(frozen=True)
class WallOnset(Record):
    """Which walls held along an axis.

    Attributes:
        held: the greatest stiffness below ``cycled`` that held [N/m]; 0 if even the least cycled.
        cycled: the least stiffness that cycled [N/m]; ``None`` if none did up to ``held``.
        tried: how many walls were tried.
    """

    held: float
    cycled: float | None
    tried: int


@dataclass(frozen=True)
class Ringing:
    """What became of the oscillation that a wall was left with.

    Attributes:
        first: its amplitude in the first half of the time [m].
        last: in the second half [m].
    """

    first: float
    last: float

    def cycles(self, floor: float) -> bool:
        """Return whether it goes on, above what steps and noise make of any wall [m]."""
        return self.last > floor and self.last >= STEADY * self.first


def ringing(way: FloatArray, period: float, frequency: float) -> Ringing:
    """Return the amplitudes of an oscillation in the two halves of a record.

    Each is the product with a wave of the frequency of the highest peak of the spectrum, between a
    third and three times the one that is expected, in a Hann window: of steps and noise next to
    nothing is left.

    Args:
        way: positions (n,) [m].
        period: T [s].
        frequency: that is expected [Hz].
    """
    count = len(way)
    centred = way - way.mean()
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
    return Ringing(float(first), float(last))


def find_wall(cycles: Callable[[float], bool], highest: float, lowest: float = LOWEST) -> WallOnset:
    """Return which walls held: from the lowest upwards, then between, and never far above.

    Args:
        cycles: whether a wall of a stiffness [N/m] goes on to cycle.
        highest: stiffness that is tried [N/m].
        lowest: likewise.
    """
    held, cycled, tried = 0.0, math.inf, 0
    stiffness = lowest
    while math.isinf(cycled) and stiffness <= highest:
        tried += 1
        if cycles(stiffness):
            cycled = stiffness
        else:
            held, stiffness = stiffness, stiffness * RISE
    if math.isinf(cycled):
        return WallOnset(held, None, tried)
    while held > 0.0 and cycled > BRACKET * held:
        tried += 1
        middle = math.sqrt(held * cycled)
        if cycles(middle):
            cycled = middle
        else:
            held = middle
    return WallOnset(held, cycled, tried)
