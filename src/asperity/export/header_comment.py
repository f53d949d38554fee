"""Comment at the top of an exported program: the surface and the results of its analysis."""

from __future__ import annotations

import math
import sys
import textwrap

import numpy as np

from asperity.analysis.analyze import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.surface_sentences import depth_range_text, leak_energy_text
from asperity.core.units import format_quantity
from asperity.core.version import __version__
from asperity.export.export_request import is_searching
from asperity.laws import Law
from asperity.textures.texture import Texture

_WIDTH = 92


def header_comment_text(analysis: Analysis, file_name: str) -> str:
    """Return the comment of an exported program.

    Args:
        analysis: analysis of the surface.
        file_name: name of the file.
    """
    surface, law = analysis.surface, analysis.surface.law
    doc = (sys.modules[law.force.__module__].__doc__ or "").strip()
    description = doc if doc.startswith(law.letter) else law.summary
    return "\n".join(
        [
            f"{file_name}: law {law}, by asperity {__version__}. Generated, do not edit.",
            "",
            *_usage(surface.law),
            "",
            description,
            "",
            *_facts(analysis),
            "",
            *_wrap([analysis.answer, *analysis.assumptions]),
        ]
    )


def _usage(law: Law) -> list[str]:
    """Return the lines on the use of the program."""
    state = "This law stores nothing in it"
    if is_searching(law.contact):
        state = "It stores the closest point for a warm start"
    if law.stateful:
        state = "It stores the anchor of friction"
    return _wrap(
        [
            "Positions [m] in the frame of the surface: z points out of the body, which is "
            "z < h(x, y). The force [N] is the one on the probe.",
            f"Call reset once for each state, then force in each tick. {state}.",
        ]
    )


def _facts(analysis: Analysis) -> list[str]:
    surface = analysis.surface
    parameters = "".join(f", {name} = {value:g}" for name, value in surface.law_parameters.items())
    rows = {
        "surface": ", ".join(
            f"{k} = {_format_value(v)}" for k, v in surface.texture.describe().items()
        ),
        "place": _format_extent(surface.texture),
        "device": analysis.device.name,
        "stiffness": f"k = {format_quantity(surface.stiffness, 'N/m')}{parameters}",
        "region": f"{surface.texture.domain.description}, {depth_range_text(surface)}",
        "clamp": _format_clamp(analysis),
        "q": _format_bound(analysis.q),
        "q+": _format_bound(analysis.one_sided),
        "leak": f"{leak_energy_text(analysis.leak)} ({analysis.leak.method})",
    }
    lines = []
    for name, value in rows.items():
        lines += textwrap.wrap(f"{name:<10}{value}", _WIDTH, subsequent_indent=" " * 10)
    return lines


def _format_extent(texture: Texture) -> str:
    """Return the extent of the surface: its heights, and one period in the plane."""
    low, high = (format_quantity(height, "m") for height in texture.extremes)
    parts = [f"heights {low} to {high}"]
    if len(texture.domain.spans) > 1:
        corners = texture.domain.points(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]))
        for axis, values in zip("xy", corners.T, strict=True):
            ends = (format_quantity(float(end), "m") for end in (values.min(), values.max()))
            parts.append(f"{axis} {' to '.join(ends)}")
    return ", ".join(parts)


def _format_value(value: object) -> str:
    """Return a value of a description as text, truncated if it is long."""
    if isinstance(value, list):
        return _truncate(f"[{', '.join(map(_format_value, value))}]")
    return _truncate(f"{value:g}" if isinstance(value, float) else str(value))


def _truncate(text: str) -> str:
    return text if len(text) <= _WIDTH else f"{text[:40]} ..."


def _format_clamp(analysis: Analysis) -> str:
    surface = analysis.surface
    depth = format_quantity(surface.max_depth, "m")
    if not surface.effective_clamp.changes_force:
        return f"none; meant to be pressed to {depth}"
    return f"{surface.effective_clamp}, the depth is held at {depth}"


def _format_bound(bound: Bound) -> str:
    if math.isfinite(bound.upper):
        return f"between {bound.lower:.6g} and {bound.upper:.6g} ({bound.method})"
    if math.isinf(bound.lower):
        return f"unbounded ({bound.method})"
    return f"at least {bound.lower:.6g}, no upper bound ({bound.method})"


def _wrap(sentences: list[str]) -> list[str]:
    return [line for one in sentences for line in textwrap.wrap(one, _WIDTH)]
