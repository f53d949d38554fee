"""Scores for each participant and pooled, with intervals of means and of shares."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray
from asperity.studies.design import Answers, TrialRecord

Interval = tuple[float, float, float]
"""An estimate, and the ends of its 95 % interval; an unbounded end is infinite."""
LEAST_RESAMPLED = 8
"""Least number of values that are resampled; the interval of fewer is that of Student's t."""


def mean_interval(values: FloatArray, resamples: int = 0, seed: int = 0) -> Interval:
    """Return the mean of independent values, and its 95 % interval.

    The studentised bootstrap: the interval of the mean m with standard error e is
    [m − t₀.₉₇₅ e, m − t₀.₀₂₅ e], with the quantiles of t = (m* − m)/e* over samples of the values
    with replacement. With fewer than 8 values, or without samples, t is Student's.

    Args:
        values: the values, such as one for each participant.
        resamples: number of samples.
        seed: of the samples.

    Returns:
        Mean and ends; the ends are infinite for fewer than 3 values, values that do not differ, or
        an infinite one.

    References:
        B. Efron, R. J. Tibshirani: An Introduction to the Bootstrap (1993), section 12.5.

    Example:
        >>> low, high = mean_interval(np.array([1.0, 2.0, 3.0, 4.0]))[1:]
        >>> f"{low:.3f} {high:.3f}"
        '0.446 4.554'
    """
    count = len(values)
    mean = float(np.mean(values)) if len(values) else math.nan
    if count < 3 or math.isinf(mean):
        return mean, -math.inf, math.inf
    error = float(np.std(values, ddof=1)) / math.sqrt(count)
    if not error > 0.0:
        return mean, -math.inf, math.inf
    low, high = _quantiles(values, mean, resamples, seed)
    return mean, mean - high * error, mean - low * error


def _quantiles(values: FloatArray, mean: float, resamples: int, seed: int) -> tuple[float, float]:
    """Return the quantiles of t."""
    from scipy.stats import t as student

    count = len(values)
    if count < LEAST_RESAMPLED or not resamples:
        high = float(student.ppf(0.975, count - 1))
        return -high, high
    rng = np.random.default_rng(seed)
    drawn = values[rng.integers(count, size=(resamples, count))]
    errors = drawn.std(axis=1, ddof=1) / math.sqrt(count)
    # Samples of one repeated value say nothing about the spread.
    ratios = (drawn.mean(axis=1) - mean)[errors > 0.0] / errors[errors > 0.0]
    low, high = np.quantile(ratios, (0.025, 0.975))
    return float(low), float(high)


def share_interval(right: int, total: int) -> Interval:
    """Return a share and its 95 % interval by Wilson's score.

    Example:
        >>> [f"{x:.3f}" for x in share_interval(8, 10)]
        ['0.800', '0.490', '0.943']
    """
    from scipy.stats import binomtest

    interval = binomtest(right, total).proportion_ci(method="wilson")
    return right / total, float(interval.low), float(interval.high)


RESAMPLES = 2000
"""Number of samples of a bootstrap, unless stated otherwise."""


_OPPOSITE = [0, 2, 1, 3]
"""Places of value, ends and value within the limits in what is subtracted."""


@dataclass(frozen=True)
class Score:
    """Estimates for each participant (row) and each condition or pair of conditions (column).

    Attributes:
        quantity: what is estimated.
        participants: codes of the participants.
        estimates: values, and lower and upper ends of the 95 % intervals of each participant, shape
            (3, participants, columns); those of a logarithmic quantity are natural logarithms.
        counts: numbers of answers.
        is_logarithmic: whether the values are logarithms.
        interval: how the intervals of each participant were found.
        pooled: values whose means are the pooled estimates, where they are not ``values``; they may
            be too skewed to be resampled, as where hardly any choice goes the other way.
        chance: of a share, its value without an effect.
        limits: of thresholds, the ends of the levels: a value outside is infinite.
        unit: SI unit of the quantity; empty for a pure number.
    """

    quantity: str
    participants: tuple[str, ...]
    estimates: FloatArray
    counts: NDArray[np.int_]
    is_logarithmic: bool = False
    interval: str = ""
    pooled: FloatArray | None = None
    chance: float | None = None
    limits: tuple[float, float] | None = None
    unit: str = ""

    def pool(self, seed: int, resamples: int = RESAMPLES) -> list[Interval]:
        """Return the mean over the participants of each column, with its interval.

        Thresholds outside the levels count as the end of the levels, and leave the end of the
        interval on their side unbounded, as half of the participants or more do whose own interval
        is unbounded there. The mean is infinite if all are outside on one side, unknown (not a
        number) if some are.
        """
        intervals = [self._pool(column, seed, resamples) for column in self._units.T]
        if self.chance is None:
            return intervals
        return [(mean, max(low, 0.0), min(high, 1.0)) for mean, low, high in intervals]  # shares

    def differences(self, seed: int, resamples: int = RESAMPLES) -> list[Interval]:
        """Return by how much each column but the first differs from the first.

        The differences are within participants. A column with a chance value is compared with it.
        """
        units = self._units.T
        if self.chance is not None:
            return [self._pool(column - self.chance, seed, resamples) for column in units]
        with np.errstate(invalid="ignore"):  # both may be infinite
            columns = units[1:] - units[0][:, _OPPOSITE]
        return [self._pool(column, seed, resamples) for column in columns]

    @property
    def values(self) -> FloatArray:
        """The estimates without their intervals."""
        result: FloatArray = self.estimates[0]
        return result

    @property
    def _units(self) -> FloatArray:
        """Values, ends, and values within the limits; shape (4, participants, columns)."""
        if self.limits is not None:
            return np.array([*self.estimates, np.clip(self.values, *self.limits)])
        values = self.values if self.pooled is None else self.pooled
        return np.array([values] * len(_OPPOSITE))

    def _pool(self, column: FloatArray, seed: int, resamples: int) -> Interval:
        """Return the mean of a column, shape (participants, 4), and its interval."""
        values, lows, highs, inner = column[~np.isnan(column[:, 3])].T
        mean, low, high = mean_interval(inner, resamples if self.pooled is None else 0, seed)
        if not np.all(np.isfinite(values)):
            mean = float(values[0]) if np.all(values == values[0]) else math.nan
        half = len(values) / 2.0
        if not np.all(values > -math.inf) or np.isinf(lows).sum() >= half > 0.0:
            low = -math.inf
        if not np.all(values < math.inf) or np.isinf(highs).sum() >= half > 0.0:
            high = math.inf
        return mean, low, high

    @property
    def pooled_interval(self) -> str:
        """How the pooled intervals are found."""
        if self.pooled is not None or len(self.participants) < LEAST_RESAMPLED:
            return "Student's t over participants"
        return f"studentised bootstrap over participants, {RESAMPLES} samples"

    def to_scale(self, values: FloatArray) -> FloatArray:
        """Return values on the scale of the quantity."""
        with np.errstate(over="ignore"):
            return np.asarray(np.exp(values) if self.is_logarithmic else values)


Cells = tuple[tuple[str, ...], FloatArray, NDArray[np.int_]]
"""Participants, their estimates, and numbers of answers, see :class:`Score`."""
_NOTHING = (math.nan, -math.inf, math.inf)


def score_cells(
    answered: Answers, columns: int, estimate: Callable[[Sequence[TrialRecord]], Interval]
) -> Cells:
    """Return an estimate from the answers of each participant to each condition.

    Args:
        answered: the answers.
        columns: number of conditions, or of their pairs.
        estimate: from one answer or more.
    """
    cells = [
        [[trial for trial in trials if trial.presentation.condition == i] for i in range(columns)]
        for trials in answered.values()
    ]
    estimates = [[estimate(cell) if cell else _NOTHING for cell in row] for row in cells]
    counts = np.array([[len(cell) for cell in row] for row in cells], int).reshape(-1, columns)
    return tuple(answered), np.array(estimates).reshape(-1, columns, 3).transpose(2, 0, 1), counts
