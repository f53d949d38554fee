"""Pairs of conditions: which of two feels more so, and which of two does a third equal (AXB).

Choices give scores by the model of Bradley and Terry: the condition i is chosen over j with the
chance 1/(1 + exp(θⱼ − θᵢ)).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.special import expit

from asperity.core.compiled import FloatArray
from asperity.studies.design import (
    Answers,
    Presentation,
    Steps,
    StudyDesign,
    TrialRecord,
    list_pairs,
    repeated_order,
)
from asperity.studies.scores import Score, score_cells, share_interval

_NORMAL = 1.96  # quantile of the normal distribution
_INTERVAL = "Fisher information; half a choice added either way where scores had no bounds"


def run_comparison(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield every pair as often as stated, first in either place by turns."""
    pairs = list_pairs(design)
    repeats = int(design.options["repeats"])
    first = rng.integers(2, size=len(pairs))
    for repeat, index in repeated_order(len(pairs), repeats, participant):
        pair = pairs[index][:: -1 if (first[index] + repeat) % 2 else 1]
        yield Presentation(pair, ("1", "2"), design.question, condition=index)


def count_choices(design: StudyDesign, answered: Sequence[TrialRecord]) -> FloatArray:
    """Return how often each condition (row) was chosen over each other (column)."""
    conditions = design.conditions
    wins = np.zeros((len(conditions), len(conditions)))
    for trial in answered:
        first, second = trial.presentation.intervals
        chosen = conditions.index(dict(first))
        other = conditions.index(dict(second))
        if trial.answer == "2":
            chosen, other = other, chosen
        wins[chosen, other] += 1.0
    return wins


def score_comparison(design: StudyDesign, answered: Answers) -> Score:
    """Return the Bradley–Terry scores of the conditions.

    Those of a participant have half a choice either way added to each pair if the participant is
    too consistent for finite scores; their intervals are those of Fisher's information.
    """
    count = len(design.conditions)
    each = np.array([count_choices(design, trials) for trials in answered.values()])
    each = each.reshape(-1, count, count)
    fitted = [fit_scores(wins) for wins in each]
    values, errors = np.array(fitted).reshape(-1, 2, count).swapaxes(0, 1)
    estimates = np.array([values, values - _NORMAL * errors, values + _NORMAL * errors])
    counts = (each + each.swapaxes(1, 2)).sum(axis=2).astype(int)
    pooled = pseudo_values(each) if len(each) else values
    return Score(
        "Bradley–Terry score", tuple(answered), estimates, counts, interval=_INTERVAL, pooled=pooled
    )


def pair_consistency(answered: Sequence[TrialRecord]) -> float | None:
    """Return the share of repeated pairs that were answered alike; ``None`` without repeats."""
    chosen: dict[int, list[str]] = {}
    for trial in answered:
        values = trial.presentation.intervals[int(trial.answer) - 1]
        chosen.setdefault(trial.presentation.condition, []).append(str(sorted(values.items())))
    alike: list[bool] = []
    for choices in chosen.values():
        alike += [a == b for a, b in itertools.combinations(choices, 2)]
    return sum(alike) / len(alike) if alike else None


def run_axb(design: StudyDesign, participant: int, rng: np.random.Generator) -> Steps:
    """Yield A, X and B, where X equals A or B, as often either way as the repeats allow."""
    pairs = list_pairs(design)
    repeats = int(design.options["repeats"])
    kinds = [rng.permutation(np.arange(repeats) % 4) for _ in pairs]
    for repeat, index in repeated_order(len(pairs), repeats, participant):
        is_last, is_swapped = divmod(int(kinds[index][repeat]), 2)
        first, last = pairs[index][:: -1 if is_swapped else 1]
        shown = (first, last if is_last else first, last)
        right = "3" if is_last else "1"
        yield Presentation(shown, ("1", "3"), design.question, correct=right, condition=index)


def label_pairs(design: StudyDesign) -> Sequence[dict[str, Any]]:
    """Return the pairs of conditions, which are what is estimated."""
    pairs = list_pairs(design)
    return [{key: f"{first[key]} / {last[key]}" for key in first} for first, last in pairs]


def score_axb(design: StudyDesign, answered: Answers) -> Score:
    """Return the shares of right matches of each pair of conditions."""
    cells = score_cells(
        answered,
        len(list_pairs(design)),
        lambda trials: share_interval(sum([t.is_correct for t in trials]), len(trials)),
    )
    return Score("share of right matches", *cells, interval="Wilson score", chance=0.5)


_HALF_WIN = 0.5


def fit_scores(wins: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the scores θ of greatest likelihood, which sum to zero, and their standard errors.

    Where some conditions are never chosen over the others, no finite scores have the greatest
    likelihood; then half a choice either way is added to each pair. The errors are those of
    Fisher's information.

    Args:
        wins: how often each condition (row) was chosen over each other (column), shape (n, n).

    References:
        R. A. Bradley, M. E. Terry: Rank analysis of incomplete block designs. Biometrika 39 (1952)
        324–345; L. R. Ford: Solution of a ranking problem from binary comparisons. American
        Mathematical Monthly 64 (1957) 28–33.

    Example:
        >>> scores, errors = fit_scores(np.array([[0.0, 30.0], [10.0, 0.0]]))
        >>> f"{scores[0] - scores[1]:.4f}"  # ln 3
        '1.0986'
    """
    from scipy.optimize import minimize

    wins = complete_wins(wins)

    def loss(scores: FloatArray) -> tuple[float, FloatArray]:
        value = float((wins * np.logaddexp(0.0, scores - scores[:, None])).sum())
        return value + 0.5 * float(scores.sum()) ** 2, scores.sum() - gradient(wins, scores)

    solution = minimize(loss, np.zeros(len(wins)), jac=True, options={"gtol": 1e-9})
    scores: FloatArray = solution.x - solution.x.mean()
    return scores, np.sqrt(np.diag(covariance(wins, scores)))


def complete_wins(wins: FloatArray) -> FloatArray:
    """Return numbers of choices for which finite scores exist."""
    from scipy.sparse.csgraph import connected_components

    _parts, labels = connected_components(wins > 0.0, connection="strong")
    return wins + _HALF_WIN * (1.0 - np.eye(len(wins))) if labels.any() else wins


def gradient(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the derivative of the logarithm of the likelihood by each score."""
    losing = wins * expit(scores - scores[:, None])
    result: FloatArray = losing.sum(axis=1) - losing.sum(axis=0)
    return result


def covariance(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the covariance of the scores of greatest likelihood, from Fisher's information."""
    chance = expit(scores[:, None] - scores)
    weights = (wins + wins.T) * chance * (1.0 - chance)
    information = np.diag(weights.sum(axis=1)) - weights
    return np.asarray(np.linalg.pinv(information), float)


def pseudo_values(each: FloatArray) -> FloatArray:
    """Return a value of each score for each participant, whose means are the pooled scores.

    A participant's values are θ + N C gᵢ, with the derivative gᵢ of the logarithm of the likelihood
    of the participant's answers at the pooled scores θ of N participants, and their covariance C:
    the infinitesimal jackknife. Their spread is that of participants.

    Args:
        each: choices of each participant, shape (participants, n, n).
    """
    wins = complete_wins(each.sum(axis=0))
    scores, _ = fit_scores(wins)
    steps = np.array([gradient(choices, scores) for choices in each]) @ covariance(wins, scores)
    return np.asarray(scores + len(each) * (steps - steps.mean(axis=0)))
