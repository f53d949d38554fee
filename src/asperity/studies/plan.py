"""Planning of studies: their power, from simulated participants before the first real one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.checks import check_positive
from asperity.core.display import Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.studies.design import StudyDesign, Values
from asperity.studies.methods import METHODS
from asperity.studies.observers import Strength, find_observer, simulate_run
from asperity.studies.statistics.intervals import share_interval

SPREAD = 0.3
"""Deviation of the logarithms of the thresholds of participants."""
SIMULATIONS = 200
_RESAMPLES = 400


@dataclass(frozen=True)
class StudyPlan(Serializable, Tabular):
    """How often a study would find an effect.

    Attributes:
        kind: kind of the method.
        participants: their number.
        effect: by which factor the first condition is stronger than the others.
        simulations: number of simulated studies.
        found: in how many the 95 % interval of the difference of the second from the first
            condition (or of the first pair from chance) leaves out no difference.
        trials: of each participant.
        half_width: median half width of that interval, on the scale of the score; logarithms of
            logarithmic quantities.
        observer: name of the simulated observer.
        spread: deviation of the logarithms of thresholds.
        seed: of the simulation.
    """

    kind: str
    participants: int
    effect: float
    simulations: int
    found: int
    trials: int
    half_width: float
    observer: str
    spread: float
    seed: int

    @property
    def power(self) -> tuple[float, float, float]:
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

    def table_rows(self) -> list[dict[str, Any]]:
        """Return one row."""
        names = ("participants", "effect", "simulations", "found", "trials", "half_width")
        power, low, high = self.power
        row = {name: getattr(self, name) for name in names}
        return [{**row, "power": power, "lower": low, "upper": high}]


def plan(
    design: StudyDesign,
    effect: float,
    participants: int | None = None,
    seed: int = 0,
    simulations: int = SIMULATIONS,
    observer: str = "typical",
    spread: float = SPREAD,
) -> StudyPlan:
    """Return how often a study would find an effect: its power, by simulation.

    Args:
        design: the study, with at least two conditions.
        effect: by which factor stimuli of the first condition are stronger at the hand than those
            of the others; 1 tells how often a study finds what is not there.
        participants: their number; by default that of the design.
        seed: of the simulation.
        simulations: number of simulated studies.
        observer: name of the observer; see :data:`~asperity.studies.observers.OBSERVERS`.
        spread: deviation of the logarithms of the thresholds of participants.

    Raises:
        ParameterError: for fewer than three participants or two conditions, or an effect that is
            not positive.
    """
    effect = check_positive("effect", effect)
    count = design.participants if participants is None else participants
    if count < 3:
        raise ParameterError("participants", "must be at least 3 for an interval", count)
    if len(design.conditions) < 2:
        raise ParameterError("vary", "must give at least two conditions to be compared", 1)
    kind = METHODS[design.kind]
    design = kind.complete(design)
    strength, base = _planned_strength(design, effect), find_observer(observer)
    found, widths, trials = 0, [], 0
    for number in range(simulations):
        rng = np.random.default_rng([seed, number])
        own = int(rng.integers(2**31))
        answered = {
            str(i): simulate_run(design, i, base.draw(rng, spread), strength, own)
            for i in range(count)
        }
        low, high = kind.score(design, answered, 0).differences(_RESAMPLES, own)[0][1:]
        found += not low <= 0.0 <= high
        widths.append((high - low) / 2.0)
        trials = len(answered["0"])
    width = float(np.median(widths)) if widths else math.nan
    return StudyPlan(
        design.kind, count, effect, simulations, found, trials, width, observer, spread, seed
    )


def _planned_strength(design: StudyDesign, effect: float) -> Strength:
    """Return strengths: 1 in the middle of the range, ``effect`` times in the first condition."""
    first, options = design.conditions[0], design.options
    key = str(options.get("level", ""))
    middle = math.sqrt(math.prod(options["range"])) if key else 1.0

    def strength(values: Values) -> float:
        level = float(values[key]) / middle if key else 1.0
        is_first = all(values[name] == value for name, value in first.items())
        return level * (effect if is_first else 1.0)

    return strength
