"""Heights that are rather in another unit: whoever knows the surface is asked, not guessed for."""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.length_words import length_text, lengths_text
from asperity.measured.reading.raw import RawSurface

STEEPEST = 10.0
"""Mean slope between neighbouring points from which on a surface is asked about: flanks of 84°.

A stylus follows flanks of 60° at most (cones of ISO 3274), a microscope of 72° (aperture 0.95),
slopes of 1.7 and 3.1; 30 real surfaces of all kinds that were tried have mean slopes up to 0.4. A
wrong unit changes the slope a thousandfold.
"""

_LONGEST = 10.0  # [m]; heights beyond are rather heights whose unit is not the metre
_MOST_LINES = 1024  # that are looked at along each axis
_UNITS = {"mm": 1e-3, "um": 1e-6, "nm": 1e-9}


def check_heights(raw: RawSurface, heights: FloatArray, pitch: tuple[float, ...]) -> None:
    """Refuse heights that are no lengths, or hardly those that they seem to be.

    Args:
        raw: the surface as it was read.
        heights: its heights [m], without outliers.
        pitch: distance of the points [m].

    Raises:
        ParameterError: for what only the user can say, with how to say it.
    """
    if raw.relative:
        raise ParameterError(
            "height_range",
            f"is required: the values of {raw.source} have no unit; give the peak-to-valley"
            " height [m]",
        )
    span = float(np.nanmax(heights)) - float(np.nanmin(heights))
    slope = mean_slope(heights, pitch)
    if slope > STEEPEST:
        raise ParameterError(
            "height_range",
            f"must be given: heights that span {length_text(span)} at a pitch of"
            f" {lengths_text(pitch)} have a mean slope of {slope:.3g}, and no instrument measures"
            f" {STEEPEST:g}; {_ways_out(raw, span, slope)}",
        )
    if span > _LONGEST and not raw.has_units:
        raise ParameterError(
            "height_range",
            f"must be given: heights that span {length_text(span)} look not to be in metres, and"
            f" {raw.source} names no unit; {_ways_out(raw, span, slope)}",
        )


def _ways_out(raw: RawSurface, span: float, slope: float) -> str:
    """Return what to say where the unit is another, and where all is as it seems."""
    unit = next((u for u, factor in _UNITS.items() if slope * factor <= 1.0), "nm")
    other = f"unit='{unit}' (--unit {unit})"
    if raw.has_units:  # the file's own: what can be said is how high it is
        other = f"height_range={span * _UNITS[unit]:.6g} (--height-range {span:.6g}{unit})"
    so = f"height_range={span:.6g} (--height-range {span:.6g}m)"
    return f"if they are in {unit}: {other}; if it is so: {so}; spikes go with --outliers 6"


def mean_slope(heights: FloatArray, pitch: tuple[float, ...]) -> float:
    """Return the mean slope |Δh| / pitch between neighbouring points, of the steeper axis.

    Args:
        heights: shape (ny, nx) or (n,) [m]; NaN is a missing point.
        pitch: (px, py) or (p,) [m].

    Example:
        >>> mean_slope(np.array([[0.0, 1.0, 0.0], [0.0, 1.0, np.nan]]), (0.5, 1.0))
        2.0
    """
    slopes = [0.0]
    for axis, step in enumerate(pitch):
        lines = np.moveaxis(heights, heights.ndim - 1 - axis, -1)
        if lines.ndim > 1:
            lines = lines[:: -(-len(lines) // _MOST_LINES)]
        with np.errstate(over="ignore"):  # heights near the largest float
            rises = np.abs(np.diff(lines, axis=-1))
            rises = rises[~np.isnan(rises)]
            slopes.append(float(rises.mean()) / step if rises.size else 0.0)
    return max(slopes)
