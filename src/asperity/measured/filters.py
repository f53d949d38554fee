"""Gaussian S- and L-filters of ISO 16610-21 (profiles) and -61 (maps), exact and in blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch, Shape, format_length

ALPHA = math.sqrt(math.log(2.0) / math.pi)
"""Constant of ISO 16610-21 and -61 for a transmission of 50 % at the cut-off."""

DEFAULT_SAMPLES = 4
"""Default cut-off wavelength in samples."""

_BLOCK = 2**22  # points transformed at once: fast, and small compared with a large map


def gaussian_filter(
    heights: FloatArray, pitch: Pitch, cutoff: float, *, periodic: bool = False
) -> FloatArray:
    """Return the heights after the Gaussian low-pass of ISO 16610-21 (profile) and -61 (map).

    The transmission at wavelength l is exp(-pi (ALPHA cutoff / l)^2), one half at the cut-off. The
    map is mirrored at its border nodes, as the type-1 cosine transform assumes, so that the
    transmission is exact for every cut-off, unlike that of a sampled and truncated weighting
    function.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite, at least two points along each axis.
        pitch: (px, py) or (px,) [m].
        cutoff: cut-off wavelength [m].
        periodic: whether the surface repeats after n times the pitch instead of being mirrored.

    Returns:
        The filtered heights [m], same shape.

    Reference:
        ISO 16610-21 and ISO 16610-61, transmission characteristic of the Gaussian filter.

    Example:
        >>> wave = np.cos(np.pi * np.arange(17) / 4)  # 8 samples a period
        >>> bool(np.allclose(gaussian_filter(wave, (1.0,), 8.0), wave / 2))
        True
    """
    smooth = np.array(heights, dtype=np.float64)
    lowpass_in_place(smooth, pitch, cutoff, periodic=periodic)
    return smooth


def lowpass_in_place(
    heights: FloatArray, pitch: Pitch, cutoff: float, *, periodic: bool = False
) -> None:
    """Filter heights in place; see :func:`gaussian_filter`.

    The Gaussian is separable: each axis is transformed separately and in blocks, so that a large
    map needs no second copy.
    """
    from scipy.fft import dct, idct, irfft, rfft, rfftfreq

    for axis, step in zip(range(heights.ndim - 1, -1, -1), pitch, strict=True):
        n = heights.shape[axis]
        frequency = rfftfreq(n, step) if periodic else np.arange(n) / (2.0 * (n - 1) * step)
        transmission = np.exp(-np.pi * (ALPHA * cutoff * frequency) ** 2)
        other = tuple(k for k in range(heights.ndim) if k != axis)
        response = np.expand_dims(transmission, other)
        for block in _blocks(heights, axis):
            spectrum = rfft(block, axis=axis) if periodic else dct(block, type=1, axis=axis)
            spectrum *= response
            if periodic:
                block[...] = irfft(spectrum, n, axis=axis)
            else:
                block[...] = idct(spectrum, type=1, axis=axis, overwrite_x=True)


def highpass_in_place(heights: FloatArray, pitch: Pitch, cutoff: float) -> None:
    """Apply the complementary high-pass of :func:`gaussian_filter` in place.

    The transmission at wavelength l is 1 - exp(-pi (ALPHA cutoff / l)^2).
    """
    heights -= gaussian_filter(heights, pitch, cutoff)


@dataclass(frozen=True)
class Cutoffs:
    """Cut-off wavelengths [m] of the S-filter and, unless None, of the L-filter.

    ``note`` explains a default of the first.
    """

    short: float
    long: float | None
    note: str


def find_cutoffs(
    shape: Shape, pitch: Pitch, cutoff: float | None, l_cutoff: float | None
) -> Cutoffs:
    """Return the cut-offs for a surface.

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        cutoff: cut-off of the S-filter [m]; None for four times the larger pitch.
        l_cutoff: cut-off of the L-filter [m]; None for no L-filter.

    Raises:
        ParameterError: a cut-off conflicts with the sampling, the extent or the other cut-off.
    """
    longest = max((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    short, note = _s_cutoff(max(pitch), longest, cutoff)
    if l_cutoff is None:
        return Cutoffs(short, None, note)
    long = check_positive("l_cutoff", l_cutoff, "m")
    if long <= short:
        limit = f"must be longer than cutoff, {format_length(short)} [m]"
        raise ParameterError("l_cutoff", limit, l_cutoff)
    _check_at_most("l_cutoff", long, longest)
    return Cutoffs(short, long, note)


def apply_filters(
    heights: FloatArray, pitch: Pitch, cutoffs: Cutoffs, record: Callable[..., None]
) -> list[str]:
    """Apply the S-filter, then the L-filter, in place.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite; changed in place.
        pitch: (px, py) or (px,) [m].
        cutoffs: result of :func:`find_cutoffs`.
        record: called after each filter, see :class:`asperity.measured.prepared.StageRecorder`.

    Returns:
        One sentence for each filter.
    """
    part = "21" if heights.ndim == 1 else "61"
    short = format_length(cutoffs.short)
    steps = [f"filtered: Gaussian ISO 16610-{part}, cut-off {short}{cutoffs.note}"]
    lowpass_in_place(heights, pitch, cutoffs.short)
    record(f"S-filter {short}", heights, pitch, removes=True)
    if cutoffs.long is not None:
        highpass_in_place(heights, pitch, cutoffs.long)
        long = format_length(cutoffs.long)
        record(f"L-filter {long}", heights, pitch, removes=True, nesting=cutoffs.long)
        steps.append(f"waviness removed: Gaussian L-filter ISO 16610-{part}, cut-off {long}")
    return steps


def _blocks(heights: FloatArray, axis: int) -> Iterator[FloatArray]:
    """Yield views of whole lines along the axis."""
    if heights.ndim == 1:
        yield heights
        return
    across = 1 - axis
    count = max(1, _BLOCK // heights.shape[axis])
    for first in range(0, heights.shape[across], count):
        part = slice(first, first + count)
        yield heights[part] if across == 0 else heights[:, part]


def _s_cutoff(max_pitch: float, max_length: float, cutoff: float | None) -> tuple[float, str]:
    if cutoff is None:
        length = min(DEFAULT_SAMPLES * max_pitch, max_length)
        return length, f" (chosen from the sampling: {length / max_pitch:g} samples)"
    length = check_positive("cutoff", cutoff, "m")
    # The tolerance admits a limit that the user computed in rounded decimals.
    if length < 2.0 * max_pitch * (1 - 5e-7):
        limit = f"must be at least two samples, {format_length(2 * max_pitch)} [m]"
        raise ParameterError("cutoff", limit, length)
    _check_at_most("cutoff", length, max_length)
    return length, ""


def _check_at_most(name: str, length: float, max_length: float) -> None:
    if length > max_length * (1 + 5e-7):
        limit = f"must be at most the surface's length, {format_length(max_length)} [m]"
        raise ParameterError(name, limit, length)
