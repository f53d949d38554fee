"""Bradley–Terry scores of pairwise comparisons.

The chance that i is chosen over j is 1/(1 + exp(θⱼ − θᵢ)); the scores θ sum to zero.
"""

from __future__ import annotations

import numpy as np
from scipy.special import expit

from asperity.core.compiled import FloatArray

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

    found = minimize(loss, np.zeros(len(wins)), jac=True, options={"gtol": 1e-9})
    scores: FloatArray = found.x - found.x.mean()
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
    steps = np.array([gradient(one, scores) for one in each]) @ covariance(wins, scores)
    return np.asarray(scores + len(each) * (steps - steps.mean(axis=0)))
