"""The definition of a limit cycle on full traces: the reference for the sums of the search."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.perception.grip import load_grip
from asperity.simulation import Run
from asperity.simulation.hands import Motion
from asperity.simulation.onset_search import DURATION_FACTORS
from asperity.simulation.trace import StopReason


@dataclass(frozen=True)
class ShiftedMotion:
    """A motion displaced by a constant offset."""

    motion: Motion
    offset: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        return np.asarray(self.motion.at(times) + self.offset)

    def to_dict(self) -> dict[str, Any]:
        return {}


def velocity_spread(run: Run, quarter: int = 3) -> float:
    """Return the standard deviations of the velocity, summed over the axes [m/s]."""
    part = np.array_split(run.velocity, 4)[quarter]
    return float(part.std(axis=0).sum())


def is_moving(run: Run, threshold: float | None = None) -> bool:
    """Return whether the velocity varies by more than a threshold, or than what a hand feels."""
    speed, extent = velocity_spread(run), np.array_split(run.position, 4)[3].std(axis=0).sum()
    if threshold is not None:
        return speed > threshold
    frequency = min(max(speed / (2.0 * np.pi * extent), 10.0), 500.0) if extent else 500.0
    return speed > np.sqrt(2.0) * np.pi * frequency * load_grip().threshold(frequency)[1]


def is_cycling(run: Run, threshold: float | None = None) -> bool:
    """Return whether a run ends in motion that the texture feeds, or diverged."""
    if run.stop is StopReason.DIVERGED:
        return True
    return is_moving(run, threshold) and run.tail is not None and run.tail.gains_energy


def is_settling(run: Run, factor: float = 16.0) -> bool:
    """Return whether the remaining motion decreases by a tenth or more per quarter of 16 spans."""
    ratio = 0.9 ** (factor / 16.0)
    return not run.stop and velocity_spread(run) < ratio * velocity_spread(run, quarter=2)


def ends_in_cycle(
    run_for: Callable[[float], Run], duration: float, threshold: float | None = None
) -> tuple[bool, Run]:
    """Return whether a loop ends in a limit cycle, and its longest run."""
    for factor in DURATION_FACTORS:
        run = run_for(factor * duration)
        if run.stop or not is_moving(run, threshold):
            break
        if factor > 1.0 and not is_settling(run, factor):
            break
    return is_cycling(run, threshold) and not is_settling(run, factor), run
