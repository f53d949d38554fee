"""Planning of studies: their power, from simulated participants before the first real one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from asperity.core.checks import check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.studies.design import StudyDesign, Values
from asperity.studies.methods import METHODS
from asperity.studies.observers import Strength, find_observer, simulate_run
from asperity.studies.statistics.intervals import Interval, share_interval

SPREAD = 0.3
"""Deviation of the logarithms of the thresholds of participants."""
_RESAMPLES = 400


@dataclass(frozen=True)
class StudyPlan(Serializable):
    """How often a study would find an effect.

    Attributes:
        participants: their number.
        trials: of each participant.
        effect: by which factor the first condition is stronger than the others.
        simulations: number of simulated studies.
        found: in how many the 95 % interval of the difference of the second from the first
            condition (or of the first pair from chance) leaves out no difference.
    """

    participants: int
    trials: int
    effect: float
    simulations: int
    found: int

    @property
    def power(self) -> Interval:
        """Share of the studies that find the effect, and its 95 % interval (Wilson)."""
        return share_interval(self.found, self.simulations)

    @property
    def text(self) -> str:
        """The plan in a sentence."""
        power, low, high = self.power
        return (
            f"With {self.participants} participants of {self.trials} trials each, "
            f"{power:.0%} ({low:.0%} to {high:.0%}) of {self.simulations} simulated studies find "
            f"that the first condition is {self.effect:g} times as strong."
        )


def plan(
    design: StudyDesign,
    effect: float,
    participants: int | None = None,
    seed: int = 0,
    simulations: int = 200,
    observer: str = "typical",
) -> StudyPlan:
    """Return how often a study would find an effect: its power, by simulation.

    The logarithms of the thresholds of participants deviate by 0.3.

    Args:
        design: the study, with at least two conditions.
        effect: by which factor stimuli of the first condition are stronger at the hand than those
            of the others; 1 tells how often a study finds what is not there.
        participants: their number; by default that of the design.
        seed: of the simulation.
        simulations: number of simulated studies.
        observer: name of the observer; see :data:`~asperity.studies.observers.OBSERVERS`.

    Raises:
        ParameterError: for fewer than three participants or two conditions, or an effect or a
            number of simulations that is not positive.
    """
    effect = check_positive("effect", effect)
    count = participants or design.participants
    check_positive("simulations", simulations)
    if count < 3:
        raise ParameterError("participants", "must be at least 3 for an interval", count)
    design.check_conditions(2)
    kind = METHODS[design.kind]
    base = find_observer(observer)
    design = kind.complete(design)
    strength = _planned_strength(design, effect)
    found = 0
    trials = 0
    for number in range(simulations):
        rng = np.random.default_rng([seed, number])
        own = int(rng.integers(2**31))
        answered = {}
        for i in range(count):
            threshold = base.threshold * math.exp(SPREAD * rng.standard_normal())
            person = replace(base, threshold=threshold)
            answered[str(i)] = simulate_run(design, i, person, strength, own)
        _, low, high = kind.score(design, answered).differences(own, _RESAMPLES)[0]
        found += not low <= 0.0 <= high
        trials = len(answered["0"])
    return StudyPlan(count, trials, effect, simulations, found)


def _planned_strength(design: StudyDesign, effect: float) -> Strength:
    """Return strengths: 1 in the middle of the range, ``effect`` times in the first condition."""
    first = design.conditions[0]
    key = str(design.options.get("level", ""))
    middle = math.sqrt(math.prod(design.range)) if key else 1.0

    def strength(values: Values) -> float:
        level = float(values[key]) / middle if key else 1.0
        return level * (effect if first.items() <= values.items() else 1.0)

    return strength
