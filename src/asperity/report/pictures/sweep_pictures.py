"""Figures of a sweep: lines over one varied number, heat maps over two."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter

from asperity.core.checks import FloatArray
from asperity.report.pictures import style
from asperity.sweeps.sweep_result import SweepResult

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
    others = [*(key for key in keys if key not in axes_names), *result.run.index]
    groups: dict[Group, list[list[Any]]] = {}
    for row in result.iterate_rows():
        if row.get(name) is not None:
            group = tuple(_text(row[key]) for key in others if key in columns)
            groups.setdefault(group, []).append([*(row[key] for key in axes_names), row[name]])
    labels = [_use_millimetres(groups.values(), i, one) for i, one in enumerate(axes_names)]
    if len(axes_names) == 1:
        return _line_figure(groups, labels[0], name)
    return _map_figure(groups, labels, name, is_grid=not plan.design)


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _use_millimetres(tables: Iterable[list[list[Any]]], axis: int, column: str) -> str:
    """Return the label of an axis; the lengths of one are converted to a better unit."""
    if not column.endswith("[m]"):
        return column
    rows = [row for table in tables for row in table]
    unit = style.length_unit(max(abs(row[axis]) for row in rows))
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
            shown = [value if math.isfinite(value) else math.nan for value in values]
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
    limits = {"vmin": finite.min(), "vmax": finite.max()} if len(finite) else {}
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
