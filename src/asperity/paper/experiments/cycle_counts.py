"""Section V.A: limit cycles at 2000 N/m, and the stiffness of their onset for each law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.paper.experiments import experiment_setups as setups
from asperity.scene.sweeps import map_threads, sweep_onsets
from asperity.simulation.batch import BatchSimulation, StopRule
from asperity.simulation.limit_cycles.onset import Prediction, run_starts, start_offsets

CYCLE_COUNT_STARTS = 24
STARTS = 8
DELAYS = (0, 1, 2, 3, 4, 5, 6)
FIGURE_5_PANELS = (("W", 1.0), ("A", 1.0), ("F", 1.0), ("A", 5.1), ("F", 8.3))
"""Law, and the divisor of its stiffness of 2000 N/m."""
ADDED_PANELS = (("H", 1.0),)
_STIFFNESS = 2000.0


@dataclass(frozen=True)
class CycleCount(Serializable):
    """Number of starts that end in a limit cycle.

    Attributes:
        law: letter.
        divisor: divisor of the stiffness of 2000 N/m.
        delay: loop delay [samples].
        starts: number of starts.
        cycles: number of starts that end in a steady cycle, see
            :mod:`asperity.simulation.limit_cycles.onset`.
        slow: number of starts that still moved after 0.5 s and came to rest by 2 or 8 s.
        time: time of the first start's trace [s], shape (n,).
        x: position of the handle [m], shape (n,).
        z: position of the handle [m], shape (n,).
    """

    serialized_attributes = "law stiffness delay starts cycles slow"

    law: str
    divisor: float
    delay: int
    starts: int
    cycles: int
    slow: int
    time: FloatArray
    x: FloatArray
    z: FloatArray

    @property
    def wall(self) -> str:
        """The law, with the divisor of its stiffness if it is not 1."""
        return self.law if self.divisor == 1.0 else f"{self.law}/{self.divisor:g}"

    @property
    def stiffness(self) -> float:
        """Stiffness [N/m]."""
        return _STIFFNESS / self.divisor


@dataclass(frozen=True)
class PassivityExperiment(Serializable):
    """Section V.A.

    Attributes:
        counts: counts at the fitted delay in the order of figure 5, then law H.
        onsets: onsets of limit cycles by law and delay, and the criteria.
        fitted: assumptions that the paper does not state.
    """

    counts: tuple[CycleCount, ...]
    onsets: tuple[Prediction, ...]
    fitted: tuple[str, ...] = setups.FITTED_ASSUMPTIONS


@lru_cache(maxsize=64)
def count_cycles(
    law: str, divisor: float, delay: int = setups.FITTED_DELAY, starts: int = CYCLE_COUNT_STARTS
) -> CycleCount:
    """Count the starts that end in a limit cycle at 2000 N/m over a divisor."""
    setup = setups.band_setup(law, _STIFFNESS / divisor, delay)
    servo = setup.servo.without_steps()
    duration = setup.duration
    loop = BatchSimulation(setup.surface, setup.plant, setup.hand, servo, setup.motion, setup.start)
    stiffness = setup.surface.stiffness
    shifts = start_offsets(setup.surface, starts)
    runs = run_starts(loop, stiffness, servo, shifts, duration)
    cycling = sum(bool(run.verdict) for run in runs)
    slow = sum(run.samples * servo.period > duration and not run.verdict for run in runs)
    samples = range(0, round(duration / servo.period), setups.TRACE_STRIDE)
    first = loop.new_trajectory(stiffness, delay, shifts[0], _observe_at(samples[1:]))
    path = [first.state[[0, 2]].copy()]
    while first.verdict is None:
        loop.run([first])
        path.append(first.state[[0, 2]].copy())
    time = np.array(samples) * servo.period
    return CycleCount(law, divisor, delay, starts, cycling, slow, time, *np.array(path).T)


def _observe_at(sample_counts: Sequence[int]) -> StopRule:
    """Pause a run at the given sample counts until it stops, without a verdict."""
    for count in sample_counts:
        if (yield count).stop:
            break
    return False


@lru_cache(maxsize=64)
def passivity_onsets(laws: str, delays: tuple[int, ...], starts: int) -> tuple[Prediction, ...]:
    """Return the onsets of laws at delays, including W, and the limits by the criteria."""
    return sweep_onsets(
        setups.band_setup("W"), laws, delays, n_phases=starts, tolerance=0.05, min_stiffness=50.0
    ).onsets


def passivity_experiment(
    laws: str = setups.ALL_LAWS, delays: tuple[int, ...] = DELAYS, starts: int = STARTS
) -> PassivityExperiment:
    """Simulate section V.A: counts at the fitted delay, and onsets against delay.

    Args:
        laws: laws of the onsets.
        delays: delays of the onsets [samples].
        starts: starts of the onsets; the counts have 24.
    """
    counts = map_threads(count_cycles, (*FIGURE_5_PANELS, *ADDED_PANELS))
    return PassivityExperiment(counts, passivity_onsets(laws, delays, starts))
