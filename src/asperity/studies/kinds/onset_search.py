"""Onset by adjustment: the participant raises a value until it begins, or lowers it until it ends.

The method of limits, with the values in the hand of the participant.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from asperity.studies.design import Answered, Presentation, StudyDesign
from asperity.studies.kinds.latin_square import balanced_order
from asperity.studies.kinds.trial_list import TrialList, check_conditions, parse_range
from asperity.studies.statistics.scores import Score, repeated_score

_JITTER = 0.25  # of the logarithmic range; a fixed way to the onset could be counted


def run_onset(design: StudyDesign, participant: int, rng: np.random.Generator) -> TrialList:
    """Return a run: ascending and descending series by turns, from scattered ends of the range."""
    check_conditions(design, 1)
    count, series = len(design.conditions), int(design.options["series"])
    low, high = parse_range(design.options["range"])
    offset = _JITTER * math.log(high / low) * rng.random((series, count))
    trials = []
    for turn in range(series):
        for one in balanced_order(count, participant * series + turn):
            away = math.exp(float(offset[turn, one]))
            start = low * away if is_ascending(turn + participant) else high / away
            trials.append(_present(design, one, start, (low, high)))
    return TrialList(trials)


def is_ascending(turn: int) -> bool:
    """Return whether a series begins at the low end."""
    return turn % 2 == 0


def _present(
    design: StudyDesign, condition: int, start: float, limits: tuple[float, float]
) -> Presentation:
    key = str(design.options["level"])
    values = {**design.conditions[condition], key: start}
    return Presentation(
        (values,), (), design.question, limits, adjusts=key, condition=condition
    )  # fmt: skip


def score_onset(
    design: StudyDesign, answered: Mapping[str, Sequence[Answered]], resamples: int
) -> Score:
    """Return the geometric means over ascending and descending series, each with equal weight."""
    count = len(design.conditions)
    cells = [[_pair_series(design, one, i) for i in range(count)] for one in answered.values()]
    estimates, counts = repeated_score(cells, count, resamples, design.seed)
    return Score(
        f"onset of {design.options['level']}", tuple(answered), estimates, counts,
        is_logarithmic=True, interval="Student's t over pairs of series",
    )  # fmt: skip


def _pair_series(design: StudyDesign, trials: Sequence[Answered], condition: int) -> list[float]:
    """Return the mean logarithm of each ascending series and the descending one with it.

    The two differ systematically (habituation, anticipation); pairs are what repeats.
    """
    low, high = parse_range(design.options["range"])
    found: tuple[list[float], list[float]] = ([], [])
    for one in trials:
        if one.presentation.condition == condition:
            start = one.presentation.intervals[0][design.options["level"]]
            found[start > math.sqrt(low * high)].append(math.log(float(one.answer)))
    return [(up + down) / 2.0 for up, down in zip(*found, strict=False)]
