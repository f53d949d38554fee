"""ISO 16610 filters, exact: Gaussian S- and L-filters, and dilation by a ball."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured.lengths import Pitch, Shape, format_length, side_lengths

ALPHA = math.sqrt(math.log(2.0) / math.pi)
"""Constant of ISO 16610-21 and -61 for a transmission of 50 % at the cut-off."""

SECTION_COUNT = 5
"""Section lengths, each as long as the cut-off of the L-filter, of a profile (ISO 21920-3)."""

DEFAULT_SAMPLES = 4
"""Default cut-off wavelength in samples."""


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
    from scipy.fft import dct, idct, irfft, rfft, rfftfreq

    smooth = np.array(heights, dtype=np.float64)
    # The Gaussian is separable: each axis is transformed separately.
    for axis, step in zip(range(smooth.ndim - 1, -1, -1), pitch, strict=True):
        n = smooth.shape[axis]
        frequency = rfftfreq(n, step) if periodic else np.arange(n) / (2.0 * (n - 1) * step)
        transmission = np.exp(-np.pi * (ALPHA * cutoff * frequency) ** 2)
        response = transmission[:, None] if axis < smooth.ndim - 1 else transmission
        if periodic:
            smooth[...] = irfft(response * rfft(smooth, axis=axis), n, axis=axis)
        else:
            smooth[...] = idct(response * dct(smooth, 1, axis=axis), 1, axis=axis)
    return smooth


@dataclass(frozen=True)
class Cutoffs:
    """Cut-off wavelengths [m] of the S-filter and, unless None, of the L-filter.

    ``note`` explains a default of the first.
    """

    short: float
    long: float | None
    note: str


def find_cutoffs(
    shape: Shape, pitch: Pitch, s_cutoff: float | None, l_cutoff: float | None
) -> Cutoffs:
    """Return the cut-offs for a surface.

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        s_cutoff: cut-off of the S-filter [m]; None for four times the larger pitch.
        l_cutoff: cut-off of the L-filter [m]; None for no L-filter.

    Raises:
        ParameterError: a cut-off conflicts with the sampling, the extent or the other cut-off.
    """
    longest = max(side_lengths(shape, pitch))
    short, note = _s_cutoff(max(pitch), longest, s_cutoff)
    if l_cutoff is None:
        return Cutoffs(short, None, note)
    long = check_positive("l_cutoff", l_cutoff, "m")
    if long <= short:
        raise ParameterError(
            "l_cutoff", f"must be longer than s_cutoff, {format_length(short)} [m]", l_cutoff
        )
    _check_at_most("l_cutoff", long, longest)
    return Cutoffs(short, long, note)


def apply_filters(
    heights: FloatArray,
    pitch: Pitch,
    cutoffs: Cutoffs,
    record: Callable[..., None],
    *,
    periodic: bool = False,
) -> list[str]:
    """Apply the S-filter, then the L-filter, in place.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite; changed in place.
        pitch: (px, py) or (px,) [m].
        cutoffs: result of :func:`find_cutoffs`.
        record: called after each filter, see :class:`asperity.measured.prepared.StageRecorder`.
        periodic: whether the surface repeats after n times the pitch instead of being mirrored.

    Returns:
        One sentence for each filter.
    """
    part = "21" if heights.ndim == 1 else "61"
    short = format_length(cutoffs.short)
    steps = [f"filtered: Gaussian ISO 16610-{part}, cut-off {short}{cutoffs.note}"]
    heights[...] = gaussian_filter(heights, pitch, cutoffs.short, periodic=periodic)
    record(f"S-filter {short}", heights, pitch, removes=True)
    if cutoffs.long is not None:
        heights -= gaussian_filter(heights, pitch, cutoffs.long, periodic=periodic)
        long = format_length(cutoffs.long)
        record(f"L-filter {long}", heights, pitch, removes=True, nesting=cutoffs.long)
        steps.append(f"waviness removed: Gaussian L-filter ISO 16610-{part}, cut-off {long}")
        steps.append(short_trace_text(heights.shape, pitch, cutoffs.long))
    return [step for step in steps if step]


def short_trace_text(shape: Shape, pitch: Pitch, l_cutoff: float) -> str:
    """Return how a surface is too short for the cut-off of its L-filter; empty if it is not.

    A profile is evaluated over five section lengths, each as long as the cut-off (ISO 21920-3). The
    evaluation area of a map is at least as wide as the nesting index (ISO 25178-3).

    Args:
        shape: (ny, nx) or (n,).
        pitch: (px, py) or (px,) [m].
        l_cutoff: cut-off of the L-filter [m].

    Example:
        >>> short_trace_text((3001,), (1e-6,), 0.8e-3)
        'too short for this L-filter: 3 mm are 3.75 section lengths of 800 µm, ISO 21920-3 takes 5'
        >>> short_trace_text((5001,), (1e-6,), 0.8e-3)
        ''
    """
    shortest = min(side_lengths(shape, pitch))
    sections = required_sections(shape)
    if shortest * (1 + 1e-9) >= sections * l_cutoff:
        return ""
    side = format_length(shortest)
    length = format_length(l_cutoff)
    if len(shape) > 1:
        return f"too small for this L-filter: {side} wide, ISO 25178-3 takes at least {length}"
    extent = f"{side} are {shortest / l_cutoff:.3g} section lengths of {length}"
    return f"too short for this L-filter: {extent}, ISO 21920-3 takes {SECTION_COUNT}"


def required_sections(shape: Shape) -> int:
    """Return how many nesting indices long a profile, or how wide a map, is at least."""
    return SECTION_COUNT if len(shape) == 1 else 1


def _s_cutoff(max_pitch: float, max_length: float, s_cutoff: float | None) -> tuple[float, str]:
    if s_cutoff is None:
        length = min(DEFAULT_SAMPLES * max_pitch, max_length)
        return length, f" (chosen from the sampling: {length / max_pitch:g} samples)"
    length = check_positive("s_cutoff", s_cutoff, "m")
    # The tolerance admits a limit that the user computed in rounded decimals.
    if length < 2.0 * max_pitch * (1 - 5e-7):
        raise ParameterError(
            "s_cutoff", f"must be at least two samples, {format_length(2 * max_pitch)} [m]", length
        )
    _check_at_most("s_cutoff", length, max_length)
    return length, ""


def _check_at_most(name: str, length: float, max_length: float) -> None:
    if length > max_length * (1 + 5e-7):
        raise ParameterError(
            name, f"must be at most the surface's length, {format_length(max_length)} [m]", length
        )


_MAX_COMPARISONS = 5e10  # about a minute at 1 to 3 ns each


def dilate(
    heights: FloatArray, pitch: Pitch, radius: float, *, periodic: bool = False
) -> FloatArray:
    """Return the path of the lowest point of a ball that slides over the surface.

    d(x) = max over |u| < R of h(x + u) + √(R² - |u|²) - R, over the nodes: the locus of the ball's
    centre, lowered by its radius, as recorded by a stylus instrument and felt with a probe of that
    radius. The radius of a crest grows by R; a groove that the ball cannot enter becomes a crease.
    The surface is mirrored at its border nodes, or repeats.

    Offsets at which the ball has risen by more than the height range of the neighbourhood cannot
    attain the maximum and are omitted: the work depends on √(2 R · range) rather than on R.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        radius: R [m].
        periodic: whether the surface repeats: the last node is followed by the first.

    Returns:
        The dilated heights [m], same shape; nowhere below the surface.

    Raises:
        ParameterError: the radius is not positive, or needs too much work.

    Reference:
        ISO 16610-41, dilation by a disk; for a map the same with a ball.

    Example:
        >>> spike = np.array([0.0, 0, 0, 0, 1, 0, 0, 0, 0])
        >>> dilate(spike, (1.0,), 2.0).round(3)
        array([0.   , 0.   , 0.   , 0.732, 1.   , 0.732, 0.   , 0.   , 0.   ])
    """
    from scipy.ndimage import grey_dilation

    check_positive("tip_radius", radius, "m")
    span = float(heights.max()) - float(heights.min())
    # Of a surface that repeats the nearest repetition of a point is the one that is touched.
    farthest = [count // 2 if periodic else count - 1 for count in heights.shape]
    rises, is_compared = _ball(farthest, pitch, radius, span)
    count = int(is_compared.sum())
    if count * heights.size > _MAX_COMPARISONS:
        raise ParameterError(
            "tip_radius",
            f"needs {count} comparisons at each of {heights.size} points, too many to wait"
            " for; crop the map or take every second point",
            radius,
        )
    ball: Any = -rises  # typed as if it had to be whole numbers
    mode: Literal["wrap", "mirror"] = "wrap" if periodic else "mirror"
    try:
        felt = grey_dilation(heights, footprint=is_compared, structure=ball, mode=mode)
    except MemoryError:  # its offsets at a border are the square of the compared points
        raise ParameterError(
            "tip_radius",
            f"is {count} points wide, more than fit into memory; give a coarser map",
            radius,
        ) from None
    return np.asarray(felt)


def check_tip_radius(shape: Shape, pitch: Pitch, radius: float) -> None:
    """Refuse a tip that is larger than the surface.

    Raises:
        ParameterError: the radius is not positive, or exceeds the shorter side.
    """
    check_positive("tip_radius", radius, "m")
    extent = min(side_lengths(shape, pitch))
    if radius > extent * (1 + 5e-7):
        raise ParameterError(
            "tip_radius",
            f"must be at most the surface's shorter side, {format_length(extent)} [m]",
            radius,
        )


def apply_tip(
    heights: FloatArray, pitch: Pitch, radius: float, *, periodic: bool = False
) -> tuple[FloatArray, str]:
    """Return the heights felt with a tip of that radius, and a sentence about the change.

    Raises:
        ParameterError: :func:`check_tip_radius` refuses the radius, or it needs too much work.
    """
    if not periodic:
        check_tip_radius(heights.shape, pitch, radius)
    felt = dilate(heights, pitch, radius, periodic=periodic)
    change = felt - heights
    raised = float((change > 0).mean())
    body = "disk" if heights.ndim == 1 else "ball"
    sentence = (
        f"felt with a tip of radius {format_length(radius)}: dilation by a {body} (as in ISO"
        f" 16610-41) lowered by the radius, heights raised at {raised:.3g} of the points, by"
        f" {format_length(float(np.sqrt(np.mean(change**2))))} RMS and at most"
        f" {format_length(float(change.max()))}"
    )
    return felt, sentence


def _ball(
    farthest: Sequence[int], pitch: Pitch, radius: float, span: float
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return how far a ball rises [m] around its lowest point, and where that is compared."""
    # Where the ball has risen by more than the height range, the point below its centre is higher.
    reach = math.sqrt(max(span * (2.0 * radius - span), 0.0)) if span < radius else radius
    limits = [math.floor(reach / p * (1 + 1e-12)) for p in pitch[::-1]]
    counts = np.minimum(limits, farthest)
    sides = [p * np.arange(-n, n + 1) for n, p in zip(counts, pitch[::-1], strict=True)]
    squares = np.sum(np.square(np.meshgrid(*sides, indexing="ij")), axis=0)
    # R - √(R² - u²), without cancellation for large balls.
    rises = squares / (radius + np.sqrt(np.maximum(radius**2 - squares, 0.0)))
    return rises, squares <= reach**2 * (1 + 1e-12)
