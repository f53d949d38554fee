"""Prepare a measured surface: read, fill, level, filter, magnify, in this order."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import ParameterError
from .filling import fill_harmonic
from .reading.raw import RawSurface

ALPHA = math.sqrt(math.log(2.0) / math.pi)
"""Constant of ISO 16610-21 and -61, which puts 50 % transmission at the cut-off."""

_LEAST = 4
_MOST_MISSING = 0.25
_LONGEST = 10.0  # [m]; heights beyond are rather heights whose unit is not the metre
_DEFAULT_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class Prepared:
    """A surface that is ready to become a texture.

    Attributes:
        heights: [m], shape (ny, nx) or (n,), finite.
        pitch: (px, py) or (px,) [m].
        steps: what was done, in order, one sentence each with its numbers.
    """

    heights: NDArray[np.float64]
    pitch: tuple[float, ...]
    steps: tuple[str, ...]


def prepare(
    raw: RawSurface,
    *,
    pitch: float | Sequence[float] | None = None,
    height_range: float | None = None,
    cutoff: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> Prepared:
    """Fill, level, filter and magnify a surface as it was read.

    Args:
        raw: the surface as read.
        pitch: distance of neighbouring points [m], one number or (px, py); needed where the
            file has none, replaces the file's where it has one.
        height_range: peak-to-valley height [m] that the measured heights are scaled to.
        cutoff: cut-off wavelength of the Gaussian filter [m], in the surface's own metres
            (before magnification); by default four times the larger pitch.
        magnify: lateral magnification, and of the heights unless magnify_height is given.
        magnify_height: magnification of the heights.

    Returns:
        The prepared surface with what was done to it.

    Raises:
        ParameterError: an argument, or a surface, that cannot be used.

    Reference:
        ISO 16610-21 (profiles) and ISO 16610-61 (maps), Gaussian filters.

    Example:
        >>> x = np.linspace(0.0, 1.0, 33)
        >>> raw = RawSurface(1e-6 * np.cos(8 * np.pi * x) + 3.2e-6 * x, (1e-5,), "wave", ())
        >>> for step in prepare(raw, magnify=20).steps:
        ...     print(step)
        no missing points
        levelled: subtracted the least-squares line, slope 0.01
        filtered: Gaussian ISO 16610-21, cut-off 40 µm (chosen from the sampling: 4 samples)
        magnified 20 times laterally and in height
    """
    steps = list(raw.notes)
    _check_heights(raw.heights)
    lateral = _chosen_pitch(raw, pitch, steps)
    heights = _scaled(raw, height_range, steps)
    level = _trend(heights, lateral)
    filled = _filled(heights, lateral, steps)
    flat = filled - level.surface
    steps.append(level.sentence)
    smooth = _filtered(flat, lateral, cutoff, steps)
    return _magnified(smooth, lateral, magnify, magnify_height, steps)


def gaussian_filter(
    heights: NDArray[np.float64], pitch: tuple[float, ...], cutoff: float
) -> NDArray[np.float64]:
    """Gaussian low-pass of ISO 16610-21 (profile) and -61 (map) with a mirrored border.

    A wave of wavelength l keeps the fraction exp(-pi (ALPHA cutoff / l)^2) of its
    amplitude: one half at the cut-off. The map is mirrored at its border nodes, which is
    what the type-1 cosine transform assumes, so the transmission is exact for every
    cut-off; a sampled and truncated weighting function would only come close.

    Args:
        heights: [m], shape (ny, nx) or (n,), finite, at least two points along each axis.
        pitch: (px, py) or (px,) [m].
        cutoff: cut-off wavelength [m].

    Returns:
        The filtered heights [m], same shape.

    Example:
        >>> wave = np.cos(np.pi * np.arange(17) / 4)  # 8 samples a period
        >>> bool(np.allclose(gaussian_filter(wave, (1.0,), 8.0), wave / 2))
        True
    """
    from scipy.fft import dctn, idctn

    spectrum = dctn(heights, type=1)
    for axis, step in zip(range(heights.ndim - 1, -1, -1), pitch, strict=True):
        n = heights.shape[axis]
        frequency = np.arange(n) / (2.0 * (n - 1) * step)
        transmission = np.exp(-np.pi * (ALPHA * cutoff * frequency) ** 2)
        spectrum *= np.expand_dims(transmission, tuple(k for k in range(heights.ndim) if k != axis))
    return np.asarray(idctn(spectrum, type=1, overwrite_x=True))


def _check_heights(heights: NDArray[np.float64]) -> None:
    shape = heights.shape
    if heights.ndim == 1 and shape[0] < _LEAST:
        raise ParameterError("surface", f"must have at least {_LEAST} points", shape[0])
    if heights.ndim == 2 and min(shape) < _LEAST:
        raise ParameterError(
            "surface", f"is too small: the smallest accepted map is 4 x 4, got {_by(shape)} points"
        )
    if heights.ndim not in (1, 2):
        raise ParameterError("surface", "must be a profile (n,) or a map (ny, nx)", shape)
    if np.isinf(heights).any():
        raise ParameterError("surface", "has infinite heights; a missing point is NaN")
    missing = float(np.isnan(heights).mean())
    if missing == 1.0:
        raise ParameterError("surface", "has no valid point: all heights are missing")
    if missing > _MOST_MISSING:
        raise ParameterError(
            "surface", f"misses {missing:.1%} of its points; at most a quarter can be filled"
        )


def _by(shape: tuple[int, ...]) -> str:
    return " x ".join(str(n) for n in shape)


def _chosen_pitch(
    raw: RawSurface, pitch: float | Sequence[float] | None, steps: list[str]
) -> tuple[float, ...]:
    axes = raw.heights.ndim
    if pitch is None:
        if raw.pitch is None:
            raise ParameterError("pitch", f"must be given [m]: {raw.source} has none")
        return _checked_pitch(raw.pitch, axes)
    given = _checked_pitch(pitch, axes)
    before = "" if raw.pitch is None else f" instead of the file's {_lengths(raw.pitch)}"
    steps.append(f"pitch {_lengths(given)} as given{before}")
    return given


def _checked_pitch(pitch: float | Sequence[float], axes: int) -> tuple[float, ...]:
    values = np.atleast_1d(np.asarray(pitch, dtype=np.float64))
    if values.ndim != 1 or len(values) not in (1, axes):
        wanted = "one number [m]" if axes == 1 else "one number or (px, py) [m]"
        raise ParameterError("pitch", f"must be {wanted}", pitch)
    for value in values:
        _positive("pitch", float(value), " [m]")
    return tuple(float(v) for v in np.broadcast_to(values, (axes,)))


def _positive(name: str, value: float, unit: str = "") -> float:
    if not (math.isfinite(value) and value > 0):
        raise ParameterError(name, f"must be positive and finite{unit}", value)
    return float(value)


def _scaled(raw: RawSurface, height_range: float | None, steps: list[str]) -> NDArray[np.float64]:
    low, high = float(np.nanmin(raw.heights)), float(np.nanmax(raw.heights))
    span = high - low
    if not math.isfinite(span):
        raise ParameterError("surface", "has heights too large for floating-point numbers")
    if height_range is None:
        if span > _LONGEST and not raw.has_units:
            raise ParameterError(
                "height_range",
                f"must be given [m]: heights that span {span:.4g} look not to be in metres,"
                f" and {raw.source} names no unit",
            )
        return raw.heights
    wanted = _positive("height_range", height_range, " [m]")
    if span == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    steps.append(f"heights scaled from {_length(span)} to {_length(wanted)} peak to valley")
    return np.asarray((raw.heights - low) / span * wanted)


@dataclass(frozen=True, eq=False)
class _Trend:
    surface: NDArray[np.float64]
    sentence: str


def _trend(heights: NDArray[np.float64], pitch: tuple[float, ...]) -> _Trend:
    """Fit the least-squares plane, or line, to the valid points."""
    valid = ~np.isnan(heights)
    axes = range(heights.ndim - 1, -1, -1)  # x is the last axis
    centred = []
    for axis in axes:
        n = heights.shape[axis]
        other = tuple(k for k in range(heights.ndim) if k != axis)
        counts = valid.sum(axis=other)
        # Coordinates between -1 and 1 about the valid points' centre: well conditioned.
        u = (np.arange(n) - float(counts @ np.arange(n)) / counts.sum()) * (2.0 / n)
        centred.append(np.expand_dims(u, other))
    mean = float(heights[valid].mean())
    rest = np.where(valid, heights - mean, 0.0)
    normal = np.array([[float(np.sum(a * b * valid)) for b in centred] for a in centred])
    slopes = np.linalg.solve(normal, [float(np.sum(a * rest)) for a in centred])
    surface = np.full(heights.shape, mean)
    for u, slope in zip(centred, slopes, strict=True):
        surface += slope * u
    physical = [
        float(slope) * 2.0 / heights.shape[axis] / step
        for slope, axis, step in zip(slopes, axes, pitch, strict=True)
    ]
    return _Trend(surface, _trend_sentence(physical))


def _trend_sentence(slopes: list[float]) -> str:
    text = " and ".join(f"{slope:.2g}" for slope in slopes)
    kind = "line, slope" if len(slopes) == 1 else "plane, slopes"
    return f"levelled: subtracted the least-squares {kind} {text}"


def _filled(
    heights: NDArray[np.float64], pitch: tuple[float, ...], steps: list[str]
) -> NDArray[np.float64]:
    missing = int(np.isnan(heights).sum())
    if missing == 0:
        steps.append("no missing points")
        return heights
    share = 100.0 * missing / heights.size
    steps.append(
        f"filled {missing} of {heights.size} missing points ({share:.2g} %)"
        " by harmonic interpolation"
    )
    return fill_harmonic(heights, pitch)


def _filtered(
    heights: NDArray[np.float64],
    pitch: tuple[float, ...],
    cutoff: float | None,
    steps: list[str],
) -> NDArray[np.float64]:
    extents = [(n - 1) * p for n, p in zip(heights.shape[::-1], pitch, strict=True)]
    coarse, longest = max(pitch), max(extents)
    if cutoff is None:
        length = min(_DEFAULT_SAMPLES * coarse, longest)
        chosen = f" (chosen from the sampling: {length / coarse:g} samples)"
    else:
        length, chosen = _positive("cutoff", cutoff, " [m]"), ""
    # Half a part in a million: a limit that was computed in decimals must not fail on rounding.
    if length < 2.0 * coarse * (1 - 5e-7):
        raise ParameterError(
            "cutoff", f"must be at least two samples, {_length(2 * coarse)} [m]", length
        )
    if length > longest * (1 + 5e-7):
        raise ParameterError(
            "cutoff", f"must be at most the surface's length, {_length(longest)} [m]", length
        )
    part = "21" if heights.ndim == 1 else "61"
    steps.append(f"filtered: Gaussian ISO 16610-{part}, cut-off {_length(length)}{chosen}")
    return gaussian_filter(heights, pitch, length)


def _magnified(
    heights: NDArray[np.float64],
    pitch: tuple[float, ...],
    magnify: float,
    magnify_height: float | None,
    steps: list[str],
) -> Prepared:
    lateral = _positive("magnify", magnify)
    upward = lateral if magnify_height is None else _positive("magnify_height", magnify_height)
    with np.errstate(over="ignore"):
        larger = heights * upward
    wider = tuple(p * lateral for p in pitch)
    if not (np.isfinite(larger).all() and np.isfinite(wider).all() and min(wider) > 0):
        raise ParameterError("magnify", "makes the surface too large or small to compute", magnify)
    if lateral == upward and lateral != 1.0:
        steps.append(f"magnified {lateral:g} times laterally and in height")
    elif lateral != upward:
        steps.append(f"magnified {lateral:g} times laterally and {upward:g} times in height")
    return Prepared(larger, wider, tuple(steps))


def _lengths(values: tuple[float, ...]) -> str:
    texts = [_length(value) for value in values]
    return texts[0] if len(set(texts)) == 1 else " x ".join(texts)


def _length(value: float) -> str:
    """Return a length with a readable unit: 1.03e-5 becomes "10.3 µm"."""
    for unit, factor in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)):
        if value >= factor:
            return f"{value / factor:.4g} {unit}"
    return f"{value / 1e-9:.4g} nm"
