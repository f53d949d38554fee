"""Make a surface periodic by blending its opposite borders over a band."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch, Shape, format_counts, format_length, format_lengths

ArrayT = TypeVar("ArrayT", bound=NDArray[Any])

DEFAULT_FRACTION = 0.1
"""Default width of the band, as a fraction of each side."""

_MIN_SAMPLES = 4  # in the band, and in the rest of the surface


def to_blend_samples(shape: Shape, pitch: Pitch, width: float | None) -> tuple[int, ...]:
    """Return the width of the band in samples, (nx,) or (nx, ny).

    Raises:
        ParameterError: the width is not positive, below four samples, or above half of the
            shorter side.
    """
    counts = shape[::-1]
    if width is None:
        samples = [max(_MIN_SAMPLES, round(DEFAULT_FRACTION * n)) for n in counts]
        if any(2 * w > n for w, n in zip(samples, counts, strict=True)):
            least = f"needs at least {2 * _MIN_SAMPLES} points along each side to blend"
            raise ParameterError("periodic", least, counts)
        return tuple(samples)
    check_positive("blend", width, "m")
    if width < (_MIN_SAMPLES - 0.5) * max(pitch):
        least = f"{_MIN_SAMPLES} samples, {format_length(_MIN_SAMPLES * max(pitch))} [m]"
        raise ParameterError("blend", f"must be at least {least}", width)
    samples = [round(min(width / p, n)) for p, n in zip(pitch, counts, strict=True)]
    if any(2 * w > n for w, n in zip(samples, counts, strict=True)):
        most = format_length(min(n // 2 * p for p, n in zip(pitch, counts, strict=True)))
        raise ParameterError("blend", f"must be at most half the shorter side, {most} [m]", width)
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
        lines = _move_axis_first(heights, axis)
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
        every = _move_axis_first(filled_mask, axis)
        mask = every[:-band].copy()
        mask[:band] |= every[-band:]
        filled_mask = _move_axis_first(mask, axis)
    widths = format_lengths([w * p for w, p in zip(samples, pitch, strict=True)])
    chosen = " (a tenth of each side)" if width is None else ""
    sentence = (
        f"made periodic: opposite borders blended over {widths}{chosen}, which leaves"
        f" {format_counts(periodic.shape[::-1])} points; a jump of up to {format_length(jump)}"
        " removed"
    )
    return periodic, filled_mask, sentence


def _move_axis_first(values: ArrayT, axis: int) -> ArrayT:
    """Return a view with the given axis first; for one or two axes it is its own inverse."""
    return values if axis == 0 else values.T


def _blend_axis(heights: FloatArray, band: int, axis: int) -> FloatArray:
    every = _move_axis_first(heights, axis)
    s = np.arange(1, band + 1) / (band + 1.0)
    weight = (s**3 * (10.0 - 15.0 * s + 6.0 * s**2)).reshape(-1, *(1,) * (heights.ndim - 1))
    result = np.array(every[:-band])
    result[:band] = weight * every[:band] + (1.0 - weight) * every[-band:]
    return np.ascontiguousarray(_move_axis_first(result, axis))
