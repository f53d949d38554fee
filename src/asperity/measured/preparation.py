"""Prepare a measured surface: outliers, form, fill, filter, tip, repeat, magnify, in this order."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.arguments import document_arguments
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.measured.defects import (
    borders_fit,
    fill_in_place,
    make_periodic,
    remove_outliers,
    to_blend_samples,
)
from asperity.measured.file_arguments import PREPARATION_ARGUMENTS
from asperity.measured.filters import apply_filters, apply_tip, check_tip_radius, find_cutoffs
from asperity.measured.form import check_degree, fit_form, subtract_form
from asperity.measured.lengths import (
    Pitch,
    Shape,
    format_counts,
    format_length,
    format_lengths,
    is_pitch,
)
from asperity.measured.prepared import (
    PreparedSurface,
    StageCallback,
    StageRecorder,
    resized_stage,
    some_or_none,
)
from asperity.measured.reader import RawSurface

MAX_MEAN_SLOPE = 10.0
"""Greatest plausible mean slope between neighbouring points: flanks of 84°.

A stylus follows flanks of 60° at most (cones of ISO 3274), a microscope of 72° (aperture 0.95),
slopes of 1.7 and 3.1; the mean slopes of 30 real surfaces of all kinds are up to 0.4. A wrong unit
changes the slope by a factor of a thousand.
"""

MIN_MEAN_SLOPE = 1e-6
"""Least plausible mean slope unless flat: 0.1 nm of noise at a pitch of 0.1 mm."""
PITCH_LIMITS = (1e-11, 0.1)
"""Plausible pitches of a file [m]; the argument ``pitch`` confirms others."""

GivenPitch = float | Sequence[float] | None
_MAX_SPAN = 10.0  # [m]; greater heights have probably another unit
_MAX_LINES = 1024  # lines sampled along each axis
_COMMON_UNITS = {"mm": 1e-3, "um": 1e-6, "nm": 1e-9}


def check_plausible(raw: RawSurface, heights: FloatArray, pitch: Pitch) -> None:
    """Refuse heights that have no unit, or an implausible one.

    Args:
        raw: the surface as read.
        heights: its heights [m], without outliers.
        pitch: distance of the points [m].

    Raises:
        ParameterError: the user must give the unit or the height range, with the options for it.
    """
    if raw.relative:
        text = f"is required: the values of {raw.source} have no unit; give {{height_range}}"
        if raw.lacks_unit:
            text += ", or their unit, such as {unit}"
        raise ParameterError("height_range", text, unit="um", height_range=_EXAMPLE_RANGE)
    span = float(np.nanmax(heights)) - float(np.nanmin(heights))
    slope = mean_slope(heights, pitch)
    fixes, suggestions = _suggest_fixes(raw, span, slope)
    if slope > MAX_MEAN_SLOPE:
        raise ParameterError(
            "height_range",
            f"must be given: heights that span {format_length(span)} at a pitch of"
            f" {format_lengths(pitch)} have a mean slope of {slope:.3g}, and no instrument measures"
            f" {MAX_MEAN_SLOPE:g}; {fixes}",
            **suggestions,
        )
    if 0.0 < slope < MIN_MEAN_SLOPE:
        raise ParameterError(
            "height_range",
            f"must be given: heights that span {format_length(span)} at a pitch of"
            f" {format_lengths(pitch)} have a mean slope of {slope:.3g}, less than"
            f" {MIN_MEAN_SLOPE:g}: heights or pitch may be in another unit; give {{pitch}}, or, if"
            " they are right, {height_range}",
            pitch=None,
            height_range=span,
        )
    if span > _MAX_SPAN and not raw.has_units:
        raise ParameterError(
            "height_range",
            f"must be given: heights that span {format_length(span)} look not to be in metres, and"
            f" {raw.source} names no unit; {fixes}",
            **suggestions,
        )


def _suggest_fixes(raw: RawSurface, span: float, slope: float) -> tuple[str, dict[str, Any]]:
    """Return what to give for another unit, and for heights that are right, with the values."""
    unit = next((u for u, factor in _COMMON_UNITS.items() if slope * factor <= 1.0), "nm")
    other = "{unit}"
    if raw.has_units:  # no argument changes the unit of a file: give the height range
        other = f"a height range of {format_length(span * _COMMON_UNITS[unit])}"
    right = "if they are right: {height_range}; {outliers} removes spikes"
    return f"if in {unit}: {other}; {right}", {"unit": unit, "height_range": span, "outliers": 6}


def mean_slope(heights: FloatArray, pitch: Pitch) -> float:
    """Return the mean slope |Δh| / pitch between neighbouring points along the steeper axis.

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
            lines = lines[:: -(-len(lines) // _MAX_LINES)]
        with np.errstate(over="ignore"):  # heights near the largest float
            rises = np.abs(np.diff(lines, axis=-1))
            rises = rises[~np.isnan(rises)]
            if rises.size:
                slopes.append(float(rises.mean()) / step)
    return max(slopes)


_MIN_POINTS = 4
MAX_MISSING = 0.25
"""Default for the greatest share of missing points."""

_BORDERS_FIT = (
    "opposite borders fit: if the surface repeats, declare it periodic, and it stays as it is",
    "periodic: opposite borders fit, so nothing is blended and no form but the mean subtracted",
)
_FORM_STAGE_NAMES = {0: "mean removed", 1: "levelled"}


@document_arguments(PREPARATION_ARGUMENTS)
def prepare(  # noqa: D417 - the others are described by their declarations
    raw: RawSurface,
    *,
    pitch: GivenPitch = None,
    height_range: float | None = None,
    outliers: float | None = None,
    max_missing: float = MAX_MISSING,
    form: int = 1,
    s_cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    periodic: bool = False,
    blend: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
    progress: Callable[[str], None] | None = None,
    on_stage: StageCallback | None = None,
) -> PreparedSurface:
    """Prepare a measured surface for use as a texture.

    In this order: remove outliers, subtract the form (which levels), fill missing points, filter
    (S, then L), dilate by a tip, make periodic, magnify. The form is fitted to the valid points,
    and the residual is interpolated harmonically over holes. All lengths are in the surface's own
    metres, before magnification. A periodic surface whose borders fit is believed: its mean is the
    only form subtracted, filters and tip repeat it, and nothing is blended. The tip is applied
    after the filter: where it bridges a groove, the heights have creases as sharp as the sampling.

    Args:
        raw: the surface as read.
        {arguments}
        progress: called with the name of each stage before it starts.
        on_stage: called with the heights after each step, see :mod:`asperity.measured.prepared`.

    Returns:
        The prepared surface with a description of its preparation.

    Raises:
        ParameterError: an argument or the surface cannot be used.

    Reference:
        ISO 16610-21 and -61 (Gaussian filters), ISO 16610-41 (morphological filters).

    Example:
        >>> x = np.linspace(0.0, 1.0, 33)
        >>> raw = RawSurface(1e-6 * np.cos(8 * np.pi * x) + 3.2e-6 * x, (1e-5,), "wave", ())
        >>> for step in prepare(raw, magnify=20).steps:
        ...     print(step)
        levelled: subtracted the least-squares line, slope 0.01
        no missing points
        filtered: Gaussian ISO 16610-21, cut-off 40 µm (chosen from the sampling: 4 samples)
        magnified 20 times laterally and in height
    """
    start = progress or (lambda _stage: None)
    record = StageRecorder(on_stage)
    steps = list(raw.notes)
    _check_shape(raw.heights, max_missing)
    lateral = _resolve_pitch(raw, pitch, height_range, steps)
    check_degree(form)
    magnification_factors(magnify, magnify_height)
    cutoffs = find_cutoffs(raw.heights.shape, lateral, s_cutoff, l_cutoff)
    _check_arguments(raw.heights.shape, lateral, tip_radius, periodic, blend)
    require_memory(*raw.heights.shape[::-1])
    periodic = bool(periodic) or (raw.is_periodic and borders_fit(raw.heights))
    start("outliers")
    heights = _scaled_heights(raw, lateral, height_range, outliers, max_missing, record, steps)
    start("form")
    repeats = blend is None and _repeats(heights, periodic, steps)
    if repeats:  # a polynomial would break it
        form = 0
    sentence = subtract_form(heights, fit_form(heights, form), lateral)
    record(_FORM_STAGE_NAMES.get(form, "form removed"), heights, lateral, removes=True)
    steps.append(sentence)
    start("fill")
    # The residual is interpolated, so that a hole at the border continues a bow or a tilt.
    filled = _fill_missing(heights, lateral, form, steps)
    if filled.any():
        record("holes filled", heights, lateral)
    start("filter")
    steps.extend(apply_filters(heights, lateral, cutoffs, record, periodic=repeats))
    start("tip")
    if tip_radius is not None:
        heights, sentence = apply_tip(heights, lateral, tip_radius, periodic=repeats)
        record(f"tip {format_length(tip_radius)}", heights, lateral, removes=True)
        steps.append(sentence)
    start("repeat")
    if periodic and not repeats:
        heights, filled, sentence = make_periodic(heights, filled, lateral, blend)
        record("periodic", heights, lateral)
        steps.append(sentence)
    start("magnify")
    ready = PreparedSurface(
        heights, lateral, tuple(steps), some_or_none(filled), periodic, tuple(record.stages)
    )
    return magnify_surface(ready, magnify, magnify_height)


def _scaled_heights(
    raw: RawSurface,
    lateral: Pitch,
    height_range: float | None,
    outliers: float | None,
    max_missing: float,
    record: StageRecorder,
    steps: list[str],
) -> FloatArray:
    """Return the heights [m] without outliers, scaled to the range where it is given."""
    heights = _copy_heights(raw, lateral)
    if height_range is None:
        record("as read", heights, lateral)
    if outliers is not None:
        steps.append(remove_outliers(heights, outliers))
        _check_missing(heights, max_missing)
    _scale_heights(heights, raw, lateral, height_range, steps)
    if outliers is not None:
        record("without outliers", heights, lateral)
    elif height_range is not None:
        record("as read", heights, lateral)
    return heights


def _repeats(heights: FloatArray, periodic: bool, steps: list[str]) -> bool:
    """Return whether heights are declared periodic and their borders fit, and note the latter."""
    fits = borders_fit(heights, smooth=not periodic)
    if fits:
        steps.append(_BORDERS_FIT[periodic])
    return fits and periodic


def magnify_surface(
    prepared: PreparedSurface, magnify: float = 1.0, magnify_height: float | None = None
) -> PreparedSurface:
    """Return a prepared surface at another size.

    Args:
        prepared: the surface; its heights are replaced.
        magnify: lateral factor; also of the heights unless magnify_height is given.
        magnify_height: factor of the heights.

    Raises:
        ParameterError: a factor is not positive, or the result overflows.
    """
    lateral, upward = magnification_factors(magnify, magnify_height)
    heights = prepared.heights
    pitch = prepared.pitch
    greatest = max(float(heights.max()), -float(heights.min()))
    with np.errstate(over="ignore"):
        wider = tuple([p * lateral for p in pitch])
        too_far = not math.isfinite(greatest * upward) or (greatest > 0 and greatest * upward == 0)
    if too_far or not is_pitch(wider):
        raise ParameterError("magnify", "makes the surface too large or small to compute", magnify)
    if lateral == upward == 1.0:
        return prepared
    heights *= upward
    history = prepared.history
    if history:
        history += (resized_stage("magnified", heights, wider, history[-1], lateral),)
    steps = (*prepared.steps, describe_magnification(lateral, upward))
    return replace(prepared, pitch=wider, steps=steps, history=history)


def describe_magnification(lateral: float, vertical: float) -> str:
    """Return the magnification of a surface in words."""
    size = f"magnified {lateral:g} times laterally and"
    if lateral == vertical:
        return f"{size} in height"
    return f"{size} {vertical:g} times in height"


def _check_arguments(
    shape: Shape, pitch: Pitch, tip_radius: float | None, periodic: bool, blend: float | None
) -> None:
    """Refuse arguments that cannot be used, before minutes of work on a large map."""
    if tip_radius is not None:
        check_tip_radius(shape, pitch, tip_radius)
    if not isinstance(periodic, (bool, np.bool_)):
        raise ParameterError("periodic", "must be true or false", periodic)
    if blend is not None and not periodic:
        raise ParameterError("blend", "is the width of the blended borders: it needs periodic")
    if periodic:
        to_blend_samples(shape, pitch, blend)


def magnification_factors(magnify: float, magnify_height: float | None) -> tuple[float, float]:
    """Return the factors along the surface and in height.

    Raises:
        ParameterError: a factor is not positive.
    """
    lateral = check_positive("magnify", magnify)
    if magnify_height is None:
        return lateral, lateral
    return lateral, check_positive("magnify_height", magnify_height)


def _check_shape(heights: FloatArray, max_missing: float) -> None:
    shape = heights.shape
    if heights.ndim == 1 and shape[0] < _MIN_POINTS:
        raise ParameterError("surface", f"must have at least {_MIN_POINTS} points", shape[0])
    if heights.ndim == 2 and min(shape) < _MIN_POINTS:
        size = f"got {format_counts(shape)} points"
        raise ParameterError("surface", f"is too small: the smallest accepted map is 4 x 4, {size}")
    if heights.ndim not in (1, 2):
        raise ParameterError("surface", "must be a profile (n,) or a map (ny, nx)", shape)
    if np.isinf(heights).any():
        raise ParameterError("surface", "has infinite heights; a missing point is NaN")
    _check_missing(heights, max_missing)


def _check_missing(heights: FloatArray, max_missing: float) -> None:
    if not isinstance(max_missing, (int, float)) or not 0.0 < max_missing < 1.0:
        raise ParameterError("max_missing", "must lie between 0 and 1", max_missing)
    missing = float(np.isnan(heights).mean())
    if missing == 1.0:
        raise ParameterError("surface", "has no valid point: all heights are missing")
    if missing > max_missing:
        share = "a quarter" if max_missing == MAX_MISSING else f"{100.0 * max_missing:.1f} %"
        raise ParameterError(
            "surface",
            f"misses {100.0 * missing:.1f} % of its points; at most {share} can be filled, "
            "unless you allow more: {max_missing}",
            max_missing=math.ceil(100 * missing) / 100,
        )


def _resolve_pitch(
    raw: RawSurface, pitch: GivenPitch, height_range: float | None, steps: list[str]
) -> Pitch:
    """Return the given pitch or that of the file [m], one value for each axis."""
    axes = raw.heights.ndim
    chosen: GivenPitch = raw.pitch
    if pitch is not None:
        chosen = pitch
    if chosen is None:
        raise _missing_pitch_error(raw, height_range)
    values = np.atleast_1d(np.asarray(chosen, dtype=np.float64))
    if values.ndim != 1 or len(values) not in (1, axes):
        wanted = ("one number [m]", "one number or (px, py) [m]")[axes - 1]
        raise ParameterError("pitch", f"must be {wanted}", chosen)
    for value in values:
        check_positive("pitch", value, "m")
    lateral = tuple(np.broadcast_to(values, (axes,)).tolist())
    if pitch is not None:
        before = ""
        if raw.pitch is not None:
            before = f" instead of the file's {format_lengths(raw.pitch)}"
        steps.append(f"pitch {format_lengths(lateral)} as given{before}")
    elif not PITCH_LIMITS[0] <= min(lateral) <= max(lateral) <= PITCH_LIMITS[1]:
        raise ParameterError(
            "pitch",
            f"must be given: {raw.source} says {format_lengths(lateral)}, which no instrument has;"
            " if it is right: {pitch}",
            pitch=lateral[0],
        )
    return lateral


def _copy_heights(raw: RawSurface, pitch: Pitch) -> FloatArray:
    """Return a copy of the heights; those in units of the pitch [m] are multiplied by it."""
    heights = np.array(raw.heights, dtype=np.float64)
    if raw.in_pitches:
        _check_square(pitch)
        heights *= pitch[0]
    return heights


def _check_square(pitch: Pitch) -> None:
    if len(set(pitch)) > 1:
        raise ParameterError("pitch", "must be equal along x and y: slopes of a normal map", pitch)


def _missing_pitch_error(raw: RawSurface, height_range: float | None) -> ParameterError:
    """Return the error for a file without a pitch, with all that is missing, ready to paste."""
    text = f"must be given: {raw.source} has none; add {{pitch}}"
    values = {"pitch": 1e-6, "unit": "um", "height_range": _EXAMPLE_RANGE}
    if raw.lacks_unit and height_range is None:
        text = f"and unit must be given: {raw.source} has neither; add {{pitch}} {{unit}}"
    elif raw.relative and height_range is None:
        text = (
            f"and height_range must be given: {raw.source} has neither; add the distance of its"
            " points and its height, such as {pitch} {height_range}"
        )
    if raw.in_pitches or (raw.relative and not raw.lacks_unit):
        values["pitch"] = _EXAMPLE_PITCH
    return ParameterError("pitch", text, **values)


_EXAMPLE_PITCH = 5e-5
_EXAMPLE_RANGE = 2e-4


def _scale_heights(
    heights: FloatArray, raw: RawSurface, pitch: Pitch, height_range: float | None, steps: list[str]
) -> None:
    low = float(np.nanmin(heights))
    high = float(np.nanmax(heights))
    span = high - low
    if not math.isfinite(span):
        raise ParameterError("surface", "has heights too large for floating-point numbers")
    if height_range is None:
        check_plausible(raw, heights, pitch)
        return
    wanted = check_positive("height_range", height_range, "m")
    if span == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    before = format_length(span) if not raw.relative else f"{span:.4g}"
    steps.append(f"heights scaled from {before} to {format_length(wanted)} peak to valley")
    heights -= low
    heights *= wanted / span


def _fill_missing(
    heights: FloatArray, pitch: Pitch, form: int, steps: list[str]
) -> NDArray[np.bool_]:
    """Fill the heights in place; return the mask of the filled points."""
    filled = np.isnan(heights)
    missing = int(filled.sum())
    if missing == 0:
        steps.append("no missing points")
        return filled
    share = 100.0 * missing / heights.size
    base = (" about the mean", " on the fitted tilt", " on the fitted form")[min(form, 2)]
    count = f"{missing} missing points of {heights.size} ({share:.2g} %)"
    steps.append(f"filled {count} by harmonic interpolation{base}")
    fill_in_place(heights, pitch)
    return filled
