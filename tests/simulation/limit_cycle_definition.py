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
from asperity.simulation.onset_search import DURATION_FACTORS, felt_speed
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
    supplied, taken, _error = supplied_energy(run)
    return is_moving(run, threshold) and bool(supplied > 0.2 * taken)


def is_settling(run: Run, factor: float = 16.0) -> bool:
    """Return whether the motion decreases by a tenth or more per quarter of 16 spans."""
    ratio = 0.9 ** min(factor / 16.0, 1.0)
    return not run.stop and velocity_spread(run) < ratio * velocity_spread(run, quarter=2)


def supplied_energy(run: Run) -> tuple[float, float, float]:
    """Return energy supplied and taken between the middles of the last quarters, and its error."""
    columns = run.energies["supplied"].sum(axis=1), run.energies["lost"] - run.energies["friction"]
    supplied, taken = (np.array_split(column, 4)[2:] for column in columns)
    spreads = [(more - less).std() for more, less in zip(supplied, taken, strict=True)]
    part = np.array_split(run.position, 4)[3]
    frequency = velocity_spread(run) / (2.0 * np.pi * part.std(axis=0).sum())
    count = frequency * len(part) * run.period
    error = sum(spreads) * np.sqrt(2.0) / (np.pi * count)
    return np.diff([x.mean() for x in supplied])[0], np.diff([x.mean() for x in taken])[0], error


def lasts(run: Run, factor: float, threshold: float | None) -> bool | None:
    """Return whether a run ends in a cycle that lasts; ``None`` if a longer run must tell."""
    if run.stop is StopReason.DIVERGED or not is_moving(run, threshold):
        return run.stop is StopReason.DIVERGED
    supplied, taken, error = supplied_energy(run)
    if run.stop:
        return bool(supplied > 0.2 * taken)
    part = np.array_split(run.position, 4)[3]
    turns = velocity_spread(run) / part.std(axis=0).sum() * len(part) * run.period
    longest = factor == DURATION_FACTORS[-1]
    if factor == 1.0 or (turns < 4.0 * 2.0 * np.pi and not longest):
        return None
    settling = is_settling(run, factor)
    steady = not settling and supplied + (error if longest else -error) > 0.9 * taken
    if steady or longest:
        return bool(steady)
    is_open = factor < 16.0 or may_last(run, settling, threshold, supplied + error > 0.2 * taken)
    return None if is_open else False


def may_last(run: Run, settling: bool, threshold: float | None, fed: bool) -> bool:
    """Return whether a motion that settles as it does is felt in a run 4 times as long, and fed."""
    part = np.array_split(run.position, 4)[3]
    change = velocity_spread(run) / velocity_spread(run, quarter=2)
    # The middle of its last quarter is 7/8 (4 - 1) runs later: so many quarters of this run.
    left = min(change, 1.0) ** (42.0 / 4.0) if settling else 1.0
    speed, extent = left * velocity_spread(run), left * part.std(axis=0).sum()
    felt = felt_speed(speed, extent) if threshold is None else threshold
    return fed and bool(speed > felt)


def ends_in_cycle(
    run_for: Callable[[float], Run], duration: float, threshold: float | None = None
) -> tuple[bool, Run]:
    """Return whether a loop ends in a limit cycle, and its longest run."""
    for factor in DURATION_FACTORS:
        run = run_for(factor * duration)
        verdict = lasts(run, factor, threshold)
        if verdict is not None:
            return verdict, run
    raise AssertionError("the longest run decides")
