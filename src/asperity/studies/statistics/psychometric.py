"""Psychometric functions: maximum likelihood, and thresholds with intervals of the bootstrap.

P(x) = γ + (1 − γ − λ)/(1 + exp(−s (x − α))) is the share of right answers at the level x, the
natural logarithm of an increment. The threshold α is where the chance of knowing the answer is a
half, apart from guesses γ and lapses λ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray

USUAL_SLOPE = 4.0
_SLOPES = np.geomspace(0.5, 40.0, 15)
_THRESHOLDS = 121
_CHI_SQUARED = 3.841  # of one degree of freedom at 95 %
_LEAST = 1e-12


@dataclass(frozen=True)
class LogLevels:
    """The levels of a threshold, and what its psychometric function assumes.

    Attributes:
        low: lowest level [SI].
        high: highest level [SI].
        reference: level of the intervals that do not differ [SI].
        base: level from which increments are counted [SI].
        guess: γ.
        lapse: λ.
    """

    low: float
    high: float
    reference: float
    base: float
    guess: float
    lapse: float

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest x."""
        return math.log(self.low - self.base), math.log(self.high - self.base)

    def value(self, x: float) -> float:
        """Return the level [SI] of a logarithm, within the range."""
        return min(max(self.base + math.exp(x), self.low), self.high)

    def probability(
        self, x: FloatArray, threshold: FloatArray | float, slope: FloatArray | float
    ) -> FloatArray:
        """Return P(x)."""
        known: FloatArray = 0.5 + 0.5 * np.tanh(0.5 * slope * (x - threshold))
        return self.guess + (1.0 - self.guess - self.lapse) * known

    @cached_property
    def grid(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Thresholds α, and all pairs (α, s); half the range beyond each end."""
        low, high = self.ends
        margin = (high - low) / 2.0
        thresholds = np.linspace(low - margin, high + margin, _THRESHOLDS)
        pairs = np.repeat(thresholds, len(_SLOPES)), np.tile(_SLOPES, len(thresholds))
        return thresholds, *pairs


def log_prior(slopes: FloatArray | float) -> FloatArray:
    """Return the logarithm of the weak prior of the slope.

    ln(s/4) is normal with deviation 1; without it, few trials may fit a slope without bounds.
    """
    return np.asarray(-0.5 * np.square(np.log(slopes / USUAL_SLOPE)))


@dataclass(frozen=True)
class Counts:
    """Answers by level.

    Attributes:
        x: the levels.
        right: numbers of right answers.
        total: numbers of answers.
    """

    x: FloatArray
    right: FloatArray
    total: FloatArray


def count_answers(x: FloatArray, right: NDArray[np.bool_]) -> Counts:
    """Return the answers to trials by level.

    Args:
        x: level of each trial.
        right: whether it was answered right.
    """
    levels, index = np.unique(x, return_inverse=True)
    return Counts(levels, np.bincount(index, right).astype(float), np.bincount(index).astype(float))


def fit_psychometric(levels: LogLevels, counts: Counts) -> tuple[float, float]:
    """Return α and s of greatest likelihood, times the weak prior of the slope.

    Args:
        levels: range, guesses and lapses.
        counts: answers by level.

    Example:
        >>> levels = LogLevels(1.0, 100.0, 1.0, 0.0, guess=0.5, lapse=0.0)
        >>> x = np.log([5.0, 10.0, 20.0])
        >>> share = levels.probability(x, float(np.log(10.0)), 4.0)
        >>> alpha, s = fit_psychometric(levels, Counts(x, 1e6 * share, np.full(3, 1e6)))
        >>> f"{np.exp(alpha):.3f} {s:.3f}"
        '10.000 4.000'
    """
    from scipy.optimize import minimize

    thresholds, all_thresholds, all_slopes = levels.grid
    likelihood = _log_likelihoods(levels, counts)(counts.right[None])[0]
    best = int(np.argmax(likelihood))

    def loss(point: FloatArray) -> tuple[float, FloatArray]:
        offset, slope = counts.x - point[0], float(np.exp(point[1]))
        chance = np.clip(levels.probability(offset, 0.0, slope), _LEAST, 1.0 - _LEAST)
        wrong = counts.total - counts.right
        sum_ = counts.right @ np.log(chance) + wrong @ np.log1p(-chance)
        # Derivatives of the sum by the exponent s (x − α), then by α and ln s.
        range_ = 1.0 - levels.guess - levels.lapse
        known = (chance - levels.guess) / range_
        terms = (counts.right / chance - wrong / (1.0 - chance)) * range_ * known * (1.0 - known)
        prior, prior_slope = log_prior(slope), -math.log(slope / USUAL_SLOPE)
        by = np.array([-slope * terms.sum(), slope * (terms @ offset) + prior_slope])
        return -float(sum_ + prior), -by

    start = np.array([all_thresholds[best], math.log(all_slopes[best])])
    bounds = [(thresholds[0], thresholds[-1]), (math.log(_SLOPES[0]), math.log(_SLOPES[-1]))]
    found = minimize(loss, start, jac=True, bounds=bounds)
    return float(found.x[0]), float(math.exp(found.x[1]))


def _log_likelihoods(levels: LogLevels, counts: Counts) -> _Likelihood:
    _, thresholds, slopes = levels.grid
    chance = levels.probability(counts.x[:, None], thresholds, slopes)
    chance = np.clip(chance, _LEAST, 1.0 - _LEAST)
    return _Likelihood(counts.total, np.log(chance), np.log1p(-chance), log_prior(slopes))


@dataclass(frozen=True)
class _Likelihood:
    """Logarithm of the likelihood of every pair of the grid."""

    total: FloatArray
    log_right: FloatArray
    log_wrong: FloatArray
    prior: FloatArray

    def __call__(self, right: FloatArray) -> FloatArray:
        """Return it for each row of numbers of right answers."""
        result: FloatArray = right @ self.log_right + (self.total - right) @ self.log_wrong
        return result + self.prior

    def profile(self, right: FloatArray) -> FloatArray:
        """Return its maximum over the slopes for each threshold."""
        shape = len(right), _THRESHOLDS, len(_SLOPES)
        result: FloatArray = self(right).reshape(shape).max(axis=2)
        return result


def threshold_interval(
    levels: LogLevels, counts: Counts, fit: tuple[float, float], resamples: int, seed: int
) -> tuple[float, float]:
    """Return the 95 % interval of a threshold.

    It holds each α whose likelihood ratio, −2 ln(L(α)/L(best)) with the best slope for each α, is
    at most the 95 % quantile of what that of the fitted threshold is in answers drawn from the
    fitted function at the same levels (parametric bootstrap), and not less than that of χ². Ends
    that the grid does not hold are infinite.

    Args:
        levels: range, guesses and lapses.
        counts: answers by level.
        fit: α and s.
        resamples: number of bootstrap samples.
        seed: of the samples.

    References:
        F. A. Wichmann, N. J. Hill: The psychometric function II. Bootstrap-based confidence
        intervals and sampling. Perception & Psychophysics 63 (2001) 1314–1329.
    """
    likelihood, thresholds = _log_likelihoods(levels, counts), levels.grid[0]
    rng = np.random.default_rng(seed)
    chance = levels.probability(counts.x, *fit)
    drawn = rng.binomial(counts.total.astype(int), chance, size=(resamples, len(chance)))
    profiles = likelihood.profile(drawn.astype(float))
    place = np.interp(fit[0], thresholds, np.arange(_THRESHOLDS))
    before = min(int(place), _THRESHOLDS - 2)
    share = place - before
    at_fit = (1.0 - share) * profiles[:, before] + share * profiles[:, before + 1]
    ratios = 2.0 * (profiles.max(axis=1) - at_fit)
    limit = max(float(np.quantile(ratios, 0.95)), _CHI_SQUARED)
    profile = likelihood.profile(counts.right[None])[0]
    return _where_above(thresholds, 2.0 * (profile - profile.max()) + limit)


def _where_above(x: FloatArray, height: FloatArray) -> tuple[float, float]:
    """Return the outermost zeros of a curve that is above zero between them."""
    inside = np.flatnonzero(height >= 0.0)
    first, last = int(inside[0]), int(inside[-1])
    low, high = -math.inf, math.inf
    if first > 0:
        low = float(np.interp(0.0, height[first - 1 : first + 1], x[first - 1 : first + 1]))
    if last < len(x) - 1:
        high = float(np.interp(0.0, height[[last + 1, last]], x[[last + 1, last]]))
    return low, high


def fit_thresholds(
    levels: LogLevels, values: FloatArray, right: NDArray[np.bool_], resamples: int, seed: int
) -> tuple[float, float, float]:
    """Return a threshold α with the ends of its interval.

    Args:
        levels: range, guesses and lapses.
        values: presented levels [SI].
        right: whether each was answered right.
        resamples: number of bootstrap samples; without any the ends are infinite.
        seed: of the samples.
    """
    counts = count_answers(np.log(values - levels.base), right)
    fit = fit_psychometric(levels, counts)
    if not resamples:
        return fit[0], -math.inf, math.inf
    return (fit[0], *threshold_interval(levels, counts, fit, resamples, seed))
