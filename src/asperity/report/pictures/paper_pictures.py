"""Figures 2 and 3 of the paper, and figures of the simulated experiments of its section V."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.core.units import format_quantity
from asperity.laws import find_law
from asperity.paper.cycle_experiments import CycleCount, PassivityExperiment, bump_setup
from asperity.paper.experiments import BumpExperiment, Experiments, ScanningExperiment
from asperity.paper.figures import ForceField, LoopEnergy, force_fields
from asperity.report.pictures import style
from asperity.report.sentences.paper_text import loop_energy_text
from asperity.report.sentences.texts import readable_name, table_notes
from asperity.simulation.onset import Prediction

_COLUMNS = 4
_MILLI = 1e3
_MICRO = 1e6
_FORCE_PER_INCH = 4.0  # of arrows at a handle [N]
_MAX_ARROW_LENGTH = 0.24  # of the arrows of the field, in every panel [inch]
_HANDLE_ARROW = {"color": style.ORANGE, "width": 0.024, "scale": _FORCE_PER_INCH}
_KEY_FORCE = 2.0  # force of the arrow in the key [N]
_MIN_ENERGY_RANGE = 40.0  # least half range of an energy axis, so that rounding stays small [µJ]


def figure_two() -> Figure:
    """Return the force of each law in the x-z plane, and at a handle on either flank of a crest.

    Reference:
        The paper's Fig. 2.
    """
    panels = force_fields()
    figure = style.new_figure(10.0, 6.6)
    places = style.axes_grid(figure, len(panels), _COLUMNS, x="x [mm]", y="z [mm]")
    for axes, panel in zip(places, panels, strict=True):
        _draw_body(axes, panel)
        _draw_forces(axes, panel)
        style.mark_law(axes, panel.law)
        start = "flat wall" if _is_measured_from_wall(panel.law) else "texture"
        remark = f"depth below the {start}"
        style.set_panel_title(axes, panel.law, readable_name(panel.name), remark)
        axes.set_aspect("equal")
    _draw_key(figure.axes[-1])
    for axes in figure.axes:
        # Arrows at the border are not clipped, and must not shrink the panels.
        for artist in axes.collections:
            artist.set_in_layout(False)
    return figure


def _is_measured_from_wall(law: str) -> bool:
    """Return whether depth is measured from the smooth wall."""
    return not find_law(law).contact.begins_on_texture


def _draw_body(axes: Axes, panel: ForceField) -> None:
    """Draw the body, and limit the axes to the field."""
    low = panel.points[..., 1].min() * _MILLI
    high = panel.points[..., 1].max() * _MILLI
    _draw_solid(axes, panel, low, 1.2)
    x = panel.points[..., 0] * _MILLI
    axes.set(xlim=(x.min(), x.max()), ylim=(low, high + 0.15))


def _draw_solid(axes: Axes, panel: ForceField | LoopEnergy, low: float, width: float) -> None:
    """Draw the body, the texture, and the wall if depth is measured from it."""
    x = panel.x * _MILLI
    height = panel.height * _MILLI
    flat = _is_measured_from_wall(panel.law)
    style.fill_below(axes, x, 0.0 * height if flat else height, low)
    axes.plot(x, height, color=style.INK, lw=width, ls=":" if flat else "-")
    if flat:
        axes.axhline(0.0, color=style.INK, lw=width)


def _draw_forces(axes: Axes, panel: ForceField) -> None:
    points = panel.points[::2, ::2] * _MILLI
    forces = panel.forces[::2, ::2]
    acts = np.abs(forces).max(axis=-1) > 0.0
    scale = float(np.linalg.norm(forces, axis=-1).max()) / _MAX_ARROW_LENGTH
    handles = panel.handle_positions * _MILLI
    arrows: list[tuple[Any, Any, dict[str, Any]]] = [
        (points[acts], forces[acts], {"color": style.MUTED, "width": 0.008, "scale": scale}),
        (handles, panel.handle_forces, _HANDLE_ARROW),
    ]
    common = style.INCH_ARROWS | {"minlength": 0.4, "zorder": 4, "clip_on": False}
    for place, force, options in arrows:
        axes.quiver(*place[:, :2].T, *force[:, :2].T, **common, **options)
    axes.plot(handles[:, 0], handles[:, 1], "o", color=style.ORANGE, ms=4.0, zorder=5)


def _draw_key(axes: Axes) -> None:
    """Draw an arrow of known force in free axes."""
    axes.set_visible(True)
    axes.set_axis_off()
    place: dict[str, Any] = {"transform": axes.transAxes}
    options: dict[str, Any] = {**place, "fontsize": style.LABEL, "color": style.MUTED}
    arrow = style.INCH_ARROWS | _HANDLE_ARROW | place
    axes.quiver([0.02], [0.78], [_KEY_FORCE], [0.0], **arrow)
    handle = f"{_KEY_FORCE:g} N at a handle"
    axes.text(0.4, 0.78, handle, va="center", **options)
    for number, line in enumerate(table_notes("figure_two")):
        axes.text(0.02, 0.58 - 0.12 * number, line, va="center", **options)


def figure_three(panels: Sequence[LoopEnergy]) -> Figure:
    """Return the closed path of each law, and the work of its force along the path.

    Args:
        panels: see :func:`~asperity.paper.figures.loop_energies`.

    Reference:
        The paper's Fig. 3.
    """
    rows = -(-len(panels) // 2)
    figure = style.new_figure(10.0, 2.15 * rows)
    grid: Any = figure.subplots(rows, _COLUMNS)
    places = list(grid.ravel())
    for axes in places[2 * len(panels) :]:
        axes.set_axis_off()
    for number, panel in enumerate(panels):
        path = places[2 * number]
        work = places[2 * number + 1]
        for axes in (path, work):
            style.style_axes(axes)
            style.mark_law(axes, panel.law)
        lowest = number + 2 >= len(panels)
        _draw_path(path, panel)
        _draw_work(work, panel)
        style.label_outer_axes(path, "x [mm]", "z [mm]", lowest=lowest)
        style.label_axes(work, "", "energy [µJ]")
        if lowest:
            style.label_axes(work, "arc length [mm]", "energy [µJ]")
    return figure


def _draw_path(axes: Axes, panel: LoopEnergy) -> None:
    x = panel.x * _MILLI
    height = panel.height * _MILLI
    closed = np.concatenate([panel.vertices, panel.vertices[:1]]) * _MILLI
    low = min(float(closed[:, 1].min()), float(height.min())) - 0.2
    _draw_solid(axes, panel, low, 0.9)
    axes.plot(closed[:, 0], closed[:, 1], color=style.ORANGE, lw=1.4)
    middle = 0.5 * (closed[1:] + closed[:-1])
    leg = np.diff(closed, axis=0)
    head = {"width": 0.02, "headwidth": 5.0, "headlength": 6.0, "minlength": 0.0, "minshaft": 0.0}
    options = style.INCH_ARROWS | head | {"angles": "xy", "scale": 1e6, "pivot": "middle"}
    axes.quiver(*middle.T, *leg.T, color=style.ORANGE, zorder=4, **options)
    top = max(float(closed[:, 1].max()), float(height.max())) + 0.2
    axes.set(xlim=(x.min(), x.max()), ylim=(low, top))
    style.set_panel_title(axes, panel.law, readable_name(panel.name))


def _draw_work(axes: Axes, panel: LoopEnergy) -> None:
    length = panel.arc_length * _MILLI
    work = panel.work * _MICRO
    axes.set_label(panel.law)
    axes.plot(length, work, color=style.BLUE, lw=1.3, label="energy")
    axes.plot(length[-1:], work[-1:], "o", color=style.BLUE, ms=4.0, clip_on=False)
    style.draw_zero_line(axes, _MIN_ENERGY_RANGE)
    options: dict[str, Any] = {"fontsize": style.LABEL, "color": style.MUTED}
    axes.set_title(loop_energy_text(panel), loc="left", pad=5.0, **options)


# Colours of the laws, in their order.
_LAW_COLOURS = (style.ORANGE, style.MUTED, style.BLUE, "#cc79a7", style.GREEN)


# --- section V.A ----------------------------------------------------------------------------------


def cycles_figure(experiment: PassivityExperiment) -> Figure:
    """Return the height of the handle against time for each wall of figure 5."""
    counts = experiment.counts
    figure, panels = style.law_panels(len(counts), 2.1, 0.4, x="time [s]", y="z [mm]")
    for axes, count in zip(panels, counts, strict=True):
        _draw_wall(axes, count)
    return figure


def _draw_wall(axes: Axes, count: CycleCount) -> None:
    axes.axhspan(-100.0, 0.0, color=style.BODY, alpha=0.5, lw=0.0, zorder=0.0)
    colour = style.ORANGE if count.cycles else style.BLUE
    axes.plot(count.time, 1e3 * count.z, color=colour, lw=0.8, label="height")
    axes.set_ylim(-13.0, 6.5)
    remark = f"{count.cycles} of {count.starts} starts cycle"
    if count.slow:
        remark += f", {count.slow} decay slowly"
    style.mark_law(axes, count.law)
    style.set_panel_title(axes, count.wall, format_quantity(round(count.stiffness), "N/m"), remark)


# --- section V.B ----------------------------------------------------------------------------------


def energies_figure(experiment: ScanningExperiment) -> Figure:
    """Return energy along x and z against time, one panel per law."""
    traces = experiment.traces
    figure, panels = style.law_panels(
        len(traces), 2.3, 0.4, x="time [s]", y="energy [mJ]", sharey=False
    )
    for axes, trace in zip(panels, traces, strict=True):
        for i, (name, colour) in enumerate((("x", style.ORANGE), ("z", style.BLUE))):
            axes.plot(trace.time, 1e3 * trace.exact[:, i], color=colour, lw=1.2, label=name)
            summed = 1e3 * trace.paper[:, i]
            axes.plot(trace.time, summed, color=colour, lw=0.9, ls="--", label=f"{name}, paper's")
        style.draw_zero_line(axes, 0.5)
        style.set_panel_title(axes, trace.law, "")
        style.mark_law(axes, trace.law)
    style.add_legend(panels[0])
    return figure


# --- section V.C ----------------------------------------------------------------------------------


def bumps_figure(experiment: BumpExperiment) -> Figure:
    """Return path and energy over the bump, one row per entry."""
    entries = list(dict.fromkeys([run.entry for run in experiment.bumps]))
    laws = dict.fromkeys([run.law for run in experiment.bumps])
    colours = dict(zip(laws, _LAW_COLOURS * len(laws), strict=False))
    figure = style.new_figure(10.0, 2.8 * len(entries) + 0.4)
    grid: Any = figure.subplots(len(entries), 2, squeeze=False)
    x = np.linspace(-0.012, 0.014, 400)
    height = bump_setup("A").surface.texture.height(np.column_stack([x, 0.0 * x]))
    for (left, right), entry in zip(grid, entries, strict=True):
        for axes in (left, right):
            style.style_axes(axes)
        style.fill_below(left, 1e3 * x, 1e3 * height, -25.0)
        runs = [bump for bump in experiment.bumps if bump.entry == entry]
        for run in runs:
            options: dict[str, Any] = {"color": colours[run.law], "label": run.law}
            lines = left.plot(1e3 * run.x, 1e3 * run.z, lw=0.9, **options)
            lines += right.plot(run.time, 1e3 * run.supplied, lw=1.2, **options)
            for line in lines:
                style.mark_law(line, run.law)
        style.draw_zero_line(right)
        style.add_legend(right)
        left.set_ylim(-25.0, max(25.0, *[1e3 * run.z.max() + 2.0 for run in runs]))
        style.set_panel_title(left, "Path", entry)
        style.set_panel_title(right, "Energy", "supplied to the hand")
        style.label_axes(left, "x [mm]", "z [mm]")
        style.label_axes(right, "time [s]", "energy [mJ]")
    return figure


# --- other devices and surfaces -------------------------------------------------------------------


_PAPER_DEVICE = "section V.A"


class _OnsetPoint(NamedTuple):
    """One case: the stiffness that a rule allows [N/m], and the onset of cycles."""

    allowed: float
    prediction: Prediction
    device: str
    is_missed: bool


def devices_figure(experiments: Experiments) -> Figure:
    """Return onset against allowed stiffness for two rules, on logarithmic axes."""
    figure = style.new_figure(10.0, 5.2)
    left, right = figure.subplots(1, 2, sharex=True, sharey=True)
    devices = dict.fromkeys([onset.device for onset in experiments.devices.onsets])
    markers = {**dict(zip(devices, "osD^vP*" * len(devices), strict=False)), _PAPER_DEVICE: "X"}
    wall_rule = [
        _OnsetPoint(
            onset.catalogue_rule, onset.prediction, onset.device, onset.catalogue_rule_missed
        )
        for onset in experiments.devices.onsets
    ]
    wall_rule += [
        _OnsetPoint(
            prediction.wall_rule or math.nan,
            prediction,
            _PAPER_DEVICE,
            prediction.violates_wall_rule,
        )
        for prediction in experiments.passivity.onsets
    ]
    delay_rule = [
        _OnsetPoint(prediction.delay_rule, prediction, device, prediction.violates_delay_rule)
        for _allowed, prediction, device, _missed in wall_rule
        if prediction.conservative
    ]
    for axes, points, name in ((left, wall_rule, "K₀/q"), (right, delay_rule, "delay rule")):
        _draw_rule(axes, points, markers)
        style.label_axes(axes, f"allowed by {name} [N/m]")
        missed = sum([point.is_missed for point in points])
        style.set_panel_title(axes, name, f"{missed} of {len(points)} wrong")
    left.set_ylabel("cycles from [N/m]", fontsize=style.LABEL, color=style.MUTED)
    for device, marker in markers.items():
        left.plot([], [], marker, mfc=style.BACKGROUND, mec=style.BLUE, label=device)
    style.add_legend(left)
    return figure


def _draw_rule(axes: Axes, points: Sequence[_OnsetPoint], markers: Mapping[str, str]) -> None:
    style.style_axes(axes)
    axes.set(xscale="log", yscale="log")
    named: dict[tuple[int, int], list[_OnsetPoint]] = {}  # by position
    for point in points:
        allowed = point.allowed
        onset = point.prediction.onset
        if not (math.isfinite(onset.value) and math.isfinite(allowed) and allowed > 0.0):
            continue
        place = round(3.0 * math.log10(allowed)), round(8.0 * math.log10(onset.value))
        named.setdefault(place, []).append(point)
        options: dict[str, Any] = {"mec": style.BLUE, "mfc": style.BACKGROUND}
        if point.is_missed:
            options = {"color": style.ORANGE}
        label = f"_{onset.law}, {point.device}"
        marker = markers[point.device]
        (drawn,) = axes.plot(allowed, onset.value, marker, label=label, mew=0.9, ms=5.5, **options)
        style.mark_law(drawn, onset.law)
    for near in named.values():
        letters = "".join(dict.fromkeys([point.prediction.onset.law for point in near]))
        last = max(near, key=lambda point: point.allowed)
        note: dict[str, Any] = {"textcoords": "offset points", "color": style.MUTED}
        corner = (last.allowed, last.prediction.onset.value)
        axes.annotate(letters, corner, (5, 3), fontsize=7.0, **note)
    axes.plot([1.0, 1e5], [1.0, 1e5], color=style.FAINT, lw=1.2, zorder=0.0)
