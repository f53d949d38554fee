"""Bradley–Terry scores of pairwise comparisons.

The chance that i is chosen over j is 1/(1 + exp(θⱼ − θᵢ)); the scores θ sum to zero.
"""

from __future__ import annotations

import numpy as np

from asperity.core.compiled import FloatArray

_HALF_WIN = 0.5


def fit_scores(wins: FloatArray) -> FloatArray:
    """Return the scores θ of greatest likelihood, which sum to zero.

    Where some conditions are never chosen over the others, no finite scores have the greatest
    likelihood; then half a choice either way is added to each pair.

    Args:
        wins: how often each condition (row) was chosen over each other (column), shape (n, n).

    References:
        R. A. Bradley, M. E. Terry: Rank analysis of incomplete block designs. Biometrika 39 (1952)
        324–345; L. R. Ford: Solution of a ranking problem from binary comparisons. American
        Mathematical Monthly 64 (1957) 28–33.

    Example:
        >>> scores = fit_scores(np.array([[0.0, 30.0], [10.0, 0.0]]))
        >>> f"{scores[0] - scores[1]:.4f}"  # ln 3
        '1.0986'
    """
    from scipy.optimize import minimize

    wins = complete_wins(wins)

    def loss(scores: FloatArray) -> tuple[float, FloatArray]:
        differences = scores[:, None] - scores
        value = float((wins * np.logaddexp(0.0, -differences)).sum())
        return value + 0.5 * float(scores.sum()) ** 2, scores.sum() - gradient(wins, scores)

    found = minimize(loss, np.zeros(len(wins)), jac=True, options={"gtol": 1e-9})
    result: FloatArray = found.x - found.x.mean()
    return result


def complete_wins(wins: FloatArray) -> FloatArray:
    """Return numbers of choices for which finite scores exist."""
    from scipy.sparse.csgraph import connected_components

    _parts, labels = connected_components(wins > 0.0, connection="strong")
    if not labels.any():
        return wins
    return wins + _HALF_WIN * (1.0 - np.eye(len(wins)))


def gradient(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the derivative of the logarithm of the likelihood by each score."""
    losing = wins / (1.0 + np.exp(scores[:, None] - scores))
    result: FloatArray = losing.sum(axis=1) - losing.sum(axis=0)
    return result


def covariance(wins: FloatArray, scores: FloatArray) -> FloatArray:
    """Return the covariance of the scores of greatest likelihood, from Fisher's information."""
    chance = 1.0 / (1.0 + np.exp(scores - scores[:, None]))
    weights = (wins + wins.T) * chance * (1.0 - chance)
    information = np.diag(weights.sum(axis=1)) - weights
    return np.asarray(np.linalg.pinv(information), float)


def pseudo_values(each: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the pooled scores, and a value for each participant whose mean they are.

    A participant's values are θ + N C gᵢ, with the derivative gᵢ of the logarithm of the likelihood
    of the participant's answers at the pooled scores θ of N participants, and their covariance C:
    the infinitesimal jackknife. Their spread is that of participants.

    Args:
        each: choices of each participant, shape (participants, n, n).
    """
    wins = complete_wins(each.sum(axis=0))
    scores = fit_scores(wins)
    inverse = covariance(wins, scores)
    steps = np.array([gradient(one, scores) for one in each]) @ inverse
    return scores, scores + len(each) * (steps - steps.mean(axis=0))
