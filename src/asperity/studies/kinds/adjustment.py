"""Onset by adjustment: the participant raises a value until it begins, or lowers it until it ends.

The method of limits, with the values in the hand of the participant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from asperity.studies.design import Answers, Presentation, Steps, StudyDesign, TrialRecord
from asperity.studies.kinds.orders import repeated_order
from asperity.studies.statistics.intervals import Interval, mean_interval
from asperity.studies.statistics.scores import Score, score_cells

_JITTER = 0.25  # of the logarithmic range; a fixed way to the onset could be counted


def run_onset(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield ascending and descending series by turns, from scattered ends of the range."""
    count = len(design.conditions)
    series = int(design.options["series"])
    (low, high) = design.range
    key = str(design.options["level"])
    away = (high / low) ** (_JITTER * rng.random((series, count)))
    for turn, one in repeated_order(count, series, participant):
        is_ascending = (turn + participant) % 2 == 0
        start = float(low * away[turn, one] if is_ascending else high / away[turn, one])
        values = {**design.conditions[one], key: start}
        yield Presentation(
            (values,), (), design.question, (low, high), adjusts=key, condition=one
        )  # fmt: skip


def score_onset(design: StudyDesign, answered: Answers) -> Score:
    """Return the geometric means over ascending and descending series, each with equal weight.

    The two differ systematically (habituation, anticipation), so the values of which the mean is
    taken are those of an ascending series and the descending one with it.
    """
    key = str(design.options["level"])
    middle = math.sqrt(math.prod(design.range))

    def estimate(trials: Sequence[TrialRecord]) -> Interval:
        found: tuple[list[float], list[float]] = ([], [])
        for one in trials:
            is_descending = one.presentation.intervals[0][key] > middle
            found[is_descending].append(math.log(float(one.answer)))
        return mean_interval(np.array([(a + b) / 2.0 for a, b in zip(*found, strict=False)]))

    cells = score_cells(answered, len(design.conditions), estimate)
    words = "Student's t over pairs of series"
    return Score(f"onset of {key}", *cells, is_logarithmic=True, interval=words)
