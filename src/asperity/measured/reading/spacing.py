"""Uniformity of printed positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray

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


INTERPOLATE = "interpolate them to a grid first, such as with scipy.interpolate.griddata"
"""Advice for points that are on no grid."""
