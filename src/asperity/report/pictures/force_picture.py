"""The forces along a straight scan, one panel per law, on shared axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from asperity.analysis.energy.merit import scan_height
from asperity.report.pictures import style
from asperity.report.pictures.vertical_cut import (
    PlaneForces,
    Stretch,
    feature_length,
    scan_forces,
    stretch_of,
)
from asperity.report.words.number_words import law_title
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering

_COLUMNS = 2
# A panel is cut where it would dwarf the others by more than this.
_DWARFED = 3.0


def force_stretch(texture: Texture) -> Stretch:
    """Return the part of the scan line that the pictures of forces show."""
    length = feature_length(texture)
    return stretch_of(texture, 2.0 * length, 12.0 * length)


def force_size(count: int) -> tuple[float, float]:
    """Return width and height of the picture [inch]."""
    return 10.0, 1.45 * math.ceil(count / _COLUMNS) + 1.0


def draw_forces(figure: Figure | SubFigure, surfaces: Sequence[Surface]) -> None:
    """Draw tangential and normal force along the scan for every law, on shared axes."""
    stretch = force_stretch(surfaces[0].texture)
    forces = [scan_forces(surface, stretch) for surface in surfaces]
    alike = len({surface.stiffness for surface in surfaces}) == 1
    limits = _shared_limits(forces, alike)
    unit = style.force_unit(max(map(abs, limits)))
    wide = style.length_unit(stretch.length)
    x, y = f"along the scan line [{wide.name}]", f"force [{unit.name}]"
    panels = style.panels(figure, len(surfaces), _COLUMNS, x=x, y=y)
    for axes, surface, force in zip(panels, surfaces, forces, strict=True):
        _draw_panel(axes, surface, force, (wide, unit))
        _mark_cut(axes, force, limits, unit)
    panels[0].set_ylim(limits[0] * unit.scale, limits[1] * unit.scale)
    panels[0].set_xlim(0.0, stretch.length * wide.scale)
    _draw_key(figure, panels[0])


def _shared_limits(forces: Sequence[PlaneForces], alike: bool) -> tuple[float, float]:
    """Return the limits of the shared axis [N]: all, unless one law dwarfs the rest.

    It may do so at its own stiffness, which is then the answer: only laws at one stiffness are cut.
    """
    lows = [min(float(f.tangential.min()), float(f.normal.min()), 0.0) for f in forces]
    highs = [max(float(f.tangential.max()), float(f.normal.max()), 0.0) for f in forces]
    spans = sorted(max(high, -low) for low, high in zip(lows, highs, strict=True))
    usual = spans[(len(spans) - 1) // 2 if alike else -1]
    limit = _DWARFED * usual if usual > 0.0 else (spans[-1] or 1.0)
    low, high = max(min(lows), -limit), min(max(highs), limit)
    margin = 0.08 * ((high - low) or 1.0)
    return low - margin, high + margin


def _draw_panel(
    axes: Axes, surface: Surface, force: PlaneForces, units: tuple[style.Unit, style.Unit]
) -> None:
    wide, unit = units
    x = force.along * wide.scale
    axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
    axes.plot(x, force.normal * unit.scale, color=style.ORANGE, linewidth=1.3, label="normal")
    axes.plot(x, force.tangential * unit.scale, color=style.BLUE, linewidth=1.3, label="tangential")
    style.entitle(axes, surface.law.letter, law_title(surface.law.name))
    style.of_law(axes, surface.law.letter)
    axes.set_title(
        f"z = {engineering(scan_height(surface), 'm', digits=2)}",
        loc="right",
        fontsize=style.TICK,
        color=style.SOFT,
    )


def _mark_cut(
    axes: Axes, force: PlaneForces, limits: tuple[float, float], unit: style.Unit
) -> None:
    """Say how far a curve goes that leaves the panel."""
    both = np.concatenate([force.tangential, force.normal])
    low, high = float(both.min()), float(both.max())
    words = []
    if high > limits[1]:
        words.append(f"up to {high * unit.scale:.2g} {unit.name}")
    if low < limits[0]:
        words.append(f"down to {low * unit.scale:.2g} {unit.name}")
    if words:
        left = f"leaves the picture: {', '.join(words)}"
        style.note(axes, left, (0.99, 0.95), ha="right", va="top", color=style.INK)


def _draw_key(figure: Figure | SubFigure, axes: Axes) -> None:
    handles, names = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        [f"{name} force" for name in names],
        loc="outside upper left",
        ncols=2,
        fontsize=style.LABEL,
        frameon=False,
        labelcolor=style.INK,
    )
