"""Prepare a measured surface: outliers, fill, form, filter, tip, repeat, magnify, in this order."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from asperity.arguments import described
from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.measured.arguments import PREPARING
from asperity.measured.blending import check_width, make_periodic
from asperity.measured.filling import fill_in_place
from asperity.measured.filters import ALPHA, apply_filters, find_cutoffs, gaussian_filter
from asperity.measured.form import check_degree, fit_form, subtract_form
from asperity.measured.history import Recorder, Watch, resized
from asperity.measured.length_words import by_text, length_text, lengths_text, positive_number
from asperity.measured.outliers import remove_outliers
from asperity.measured.plausible import check_heights
from asperity.measured.prepared import Prepared
from asperity.measured.reading.raw import RawSurface
from asperity.measured.stylus import apply_tip, check_radius
from asperity.memory import reserve

__all__ = ["ALPHA", "STAGES", "Prepared", "gaussian_filter", "magnified", "prepare"]

STAGES = ("outliers", "form", "fill", "filter", "tip", "repeat", "magnify")
"""What :func:`prepare` reports to ``progress`` before it begins each part."""

_LEAST = 4
MAX_MISSING = 0.25
"""Share of missing points that is filled unless more is allowed."""

_LEVELLED = {0: "mean removed", 1: "levelled"}


@described(PREPARING)
def prepare(  # noqa: D417 - the others are described where they are declared
    raw: RawSurface,
    *,
    pitch: float | Sequence[float] | None = None,
    height_range: float | None = None,
    outliers: float | None = None,
    max_missing: float = MAX_MISSING,
    form: int = 1,
    cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    periodic: bool = False,
    blend: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
    progress: Callable[[str], None] | None = None,
    watch: Watch | None = None,
) -> Prepared:
    """Make a surface ready to be a texture, as far as it is asked for.

    In this order: remove outliers, fill missing points, subtract the form (which levels), filter
    (S, then L), feel with a tip, make periodic, magnify. The form is fitted to the valid points,
    and holes are filled by the form and the harmonic interpolation of what it leaves. All lengths
    but the magnified ones are in the surface's own metres. The tip comes after the filter: where
    it bridges a groove, the heights have creases as sharp as the sampling.

    Args:
        raw: the surface as read.
        {arguments}
        progress: called with the name of each stage before it begins.
        watch: told the heights after each step, see :mod:`asperity.measured.history`.

    Returns:
        The prepared surface with what was done to it.

    Raises:
        ParameterError: an argument, or a surface, that cannot be used.

    Reference:
        ISO 16610-21 and -61 (Gaussian filters), ISO 16610-41 (morphological filters).

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
    begin, record = progress or (lambda _stage: None), Recorder(watch)
    raw = raw.in_metres(raw.pitch if pitch is None else pitch)
    steps = list(raw.notes)
    _check_heights(raw.heights, max_missing)
    lateral = _chosen_pitch(raw, pitch, steps)
    check_degree(form)
    factors(magnify, magnify_height)
    cutoffs = find_cutoffs(raw.heights.shape, lateral, cutoff, l_cutoff)
    _check_early(raw.heights.shape, lateral, tip_radius, periodic, blend)
    reserve(*raw.heights.shape[::-1])
    begin("outliers")
    heights = np.array(raw.heights, dtype=np.float64)
    if height_range is None:
        record("as read", heights, lateral)
    if outliers is not None:
        steps.append(remove_outliers(heights, outliers))
        _check_missing(heights, max_missing)
    _scale(heights, raw, lateral, height_range, steps)
    if outliers is not None or height_range is not None:
        record("as read" if outliers is None else "without outliers", heights, lateral)
    begin("form")
    sentence = subtract_form(heights, fit_form(heights, form), lateral)
    record(_LEVELLED.get(form, "form removed"), heights, lateral, removes=True)
    begin("fill")
    # What the form leaves is interpolated: a hole at the border continues a bow or a tilt.
    filled = _fill(heights, lateral, form, steps)
    if filled.any():
        record("holes filled", heights, lateral)
    steps.append(sentence)
    begin("filter")
    steps.extend(apply_filters(heights, lateral, cutoffs, record))
    begin("tip")
    if tip_radius is not None:
        heights, sentence = apply_tip(heights, lateral, tip_radius)
        record(f"tip {length_text(tip_radius)}", heights, lateral, removes=True)
        steps.append(sentence)
    begin("repeat")
    if periodic:
        heights, filled, sentence = make_periodic(heights, filled, lateral, blend)
        record("periodic", heights, lateral)
        steps.append(sentence)
    begin("magnify")
    mask = filled if filled.any() else None
    ready = Prepared(heights, lateral, tuple(steps), mask, bool(periodic), tuple(record.stages))
    return magnified(ready, magnify, magnify_height)


def magnified(
    prepared: Prepared, magnify: float = 1.0, magnify_height: float | None = None
) -> Prepared:
    """Return a prepared surface at another size.

    Args:
        prepared: the surface; its heights are replaced.
        magnify: lateral factor, and of the heights unless magnify_height is given.
        magnify_height: factor of the heights.

    Raises:
        ParameterError: for a factor that is not positive, or beyond all bounds.
    """
    lateral, upward = factors(magnify, magnify_height)
    heights, pitch = prepared.heights, prepared.pitch
    greatest = max(float(heights.max()), -float(heights.min()))
    with np.errstate(over="ignore"):
        wider = tuple(p * lateral for p in pitch)
        too_far = not math.isfinite(greatest * upward) or (greatest > 0 and greatest * upward == 0)
    if too_far or not all(0 < p < math.inf for p in wider):
        raise ParameterError("magnify", "makes the surface too large or small to compute", magnify)
    if lateral == upward == 1.0:
        return prepared
    heights *= upward
    history = prepared.history
    if history:
        history += (resized("magnified", heights, wider, history[-1], lateral),)
    steps = (*prepared.steps, magnified_text(lateral, upward))
    return replace(prepared, pitch=wider, steps=steps, history=history)


def magnified_text(lateral: float, upward: float) -> str:
    """Return by how much a surface was magnified, in words."""
    size = f"magnified {lateral:g} times laterally and"
    return f"{size} in height" if lateral == upward else f"{size} {upward:g} times in height"


def _check_early(
    shape: tuple[int, ...],
    pitch: tuple[float, ...],
    tip_radius: float | None,
    periodic: bool,
    blend: float | None,
) -> None:
    """Refuse what is wrong by itself before minutes of work on a large map."""
    if tip_radius is not None:
        check_radius(shape, pitch, tip_radius)
    if not isinstance(periodic, (bool, np.bool_)):
        raise ParameterError("periodic", "must be true or false", periodic)
    if blend is not None and not periodic:
        raise ParameterError("blend", "is the width of the blended borders: it needs periodic")
    if periodic:
        check_width(shape, pitch, blend)


def factors(magnify: float, magnify_height: float | None) -> tuple[float, float]:
    """Return the factors along the surface and in height.

    Raises:
        ParameterError: for one that is not positive.
    """
    lateral = positive_number("magnify", magnify, "")
    if magnify_height is None:
        return lateral, lateral
    return lateral, positive_number("magnify_height", magnify_height, "")


def _check_heights(heights: FloatArray, max_missing: float) -> None:
    shape = heights.shape
    if heights.ndim == 1 and shape[0] < _LEAST:
        raise ParameterError("surface", f"must have at least {_LEAST} points", shape[0])
    if heights.ndim == 2 and min(shape) < _LEAST:
        raise ParameterError(
            "surface",
            f"is too small: the smallest accepted map is 4 x 4, got {by_text(shape)} points",
        )
    if heights.ndim not in (1, 2):
        raise ParameterError("surface", "must be a profile (n,) or a map (ny, nx)", shape)
    if np.isinf(heights).any():
        raise ParameterError("surface", "has infinite heights; a missing point is NaN")
    _check_missing(heights, max_missing)


def _check_missing(heights: FloatArray, most: float) -> None:
    if not isinstance(most, (int, float)) or not 0.0 < most < 1.0:
        raise ParameterError("max_missing", "must lie between 0 and 1", most)
    missing = float(np.isnan(heights).mean())
    if missing == 1.0:
        raise ParameterError("surface", "has no valid point: all heights are missing")
    if missing > most:
        share = "a quarter" if most == MAX_MISSING else f"{most:.1%}"
        raise ParameterError(
            "surface",
            f"misses {missing:.1%} of its points; at most {share} can be filled, unless you allow"
            f" more: max_missing={math.ceil(100 * missing) / 100:g} (--max-missing)",
        )


def _chosen_pitch(
    raw: RawSurface, pitch: float | Sequence[float] | None, steps: list[str]
) -> tuple[float, ...]:
    axes = raw.heights.ndim
    if pitch is None:
        if raw.pitch is None:
            raise ParameterError("pitch", f"must be given [m]: {raw.source} has none")
        return _checked_pitch(raw.pitch, axes)
    given = _checked_pitch(pitch, axes)
    before = "" if raw.pitch is None else f" instead of the file's {lengths_text(raw.pitch)}"
    steps.append(f"pitch {lengths_text(given)} as given{before}")
    return given


def _checked_pitch(pitch: float | Sequence[float], axes: int) -> tuple[float, ...]:
    values = np.atleast_1d(np.asarray(pitch, dtype=np.float64))
    if values.ndim != 1 or len(values) not in (1, axes):
        wanted = "one number [m]" if axes == 1 else "one number or (px, py) [m]"
        raise ParameterError("pitch", f"must be {wanted}", pitch)
    for value in values:
        positive_number("pitch", value)
    return tuple(float(v) for v in np.broadcast_to(values, (axes,)))


def _scale(
    heights: FloatArray,
    raw: RawSurface,
    pitch: tuple[float, ...],
    height_range: float | None,
    steps: list[str],
) -> None:
    low, high = float(np.nanmin(heights)), float(np.nanmax(heights))
    span = high - low
    if not math.isfinite(span):
        raise ParameterError("surface", "has heights too large for floating-point numbers")
    if height_range is None:
        check_heights(raw, heights, pitch)
        return
    wanted = positive_number("height_range", height_range)
    if span == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    given = f"{span:.4g}" if raw.relative else length_text(span)
    steps.append(f"heights scaled from {given} to {length_text(wanted)} peak to valley")
    heights -= low
    heights *= wanted / span


def _fill(
    heights: FloatArray, pitch: tuple[float, ...], form: int, steps: list[str]
) -> NDArray[np.bool_]:
    """Fill the heights where they are; return where they were missing."""
    filled = np.isnan(heights)
    missing = int(filled.sum())
    if missing == 0:
        steps.append("no missing points")
        return filled
    share = 100.0 * missing / heights.size
    base = (" about the mean", " on the fitted tilt")[form] if form < 2 else " on the fitted form"
    steps.append(
        f"filled {missing} of {heights.size} missing points ({share:.2g} %)"
        f" by harmonic interpolation{base}"
    )
    fill_in_place(heights, pitch)
    return filled
