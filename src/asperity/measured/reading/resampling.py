"""Uniformity of printed positions, and interpolation of points that are on no regular grid."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.core.units import format_quantity
from asperity.measured.lengths import format_counts, format_length
from asperity.measured.reading.reader import MAX_POINTS

# A thousandth of a step does not change a texture and covers positions stored in float32.
_TOLERANCE = 1e-3
# If most steps are one printed digit, a lost sample is indistinguishable from rounding.
_COARSE_FRACTION = 0.9


@dataclass(frozen=True)
class Spacing:
    """Step of a list of positions, and its deviation from uniform spacing.

    Attributes:
        step: (last - first) / (n - 1), in the unit of the positions.
        deviation: largest distance from the uniform grid through first and last.
        index: position with this deviation.
        is_uniform: whether rounding explains every deviation.
    """

    step: float
    deviation: float
    index: int
    is_uniform: bool


def measure_spacing(positions: FloatArray, resolution: FloatArray | float) -> Spacing:
    """Return the deviation of increasing positions from a uniform grid a + p i.

    The positions are uniform if for some a and p every a + p i is within half a resolution of the
    printed position. The excess is convex in p, so that a ternary search finds the best p.

    Args:
        positions: strictly increasing, shape (n,), n at least 2.
        resolution: value of the last printed digit, one for all or shape (n,).

    Returns:
        The step, the largest deviation and whether the positions are uniform.

    Example:
        >>> measure_spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.6]), 0.1).is_uniform
        True
        >>> measure_spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.9]), 0.1).is_uniform
        False
    """
    n = len(positions)
    index = np.arange(n, dtype=np.float64)
    step = float(positions[-1] - positions[0]) / (n - 1)
    offset = positions - (positions[0] + step * index)
    worst = int(np.argmax(np.abs(offset)))
    half = np.broadcast_to(np.asarray(resolution, dtype=np.float64) / 2, (n,))
    if float(half.max()) * 2 > _COARSE_FRACTION * float(np.median(np.diff(positions))):
        half = np.zeros(n)
    half = np.maximum(half, _TOLERANCE * step)
    uniform = _min_excess(offset, index, half) <= _TOLERANCE * step
    return Spacing(step, float(abs(offset[worst])), worst, uniform)


def _min_excess(offset: FloatArray, index: FloatArray, half: FloatArray) -> float:
    """Return the least width, over all slopes, by which the offsets exceed half a resolution."""

    def width(slope: float) -> float:
        line = offset - slope * index
        return float(np.max(line - half) - np.min(line + half))

    # The ends are exact to half a resolution each, which bounds the slope's error.
    high = float(half[0] + half[-1]) / max(len(offset) - 1, 1)
    low = -high
    for _ in range(48):
        third = (high - low) / 3
        if width(low + third) <= width(high - third):
            high -= third
        else:
            low += third
    return width((low + high) / 2)


_MAX_SCATTERED_POINTS = 2 * 10**6  # their triangulation takes some seconds and a gigabyte
_MAX_GRID_RATIO = 100  # grid points for each point of the list: a finer grid adds no information
_COLLINEAR_TOLERANCE = 1e-6  # relative width of points on one line, from rounding
_HOLDOUT_DIVISOR = 10  # one point in so many is left out to estimate the error


def resampling_hint(pitch: float) -> str:
    """Return the advice for points that are on no grid.

    Args:
        pitch: a pitch that suits them [m].

    Example:
        >>> resampling_hint(4.5e-6)[-43:]
        'such as resample=4.5e-06 (--resample 4.5um)'
    """
    pitch = float(f"{pitch:.2g}")
    option = format_quantity(pitch, "m", digits=2).replace(" ", "").replace("µ", "u")
    example = f"resample={pitch:g} (--resample {option})"
    return f"points on no grid are interpolated to a pitch that you give, such as {example}"


def suggest_pitch(positions: FloatArray) -> float | None:
    """Return the pitch [m], with two digits, of a grid with as many points as the list.

    None for points on one line, which span no grid.

    Args:
        positions: x, y [m], shape (n, 2).

    Example:
        >>> suggest_pitch(np.array([[0, 0], [1, 0.1], [0, 1], [1, 1.1], [0.4, 0.3]]))
        0.45
    """
    from scipy.spatial import ConvexHull

    if len(positions) < 3:
        return None
    moved = positions - positions.mean(axis=0)
    length, width = np.linalg.svd(moved, compute_uv=False)
    if width <= _COLLINEAR_TOLERANCE * length:
        return None
    area = ConvexHull(moved / length).volume
    return float(f"{length * (area / len(positions)) ** 0.5:.2g}")


def resample_points(points: FloatArray, pitch: float) -> tuple[FloatArray, str]:
    """Return a map through scattered points, interpolated linearly on their Delaunay triangles.

    The error is estimated by cross-validation: a tenth of the points, chosen with a fixed seed, is
    interpolated from the others. As those are farther apart, the estimate is conservative.

    Args:
        points: x, y, z [m], shape (n, 3); those without a height are left out.
        pitch: pitch of the grid [m], which starts at the least x and y.

    Returns:
        Heights [m], shape (ny, nx), NaN outside the convex hull of the points; and a sentence with
        the error.

    Raises:
        SurfaceFileError: the points span no area, are too many, or two have the same position.
        ParameterError: the pitch is much finer than the points.
    """
    points = points[~np.isnan(points[:, 2])]
    if len(points) > _MAX_SCATTERED_POINTS:
        limit = f"at most {_MAX_SCATTERED_POINTS} are interpolated"
        raise SurfaceFileError(f"{len(points)} points; {limit}")
    if len(np.unique(points[:, :2], axis=0)) < len(points):
        raise SurfaceFileError("two points have the same position")
    if suggest_pitch(points[:, :2]) is None:
        raise SurfaceFileError("the points lie on one line: no map goes through them")
    low = points[:, :2].min(axis=0)
    local = (points[:, :2] - low) / pitch
    columns, rows = (int(n) for n in np.minimum(local.max(axis=0) + 1e-9, 2.0**40) + 1)
    if rows * columns > min(MAX_POINTS, _MAX_GRID_RATIO * len(points)):
        fault = f"is too fine for {len(points)} points: {columns} x {rows} of a grid"
        raise ParameterError("resample", fault, pitch)
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    heights = _interpolate_linear(local, points[:, 2], (x, y))
    sentence = (
        f"{len(points)} points interpolated linearly (Delaunay) to"
        f" {format_counts((columns, rows))} of pitch {format_length(pitch)};"
        f" {_describe_holdout_error(local, points[:, 2])}"
    )
    return heights, sentence


def resample_profile(
    positions: FloatArray, heights: FloatArray, pitch: float
) -> tuple[FloatArray, str]:
    """Return a profile interpolated linearly between its points.

    Args:
        positions: [m], shape (n,), increasing.
        heights: [m], shape (n,); points without one are left out.
        pitch: pitch of the profile [m], which starts at the first position.

    Returns:
        Heights [m], shape (m,); and a sentence with the error at every other point.

    Raises:
        SurfaceFileError: fewer than two points have a height.
        ParameterError: the pitch is much finer than the points.
    """
    known = ~np.isnan(heights)
    positions, heights = positions[known], heights[known]
    if len(positions) < 2:
        raise SurfaceFileError("a profile needs two points with a height")
    length = float(positions[-1] - positions[0])
    count = int(min(length / pitch + 1e-9, 2.0**40)) + 1
    if count > min(MAX_POINTS, _MAX_GRID_RATIO * len(positions)):
        raise ParameterError("resample", f"is too fine for {len(positions)} points", pitch)
    along = positions[0] + pitch * np.arange(count)
    missed = np.abs(np.interp(positions[1::2], positions[::2], heights[::2]) - heights[1::2])
    rms = format_length(_rms(missed))
    sentence = (
        f"{len(positions)} points interpolated linearly to {count} of pitch {format_length(pitch)};"
        f" from every other point the rest are missed by {rms} rms"
    )
    return np.interp(along, positions, heights), sentence


def _interpolate_linear(
    positions: FloatArray, heights: FloatArray, targets: tuple[FloatArray, ...]
) -> FloatArray:
    from scipy.interpolate import LinearNDInterpolator

    return np.asarray(LinearNDInterpolator(positions, heights)(*targets), dtype=np.float64)


def _describe_holdout_error(positions: FloatArray, heights: FloatArray) -> str:
    """Return the interpolation error at points that are left out, in words."""
    from scipy.spatial import QhullError

    held_out = np.zeros(len(positions), dtype=bool)
    order = np.random.default_rng(0).permutation(len(positions))
    held_out[order[: max(1, len(positions) // _HOLDOUT_DIVISOR)]] = True
    try:
        others = positions[~held_out]
        found = _interpolate_linear(others, heights[~held_out], (positions[held_out],))
    except (QhullError, ValueError):
        found = np.full(int(held_out.sum()), np.nan)
    missed = np.abs(found - heights[held_out])
    missed = missed[~np.isnan(missed)]
    if not len(missed):
        return "too few points to know its error"
    rms, most = format_length(_rms(missed)), format_length(float(missed.max()))
    return f"{len(missed)} points that were left out are missed by {rms} rms, {most} at most"


def _rms(values: FloatArray) -> float:
    """Return the root mean square without squaring, which overflows for 1e308."""
    return math.hypot(*values) / math.sqrt(len(values))
