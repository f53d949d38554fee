"""Make a surface repeat: blend its opposite borders over a band."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.length_words import by_text, length_text, lengths_text, positive_number

Values = TypeVar("Values", bound=NDArray[Any])

DEFAULT_SHARE = 0.1
"""Width of the band as a share of each side where none is given."""

_LEAST = 4  # samples in the band, and in what is left of the surface


@dataclass(frozen=True)
class Seam:
    """What blending has changed.

    Attributes:
        rms: root mean square of the height change over the blended bands [m]. A blended point is
            compared with the border, of the two, that it mostly consists of.
        slope: largest change of the slope across the seam between neighbouring points.
        jump: largest jump that repeating the surface as it was would have had [m].
    """

    rms: float
    slope: float
    jump: float


def check_width(
    shape: tuple[int, ...], pitch: tuple[float, ...], width: float | None
) -> tuple[int, ...]:
    """Return the width of the band in samples, (nx,) or (nx, ny).

    Raises:
        ParameterError: for a width that is not positive, below four samples, or above half of
            the shorter side.
    """
    counts = shape[::-1]
    if width is None:
        samples = [max(_LEAST, round(DEFAULT_SHARE * n)) for n in counts]
        if any(2 * w > n for w, n in zip(samples, counts, strict=True)):
            raise ParameterError(
                "periodic", f"needs at least {2 * _LEAST} points along each side to blend", counts
            )
        return tuple(samples)
    positive_number("blend", width)
    if width < (_LEAST - 0.5) * max(pitch):
        least = length_text(_LEAST * max(pitch))
        raise ParameterError("blend", f"must be at least {_LEAST} samples, {least} [m]", width)
    samples = [round(min(width / p, n)) for p, n in zip(pitch, counts, strict=True)]
    if any(2 * w > n for w, n in zip(samples, counts, strict=True)):
        most = min(n // 2 * p for p, n in zip(pitch, counts, strict=True))
        raise ParameterError(
            "blend", f"must be at most half of the shorter side, {length_text(most)} [m]", width
        )
    return tuple(samples)


def blend_borders(
    heights: FloatArray, samples: tuple[int, ...], pitch: tuple[float, ...]
) -> tuple[FloatArray, Seam]:
    """Return a surface that repeats, shorter by the band along each axis.

    Along an axis of n points and a band of w, the points i < w become
    t_i h_i + (1 - t_i) h_(n-w+i) and the last w points go: where the surface repeats it runs on
    into its own end, and returns to its beginning over the band. The weight
    t = 10 s³ - 15 s⁴ + 6 s⁵, s = (i + 1)/(w + 1), has no jump in slope or curvature. The result
    stays between the heights that it blends.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        samples: w along x, or along x and y.
        pitch: (px, py) or (px,) [m].

    Returns:
        The heights [m] and what the blending has changed.

    Example:
        >>> ramp, seam = blend_borders(np.arange(12.0), (4,), (1.0,))
        >>> ramp.round(2)
        array([7.54, 6.46, 4.54, 3.46, 4.  , 5.  , 6.  , 7.  ])
        >>> seam.jump
        11.0
    """
    squares, count, slope, jump = 0.0, 0, 0.0, 0.0
    for axis, band, step in zip(range(heights.ndim - 1, -1, -1), samples, pitch, strict=True):
        jump = max(jump, float(np.abs(_along(heights, axis)[0] - _along(heights, axis)[-1]).max()))
        heights, change, turn = _blend(heights, band, axis)
        squares += float(np.vdot(change, change))
        count += change.size
        slope = max(slope, turn / step)
    return heights, Seam(math.sqrt(squares / count), slope, jump)


def make_periodic(
    heights: FloatArray,
    filled: NDArray[np.bool_],
    pitch: tuple[float, ...],
    width: float | None,
) -> tuple[FloatArray, NDArray[np.bool_], str]:
    """Blend the borders of a surface and of its mask, and say what was done.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        filled: where heights were interpolated, same shape.
        pitch: (px, py) or (px,) [m].
        width: of the band [m]; None for a tenth of each side.

    Returns:
        Heights [m], mask and a sentence.

    Raises:
        ParameterError: see :func:`check_width`.
    """
    samples = check_width(heights.shape, pitch, width)
    periodic, seam = blend_borders(heights, samples, pitch)
    for axis, band in zip(range(heights.ndim - 1, -1, -1), samples, strict=True):
        every = _along(filled, axis)
        mask = every[:-band].copy()
        mask[:band] |= every[-band:]
        filled = _along(mask, axis)
    widths = lengths_text([w * p for w, p in zip(samples, pitch, strict=True)])
    chosen = " (a tenth of each side)" if width is None else ""
    sentence = (
        f"made periodic: opposite borders blended over {widths}{chosen}, which leaves"
        f" {by_text(periodic.shape[::-1])} points; a jump of up to {length_text(seam.jump)}"
        f" removed; in the blended bands heights changed by {length_text(seam.rms)} RMS,"
        f" slopes across the seam by at most {seam.slope:.2g}"
    )
    return periodic, filled, sentence


def _along(values: Values, axis: int) -> Values:
    """Return a view whose first axis is the given one; of one or two axes, it is its inverse."""
    return values if axis == 0 else values.T


def _blend(heights: FloatArray, band: int, axis: int) -> tuple[FloatArray, FloatArray, float]:
    """Blend along one axis; return also the height changes and the largest change of a step."""
    every = _along(heights, axis)
    starts, ends = every[:band], every[-band:]
    weight = _weights(band).reshape(-1, *(1,) * (heights.ndim - 1))
    result = np.array(every[:-band])
    result[:band] = weight * starts + (1.0 - weight) * ends
    from_end, from_start = result[:band] - ends, result[:band] - starts
    half = band // 2  # the points before consist mostly of the end
    change = np.concatenate([from_end[:half], from_start[half:]])
    # Both sides of the seam, unchanged beyond, and the step in the middle seen from either piece.
    low = np.diff(from_end[: half + 1], axis=0, prepend=0.0 * from_end[:1])
    high = np.diff(from_start[half:], axis=0, append=0.0 * from_start[:1])
    turn = max(float(np.abs(low).max()), float(np.abs(high).max()))
    return np.ascontiguousarray(_along(result, axis)), change, turn


def _weights(band: int) -> FloatArray:
    s = np.arange(1, band + 1) / (band + 1.0)
    return np.asarray(s**3 * (10.0 - 15.0 * s + 6.0 * s**2))
