"""Intervals of means and of shares."""

from __future__ import annotations

import math

import numpy as np

from asperity.core.compiled import FloatArray

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
        Mean and ends; the ends are infinite for fewer than 3 values or values that do not differ.

    References:
        B. Efron, R. J. Tibshirani: An Introduction to the Bootstrap (1993), section 12.5.

    Example:
        >>> low, high = mean_interval(np.array([1.0, 2.0, 3.0, 4.0]))[1:]
        >>> f"{low:.3f} {high:.3f}"
        '0.446 4.554'
    """
    count = len(values)
    mean = float(np.mean(values)) if len(values) else math.nan
    error = float(np.std(values, ddof=1)) / math.sqrt(count) if count > 2 else 0.0
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
