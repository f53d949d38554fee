"""Is a list of positions a uniform grid, rounded to the digits that were printed?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# A thousandth of a step does no harm to a texture and covers positions stored in float32.
_SLACK = 1e-3
# Where most steps are one printed digit, a lost sample cannot be told from rounding.
_COARSE = 0.9


@dataclass(frozen=True)
class Spacing:
    """Step of a list of positions, and how far it is from uniform.

    Attributes:
        step: (last - first) / (n - 1), in the unit of the positions.
        deviation: largest distance from the uniform grid through first and last.
        index: position that has this deviation.
        uniform: True where rounding explains every deviation.
    """

    step: float
    deviation: float
    index: int
    uniform: bool


def spacing(positions: NDArray[np.float64], resolution: NDArray[np.float64] | float) -> Spacing:
    """Compare increasing positions with a uniform grid a + p i.

    The positions are uniform if some a and p put every a + p i within half a resolution
    of the printed position. The width that is missing is convex in p, so a ternary search
    finds the best p.

    Args:
        positions: strictly increasing, shape (n,), n at least 2.
        resolution: value of the last printed digit, one for all or shape (n,).

    Returns:
        The step, the largest deviation and the verdict.

    Example:
        >>> spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.6]), 0.1).uniform
        True
        >>> spacing(np.array([0.0, 0.2, 0.3, 0.5, 0.9]), 0.1).uniform
        False
    """
    n = len(positions)
    index = np.arange(n, dtype=np.float64)
    step = float(positions[-1] - positions[0]) / (n - 1)
    offset = positions - (positions[0] + step * index)
    worst = int(np.argmax(np.abs(offset)))
    half = np.broadcast_to(np.asarray(resolution, dtype=np.float64) / 2, (n,))
    if float(half.max()) * 2 > _COARSE * float(np.median(np.diff(positions))):
        half = np.zeros(n)
    half = np.maximum(half, _SLACK * step)
    uniform = _excess(offset, index, half) <= _SLACK * step
    return Spacing(step, float(abs(offset[worst])), worst, uniform)


def _excess(
    offset: NDArray[np.float64], index: NDArray[np.float64], half: NDArray[np.float64]
) -> float:
    """Least width, over all slopes, by which the offsets exceed their half resolutions."""

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
