"""Export a surface and its law as the source of a program: ``export_code``."""

from __future__ import annotations

import math
import os
import sys
import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.press import holds_at_any_press, mean_press, scan_force_peak
from asperity.analysis.results.analyze import Analysis, Progress, analyze
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.core.display import describe
from asperity.core.errors import ParameterError
from asperity.core.files import check_not_existing
from asperity.core.units import format_quantity, format_stiffness
from asperity.core.version import __version__
from asperity.devices import DeviceLike
from asperity.export import targets
from asperity.export.c99 import data_size
from asperity.export.c_language import fill_template, load_template
from asperity.export.surface_functions import ExportRequest, is_searching
from asperity.laws.clamps import BACKED
from asperity.rendering import coarsened_surface
from asperity.surface import Surface
from asperity.textures.catalogue import TextureLike
from asperity.textures.fields.field_file import is_field, save_field
from asperity.textures.texture import Texture

if TYPE_CHECKING:
    from asperity.export.targets import ExportTarget
    from asperity.textures.fields.potential_field import PotentialField


_WIDTH = 92


def export_code(
    surface: Surface | TextureLike,
    path: str | os.PathLike[str],
    device: DeviceLike = DEFAULT_DEVICE,
    *,
    lang: str = "c99",
    load: bool = False,
    shared: bool = False,
    force: bool = False,
    progress: Progress | None = None,
    **arguments: Any,
) -> tuple[Path, ...]:
    """Export a surface and its law as C code with one function, ``texture_force()``.

    The numbers at the top of the file are those of
    :func:`~asperity.analysis.results.analyze.analyze`.

    Args:
        surface: the surface; or a texture, or what names one, which gets the law and the stiffness
            that are recommended on the device.
        path: the main file ("texture.h"), beside which further files are written; a folder for
            Unity.
        device: device whose limits stand in the file.
        lang: export target, "c99" or "unity".
        load: whether the program loads the field of law H from a file, which is written as well.
        shared: whether to write a library: header, source and CMakeLists.txt.
        force: whether to replace existing files.
        progress: called with the name of each step of the analysis.
        **arguments: ``name``, ``precision``, ``max_data_size``, ``max_bytes``,
            ``max_evaluations`` of
            :class:`~asperity.export.surface_functions.ExportRequest`; those of
            :func:`~asperity.analysis.results.analyze.analyze` otherwise.

    Returns:
        The files that were written.

    Raises:
        ParameterError: for an invalid value, a file that exists, or one that cannot be written.

    Example:
        >>> from tempfile import TemporaryDirectory
        >>> with TemporaryDirectory() as folder:
        ...     files = export_code("cloth", f"{folder}/texture.h", law="C", stiffness=300)
        >>> [file.name for file in files]
        ['texture.h', 'texture_data.c']
    """
    target = targets.find_target(lang)
    place = Path(path)
    targets.check_name(place, target)
    names = ("name", "precision", "max_data_size", "max_bytes", "max_evaluations")
    request = {name: arguments.pop(name) for name in names if name in arguments}
    ExportRequest.validate(**request)
    target.check(**request, loads_field=load)
    is_file = isinstance(surface, (str, os.PathLike)) and is_field(surface)
    field = None
    if load and not is_file:
        field = place.with_suffix(".field")
    for file in filter(None, [place, field]):
        check_not_existing("path", file, force=force)
    if not isinstance(surface, Surface):
        arguments = {"clamp": BACKED.name, **arguments}
    request |= {"as_library": shared, "loads_field": load}
    analysis = analyze(surface, device, progress=progress, **arguments)
    analysis = fit_analysis(analysis, request, progress)
    return tuple(export_analysis(analysis, place, target, field, request, force=force))


def fit_analysis(
    analysis: Analysis, request: Mapping[str, Any], progress: Progress | None = None
) -> Analysis:
    """Return the analysis of the finest map or field whose data fit into ``max_bytes``.

    Raises:
        ParameterError: if the data do not fit, and there is no coarser map or field that does.
    """
    limit = request.get("max_bytes")
    if limit is None:
        return analysis
    surface = fit_surface(analysis.surface, limit, request)
    if surface is analysis.surface:
        return analysis
    return analyze(surface, analysis.device, progress=progress)


def fit_surface(surface: Surface, limit: float, request: Mapping[str, Any]) -> Surface:
    """Return the surface, or one with a coarser texture, whose data are at most so many bytes."""
    fitted = surface
    share = 1.0
    size = data_size(ExportRequest(surface, **request))
    while size > limit:
        share *= min(math.sqrt(limit / size), 0.99)
        coarser = coarsened_surface(surface, share)
        if coarser is None:
            reason = "is too small: no coarser map or field of this surface fits"
            raise ParameterError("max_bytes", reason, limit)
        fitted = coarser
        size = data_size(ExportRequest(fitted, **request))
    return fitted


def export_analysis(
    analysis: Analysis,
    path: Path,
    target: ExportTarget,
    field: Path | None,
    request: Mapping[str, Any],
    *,
    force: bool,
) -> list[Path]:
    """Export an analyzed surface; return the files that were written.

    Args:
        analysis: the analysis, whose numbers stand at the top of the file.
        path: the main file.
        target: the export target.
        field: where to save the field of law H; ``None`` to save none.
        request: options of :class:`~asperity.export.surface_functions.ExportRequest`.
        force: whether to replace existing files.
    """
    surface = analysis.surface
    numbers: dict[str, Any] = {
        "q_upper": analysis.q.upper,
        "one_sided_upper": analysis.one_sided.upper,
        "max_force": scan_force_peak(surface),
        "max_press": mean_press(surface),
        "holds_deeper": holds_at_any_press(surface),
    }
    comment = header_comment_text(analysis, path.name)
    order = ExportRequest(surface, comment=comment, **numbers, **request)
    files = targets.write_files(path, target, order, force=force)
    if field is not None:
        save_field(field, cast("PotentialField", surface.texture))
        files.append(field)
    return files


# --- comment at the top of the file --------------------------------------------------------------


def header_comment_text(analysis: Analysis, file_name: str) -> str:
    """Return the comment of an exported program.

    Args:
        analysis: analysis of the surface.
        file_name: name of the file.
    """
    law = analysis.surface.law
    doc = (sys.modules[law.force.__module__].__doc__ or "").strip()
    if not doc.startswith(law.letter):
        doc = law.summary
    if analysis.surface.texture.baked_numbers:
        doc = "\n".join(_wrap([_FIELD_NOTE])) + f"\n\n{doc}"
    paragraphs = [
        [f"{file_name}: law {law}, by asperity {__version__}. Generated, do not edit."],
        _usage(analysis.surface),
        [doc],
        _facts(analysis),
        _wrap([analysis.answer, *analysis.assumptions]),
    ]
    return "\n\n".join(map("\n".join, paragraphs))


_FIELD_NOTE = (
    "This file evaluates a baked field of the law, whose q, q+ and leak are those in the list "
    "below. The exact law:"
)


def _usage(surface: Surface) -> list[str]:
    """Return the lines on the use of the program."""
    parts = []
    if surface.law.stateful or surface.contact_friction is not None:
        parts.append("the anchor of friction")
    if is_searching(surface.law.contact):
        parts.append("the closest point for a warm start")
    state = "This law stores nothing in it"
    if parts:
        state = f"It stores {' and '.join(parts)}"
    return _wrap(fill_template(load_template("usage.txt"), {"state": state}).splitlines())


def _facts(analysis: Analysis) -> list[str]:
    surface = analysis.surface
    numbers = {**surface.law_parameters, **surface.friction_values}
    parameters = [f"{name} = {value:g}" for name, value in numbers.items()]
    described = surface.texture.describe().items()
    arguments = [(name, value) for name, value in described if _is_argument(value)]
    rows = {
        "surface": ", ".join([f"{name} = {_format_value(value)}" for name, value in arguments]),
        "place": _format_extent(surface.texture),
        "device": analysis.device.name,
        "stiffness": ", ".join([f"k = {format_stiffness(surface.stiffness)}", *parameters]),
        "region": f"{surface.texture.domain.description}, {describe(surface, 'depth_range')}",
        "clamp": _format_clamp(analysis),
        "q": _format_bound(analysis.q),
        "q+": _format_bound(analysis.one_sided),
        "leak": f"{analysis.leak.energy_text} ({analysis.leak.method})",
    }
    lines = []
    for name, value in rows.items():
        lines += textwrap.wrap(f"{name:<10}{value}", _WIDTH, subsequent_indent=" " * 10)
    return lines


def _format_extent(texture: Texture) -> str:
    """Return the extent of the surface: its heights, and one period in the plane."""
    parts = [f"heights {_format_range(texture.extremes)}"]
    if len(texture.domain.spans) > 1:
        corners = texture.domain.points(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]))
        for axis, values in zip("xy", corners.T, strict=True):
            parts.append(f"{axis} {_format_range((float(values.min()), float(values.max())))}")
    return ", ".join(parts)


def _format_range(ends: tuple[float, float]) -> str:
    return f"{format_quantity(ends[0], 'm')} to {format_quantity(ends[1], 'm')}"


def _is_argument(value: object) -> bool:
    """Return whether a value is no sentence on the preparation and no result, given elsewhere."""
    is_text = isinstance(value, list) and set(map(type, value)) <= {str}
    return not isinstance(value, dict) and not is_text


def _format_value(value: object) -> str:
    """Return a value of a description as text, truncated if it is long."""
    if isinstance(value, list):
        text = f"[{', '.join(map(_format_value, value))}]"
    elif isinstance(value, float):
        text = f"{value:g}"
    else:
        text = str(value)
    return text if len(text) <= _WIDTH else f"{text[:40]} ..."


def _format_clamp(analysis: Analysis) -> str:
    surface = analysis.surface
    depth = format_quantity(surface.max_depth, "m")
    if not surface.effective_clamp.changes_force:
        return f"none; meant to be pressed to {depth}"
    return f"{surface.effective_clamp}, the depth is held at {depth}"


def _format_bound(bound: Bound) -> str:
    if math.isfinite(bound.lower) and math.isinf(bound.upper):
        return f"at least {bound.lower:.6g}, no upper bound ({bound.method})"
    return f"{describe(bound, 'interval')} ({bound.method})"


def _wrap(sentences: list[str]) -> list[str]:
    return [line for sentence in sentences for line in textwrap.wrap(sentence, _WIDTH)]
