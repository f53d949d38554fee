"""Points on no regular grid: the pitch that fits them, and the map through them with its error."""

from __future__ import annotations

import math

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.length_words import by_text, length_text
from asperity.measured.reading.raw import MAX_POINTS
from asperity.units import engineering

_MOST = 2 * 10**6  # points: their triangles take some seconds and a gigabyte
_FINEST = 100  # grid points for each point of the list: finer says nothing more
_THIN = 1e-6  # points as close to one line are on it but for rounding
_LEFT_OUT = 10  # one point in so many is left out to find the error


def advice(pitch: float) -> str:
    """Return how points on no grid can be read.

    Args:
        pitch: that fits them [m].

    Example:
        >>> advice(4.5e-6)[-43:]
        'such as resample=4.5e-06 (--resample 4.5um)'
    """
    pitch = float(f"{pitch:.2g}")
    said = engineering(pitch, "m", digits=2).replace(" ", "").replace("µ", "u")
    return (
        "points on no grid are interpolated to a pitch that you give, such as"
        f" resample={pitch:g} (--resample {said})"
    )


def fitting_pitch(positions: FloatArray) -> float | None:
    """Return the pitch [m] of as many grid points as there are points, with two digits.

    None for points on one line, which no grid fits.

    Args:
        positions: x, y [m], shape (n, 2).

    Example:
        >>> fitting_pitch(np.array([[0, 0], [1, 0.1], [0, 1], [1, 1.1], [0.4, 0.3]]))
        0.45
    """
    from scipy.spatial import ConvexHull

    if len(positions) < 3:
        return None
    moved = positions - positions.mean(axis=0)
    length, width = np.linalg.svd(moved, compute_uv=False)
    if width <= _THIN * length:
        return None
    area = ConvexHull(moved / length).volume
    return float(f"{length * (area / len(positions)) ** 0.5:.2g}")


def resampled(points: FloatArray, pitch: float) -> tuple[FloatArray, str]:
    """Interpolate linearly on the Delaunay triangles of the points.

    The error is found by leave-out cross-validation: a tenth of the points, drawn from a fixed
    seed, is interpolated from the others, which lie farther apart: it is on the safe side.

    Args:
        points: x, y, z [m], shape (n, 3); those without a height are left out.
        pitch: of the grid [m], which begins at the least x and y.

    Returns:
        Heights [m], shape (ny, nx), NaN outside the convex hull of the points; what was done,
        with its error.

    Raises:
        SurfaceFileError: for points that span no area, are too many, or have one position.
        ParameterError: for a pitch that is much finer than the points.
    """
    points = points[~np.isnan(points[:, 2])]
    if len(points) > _MOST:
        raise SurfaceFileError(f"{len(points)} points; at most {_MOST} are interpolated")
    if len(np.unique(points[:, :2], axis=0)) < len(points):
        raise SurfaceFileError("two points have the same position")
    if fitting_pitch(points[:, :2]) is None:
        raise SurfaceFileError("the points lie on one line: no map goes through them")
    low = points[:, :2].min(axis=0)
    places = (points[:, :2] - low) / pitch
    columns, rows = (int(n) for n in np.minimum(places.max(axis=0) + 1e-9, 2.0**40) + 1)
    if rows * columns > min(MAX_POINTS, _FINEST * len(points)):
        raise ParameterError(
            "resample", f"is too fine for {len(points)} points: {columns} x {rows} of a grid", pitch
        )
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    heights = _linear(places, points[:, 2], (x, y))
    said = (
        f"{len(points)} points interpolated linearly (Delaunay) to {by_text((columns, rows))} of"
        f" pitch {length_text(pitch)}; {_error(places, points[:, 2])}"
    )
    return heights, said


def resampled_line(
    positions: FloatArray, heights: FloatArray, pitch: float
) -> tuple[FloatArray, str]:
    """Interpolate a profile linearly between its points.

    Args:
        positions: [m], shape (n,), increasing.
        heights: [m], shape (n,); points without one are left out.
        pitch: of the profile [m], which begins at the first position.

    Returns:
        Heights [m], shape (m,); what was done, with its error as in :func:`resampled`.

    Raises:
        SurfaceFileError: for fewer than two points with a height.
        ParameterError: for a pitch that is much finer than the points.
    """
    known = ~np.isnan(heights)
    positions, heights = positions[known], heights[known]
    if len(positions) < 2:
        raise SurfaceFileError("a profile needs two points with a height")
    length = float(positions[-1] - positions[0])
    count = int(min(length / pitch + 1e-9, 2.0**40)) + 1
    if count > min(MAX_POINTS, _FINEST * len(positions)):
        raise ParameterError("resample", f"is too fine for {len(positions)} points", pitch)
    along = positions[0] + pitch * np.arange(count)
    missed = np.abs(np.interp(positions[1::2], positions[::2], heights[::2]) - heights[1::2])
    rms = length_text(_rms(missed))
    said = (
        f"{len(positions)} points interpolated linearly to {count} of pitch {length_text(pitch)};"
        f" from every other point the rest are missed by {rms} rms"
    )
    return np.interp(along, positions, heights), said


def _linear(places: FloatArray, heights: FloatArray, at: tuple[FloatArray, ...]) -> FloatArray:
    from scipy.interpolate import LinearNDInterpolator

    return np.asarray(LinearNDInterpolator(places, heights)(*at), dtype=np.float64)


def _error(places: FloatArray, heights: FloatArray) -> str:
    """Return the error of the interpolation at points that were left out, in words."""
    from scipy.spatial import QhullError

    left = np.zeros(len(places), dtype=bool)
    order = np.random.default_rng(0).permutation(len(places))
    left[order[: max(1, len(places) // _LEFT_OUT)]] = True
    try:
        found = _linear(places[~left], heights[~left], (places[left],))
    except (QhullError, ValueError):
        found = np.full(int(left.sum()), np.nan)
    missed = np.abs(found - heights[left])
    missed = missed[~np.isnan(missed)]
    if not len(missed):
        return "too few points to know its error"
    rms = _rms(missed)
    return (
        f"{len(missed)} points that were left out are missed by {length_text(rms)} rms,"
        f" {length_text(float(missed.max()))} at most"
    )


def _rms(values: FloatArray) -> float:
    """Return the root mean square without a square, which of 1e308 would be infinite."""
    return math.hypot(*values) / math.sqrt(len(values))
