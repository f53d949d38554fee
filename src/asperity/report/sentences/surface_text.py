"""Textures, their arguments, measured parameters and maps as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from asperity.analysis import characteristic_number
from asperity.analysis.energy.leak import find_leak
from asperity.core.arguments import Argument
from asperity.core.units import format_quantity
from asperity.export.surface_maps import SampledMap, height_resolution, normal_error
from asperity.measured.filters import short_trace_text
from asperity.measured.form import SurfaceDecomposition
from asperity.measured.lengths import format_counts, format_lengths
from asperity.measured.parameters import MAX_CORRELATION_POINTS
from asperity.measured.prepared import PreparationStage, PreparedSurface
from asperity.measured.reading.measured_file import MeasurementSummary
from asperity.report.sentences.texts import (
    energy_text,
    readable_name,
    sentence,
    sentence_case,
    yes_no_text,
)
from asperity.surface import Surface
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.texture import Texture, TextureKind

# Lengths of maps and profiles, which are not arguments of a kind.
_LENGTH_NAMES = {"pitch", "cutoff"}
_OMITTED_NAMES = {"kind", "preparation", "phase", "direction", "phases", "wavevectors"}
_OMITTED_NAMES |= {"thin_regions", "gain", "one_sided", "accuracy", "grid", "source"}  # of fields


def describe_texture(description: dict[str, Any]) -> str:
    """Return the kind of a texture and its plain arguments as text.

    Example:
        >>> describe_texture({"kind": "sinusoid", "amplitude": 8e-4, "period": 1e-3, "phase": 0.0})
        'sinusoid: amplitude 0.8 mm, period 1 mm'
    """
    declared = {}
    if description["kind"] in CATALOGUE:
        arguments = CATALOGUE[description["kind"]].arguments
        declared = {argument.name: argument for argument in arguments}
    parts = []
    for name, value in description.items():
        if name in _OMITTED_NAMES:
            continue
        values = value if isinstance(value, list) else [value]
        if len(values) > 4:
            parts.append(f"{len(values)} {name}")
            continue
        numbers = [_value_text(name, number, declared.get(name)) for number in values]
        parts.append(f"{readable_name(name)} {' × '.join(numbers)}")
    return f"{description['kind']}: {', '.join(parts)}"


def _value_text(name: str, value: Any, argument: Argument | None) -> str:
    if isinstance(value, bool):
        return yes_no_text(value)
    if argument is not None:
        return argument.format_value(value)
    if name in _LENGTH_NAMES and isinstance(value, float):
        return format_quantity(value, "m")
    return f"{value}"


def texture_name(texture: Texture) -> str:
    """Return the file of a texture, its kind, or that of the one that was baked, for a title.

    Example:
        >>> from asperity.textures import Sinusoid
        >>> texture_name(Sinusoid(1e-4, 1e-3))
        'Sinusoid'
    """
    description = texture.describe().get("source", texture.describe())
    return texture.file_name or readable_name(description["kind"]).capitalize()


def parts_text(parts: SurfaceDecomposition) -> str:
    """Return how form, waviness and texture are separated, in one sentence."""
    return sentence("parts", nesting=format_quantity(parts.nesting, "m"))


def texture_text(parts: SurfaceDecomposition) -> str:
    """Return the RMS of texture, form and waviness, in one sentence."""
    return sentence(
        "texture",
        texture=format_quantity(parts.texture.rms, "m"),
        nesting=format_quantity(parts.nesting, "m"),
        form=format_quantity(parts.form.rms, "m"),
        waviness=format_quantity(parts.waviness.rms, "m"),
    )


def roughness_text(history: Sequence[PreparationStage]) -> str:
    """Return the RMS of what the requested L-filter left, in one sentence; empty for none."""
    nesting = history[-1].nesting if history else None
    if nesting is None:
        return ""
    symbol, rms = next(iter(history[-1].values.items()))
    rms_text = format_quantity(rms or 0.0, "m")
    nesting_text = format_quantity(nesting, "m")
    return sentence("roughness", symbol=symbol, rms=rms_text, nesting=nesting_text)


def surface_summary_text(prepared: PreparedSurface) -> str:
    """Return a surface in one line: size, pitch, heights.

    Example:
        >>> import numpy as np
        >>> surface_summary_text(PreparedSurface(np.array([0.0, 1e-6, 0.0, 1e-6]), (1e-5,), ()))
        '4 points, pitch 10 µm, peak to valley 1 µm, RMS 500 nm'
    """
    heights = prepared.heights
    span = float(heights.max()) - float(heights.min())
    parts = [
        f"{format_counts(heights.shape[::-1])} points",
        f"pitch {format_lengths(prepared.pitch)}",
        f"peak to valley {format_quantity(span, 'm')}",
        f"RMS {format_quantity(float(heights.std()), 'm')}",
    ]
    if prepared.filled_mask is not None:
        parts.append(f"{100.0 * float(prepared.filled_mask.mean()):.2g} % filled")
    if prepared.periodic:
        parts.append("periodic")
    return ", ".join(parts)


def lay_text(summary: MeasurementSummary) -> str:
    """Return autocorrelation length and texture aspect ratio as text; empty for a profile."""
    heights = summary.prepared.heights
    (length, ratio) = summary.correlation
    if heights.ndim == 1:
        return ""
    if heights.size > MAX_CORRELATION_POINTS:
        return f"Sal and Str are computed for at most {MAX_CORRELATION_POINTS} points."
    if length is None:
        return "Sal: none; the correlation falls to 0.2 in no direction within half of the map."
    text = f"Sal {format_quantity(length, 'm')} (autocorrelation length)"
    if ratio is None:
        return f"{text}; Str: none, the correlation stays above 0.2 in some direction (a lay)."
    return f"{text}, Str {ratio:.2g} (texture aspect ratio: 1 isotropic, 0 a lay)."


def removed_text(stage: PreparationStage) -> str:
    """Return what a step removed: "12.3 nm RMS, range 1.2 µm"."""
    if stage.removed is None:
        return "nothing"
    rms = format_quantity(stage.removed.rms, "m")
    span = format_quantity(stage.removed.range, "m")
    return f"{rms} RMS, range {span}"


def arguments_text(kind: TextureKind) -> str:
    """Return the arguments on one line: with their defaults, or with their units.

    Example:
        >>> from asperity.textures.catalogue import CATALOGUE
        >>> arguments_text(CATALOGUE["grating"])
        'height [m], period [m], duty=0.5, edge=ridge or groove/4'
    """
    return ", ".join(map(_default_or_unit, kind.arguments))


def _default_or_unit(argument: Argument) -> str:
    if argument.required:
        return unit_name(argument)
    if argument.default is None:
        return f"{argument.name}={argument.default_description}"
    # Without spaces, so that no line breaks inside a quantity.
    return f"{argument.name}={argument.default_text.replace(' ', '')}"


def unit_name(argument: Argument) -> str:
    """Return the name of an argument with its unit."""
    return f"{argument.name} [{argument.unit}]" if argument.unit else argument.name


def argument_text(argument: Argument) -> str:
    """Return the description of an argument with its choices."""
    if not argument.choices:
        return argument.description
    return f"{argument.description}: {', '.join(argument.choices)}"


_SHADING_LAW = "G"


def describe_map(sampled_map: SampledMap) -> str:
    """Return content and size of a map."""
    size = " x ".join([format_quantity(side, "m") for side in sampled_map.size])
    tiled = "it can be tiled" if sampled_map.is_periodic else "it cannot be tiled"
    content = sentence_case(sampled_map.description)
    return sentence("sampled_map", content=content, size=size, tiled=tiled)


def describe_heights(sampled_map: SampledMap, suffix: str) -> str:
    """Return the range of the heights in a file, and their rounding error."""
    low = format_quantity(float(sampled_map.heights.min()), "m", digits=6)
    high = format_quantity(float(sampled_map.heights.max()), "m", digits=6)
    error = height_resolution(sampled_map, suffix)
    accuracy = "exact"
    if error:
        accuracy = f"with errors up to {format_quantity(error, 'm', digits=3)}"
    return f"Heights from {low} to {high}, {accuracy}; the interpolation depends on the tool."


def describe_normals(sampled_map: SampledMap, convention: str) -> str:
    """Return the errors of normals in 8 bits, and of forces computed from them."""
    angle = normal_error(sampled_map, convention)
    error = 100.0 * 2.0 * math.sin(0.5 * angle)
    return sentence("normals", angle=f"{math.degrees(angle):.2g}°", error=f"{error:.2g} %")


def describe_shading(texture: Texture, stiffness: float | None) -> str:
    """Return loop energy and q of a force along these normals, which is law G.

    Args:
        texture: the texture.
        stiffness: [N/m]; default: that of a surface.
    """
    surface = Surface(texture, _SHADING_LAW)
    if stiffness is not None:
        surface = surface.to_stiffness(stiffness)
    q = characteristic_number(surface)
    leak = find_leak(surface)
    energy = "no loop gains energy"
    if math.isnan(leak.energy):
        energy = f"a loop gains {leak.energy_text}"
    elif leak.energy > 0.0:
        energy = f"a loop gains {energy_text(leak.energy)}"
    at = format_quantity(surface.stiffness, "N/m")
    depth = format_quantity(surface.max_depth, "m")
    return sentence("shading", law=_SHADING_LAW, at=at, depth=depth, energy=energy, q=q)


def measurement_answer(summary: MeasurementSummary) -> str:
    """Return the RMS of texture, form and waviness, or the roughness with a warning."""
    if summary.parts is not None:
        return texture_text(summary.parts)
    prepared = summary.prepared
    roughness = roughness_text(prepared.history)
    nesting = prepared.history[-1].nesting
    warning = short_trace_text(prepared.heights.shape, prepared.pitch, nesting or 0.0)
    return f"{roughness} {sentence_case(warning)}." if warning else roughness
