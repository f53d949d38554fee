"""What stands on top of an exported program: what it renders, and what was proved of it."""

from __future__ import annotations

import math
import sys
import textwrap

import numpy as np

import asperity
from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.analysis.words.surface import depths, most_gained
from asperity.laws import Law
from asperity.textures.texture import Texture
from asperity.units import engineering

_WIDTH = 92


def note_text(analysis: Analysis, file: str) -> str:
    """Return the comment of an exported program.

    Args:
        analysis: what is known of the surface and its law.
        file: name of the file.
    """
    surface, law = analysis.surface, analysis.surface.law
    doc = (sys.modules[law.force.__module__].__doc__ or "").strip()
    said = doc if doc.startswith(law.letter) else law.summary
    return "\n".join(
        [
            f"{file}: law {law}, by asperity {asperity.__version__}. Generated, do not edit.",
            "",
            *_usage(surface.law),
            "",
            said,
            "",
            *_facts(analysis),
            "",
            *_wrapped([analysis.answer, *analysis.assumptions]),
        ]
    )


def _usage(law: Law) -> list[str]:
    """Return how the program is used."""
    kept = "This law keeps nothing in it"
    if law.contact.remembers:
        kept = "It keeps where the last search ended"
    if law.stateful:
        kept = "It keeps the anchor of friction"
    return _wrapped(
        [
            "Positions [m] in the frame of the surface: z points out of the body, which is "
            "z < h(x, y). The force [N] is the one on the probe.",
            f"Call reset once for a state of your own, then force in each tick. {kept}.",
        ]
    )


def _facts(analysis: Analysis) -> list[str]:
    surface = analysis.surface
    parameters = "".join(f", {name} = {value:g}" for name, value in surface.law_parameters.items())
    rows = {
        "surface": ", ".join(f"{k} = {_plain(v)}" for k, v in surface.texture.describe().items()),
        "place": _place(surface.texture),
        "device": analysis.device.name,
        "stiffness": f"k = {engineering(surface.stiffness, 'N/m')}{parameters}",
        "region": f"{surface.texture.domain.description}, {depths(surface)}",
        "clamp": _clamp(analysis),
        "q": _bound(analysis.q),
        "q+": _bound(analysis.one_sided),
        "leak": f"{most_gained(analysis.leak)} ({analysis.leak.method})",
    }
    lines = []
    for name, value in rows.items():
        lines += textwrap.wrap(f"{name:<10}{value}", _WIDTH, subsequent_indent=" " * 10)
    return lines


def _place(texture: Texture) -> str:
    """Return where the surface is: its heights, and one copy of it in the plane."""
    low, high = (engineering(height, "m") for height in texture.extremes)
    parts = [f"heights {low} to {high}"]
    if len(texture.domain.spans) > 1:
        corners = texture.domain.points(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]))
        for axis, values in zip("xy", corners.T, strict=True):
            ends = (engineering(float(end), "m") for end in (values.min(), values.max()))
            parts.append(f"{axis} {' to '.join(ends)}")
    return ", ".join(parts)


def _plain(value: object) -> str:
    """Return a value of a description in short: lists are long, and in the data."""
    if isinstance(value, list):
        return _cut(f"[{', '.join(map(_plain, value))}]")
    return _cut(f"{value:g}" if isinstance(value, float) else str(value))


def _cut(text: str) -> str:
    return text if len(text) <= _WIDTH else f"{text[:40]} ..."


def _clamp(analysis: Analysis) -> str:
    surface = analysis.surface
    depth = engineering(surface.max_depth, "m")
    if surface.acting_clamp == "none":
        return f"none; meant to be pressed to {depth}"
    return f"{surface.acting_clamp}, the depth is held at {depth}"


def _bound(bound: Bound) -> str:
    if math.isfinite(bound.upper):
        return f"between {bound.lower:.6g} and {bound.upper:.6g} ({bound.method})"
    if math.isinf(bound.lower):
        return f"unbounded ({bound.method})"
    return f"at least {bound.lower:.6g}, no upper bound ({bound.method})"


def _wrapped(sentences: list[str]) -> list[str]:
    return [line for one in sentences for line in textwrap.wrap(one, _WIDTH)]
