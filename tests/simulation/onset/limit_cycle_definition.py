"""What a limit cycle is, from whole traces of runs: what the sums of the search must come to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.simulation import Run
from asperity.simulation.hands import Motion
from asperity.simulation.limit_cycles.onset_search import CYCLE_SPEED, DURATION_FACTORS
from asperity.simulation.trace import StopReason


@dataclass(frozen=True)
class Shifted:
    """A motion that is carried along: the same way from another place."""

    motion: Motion
    offset: FloatArray

    def at(self, times: FloatArray) -> FloatArray:
        return np.asarray(self.motion.at(times) + self.offset)

    def to_dict(self) -> dict[str, Any]:
        return {}


def restlessness(run: Run, quarter: int = 3) -> float:
    """Return the standard deviations of the velocity, summed over the axes [m/s]."""
    part = np.array_split(run.velocity, 4)[quarter]
    return float(part.std(axis=0).sum())


def cycles(run: Run, threshold: float = CYCLE_SPEED) -> bool:
    """Return whether a run ends restless, and fed by the texture, or diverged."""
    if run.stop is StopReason.DIVERGED:
        return True
    return restlessness(run) > threshold and run.tail is not None and run.tail.gains_energy


def calms_down(run: Run) -> bool:
    """Return whether what is left of the motion is still getting less, by a tenth or more."""
    return not run.stop and restlessness(run) < 0.9 * restlessness(run, quarter=2)


def ends_in_cycle(
    run_for: Callable[[float], Run], duration: float, threshold: float = CYCLE_SPEED
) -> tuple[bool, Run]:
    """Return whether a loop ends in a limit cycle, and the longest run of it."""
    for patience in DURATION_FACTORS:
        run = run_for(patience * duration)
        if run.stop or restlessness(run) <= threshold:
            break
        if patience > 1.0 and not calms_down(run):
            break
    return cycles(run, threshold), run
