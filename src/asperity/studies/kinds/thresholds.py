"""Thresholds: one of two or three intervals differs, and the participant says which."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from asperity.core.errors import ParameterError
from asperity.studies.design import Answered, Presentation, StudyDesign
from asperity.studies.kinds.bayes import BayesianTrack
from asperity.studies.kinds.latin_square import balanced_order
from asperity.studies.kinds.staircase import Staircase, Track
from asperity.studies.kinds.trial_list import check_answer, parse_range
from asperity.studies.statistics.psychometric import LogLevels, fit_thresholds
from asperity.studies.statistics.scores import Score

_MAX_INTERVALS = 3
_BASES = {"level": 0.0, "difference": 1.0}  # share of the reference


def log_levels(design: StudyDesign) -> LogLevels:
    """Return the logarithmic levels of a design of this kind with all its options.

    Levels are counted from zero, differences from the reference.

    Raises:
        ParameterError: for a range or a reference that cannot be used.
    """
    options = design.options
    low, high = parse_range(options["range"])
    reference = float(options.get("reference", low))
    base = _BASES[options["scale"]] * reference
    if base >= low:
        words = "must be below the range, whose levels are discriminated from it"
        raise ParameterError("method.reference", words, reference)
    count = int(options["intervals"])
    if count > _MAX_INTERVALS:
        raise ParameterError("method.intervals", f"must be 2 or {_MAX_INTERVALS}", count)
    return LogLevels(low, high, reference, base, 1.0 / count, float(options["lapse"]))


def _staircase(design: StudyDesign, levels: LogLevels) -> Track:
    low, high = levels.ends
    step, target = math.log(design.options["step"]), float(design.options["target"])
    return Staircase(high, low, high, step, target, levels.guess)


def _bayesian(_design: StudyDesign, levels: LogLevels) -> Track:
    return BayesianTrack(*levels.ends, levels.guess, levels.lapse)


PROCEDURES: dict[str, Callable[[StudyDesign, LogLevels], Track]] = {
    "weighted-up-down": _staircase,
    "bayesian": _bayesian,
}
"""Procedures that choose the levels, by name."""


class ThresholdRun:
    """A run that has the conditions one after another, in the order of a balanced square.

    Args:
        design: the study with all options.
        participant: number of the participant.
        rng: random numbers, for the interval that differs.
    """

    def __init__(self, design: StudyDesign, participant: int, rng: np.random.Generator) -> None:
        self._design, self._levels = design, log_levels(design)
        conditions, trials = design.conditions, int(design.options["trials"])
        order = balanced_order(len(conditions), participant)
        places = rng.integers(int(design.options["intervals"]), size=(len(order), trials))
        self._trials = [
            (one, int(place)) for one, row in zip(order, places, strict=True) for place in row
        ]
        self._trials_each, self._done = trials, 0
        self._start()

    def _start(self) -> None:
        """Begin a condition if it is time, and prepare what to present."""
        if self._done == len(self._trials):
            self._now: Presentation | None = None
            return
        if self._done % self._trials_each == 0:
            self._track = PROCEDURES[self._design.options["procedure"]](self._design, self._levels)
        condition, place = self._trials[self._done]
        self._now = self._present(condition, place)

    def _present(self, condition: int, place: int) -> Presentation:
        key, count = self._design.options["level"], int(self._design.options["intervals"])
        values = self._design.conditions[condition]
        usual = {**values, key: self._levels.reference}
        intervals = [usual] * count
        intervals[place] = {**values, key: self._levels.value(self._track.level())}
        answers = tuple(str(one + 1) for one in range(count))
        return Presentation(
            tuple(intervals), answers, self._design.question,
            correct=answers[place], condition=condition,
        )  # fmt: skip

    def next(self) -> Presentation | None:
        """Return what to present now; ``None`` at the end."""
        return self._now

    def answer(self, answer: str) -> None:
        """Record an answer."""
        check_answer(self._now, answer)
        self._track.record(self._now is not None and answer == self._now.correct)
        self._done += 1
        self._start()


def presented_level(design: StudyDesign, presentation: Presentation) -> float:
    """Return the level of the interval that differs [SI]."""
    interval = presentation.intervals[int(presentation.correct or 1) - 1]
    return float(interval[design.options["level"]])


def label_conditions(design: StudyDesign) -> Sequence[dict[str, Any]]:
    """Return the conditions, which are what is estimated."""
    return design.conditions


def score_thresholds(
    design: StudyDesign, answered: Mapping[str, Sequence[Answered]], resamples: int
) -> Score:
    """Return the thresholds of each participant in each condition, as logarithms of levels.

    A psychometric function is fitted for each by maximum likelihood; the interval is that of the
    parametric bootstrap.
    """
    levels, count = log_levels(design), len(design.conditions)
    estimates = np.full((3, len(answered), count), np.nan)
    counts = np.zeros((len(answered), count), int)
    for row, trials in enumerate(answered.values()):
        for column in range(count):
            found = [one for one in trials if one.presentation.condition == column]
            counts[row, column] = len(found)
            if found:
                x = [presented_level(design, one.presentation) for one in found]
                right = np.array([one.is_correct for one in found])
                seed = design.seed
                estimates[:, row, column] = fit_thresholds(
                    levels, np.array(x), right, resamples, seed
                )
    unit = str(design.options["level"])
    return Score(
        f"threshold of {unit}", tuple(answered), estimates, counts, is_logarithmic=True,
        interval="parametric bootstrap of the psychometric function",
    )  # fmt: skip
