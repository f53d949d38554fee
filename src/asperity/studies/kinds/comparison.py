"""Pairwise comparison: which of two feels more so."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence

import numpy as np

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answered, Presentation, StudyDesign
from asperity.studies.kinds.latin_square import balanced_order
from asperity.studies.kinds.trial_list import TrialList, check_conditions
from asperity.studies.statistics import bradley_terry
from asperity.studies.statistics.scores import Score

ANSWERS = ("1", "2")
_NORMAL = 1.96  # quantile of the normal distribution
_INTERVAL = "Fisher information; half a choice added either way where scores had no bounds"


def list_pairs(design: StudyDesign) -> list[tuple[int, int]]:
    """Return all pairs of conditions.

    Raises:
        ParameterError: for fewer than two conditions.
    """
    check_conditions(design, 2)
    return list(itertools.combinations(range(len(design.conditions)), 2))


def run_comparison(design: StudyDesign, participant: int, rng: np.random.Generator) -> TrialList:
    """Return a run: every pair as often as stated, first in either place by turns.

    Each repeat has all pairs, in the next row of a balanced square.
    """
    pairs, repeats = list_pairs(design), int(design.options["repeats"])
    first = rng.integers(2, size=len(pairs))
    trials = []
    for repeat in range(repeats):
        for index in balanced_order(len(pairs), participant * repeats + repeat):
            pair = pairs[index][:: -1 if (first[index] + repeat) % 2 else 1]
            intervals = tuple(design.conditions[one] for one in pair)
            trials.append(Presentation(intervals, ANSWERS, design.question, condition=index))
    return TrialList(trials)


def count_choices(design: StudyDesign, answered: Sequence[Answered]) -> FloatArray:
    """Return how often each condition (row) was chosen over each other (column)."""
    conditions = design.conditions
    wins = np.zeros((len(conditions), len(conditions)))
    for one in answered:
        first, second = (conditions.index(dict(values)) for values in one.presentation.intervals)
        wins[(first, second) if one.answer == ANSWERS[0] else (second, first)] += 1.0
    return wins


def score_comparison(
    design: StudyDesign, answered: Mapping[str, Sequence[Answered]], _resamples: int
) -> Score:
    """Return the Bradley–Terry scores of the conditions.

    Those of a participant have half a choice either way added to each pair if the participant is
    too consistent for finite scores; their intervals are those of Fisher's information.
    """
    shape = len(answered), len(design.conditions)
    each = np.array([count_choices(design, one) for one in answered.values()])
    each = each.reshape(shape[0], shape[1], shape[1])
    values = np.array([bradley_terry.fit_scores(wins) for wins in each]).reshape(shape)
    errors = np.array([_errors(*one) for one in zip(each, values, strict=True)]).reshape(shape)
    counts = (each + each.swapaxes(1, 2)).sum(axis=2).astype(int)
    pooled = bradley_terry.pseudo_values(each)[1] if len(each) else values
    estimates = np.array([values, values - _NORMAL * errors, values + _NORMAL * errors])
    return Score(
        "Bradley–Terry score", tuple(answered), estimates, counts,
        interval=_INTERVAL, pooled=pooled,
        # The values are skewed where hardly any choice goes the other way; samples without it would
        # make the interval of the bootstrap much too wide.
        is_resampled=False,
    )  # fmt: skip


def _errors(wins: FloatArray, scores: FloatArray) -> FloatArray:
    spread = bradley_terry.covariance(bradley_terry.complete_wins(wins), scores)
    return np.asarray(np.sqrt(np.diag(spread)))


def pair_consistency(answered: Sequence[Answered]) -> float | None:
    """Return the share of repeated pairs that were answered alike; ``None`` without repeats."""
    chosen: dict[int, list[str]] = {}
    for one in answered:
        shown = one.presentation.intervals[int(one.answer) - 1]
        chosen.setdefault(one.presentation.condition, []).append(str(sorted(shown.items())))
    alike = [a == b for found in chosen.values() for a, b in itertools.combinations(found, 2)]
    return math.fsum(alike) / len(alike) if alike else None
