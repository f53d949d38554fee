"""Gaussian S- and L-filters of ISO 16610-21 (profiles) and -61 (maps), exact and in blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.length_words import length_text, positive_number

ALPHA = math.sqrt(math.log(2.0) / math.pi)
"""Constant of ISO 16610-21 and -61, which puts 50 % transmission at the cut-off."""

DEFAULT_SAMPLES = 4
"""Cut-off wavelength in samples where none is given."""

# Points that are transformed at once: large enough for speed, small against a large map.
_BLOCK = 2**22


def gaussian_filter(
    heights: FloatArray, pitch: tuple[float, ...], cutoff: float, *, periodic: bool = False
) -> FloatArray:
    """Gaussian low-pass of ISO 16610-21 (profile) and -61 (map) with a mirrored border.

    A wave of wavelength l keeps the fraction exp(-pi (ALPHA cutoff / l)^2) of its
    amplitude: one half at the cut-off. The map is mirrored at its border nodes, which is
    what the type-1 cosine transform assumes, so the transmission is exact for every
    cut-off; a sampled and truncated weighting function would only come close.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite, at least two points along each axis.
        pitch: (px, py) or (px,) [m].
        cutoff: cut-off wavelength [m].
        periodic: whether the surface repeats after n times the pitch and is not mirrored.

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
    smooth_in_place(smooth, pitch, cutoff, periodic=periodic)
    return smooth


def smooth_in_place(
    heights: FloatArray, pitch: tuple[float, ...], cutoff: float, *, periodic: bool = False
) -> None:
    """Filter heights where they are; see :func:`gaussian_filter`.

    The Gaussian is separable, so that each axis is transformed for itself and in blocks: a map
    of any size costs no second copy.
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


def roughen_in_place(heights: FloatArray, pitch: tuple[float, ...], cutoff: float) -> None:
    """Keep the short waves, the complement of :func:`gaussian_filter`, where the heights are.

    A wave of wavelength l keeps 1 - exp(-pi (ALPHA cutoff / l)^2) of its amplitude.
    """
    heights -= gaussian_filter(heights, pitch, cutoff)


@dataclass(frozen=True)
class Cutoffs:
    """Cut-off wavelengths [m] of the S-filter and, unless None, of the L-filter.

    ``chosen`` says where the first comes from if it was not given.
    """

    short: float
    long: float | None
    chosen: str


def find_cutoffs(
    shape: tuple[int, ...],
    pitch: tuple[float, ...],
    cutoff: float | None,
    l_cutoff: float | None,
) -> Cutoffs:
    """Return the cut-offs for a surface.

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        cutoff: of the S-filter [m]; None for four times the larger pitch.
        l_cutoff: of the L-filter [m]; None for no L-filter.

    Raises:
        ParameterError: for a cut-off that the sampling, the extent or the other does not allow.
    """
    longest = max((n - 1) * p for n, p in zip(shape[::-1], pitch, strict=True))
    short, chosen = _short(max(pitch), longest, cutoff)
    if l_cutoff is None:
        return Cutoffs(short, None, chosen)
    long = positive_number("l_cutoff", l_cutoff)
    if long <= short:
        raise ParameterError(
            "l_cutoff", f"must be longer than cutoff, {length_text(short)} [m]", l_cutoff
        )
    _at_most("l_cutoff", long, longest)
    return Cutoffs(short, long, chosen)


def apply_filters(
    heights: FloatArray,
    pitch: tuple[float, ...],
    cutoffs: Cutoffs,
    record: Callable[..., None] = lambda *_arguments, **_words: None,
) -> list[str]:
    """Apply the S-filter, then the L-filter, where the heights are.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite; replaced.
        pitch: (px, py) or (px,) [m].
        cutoffs: of :func:`find_cutoffs`.
        record: told after each filter, see :class:`asperity.measured.history.Recorder`.

    Returns:
        What was done, one sentence for each filter.
    """
    part = "21" if heights.ndim == 1 else "61"
    short = length_text(cutoffs.short)
    steps = [f"filtered: Gaussian ISO 16610-{part}, cut-off {short}{cutoffs.chosen}"]
    smooth_in_place(heights, pitch, cutoffs.short)
    record(f"S-filter {short}", heights, pitch, removes=True)
    if cutoffs.long is not None:
        roughen_in_place(heights, pitch, cutoffs.long)
        long = length_text(cutoffs.long)
        record(f"L-filter {long}", heights, pitch, removes=True, nesting=cutoffs.long)
        steps.append(f"waviness removed: Gaussian L-filter ISO 16610-{part}, cut-off {long}")
    return steps


def _blocks(heights: FloatArray, axis: int) -> Iterator[FloatArray]:
    """Yield views that hold whole lines along the axis."""
    if heights.ndim == 1:
        yield heights
        return
    across = 1 - axis
    count = max(1, _BLOCK // heights.shape[axis])
    for first in range(0, heights.shape[across], count):
        part = slice(first, first + count)
        yield heights[part] if across == 0 else heights[:, part]


def _short(coarse: float, longest: float, cutoff: float | None) -> tuple[float, str]:
    if cutoff is None:
        length = min(DEFAULT_SAMPLES * coarse, longest)
        return length, f" (chosen from the sampling: {length / coarse:g} samples)"
    length = positive_number("cutoff", cutoff)
    # Half a part in a million: a limit that was computed in decimals must not fail on rounding.
    if length < 2.0 * coarse * (1 - 5e-7):
        raise ParameterError(
            "cutoff", f"must be at least two samples, {length_text(2 * coarse)} [m]", length
        )
    _at_most("cutoff", length, longest)
    return length, ""


def _at_most(name: str, length: float, longest: float) -> None:
    if length > longest * (1 + 5e-7):
        raise ParameterError(
            name, f"must be at most the surface's length, {length_text(longest)} [m]", length
        )
