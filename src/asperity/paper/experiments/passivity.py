"""Section V.A: who begins to cycle at 2000 N/m, and at which stiffness each law does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record
from asperity.paper.experiments.settings import FITTED, LAG, LETTERS, band_setup
from asperity.scene.sweeps import onsets, side_by_side
from asperity.simulation.onset import ends_of_starts, offsets
from asperity.simulation.prediction import Prediction
from asperity.simulation.together import Judge, Together

COUNTED_STARTS = 24
STARTS = 8
DELAYS = (0, 1, 2, 3, 4, 5, 6)
# Law, and what its stiffness of 2000 N/m is divided by: the paper's figure 5.
PANELS = (("W", 1.0), ("A", 1.0), ("F", 1.0), ("A", 5.1), ("F", 8.3))
NEW = (("H", 1.0),)
_STIFFNESS = 2000.0
_EVERY = 10


@dataclass(frozen=True)
class Count(Record):
    """How many of the starts end in a limit cycle.

    Attributes:
        law: letter.
        divisor: of the stiffness of 2000 N/m.
        delay: in samples.
        starts: how many there were.
        cycles: how many ended in a steady cycle, see ``simulation/judging.py``.
        slow: how many were restless after 0.5 s, but came to rest by 2 or 8 s.
        time: of the first start's trace [s], shape (n,).
        x: of the handle [m], shape (n,).
        z: of the handle [m], shape (n,).
    """

    written = "law stiffness delay starts cycles slow"

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
    def stiffness(self) -> float:
        """[N/m]."""
        return _STIFFNESS / self.divisor


@dataclass(frozen=True)
class PassivityExperiment(Record):
    """Section V.A.

    Attributes:
        counts: at the fitted lag, in the order of figure 5, and law H.
        onsets: of limit cycles by law and delay, beside the criteria.
        fitted: what the paper does not state.
    """

    counts: tuple[Count, ...]
    onsets: tuple[Prediction, ...]
    fitted: tuple[str, ...] = FITTED

    def count(self, law: str, divisor: float = 1.0) -> Count:
        """Return the count of a law at 2000 N/m over a divisor."""
        return next(one for one in self.counts if (one.law, one.divisor) == (law, divisor))

    def onset(self, law: str, delay: int) -> Prediction:
        """Return the onset of a law at a delay."""
        return next(one for one in self.onsets if (one.onset.law, one.onset.delay) == (law, delay))


@lru_cache(maxsize=64)
def count_cycles(law: str, divisor: float, delay: int = LAG, starts: int = COUNTED_STARTS) -> Count:
    """Return how many starts end in a limit cycle at 2000 N/m over a divisor."""
    setup = band_setup(law, _STIFFNESS / divisor, delay)
    servo, duration = setup.servo, setup.duration
    loop = Together(setup.surface, setup.plant, setup.hand, servo, setup.motion, setup.start)
    stiffness, shifts = setup.surface.stiffness, offsets(setup.surface, starts)
    runs = ends_of_starts(loop, stiffness, servo, shifts, duration)
    cycling = sum(bool(run.verdict) for run in runs)
    slow = sum(run.samples * servo.period > duration and not run.verdict for run in runs)
    shown = range(0, round(duration / servo.period), _EVERY)
    first = loop.start(stiffness, delay, shifts[0], _seen_at(shown[1:]))
    path = [first.state[[0, 2]].copy()]
    while first.verdict is None:
        loop.run([first])
        path.append(first.state[[0, 2]].copy())
    time = np.array(shown) * servo.period
    return Count(law, divisor, delay, starts, cycling, slow, time, *np.array(path).T)


def _seen_at(goals: Sequence[int]) -> Judge:
    """See a run after so many samples each, as far as it goes, and judge nothing."""
    for goal in goals:
        if (yield goal).stop:
            break
    return False


@lru_cache(maxsize=64)
def passivity_onsets(laws: str, delay: int, starts: int) -> tuple[Prediction, ...]:
    """Return the onsets of laws at a delay, W among them, beside what the criteria allow."""
    return _onsets(laws, (delay,), starts)


def _onsets(laws: str, delays: tuple[int, ...], starts: int) -> tuple[Prediction, ...]:
    return onsets(band_setup("W"), laws, delays, starts=starts, tolerance=0.05, lowest=50.0)


def passivity_experiment(
    laws: str = LETTERS, delays: tuple[int, ...] = DELAYS, starts: int = STARTS
) -> PassivityExperiment:
    """Return section V.A: counts at the fitted lag, and onsets against delay.

    Args:
        laws: of the onsets.
        delays: of the onsets [samples].
        starts: of the onsets; the counts have 24.
    """
    counts = side_by_side(count_cycles, (*PANELS, *NEW))
    return PassivityExperiment(counts, _onsets(laws, delays, starts))
