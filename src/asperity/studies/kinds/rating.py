"""Ratings: magnitude estimation with geometric means, and Likert scales."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answered, Presentation, StudyDesign
from asperity.studies.kinds.latin_square import balanced_order
from asperity.studies.kinds.trial_list import TrialList, check_conditions
from asperity.studies.statistics.scores import Score, collect_values, repeated_score

_SMALLEST, _LARGEST = 1e-6, 1e6


@dataclass(frozen=True)
class Scale:
    """A scale of ratings.

    Attributes:
        quantity: what it measures.
        transform: from the answer to the value of which means are taken.
        is_logarithmic: whether the values are logarithms, which are taken from the mean of the
            participant, and have the mean of all added (modulus equalisation).
    """

    quantity: str
    transform: Callable[[float], float]
    is_logarithmic: bool


SCALES = {
    "magnitude": Scale("magnitude", math.log, is_logarithmic=True),
    "likert": Scale("rating", float, is_logarithmic=False),
}
"""Scales by name."""


def run_rating(design: StudyDesign, participant: int, _rng: np.random.Generator) -> TrialList:
    """Return a run: each repeat has all conditions, in the next row of a balanced square."""
    check_conditions(design, 1)
    repeats, count = int(design.options["repeats"]), len(design.conditions)
    likert = tuple(str(one + 1) for one in range(int(design.options["points"])))
    answers = {"magnitude": (), "likert": likert}[design.options["scale"]]
    limits = None if answers else (_SMALLEST, _LARGEST)
    return TrialList([
        Presentation((design.conditions[one],), answers, design.question, limits, condition=one)
        for repeat in range(repeats)
        for one in balanced_order(count, participant * repeats + repeat)
    ])  # fmt: skip


def score_rating(
    design: StudyDesign, answered: Mapping[str, Sequence[Answered]], resamples: int
) -> Score:
    """Return the mean ratings: geometric means of magnitudes, arithmetic ones of Likert scales.

    References:
        S. S. Stevens: Psychophysics (1975), on magnitude estimation and modulus equalisation.
    """
    scale, count = SCALES[design.options["scale"]], len(design.conditions)
    cells = collect_values(answered, count, lambda one: scale.transform(float(one.answer)))
    estimates, counts = repeated_score(cells, count, resamples, design.seed)
    if scale.is_logarithmic:
        estimates = estimates + _equalising_shifts(estimates[0])[:, None]
    return Score(
        scale.quantity, tuple(answered), estimates, counts,
        is_logarithmic=scale.is_logarithmic, interval="Student's t over repeats",
    )  # fmt: skip


def _equalising_shifts(values: FloatArray) -> FloatArray:
    """Return what gives all participants the same mean."""
    known = np.isfinite(values)
    means = np.where(known, values, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return np.asarray(means.mean() - means) if len(means) else means
