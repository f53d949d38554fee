"""Remove spikes: points far from the median of their neighbours."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.measured.lengths import Shape, format_length

WINDOW_SIZES = {1: 9, 2: 5}
"""Points along each side of the neighbourhood, by number of axes."""

# Standard deviation of a normal distribution over median, and over mean, of the absolute value.
_FROM_MEDIAN = 1.482602218505602
_FROM_MEAN = math.sqrt(math.pi / 2.0)
_BLOCK = 2**18

IndexArrays = tuple[NDArray[np.intp], ...]


def remove_outliers(heights: FloatArray, threshold: float) -> str:
    """Replace spikes by NaN in place.

    The residual r of a point is its height minus the median m of the neighbourhood (5 x 5 points,
    9 of a profile). It is compared with two robust standard deviations: 1.4826 median |r| of the
    whole surface and 1.4826 median |h - m| of the neighbourhood (Hampel's identifier). A spike
    exceeds the threshold of both, so that noise in flat places, crests and steep flanks are
    unaffected. Missing points are ignored. If more than half of all residuals vanish (stepped
    heights), 1.2533 mean |r| replaces the first. A corner of a sharp step may still be taken for a
    spike.

    Args:
        heights: [m], shape (ny, nx) or (n,), NaN for missing points; changed in place.
        threshold: threshold in robust standard deviations.

    Returns:
        A sentence with the number of spikes.

    Raises:
        ParameterError: the threshold is not positive.

    Example:
        >>> x = np.arange(40.0)
        >>> wave = np.sin(x / 3)
        >>> wave[17] = 9.0
        >>> remove_outliers(wave, 6.0)[:47], np.flatnonzero(np.isnan(wave))
        ('outliers: 1 point beyond 6 robust standard devi', array([17]))
    """
    threshold = check_positive("outliers", threshold)
    padded = _pad_by_reflection(heights, _half_window(heights.shape))
    residual = _local_median(padded, heights.shape)
    np.subtract(heights, residual, out=residual)
    np.abs(residual, out=residual)
    sigma, origin = _robust_deviation(residual)
    # Rounding must not produce outliers on a surface that equals its medians.
    least = max(threshold * sigma, 1e-12 * float(np.nanmax(np.abs(heights))))
    suspects = np.nonzero(residual > least)
    count = 0
    for block, windows in _iter_windows(padded, heights.shape, suspects):
        middle = np.nanmedian(windows, axis=1, keepdims=True)
        spread = _FROM_MEDIAN * np.nanmedian(np.abs(windows - middle), axis=1)
        spikes = residual[block] > threshold * spread
        heights[tuple(index[spikes] for index in block)] = np.nan
        count += int(spikes.sum())
    side = WINDOW_SIZES[heights.ndim]
    around = f"{side} points" if heights.ndim == 1 else f"{side} x {side} points"
    return (
        f"outliers: {count} point{'' if count == 1 else 's'} beyond {threshold:g} robust standard"
        f" deviations, of {around} around and of all"
        f" ({format_length(sigma)}, from the {origin} absolute deviation), made missing"
    )


def _half_window(shape: Shape) -> int:
    return min(WINDOW_SIZES[len(shape)] // 2, min(shape) - 3)


def _local_median(padded: FloatArray, shape: Shape) -> FloatArray:
    """Return the median of the valid points in each neighbourhood; NaN at missing points."""
    from scipy.ndimage import binary_dilation, median_filter

    reach = _half_window(shape)
    box = (2 * reach + 1,) * len(shape)
    inner = (slice(reach, -reach),) * len(shape)
    missing = np.isnan(padded)
    if not missing.any():
        return np.array(median_filter(padded, size=box)[inner])
    medians = np.array(median_filter(np.where(missing, 0.0, padded), size=box)[inner])
    near = binary_dilation(missing, np.ones(box, bool))[inner] & ~missing[inner]
    for block, windows in _iter_windows(padded, shape, np.nonzero(near)):
        medians[block] = np.nanmedian(windows, axis=1)
    medians[missing[inner]] = np.nan
    return medians


def _iter_windows(
    padded: FloatArray, shape: Shape, indices: IndexArrays
) -> Iterator[tuple[IndexArrays, FloatArray]]:
    """Yield blocks of points and their neighbourhoods, one row each."""
    side = 2 * _half_window(shape) + 1
    windows = np.lib.stride_tricks.sliding_window_view(padded, (side,) * len(shape))
    for first in range(0, len(indices[0]), _BLOCK):
        block = tuple(index[first : first + _BLOCK] for index in indices)
        yield block, windows[block].reshape(len(block[0]), -1)


def _pad_by_reflection(heights: FloatArray, half_window: int) -> FloatArray:
    """Return the heights extended by point reflection through the median of the last three points.

    A single spike does not change that median. The slope continues: a tilted surface has no
    residuals at its border.
    """
    for axis in range(heights.ndim):
        lines = np.moveaxis(heights, axis, 0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of three missing points: NaN
            first = np.nanmedian(lines[:3], axis=0)
            last = np.nanmedian(lines[-3:], axis=0)
        before = 2.0 * first - lines[3 : 3 + half_window][::-1]
        after = 2.0 * last - lines[-3 - half_window : -3][::-1]
        heights = np.moveaxis(np.concatenate([before, lines, after]), 0, axis)
    return heights


def _robust_deviation(residual: FloatArray) -> tuple[float, str]:
    valid = residual[~np.isnan(residual)]
    middle = float(np.median(valid, overwrite_input=True))
    if middle > 0.0:
        return _FROM_MEDIAN * middle, "median"
    return _FROM_MEAN * float(valid.mean()), "mean"
