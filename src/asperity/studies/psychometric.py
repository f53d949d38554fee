"""Psychometric functions, and thresholds with intervals of the posterior.

P(x) = γ + (1 − γ − λ)/(1 + exp(−s (x − α))) is the share of right answers at the level x, the
natural logarithm of an increment. The threshold α is where the chance of knowing the answer is a
half, apart from guesses γ and lapses λ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from asperity.core.compiled import FloatArray
from asperity.studies.scores import Interval

USUAL_SLOPE = 4.0
SLOPE_SPREAD = 0.7
"""Prior of the slope: median, and deviation of the logarithm."""
_SLOPES = np.geomspace(0.5, 32.0, 25)
_THRESHOLDS = 241
_QUANTILES = (0.5, 0.025, 0.975)


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
        known: FloatArray = expit(slope * (x - threshold))
        return self.guess + (1.0 - self.guess - self.lapse) * known

    def posterior(
        self, x: FloatArray, right: NDArray[np.bool_]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return thresholds α, slopes s, and the probability of each pair after the answers.

        Before them, α is as likely anywhere from half the range below its low end to half the range
        above its high end, and ln(s/4) is normal with deviation 0.7.

        Args:
            x: level of each trial.
            right: whether it was answered right.

        Returns:
            The probabilities have the shape (thresholds, slopes), and sum to one.
        """
        low, high = self.ends
        margin = (high - low) / 2.0
        thresholds = np.linspace(low - margin, high + margin, _THRESHOLDS)
        chance = self.probability(x[:, None, None], thresholds[:, None], _SLOPES)
        with np.errstate(divide="ignore"):  # without lapses a wrong answer may be impossible
            logarithm = np.log(np.where(right[:, None, None], chance, 1.0 - chance)).sum(axis=0)
        logarithm -= 0.5 * np.square(np.log(_SLOPES / USUAL_SLOPE) / SLOPE_SPREAD)
        share = np.exp(logarithm - logarithm.max())
        return thresholds, _SLOPES, share / share.sum()

    def estimate_threshold(self, x: FloatArray, right: NDArray[np.bool_]) -> Interval:
        """Return the median of the posterior of α, and its central 95 % interval.

        An end that lies outside the levels is infinite: the answers do not bound it.

        References:
            H. H. Schütt et al.: Painfree and accurate Bayesian estimation of psychometric functions
            for (potentially) overdispersed data. Vision Research 122 (2016) 105–123.

        Example:
            >>> levels = LogLevels(1.0, 100.0, 1.0, 0.0, guess=0.5, lapse=0.0)
            >>> x = np.log(np.repeat([5.0, 10.0, 20.0], 400))
            >>> right = np.arange(1200) % 400 < 400 * levels.probability(x, np.log(10.0), 4.0)
            >>> f"{np.exp(levels.estimate_threshold(x, right)[0]):.1f}"
            '10.0'
        """
        thresholds, _, pairs = self.posterior(x, right)
        share = pairs.sum(axis=1)
        below = np.cumsum(share) - 0.5 * share
        middle, low, high = np.interp(_QUANTILES, below, thresholds).tolist()
        lowest, highest = self.ends
        if low <= lowest:
            low = -math.inf
        if high >= highest:
            high = math.inf
        return middle, low, high
