"""Ratings: magnitude estimation with geometric means, and Likert scales."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answers, Presentation, Steps, StudyDesign
from asperity.studies.kinds.orders import repeated_order
from asperity.studies.statistics.intervals import mean_interval
from asperity.studies.statistics.scores import Score, score_cells

_LIMITS = (1e-6, 1e6)
_INTERVAL = "Student's t over repeats"
LIKERT = "likert"  # scale


def run_rating(design: StudyDesign, participant: int, _rng: np.random.Generator) -> Steps:
    """Yield each condition in each repeat, in the next row of a balanced square."""
    points = range(int(design.options["points"]))
    is_likert = design.options["scale"] == LIKERT
    answers = tuple(str(one + 1) for one in points) if is_likert else ()
    limits = None if is_likert else _LIMITS
    count = len(design.conditions)
    for _, one in repeated_order(count, int(design.options["repeats"]), participant):
        shown = (design.conditions[one],)
        yield Presentation(shown, answers, design.question, limits, condition=one)


def score_rating(design: StudyDesign, answered: Answers) -> Score:
    """Return mean ratings: arithmetic ones of Likert scales, geometric ones of magnitudes.

    Magnitudes are shifted so that all participants have the same mean (equalised modulus).

    References:
        S. S. Stevens: Psychophysics (1975).
    """
    is_likert = design.options["scale"] == LIKERT
    transform: Callable[[float], float] = float if is_likert else math.log
    cells = score_cells(
        answered, len(design.conditions),
        lambda found: mean_interval(np.array([transform(float(one.answer)) for one in found])),
    )  # fmt: skip
    score = Score("rating" if is_likert else "magnitude", *cells, interval=_INTERVAL)
    return score if is_likert else _equalise(score)


def _equalise(score: Score) -> Score:
    """Return logarithms of magnitudes, of which all participants have the same mean."""
    known = np.isfinite(score.values)
    means = np.where(known, score.values, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    shifts: FloatArray = means.mean() - means if len(means) else means
    return replace(score, estimates=score.estimates + shifts[:, None], is_logarithmic=True)
