"""The paper's figures 2 and 3, drawn from what the laws give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.laws import find_law
from asperity.paper.figures import ForceField, LoopEnergy, force_fields, loop_energies
from asperity.report.pictures import style
from asperity.report.words.number_words import law_title

_COLUMNS = 4
_MILLI, _MICRO = 1e3, 1e6
_PER_INCH = 4.0  # force at a handle that an inch of arrow stands for [N]
_LONGEST = 0.24  # of the arrows of the field, in every panel [inch]
_KEY = 2.0  # force of the arrow in the key [N]
_LEAST = 40.0  # half the height of an energy axis, so that nothing looks like nothing [µJ]


def figure_two(panels: Sequence[ForceField] | None = None) -> Figure:
    """Return the force of each law in the x-z plane, and at a handle on either flank of a crest.

    Args:
        panels: see :func:`~asperity.paper.figures.force_fields`; computed by default.

    Reference:
        The paper's Fig. 2.
    """
    panels = force_fields() if panels is None else panels
    figure = style.new_figure(10.0, 6.6)
    grid: Any = figure.subplots(2, _COLUMNS, sharex=True, sharey=True)
    places = list(grid.ravel())
    for number, (axes, panel) in enumerate(zip(places, panels, strict=False)):
        style.dress(axes)
        _draw_body(axes, panel)
        _draw_forces(axes, panel)
        style.of_law(axes, panel.law)
        start = "flat wall" if _is_flat(panel.law) else "texture"
        style.entitle(axes, panel.law, law_title(panel.name), f"depth below the {start}")
        style.label(
            axes,
            "x [mm]" if number + _COLUMNS >= len(panels) else "",
            "z [mm]" if number % _COLUMNS == 0 else "",
        )
        axes.tick_params(labelbottom=number + _COLUMNS >= len(panels))
        axes.set_aspect("equal")
    _draw_key(places[len(panels) :])
    for axes in places:
        # Arrows at the border are not clipped; they must not shrink the panels either.
        for artist in axes.collections:
            artist.set_in_layout(False)
    return figure


def _is_flat(law: str) -> bool:
    """Return whether depth is counted from the smooth wall."""
    return not find_law(law).contact.begins_on_texture


def _draw_body(axes: Axes, panel: ForceField) -> None:
    """Draw what is solid, and show the part of the plane that the field fills."""
    low, high = panel.points[..., 1].min() * _MILLI, panel.points[..., 1].max() * _MILLI
    _draw_solid(axes, panel, low, 1.2)
    axes.set_xlim(panel.points[..., 0].min() * _MILLI, panel.points[..., 0].max() * _MILLI)
    axes.set_ylim(low, high + 0.15)


def _draw_solid(axes: Axes, panel: ForceField | LoopEnergy, low: float, width: float) -> None:
    """Draw what is solid, the texture, and the wall where depth is counted from it."""
    x, height = panel.x * _MILLI, panel.height * _MILLI
    flat = _is_flat(panel.law)
    axes.fill_between(x, 0.0 * height if flat else height, low, color=style.BODY, lw=0.0, alpha=0.6)
    axes.plot(x, height, color=style.INK, lw=width, ls=":" if flat else "-")
    if flat:
        axes.axhline(0.0, color=style.INK, lw=width)


def _draw_forces(axes: Axes, panel: ForceField) -> None:
    points, forces = panel.points[::2, ::2] * _MILLI, panel.forces[::2, ::2]
    acts = np.abs(forces).max(axis=-1) > 0.0
    scale = float(np.linalg.norm(forces, axis=-1).max()) / _LONGEST
    arrows: list[tuple[Any, Any, str, float, float]] = [
        (points[acts], forces[acts], style.SOFT, 0.008, scale),
        (panel.handles * _MILLI, panel.handle_forces, style.ORANGE, 0.024, _PER_INCH),
    ]
    for place, force, colour, width, per_inch in arrows:
        axes.quiver(
            place[:, 0], place[:, 1], force[:, 0], force[:, 1], angles="uv", units="inches",
            scale_units="inches", scale=per_inch, width=width, color=colour, minlength=0.4,
            zorder=4, clip_on=False,
        )  # fmt: skip
    handles = panel.handles * _MILLI
    axes.plot(handles[:, 0], handles[:, 1], "o", color=style.ORANGE, ms=4.0, zorder=5)


def _draw_key(places: Sequence[Axes]) -> None:
    """Draw an arrow of known force in the first place that is left; hide the others."""
    for axes in places:
        axes.set_axis_off()
    if not places:
        return
    style_of: dict[str, Any] = {
        "transform": places[0].transAxes,
        "fontsize": style.LABEL,
        "color": style.SOFT,
    }
    key: dict[str, Any] = {"units": "inches", "scale_units": "inches", "scale": _PER_INCH}
    places[0].quiver(
        [0.02], [0.78], [_KEY], [0.0], transform=places[0].transAxes, angles="uv", width=0.024,
        color=style.ORANGE, **key,
    )  # fmt: skip
    words = (
        f"{_KEY:g} N at a handle",
        "brown: where the force acts",
        "grey: its direction, and its",
        "size within one panel",
        "F: while it slides to +x",
    )
    places[0].text(0.4, 0.78, words[0], va="center", **style_of)
    for number, line in enumerate(words[1:]):
        places[0].text(0.02, 0.58 - 0.12 * number, line, va="center", **style_of)


def figure_three(panels: Sequence[LoopEnergy] | None = None) -> Figure:
    """Return the closed path of each law, and the work of its force along the way.

    Args:
        panels: see :func:`~asperity.paper.figures.loop_energies`; computed by default.

    Reference:
        The paper's Fig. 3.
    """
    panels = loop_energies() if panels is None else panels
    rows = -(-len(panels) // 2)
    figure = style.new_figure(10.0, 2.15 * rows)
    grid: Any = figure.subplots(rows, _COLUMNS)
    places = list(grid.ravel())
    for axes in places[2 * len(panels) :]:
        axes.set_axis_off()
    for number, panel in enumerate(panels):
        path, work = places[2 * number], places[2 * number + 1]
        for axes in (path, work):
            style.dress(axes)
            style.of_law(axes, panel.law)
        lowest = number + 2 >= len(panels)
        _draw_path(path, panel)
        _draw_work(work, panel)
        path.tick_params(labelbottom=lowest)
        style.label(path, "x [mm]" if lowest else "", "z [mm]")
        style.label(work, "way along the path [mm]" if lowest else "", "energy [µJ]")
    return figure


def _draw_path(axes: Axes, panel: LoopEnergy) -> None:
    x, height = panel.x * _MILLI, panel.height * _MILLI
    closed = np.concatenate([panel.vertices, panel.vertices[:1]]) * _MILLI
    low = min(float(closed[:, 1].min()), float(height.min())) - 0.2
    _draw_solid(axes, panel, low, 0.9)
    axes.plot(closed[:, 0], closed[:, 1], color=style.ORANGE, lw=1.4)
    middle, leg = 0.5 * (closed[1:] + closed[:-1]), np.diff(closed, axis=0)
    axes.quiver(
        middle[:, 0], middle[:, 1], leg[:, 0], leg[:, 1], angles="xy", units="inches",
        scale_units="inches", scale=1e6, width=0.02, headwidth=5.0, headlength=6.0, minlength=0.0,
        minshaft=0.0, pivot="middle", color=style.ORANGE, zorder=4,
    )  # fmt: skip
    axes.set_xlim(x.min(), x.max())
    axes.set_ylim(low, max(float(closed[:, 1].max()), float(height.max())) + 0.2)
    style.entitle(axes, panel.law, law_title(panel.name))


def _draw_work(axes: Axes, panel: LoopEnergy) -> None:
    way, work = panel.way * _MILLI, panel.work * _MICRO
    axes.set_label(panel.law)
    axes.plot(way, work, color=style.BLUE, lw=1.3, label="energy")
    axes.plot(way[-1:], work[-1:], "o", color=style.BLUE, ms=4.0, clip_on=False)
    style.zero_line(axes, _LEAST)
    axes.set_title(energy_words(panel), loc="left", fontsize=style.LABEL, color=style.SOFT, pad=5.0)


def energy_words(panel: LoopEnergy) -> str:
    """Return what the loop gives, in words."""
    gain = round(panel.energy * _MICRO, 1)
    source = f", as {panel.equation}" if panel.equation else ""
    return f"gains {gain:.1f} µJ{source}" if gain > 0.0 else f"returns all{source}"
