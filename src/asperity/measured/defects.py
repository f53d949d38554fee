"""Mend a measured surface: spikes, missing points, and borders that do not meet.

A spike is a point far from the median of its neighbours. Missing points are filled by harmonic
interpolation (Laplace's equation). A surface becomes periodic by blending its opposite borders over
a band.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch, Shape, format_counts, format_length, format_lengths

if TYPE_CHECKING:
    from scipy.sparse import csr_array

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
    limit = max(threshold * sigma, 1e-12 * float(np.nanmax(np.abs(heights))))
    suspects = np.nonzero(residual > limit)
    count = 0
    for block, windows in _iter_windows(padded, heights.shape, suspects):
        middle = np.nanmedian(windows, axis=1, keepdims=True)
        spread = _FROM_MEDIAN * np.nanmedian(np.abs(windows - middle), axis=1)
        spikes = residual[block] > threshold * spread
        heights[tuple(index[spikes] for index in block)] = np.nan
        count += int(spikes.sum())
    points = "point" if count == 1 else "points"
    neighbourhood = format_counts([WINDOW_SIZES[heights.ndim]] * heights.ndim)
    return (
        f"outliers: {count} {points} beyond {threshold:g} robust standard"
        f" deviations, of {neighbourhood} points around and of all"
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


_GROUP_SIZE = 100_000  # points solved together; larger holes one by one
_MAX_HOLE = 2_000_000  # points of a hole: some 20 s and 3 GB

Indices = NDArray[np.int64]


def fill_in_place(heights: FloatArray, pitch: Pitch) -> None:
    """Replace NaN by the harmonic function determined by the valid neighbours.

    The five-point Laplace equation h_xx + h_yy = 0 holds at each missing point, the valid
    points are unchanged, and the slope across the outer border is zero (natural border). Inside
    a hole the result has no extremum, and a plane around an interior hole is continued
    exactly. On a profile this is linear interpolation, constant beyond the ends.

    Holes are independent of each other: small ones are solved in groups, each large one by itself.

    Args:
        heights: [m], shape (ny, nx) or (n,), with at least one valid point; changed in place.
        pitch: (px, py) [m]; only the ratio matters.

    Raises:
        ParameterError: a hole is too large.

    Example:
        >>> heights = np.array([0.0, np.nan, 2.0, np.nan])
        >>> fill_in_place(heights, (1.0,))
        >>> heights
        array([0., 1., 2., 2.])
    """
    from scipy.sparse.linalg import spsolve

    missing = np.isnan(heights)
    if not missing.any():
        return
    if heights.ndim == 1:
        valid = np.flatnonzero(~missing)
        heights[missing] = np.interp(np.flatnonzero(missing), valid, heights[valid])
        return
    # Without the mean, the solver's tolerance is relative to the range of heights.
    mean = float(np.nanmean(heights))
    weights = (1.0, (pitch[0] / pitch[1]) ** 2)
    for points in _hole_groups(missing):
        if len(points) > _MAX_HOLE:
            fault = f"has a hole of {len(points)} points; at most {_MAX_HOLE} are filled: crop it"
            raise ParameterError("surface", fault)
        matrix, right = _laplace_system(heights, points, weights, mean)
        solution = spsolve(matrix.tocsc(), right, permc_spec="MMD_AT_PLUS_A")
        heights.reshape(-1)[points] = solution + mean


def _hole_groups(missing: NDArray[np.bool_]) -> Iterator[Indices]:
    """Yield sorted flat indices of the points of a large hole, or of several small ones."""
    from scipy.ndimage import label

    labels, _count = label(missing)  # neighbours along the axes only, as in the equation
    points = np.flatnonzero(missing).astype(np.int64)
    hole = labels.reshape(-1)[points]
    del labels
    order = np.argsort(hole, kind="stable")
    sizes = np.bincount(hole)[1:]
    first = 0
    size = 0
    for count in sizes:
        if size and size + count > _GROUP_SIZE:
            yield np.sort(points[order[first : first + size]])
            first = first + size
            size = 0
        size += int(count)
    yield np.sort(points[order[first : first + size]])


def _laplace_system(
    heights: FloatArray, points: Indices, weights: tuple[float, float], mean: float
) -> tuple[csr_array, FloatArray]:
    """Return the symmetric positive definite system of whole holes."""
    from scipy.sparse import csr_array

    count = len(points)
    (ny, nx) = heights.shape
    row, column = divmod(points, nx)
    small = np.int32 if 5 * count < 2**31 else np.int64
    columns = np.full((count, 5), -1, dtype=small)  # neighbours and, last, the point itself
    values = np.empty((count, 5))
    right = np.zeros(count)
    values[:, 4] = 0.0
    columns[:, 4] = np.arange(count)
    insides = (column > 0, column < nx - 1, row > 0, row < ny - 1)
    for k, (inside, step) in enumerate(zip(insides, (-1, 1, -nx, nx), strict=True)):
        weight = weights[k // 2]
        values[:, 4] += weight * inside
        values[:, k] = -weight
        rows = np.flatnonzero(inside)
        neighbours = points[rows] + step
        their_heights = heights.reshape(-1)[neighbours]
        unknown = np.isnan(their_heights)
        columns[rows[unknown], k] = np.searchsorted(points, neighbours[unknown])
        right[rows[~unknown]] += weight * (their_heights[~unknown] - mean)
    used = columns >= 0
    starts = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    matrix = csr_array((values[used], columns[used], starts), shape=(count, count))
    return matrix, right


DEFAULT_FRACTION = 0.1
"""Default width of the band, as a fraction of each side."""

_MIN_SAMPLES = 4  # in the band, and in the rest of the surface


_FIT_LINES = 1024
_FIT = 1.5  # steps and bends across the border over the greatest inside, RMS of a line


def borders_fit(heights: FloatArray, *, smooth: bool = False) -> bool:
    """Return whether a surface repeats without a seam: opposite borders fit in height and slope.

    Across the border, first and second differences are at most 1.5 times those inside, each the RMS
    over a line.

    Args:
        heights: [m], shape (ny, nx) or (n,); a missing point at a border does not fit.
        smooth: whether steps must be smaller than the heights, too, unlike those of white noise.

    Example:
        >>> wave = np.sin(2 * np.pi * np.arange(32) / 32)
        >>> borders_fit(wave), borders_fit(wave[:-1]), borders_fit(np.append(wave, 0.0))
        (True, False, False)
    """
    for axis in range(heights.ndim):
        lines = np.moveaxis(heights, axis, 0).reshape(heights.shape[axis], -1)
        lines = lines[:, :: -(-lines.shape[1] // _FIT_LINES)]
        for order in (1, 2):
            inside = np.sqrt(np.mean(np.diff(lines, order, axis=0) ** 2, axis=1))
            seam = np.diff(np.concatenate([lines[-order:], lines[:order]]), order, axis=0)
            across = np.sqrt(np.mean(seam**2, axis=1)).max()
            limit = _FIT * np.max(inside, initial=0.0, where=np.isfinite(inside))
            if smooth:
                limit = min(limit, float(np.nanstd(lines)))
            if not across <= limit:
                return False
    return True


def to_blend_samples(shape: Shape, pitch: Pitch, width: float | None) -> tuple[int, ...]:
    """Return the width of the band in samples, (nx,) or (nx, ny).

    Raises:
        ParameterError: the width is not positive, below four samples, or above half of the
            shorter side.
    """
    counts = np.array(shape[::-1])
    if width is None:
        samples = [max(_MIN_SAMPLES, round(DEFAULT_FRACTION * n)) for n in counts]
        if np.any(2 * np.array(samples) > counts):
            limit = f"needs at least {2 * _MIN_SAMPLES} points along each side to blend"
            raise ParameterError("periodic", limit, shape[::-1])
        return tuple(samples)
    check_positive("blend", width, "m")
    if width < (_MIN_SAMPLES - 0.5) * max(pitch):
        limit = f"{_MIN_SAMPLES} samples, {format_length(_MIN_SAMPLES * max(pitch))} [m]"
        raise ParameterError("blend", f"must be at least {limit}", width)
    samples = [round(min(width / p, n)) for p, n in zip(pitch, shape[::-1], strict=True)]
    if np.any(2 * np.array(samples) > counts):
        limit = format_length(float(min(counts // 2 * pitch)))
        raise ParameterError("blend", f"must be at most half the shorter side, {limit} [m]", width)
    return tuple(samples)


def blend_borders(heights: FloatArray, samples: tuple[int, ...]) -> tuple[FloatArray, float]:
    """Return a periodic surface, shorter by the band along each axis.

    Along an axis of n points and a band of w, the points i < w become
    t_i h_i + (1 - t_i) h_(n-w+i), and the last w points are dropped: the end of one period
    continues into the band, which returns to the start of the surface. The weight
    t = 10 s³ - 15 s⁴ + 6 s⁵, s = (i + 1)/(w + 1), is continuous in slope and curvature. The result
    lies between the blended heights.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        samples: w along x, or along x and y.

    Returns:
        The heights, and the largest jump between opposite borders before blending [m].

    Example:
        >>> ramp, jump = blend_borders(np.arange(12.0), (4,))
        >>> ramp.round(2)
        array([7.54, 6.46, 4.54, 3.46, 4.  , 5.  , 6.  , 7.  ])
        >>> jump
        11.0
    """
    jump = 0.0
    for axis, band in zip(range(heights.ndim - 1, -1, -1), samples, strict=True):
        lines = np.swapaxes(heights, 0, axis)
        jump = max(jump, float(np.abs(lines[0] - lines[-1]).max()))
        heights = _blend_axis(heights, band, axis)
    return heights, jump


def make_periodic(
    heights: FloatArray, filled_mask: NDArray[np.bool_], pitch: Pitch, width: float | None
) -> tuple[FloatArray, NDArray[np.bool_], str]:
    """Blend the borders of a surface and of its mask, and describe the result.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        filled_mask: True for interpolated heights, same shape.
        pitch: (px, py) or (px,) [m].
        width: width of the band [m]; None for a tenth of each side.

    Returns:
        Heights [m], mask and a sentence.

    Raises:
        ParameterError: see :func:`to_blend_samples`.
    """
    samples = to_blend_samples(heights.shape, pitch, width)
    periodic, jump = blend_borders(heights, samples)
    for axis, band in zip(range(heights.ndim - 1, -1, -1), samples, strict=True):
        every = np.swapaxes(filled_mask, 0, axis)
        mask = every[:-band].copy()
        mask[:band] |= every[-band:]
        filled_mask = np.swapaxes(mask, 0, axis)
    widths = format_lengths([w * p for w, p in zip(samples, pitch, strict=True)])
    if width is None:
        widths += " (a tenth of each side)"
    sentence = (
        f"made periodic: opposite borders blended over {widths}, which leaves"
        f" {format_counts(periodic.shape[::-1])} points; a jump of up to {format_length(jump)}"
        " removed"
    )
    return periodic, filled_mask, sentence


def _blend_axis(heights: FloatArray, band: int, axis: int) -> FloatArray:
    every = np.swapaxes(heights, 0, axis)
    s = np.arange(1, band + 1) / (band + 1.0)
    weight = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2)).reshape(-1, *(1,) * (heights.ndim - 1))
    result = np.array(every[:-band])
    result[:band] = weight * every[:band] + (1.0 - weight) * every[-band:]
    return np.ascontiguousarray(np.swapaxes(result, 0, axis))
