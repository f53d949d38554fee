"""Find spikes: points far from the median of their neighbours."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.measured.length_words import length_text, positive_number

WINDOW = {1: 9, 2: 5}
"""Points along each side of the neighbourhood, for profiles and maps."""

# Of a normal distribution: standard deviation over median, and over mean, of the absolute value.
_FROM_MEDIAN = 1.482602218505602
_FROM_MEAN = math.sqrt(math.pi / 2.0)
_BLOCK = 2**18

Indices = tuple[NDArray[np.intp], ...]


def remove_outliers(heights: FloatArray, threshold: float) -> str:
    """Make spikes missing where the heights are.

    The residual r of a point is its height less the median m of the neighbourhood (5 x 5 points,
    9 of a profile). It is compared with two robust standard deviations, 1.4826 median |r| of the
    whole surface and 1.4826 median |h - m| of the neighbourhood (Hampel's identifier): a spike
    lies beyond the threshold of both, so that neither noise in flat places nor a crest or a steep
    flank counts. Missing points take no part. Where more than half of all residuals vanish
    (stepped heights), 1.2533 mean |r| stands for the first. A corner of a sharp step may still
    count as a spike.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN where missing; replaced.
        threshold: in robust standard deviations.

    Returns:
        What was done, in one sentence.

    Raises:
        ParameterError: for a threshold that is not positive.

    Example:
        >>> x = np.arange(40.0)
        >>> wave = np.sin(x / 3)
        >>> wave[17] = 9.0
        >>> remove_outliers(wave, 6.0)[:47], np.flatnonzero(np.isnan(wave))
        ('outliers: 1 point beyond 6 robust standard devi', array([17]))
    """
    threshold = positive_number("outliers", threshold, "robust standard deviations")
    padded = _continued(heights, _reach(heights.shape))
    residual = _local_median(padded, heights.shape)
    np.subtract(heights, residual, out=residual)
    np.abs(residual, out=residual)
    sigma, origin = _robust_deviation(residual)
    # Rounding alone must not make outliers of a surface that equals its medians.
    least = max(threshold * sigma, 1e-12 * float(np.nanmax(np.abs(heights))))
    suspects = np.nonzero(residual > least)
    count = 0
    for some, windows in _windows_at(padded, heights.shape, suspects):
        middle = np.nanmedian(windows, axis=1, keepdims=True)
        spread = _FROM_MEDIAN * np.nanmedian(np.abs(windows - middle), axis=1)
        spikes = residual[some] > threshold * spread
        heights[tuple(index[spikes] for index in some)] = np.nan
        count += int(spikes.sum())
    side = WINDOW[heights.ndim]
    around = f"{side} points" if heights.ndim == 1 else f"{side} x {side} points"
    return (
        f"outliers: {count} point{'' if count == 1 else 's'} beyond {threshold:g} robust standard"
        f" deviations, of {around} around and of all"
        f" ({length_text(sigma)}, from the {origin} absolute deviation), made missing"
    )


def _reach(shape: tuple[int, ...]) -> int:
    return min(WINDOW[len(shape)] // 2, min(shape) - 3)


def _local_median(padded: FloatArray, shape: tuple[int, ...]) -> FloatArray:
    """Return the median of the valid points of each neighbourhood; NaN at missing points."""
    from scipy.ndimage import binary_dilation, median_filter

    reach = _reach(shape)
    box = (2 * reach + 1,) * len(shape)
    inner = (slice(reach, -reach),) * len(shape)
    missing = np.isnan(padded)
    if not missing.any():
        return np.array(median_filter(padded, size=box)[inner])
    medians = np.array(median_filter(np.where(missing, 0.0, padded), size=box)[inner])
    near = binary_dilation(missing, np.ones(box, bool))[inner] & ~missing[inner]
    for some, windows in _windows_at(padded, shape, np.nonzero(near)):
        medians[some] = np.nanmedian(windows, axis=1)
    medians[missing[inner]] = np.nan
    return medians


def _windows_at(
    padded: FloatArray, shape: tuple[int, ...], where: Indices
) -> Iterator[tuple[Indices, FloatArray]]:
    """Yield blocks of points and their neighbourhoods, one row each."""
    side = 2 * _reach(shape) + 1
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side,) * len(shape))
    for first in range(0, len(where[0]), _BLOCK):
        some = tuple(index[first : first + _BLOCK] for index in where)
        yield some, windows[some].reshape(len(some[0]), -1)


def _continued(heights: FloatArray, reach: int) -> FloatArray:
    """Reflect each end through the median of its last three points, which no spike moves.

    That keeps the slope: a tilted surface has no residuals at its border.
    """
    for axis in range(heights.ndim):
        lines = np.moveaxis(heights, axis, 0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # three missing points: stay missing
            first, last = np.nanmedian(lines[:3], axis=0), np.nanmedian(lines[-3:], axis=0)
        before = 2.0 * first - lines[3 : 3 + reach][::-1]
        after = 2.0 * last - lines[-3 - reach : -3][::-1]
        heights = np.moveaxis(np.concatenate([before, lines, after]), 0, axis)
    return heights


def _robust_deviation(residual: FloatArray) -> tuple[float, str]:
    valid = residual[~np.isnan(residual)]
    middle = float(np.median(valid, overwrite_input=True))
    if middle > 0.0:
        return _FROM_MEDIAN * middle, "median"
    return _FROM_MEAN * float(valid.mean()), "mean"
