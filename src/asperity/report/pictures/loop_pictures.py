"""Figures of a loop: motion, force, energy, phase of a run; onsets, strokes, cases of sweeps."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.recording.recording import Recording
from asperity.recording.replay import recorded_field
from asperity.recording.row_encoding import NamedColumns
from asperity.report.pictures import style
from asperity.simulation.onset import Prediction
from asperity.simulation.scan import Stroke
from asperity.simulation.trace import MAX_ROWS
from asperity.sweeps.sweep_result import SweepResult

_MAX_POINTS = 6000
_AXIS_NAMES = ("x", "y", "z")
_AXIS_COLOURS = (style.ORANGE, style.GREEN, style.BLUE)


HeightFunction = Callable[[FloatArray], FloatArray]
"""Returns the heights of the surface [m], shape (n,), at points (n, 2) [m]."""


def run_figure(run: NamedColumns, height: HeightFunction) -> Figure:
    """Return height, force and energy against time, the path, and the phase portrait.

    Args:
        run: with its trace in memory.
        height: of the surface.
    """
    figure = style.new_figure(10.0, 8.2)
    grid: Any = figure.add_gridspec(3, 3, width_ratios=[1.0, 1.0, 0.95])
    step = max(1, -(-len(run.time) // _MAX_POINTS))
    shown = slice(None, None, step)
    motion = figure.add_subplot(grid[0, :2])
    force = figure.add_subplot(grid[1, :2], sharex=motion)
    energy = figure.add_subplot(grid[2, :2], sharex=motion)
    path = figure.add_subplot(grid[0, 2])
    phase_z = figure.add_subplot(grid[1, 2])
    phase_x = figure.add_subplot(grid[2, 2])
    for axes in (motion, force, energy, path, phase_z, phase_x):
        style.style_axes(axes)
    _draw_motion(motion, run, height, shown)
    _draw_force(force, run, shown)
    _draw_energy(energy, run, shown)
    _draw_path(path, run, height, shown)
    _draw_phase(phase_z, run, 2, shown)
    _draw_phase(phase_x, run, _scan_axis(run), shown)
    return figure


def recording_figure(recording: Recording) -> Figure:
    """Return motion, force, energy and phase of a recording.

    Raises:
        ParameterError: for less than two rows, or missing columns.
    """
    traced = recording.to_columns(MAX_ROWS)
    if len(traced.table) < 2:
        raise ParameterError("recording", "needs at least two rows to be drawn")
    return run_figure(traced, recorded_field(recording).height)


def _scan_axis(run: NamedColumns) -> int:
    """Return the axis, 0 or 1, with the longer motion of the handle."""
    return int(np.argmax(np.ptp(run.position[:, :2], axis=0)))


def _draw_motion(
    axes: Axes, run: NamedColumns, height_at: HeightFunction, selection: slice
) -> None:
    time = run.time[selection]
    place = run.position[selection]
    height = height_at(place[:, :2])
    unit = style.length_unit(float(np.abs(np.append(place[:, 2], height)).max()))
    low = min(float(place[:, 2].min()), float(height.min())) * unit.scale
    style.fill_below(axes, time, height * unit.scale, low)
    axes.plot(time, place[:, 2] * unit.scale, color=style.BLUE, lw=1.0, label="handle")
    if run.has_columns("anchor z"):  # not known on a real device
        anchor = run.select("anchor z")[selection, 0]
        if np.abs(anchor).max() < 4.0 * max(np.abs(place[:, 2]).max(), 1e-9):
            axes.plot(time, anchor * unit.scale, color=style.MUTED, lw=0.8, ls="--", label="hand")
            style.add_legend(axes)
    style.label_axes(axes, "", f"z [{unit.name}]")
    style.set_panel_title(axes, "Motion", "height of the handle over the surface below it")


def _nonzero_axes(values: np.ndarray) -> list[int]:
    """Return the axes that are not constantly zero."""
    return [i for i in range(3) if np.any(values[:, i] != 0.0)] or [2]


def _draw_force(axes: Axes, run: NamedColumns, selection: slice) -> None:
    applied = run.applied[selection]
    unit = style.force_unit(float(np.abs(applied).max()))
    for i in _nonzero_axes(applied):
        options: dict[str, Any] = {"color": _AXIS_COLOURS[i], "lw": 0.8, "label": _AXIS_NAMES[i]}
        axes.plot(run.time[selection], applied[:, i] * unit.scale, **options)
    style.add_legend(axes)
    style.label_axes(axes, "", f"force [{unit.name}]")
    style.set_panel_title(axes, "Force", "applied to the handle")


def _draw_energy(axes: Axes, run: NamedColumns, selection: slice) -> None:
    time = run.time[selection]
    if run.has_columns("supplied x"):
        energies = run.energies
        supplied = energies["supplied"][selection] * 1e3
        for i in _nonzero_axes(supplied):
            axes.plot(time, supplied[:, i], color=_AXIS_COLOURS[i], lw=0.8, label=_AXIS_NAMES[i])
        total = supplied.sum(axis=1)
        paper = energies["same_sample"][selection].sum(axis=1) * 1e3
        axes.plot(time, paper, color=style.MUTED, lw=0.9, ls="--", label="the paper's sum")
    else:  # a real device records the sum alone
        total = run.select("supplied")[selection, 0] * 1e3
    axes.plot(time, total, color=style.INK, lw=1.4, label="sum, exact")
    style.draw_zero_line(axes)
    style.add_legend(axes)
    style.label_axes(axes, "time [s]", "energy [mJ]")
    style.set_panel_title(axes, "Energy", "supplied by the texture; positive: gained by the hand")


def _draw_path(axes: Axes, run: NamedColumns, height_at: HeightFunction, selection: slice) -> None:
    i = _scan_axis(run)
    place = run.position[selection]
    wide = style.length_unit(float(np.abs(place[:, i]).max()))
    high = style.length_unit(float(np.abs(place[:, 2]).max()))
    low = float(place[:, i].min())
    top = float(place[:, i].max())
    line = np.repeat(np.median(run.position, axis=0)[None, :2], 600, axis=0)
    line[:, i] = np.linspace(low, top, 600)
    height = height_at(line)
    floor = min(float(place[:, 2].min()), float(height.min()))
    style.fill_below(axes, line[:, i] * wide.scale, height * high.scale, floor * high.scale)
    x = place[:, i] * wide.scale
    z = place[:, 2] * high.scale
    axes.plot(x, z, color=style.BLUE, lw=0.7, label="path")
    style.label_axes(axes, f"{_AXIS_NAMES[i]} [{wide.name}]", f"z [{high.name}]")
    style.set_panel_title(axes, "Path", f"in the {_AXIS_NAMES[i]}-z plane")


def _axis_velocity(run: NamedColumns, i: int) -> FloatArray:
    """Return the velocity along an axis, from positions if it is not recorded."""
    if run.has_columns("vx", "vy", "vz"):
        return run.velocity[:, i]
    steps = np.diff(run.position[:, i]) / np.diff(run.time)
    return np.append(steps[:1], steps)


def _draw_phase(axes: Axes, run: NamedColumns, i: int, selection: slice) -> None:
    place = run.position[selection, i]
    speed = _axis_velocity(run, i)[selection]
    unit = style.length_unit(float(np.abs(place).max()))
    fast = style.length_unit(float(np.abs(speed).max()))
    last = len(place) - max(len(place) // 4, 1)
    axes.plot(place * unit.scale, speed * fast.scale, color=style.FAINT, lw=0.6, label="phase")
    axes.plot(place[last:] * unit.scale, speed[last:] * fast.scale, color=style.BLUE, lw=0.8)
    name = _AXIS_NAMES[i]
    style.label_axes(axes, f"{name} [{unit.name}]", f"d{name}/dt [{fast.name}/s]")
    style.set_panel_title(axes, "Phase", f"along {name}, last quarter blue")


_DASHES = ("-", "--", ":", "-.")


def onset_figure(predictions: Sequence[Prediction]) -> Figure:
    """Return onset stiffness against delay, one panel per law, with the predictions."""
    laws = list(dict.fromkeys([case.onset.law for case in predictions]))
    figure, panels = style.law_panels(len(laws), 2.3, 0.5, x="delay [samples]", y="stiffness [N/m]")
    for axes, law in zip(panels, laws, strict=True):
        mine = [case for case in predictions if case.onset.law == law]
        proved = mine[0].conservative
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        delays = [case.onset.delay for case in mine]
        dashes = "-" if proved else ":"
        lines: list[tuple[str, list[float], dict[str, Any]]] = [
            ("onset", [case.onset.value for case in mine], _line_style(style.BLUE, "-", 1.2, "o")),
            ("delay rule", [case.delay_rule for case in mine], _line_style(style.GREEN, dashes)),
            ("paper (1)", [case.paper_limit for case in mine], _line_style(style.MUTED, "--")),
            (
                "K₀/q",
                [case.wall_rule or math.nan for case in mine],
                _line_style(style.ORANGE, "-."),
            ),
        ]
        for name, values, options in lines:
            shown = np.array(values)
            shown[~(np.isfinite(shown) & (shown > 0.0))] = np.nan  # not on a logarithmic axis
            axes.plot(delays, shown, label=name, **options)
        if any(case.onset.quiet == 0.0 for case in predictions):
            below = [math.nan if case.onset.quiet else case.onset.cycling for case in mine]
            options = _line_style(style.BLUE, "", marker="v") | {"ms": 8.0, "mfc": style.BACKGROUND}
            axes.plot(delays, below, label="the least tried", **options)
        style.set_panel_title(axes, law, "conservative" if proved else "not conservative: no proof")
        style.mark_law(axes, law)
    style.add_legend(panels[0])
    return figure


def _line_style(colour: str, dashes: str, width: float = 1.1, marker: str = "") -> dict[str, Any]:
    return {"color": colour, "ls": dashes, "lw": width, "marker": marker, "ms": 4.0}


def strokes_figure(strokes: Sequence[Stroke]) -> Figure:
    """Return energy per stroke against speed, one panel per law, one line per depth."""
    laws = list(dict.fromkeys([stroke.law for stroke in strokes]))
    figure, panels = style.law_panels(
        len(laws), 2.3, 0.5, x="speed [m/s]", y="energy per stroke [mJ]", sharey=False
    )
    totals = [abs(stroke.total) for stroke in strokes if math.isfinite(stroke.total)]
    least = 1e3 * 0.01 * max(totals, default=1e-3)
    for axes, law in zip(panels, laws, strict=True):
        _draw_law_strokes(axes, [stroke for stroke in strokes if stroke.law == law])
        style.draw_zero_line(axes, least)  # so that small values stay small
        axes.xaxis.set_major_locator(MaxNLocator(5))
        style.set_panel_title(axes, law, "")
        style.mark_law(axes, law)
    style.add_legend(panels[0])
    return figure


def _draw_law_strokes(axes: Axes, strokes: Sequence[Stroke]) -> None:
    """Draw stroke line per depth: the sum, and thinner lines for x and z."""
    depths = dict.fromkeys([stroke.depth for stroke in strokes])
    for depth, dashes in zip(depths, _DASHES * len(depths), strict=False):
        mine = [stroke for stroke in strokes if stroke.depth == depth]
        speeds = [stroke.speed for stroke in mine]
        name = f"{format_quantity(depth, 'm', digits=3)} deep"
        for i, colour in ((0, style.ORANGE), (2, style.BLUE)):
            values = [1e3 * stroke.energy[i] for stroke in mine]
            along = f"_{'xyz'[i]}, {name}"
            axes.plot(speeds, values, dashes, color=colour, lw=0.9, label=along)
        values = [1e3 * stroke.total for stroke in mine]
        axes.plot(speeds, values, dashes, color=style.INK, lw=1.5, marker="o", ms=3.0, label=name)


_MAX_PANELS = 18
_LOGARITHMIC = 5.0  # ratio of the greatest to the least value of an axis that is logarithmic
Group = tuple[str, ...]


def sweep_figure(result: SweepResult, name: str) -> Figure:
    """Return one column of a sweep over the varied numbers, a panel for each other choice.

    With one varied number, lines; with two or more, heat maps over the first two; with a design,
    coloured points. Without any, points over the first key.

    Args:
        result: the sweep.
        name: the column.
    """
    plan = result.plan
    columns = result.columns
    keys = [plan.column(key) for key in plan.arguments]
    axes_names = [key for key in keys if columns[key] in (int, float)][:2] or keys[:1]
    others = [*[key for key in keys if key not in axes_names], *result.run.index]
    groups: dict[Group, list[list[Any]]] = {}
    for row in result.iterate_rows():
        if row.get(name) is not None:
            group = tuple([_text(row[key]) for key in others if key in columns])
            groups.setdefault(group, []).append([row[key] for key in (*axes_names, name)])
    labels = [_use_millimetres(groups.values(), i, column) for i, column in enumerate(axes_names)]
    if len(axes_names) == 1:
        return _line_figure(groups, labels[0], name)
    return _map_figure(groups, labels, name, is_grid=not plan.design)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def _use_millimetres(tables: Iterable[list[list[Any]]], axis: int, column: str) -> str:
    """Return the label of an axis; the lengths of one are converted to a better unit."""
    if not column.endswith("[m]"):
        return column
    rows = [row for table in tables for row in table]
    unit = style.length_unit(max([abs(row[axis]) for row in rows]))
    for row in rows:
        row[axis] *= unit.scale
    return f"{column[:-2]}{unit.name}]"


def _line_figure(groups: dict[Group, list[list[Any]]], x: str, y: str) -> Figure:
    """Return one panel per first choices, with a line for the last one, such as the law."""
    panels: dict[Group, dict[Group, list[list[Any]]]] = {}
    for group, rows in list(groups.items()):
        panels.setdefault(group[:-1], {})[group[-1:]] = rows
    figure, axes = style.law_panels(min(len(panels), _MAX_PANELS), 2.6, 0.6, x=x, y=y)
    for panel, (title, lines) in zip(axes, panels.items(), strict=False):
        for label, rows in lines.items():
            places, values = zip(*rows, strict=True)
            shown = np.array(values, dtype=float)
            shown[~np.isfinite(shown)] = np.nan
            panel.plot(places, shown, "o-", ms=2.5, lw=1.0, label=", ".join(label))
        _scale(panel, [row for rows in lines.values() for row in rows])
        style.set_panel_title(panel, ", ".join(title), "")
    style.add_legend(axes[0])
    return figure


def _scale(axes: Axes, rows: Sequence[Sequence[Any]]) -> None:
    """Make the axes logarithmic whose values are positive and far apart."""
    for values, scale, axis in zip(
        zip(*rows, strict=True),
        (axes.set_xscale, axes.set_yscale),
        (axes.xaxis, axes.yaxis),
        strict=False,
    ):
        numbers = [v for v in values if not isinstance(v, str) and math.isfinite(v)]
        if numbers and min(numbers) > 0.0 and max(numbers) > _LOGARITHMIC * min(numbers):
            scale("log")
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter(NullFormatter())
        elif numbers:
            axis.set_major_locator(MaxNLocator(4))


def _map_figure(
    groups: dict[Group, list[list[Any]]], names: Sequence[str], label: str, *, is_grid: bool
) -> Figure:
    """Return a panel per choice, coloured by the number, on one scale."""
    shown = dict(list(groups.items())[:_MAX_PANELS])
    figure, axes = style.law_panels(len(shown), 2.8, 1.0, x=names[0], y=names[1])
    tables = [np.array(rows, dtype=np.float64) for rows in shown.values()]
    finite = np.concatenate([table[np.isfinite(table[:, 2]), 2] for table in tables])
    limits = {}
    if len(finite):
        limits = {"vmin": finite.min(), "vmax": finite.max()}
    for panel, title, table in zip(axes, shown, tables, strict=True):
        artist = _draw_map(panel, table, is_grid, {**limits, "cmap": style.HEIGHTS})
        _scale(panel, table[:, :2].tolist())
        style.set_panel_title(panel, ", ".join(title), "")
    style.add_colorbar(figure, artist, axes, label, **{**style.WIDE_COLORBAR, "extend": "neither"})
    return figure


def _draw_map(axes: Axes, table: FloatArray, is_grid: bool, colours: dict[str, Any]) -> Any:
    """Draw the values of a grid, or of points anywhere."""
    x = np.unique(table[:, 0])
    y = np.unique(table[:, 1])
    if not is_grid or min(len(x), len(y)) < 2:
        return axes.scatter(table[:, 0], table[:, 1], c=table[:, 2], s=14, **colours)
    values = np.full((len(y), len(x)), np.nan)
    values[np.searchsorted(y, table[:, 1]), np.searchsorted(x, table[:, 0])] = table[:, 2]
    return axes.pcolormesh(x, y, values, shading="nearest", rasterized=True, **colours)
