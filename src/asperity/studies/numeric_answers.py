"""Studies whose answers are numbers: ratings, and onsets by adjustment.

Ratings are magnitude estimation with geometric means, or Likert scales. An onset is adjusted by the
method of limits, with the value in the hand of the participant, who raises it until it begins, or
lowers it until it ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from asperity.core.compiled import FloatArray
from asperity.studies.design import (
    Answers,
    Presentation,
    Steps,
    StudyDesign,
    TrialRecord,
    repeated_order,
)
from asperity.studies.scores import Interval, Score, mean_interval, score_cells

_LIMITS = (1e-6, 1e6)
_INTERVAL = "Student's t over repeats"
LIKERT = "likert"  # scale


def run_rating(design: StudyDesign, participant: int, _rng: np.random.Generator) -> Steps:
    """Yield each condition in each repeat, in the next row of a balanced square."""
    points = range(int(design.options["points"]))
    is_likert = design.options["scale"] == LIKERT
    answers: tuple[str, ...] = ()
    limits: tuple[float, float] | None = _LIMITS
    if is_likert:
        answers = tuple([str(point + 1) for point in points])
        limits = None
    count = len(design.conditions)
    for _, condition in repeated_order(count, int(design.options["repeats"]), participant):
        intervals = (design.conditions[condition],)
        yield Presentation(intervals, answers, design.question, limits, condition=condition)


def score_rating(design: StudyDesign, answered: Answers) -> Score:
    """Return mean ratings: arithmetic ones of Likert scales, geometric ones of magnitudes.

    Magnitudes are shifted so that all participants have the same mean (equalised modulus).

    References:
        S. S. Stevens: Psychophysics (1975).
    """
    is_likert = design.options["scale"] == LIKERT
    transform: Callable[[float], float] = float if is_likert else math.log
    cells = score_cells(
        answered,
        len(design.conditions),
        lambda trials: mean_interval(np.array([transform(float(t.answer)) for t in trials])),
    )
    score = Score("rating" if is_likert else "magnitude", *cells, interval=_INTERVAL)
    return score if is_likert else _equalise(score)


def _equalise(score: Score) -> Score:
    """Return logarithms of magnitudes, of which all participants have the same mean."""
    known = np.isfinite(score.values)
    means = np.where(known, score.values, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    shifts: FloatArray = means.mean() - means if len(means) else means
    return replace(score, estimates=score.estimates + shifts[:, None], is_logarithmic=True)


_JITTER = 0.25  # of the logarithmic range; a fixed way to the onset could be counted


def run_onset(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield ascending and descending series by turns, from scattered ends of the range."""
    count = len(design.conditions)
    series = int(design.options["series"])
    (low, high) = design.range
    key = str(design.options["level"])
    away = (high / low) ** (_JITTER * rng.random((series, count)))
    for turn, condition in repeated_order(count, series, participant):
        is_ascending = (turn + participant) % 2 == 0
        distance = float(away[turn, condition])
        start = low * distance if is_ascending else high / distance
        values = {**design.conditions[condition], key: start}
        yield Presentation(
            (values,), (), design.question, (low, high), adjusts=key, condition=condition
        )


def score_onset(design: StudyDesign, answered: Answers) -> Score:
    """Return the geometric means over ascending and descending series, each with equal weight.

    The two differ systematically (habituation, anticipation), so the values of which the mean is
    taken are those of an ascending series and the descending one with it.
    """
    key = str(design.options["level"])
    middle = math.sqrt(math.prod(design.range))

    def estimate(trials: Sequence[TrialRecord]) -> Interval:
        onsets: tuple[list[float], list[float]] = ([], [])
        for trial in trials:
            is_descending = trial.presentation.intervals[0][key] > middle
            onsets[is_descending].append(math.log(float(trial.answer)))
        return mean_interval(np.array([(a + b) / 2.0 for a, b in zip(*onsets, strict=False)]))

    cells = score_cells(answered, len(design.conditions), estimate)
    interval = "Student's t over pairs of series"
    return Score(f"onset of {key}", *cells, is_logarithmic=True, interval=interval)
