"""Numbers of a figure, for the pointer, tables and text alternatives of a page.

They are extracted from the figure itself: lines with a label, which is hidden from the legend if it
begins with an underscore, and fields in colours.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D

from asperity.core.checks import FloatArray
from asperity.report.pictures import style
from asperity.report.sentences.texts import sentence_case

_COLORBAR_LABEL = "<colorbar>"  # what matplotlib calls the axes of a colour bar
_MAX_POINTS = 2000  # of a line
_MAX_CELLS = (64, 40)  # at most, of a field: along and up
_DIGITS = 5
_FIELD_DIGITS = 3


@dataclass(frozen=True)
class Series:
    """A line or points: name, letter of the law or none, and values in the units of the axes."""

    name: str
    law: str
    x: FloatArray
    y: FloatArray


@dataclass(frozen=True)
class FieldData:
    """Values of equal cells over a panel: rows upwards, NaN without data."""

    name: str
    values: FloatArray


@dataclass(frozen=True)
class Panel:
    """Axes of a figure.

    Attributes:
        name: its title; may be empty.
        law: letter of its law; may be empty.
        box: left, top, width, height in the units of the SVG.
        axes: the Matplotlib axes.
        x: label of the horizontal axis with its unit.
        y: label of the vertical axis with its unit.
        series: its lines.
        field: its values in colours, if any.
    """

    name: str
    law: str
    box: tuple[float, float, float, float]
    axes: Axes
    x: str
    y: str
    series: list[Series]
    field: FieldData | None


def extract_panels(figure: Figure) -> list[Panel]:
    """Return the panels of a figure, which must have been drawn, as that places the panels."""
    panels = []
    for axes in figure.axes:
        if axes.get_label() != _COLORBAR_LABEL and axes.get_visible() and axes.axison:
            panel = _extract_panel(figure, axes)
            if panel.series or panel.field is not None:
                panels.append(panel)
    return panels


def _extract_panel(figure: Figure, axes: Axes) -> Panel:
    wide, high = 72.0 * figure.get_size_inches()
    x0, y0, width, height = axes.get_position().bounds
    law = _find_law(axes)
    return Panel(
        f"{axes.get_label()}" or axes.get_title(loc="left"),
        law,
        (x0 * wide, (1.0 - y0 - height) * high, width * wide, height * high),
        axes,
        axes.get_xlabel() or _neighbour_label(figure, axes, "x"),
        axes.get_ylabel() or _neighbour_label(figure, axes, "y"),
        [_extract_series(line, law) for line in axes.get_lines() if _is_data_line(axes, line)],
        _extract_field(figure, axes),
    )


def _find_law(artist: Any) -> str:
    before, prefix, letter = (artist.get_gid() or "").partition(style.LAW_PREFIX)
    return letter if prefix and not before else ""


def _neighbour_label(figure: Figure, axes: Axes, axis_name: str) -> str:
    """Return the label of another panel in the same column, or row."""

    def place(panel: Axes) -> int | None:
        spec = panel.get_subplotspec()
        if spec is None:
            return None
        span = {"x": spec.colspan, "y": spec.rowspan}[axis_name]
        return span.start

    panels = [panel for panel in figure.axes if panel.get_label() != _COLORBAR_LABEL]
    neighbours = [panel for panel in panels if place(panel) == place(axes)]
    labels = [getattr(panel, f"get_{axis_name}label")() for panel in neighbours]
    return next(filter(None, labels), "")


# --- lines ----------------------------------------------------------------------------------------


def _is_data_line(axes: Axes, line: Line2D) -> bool:
    name = str(line.get_label())
    is_in_data = all(line.get_transform().contains_branch_seperately(axes.transData))
    return is_in_data and not name.startswith("_child") and np.size(line.get_xdata()) > 0


def _extract_series(line: Line2D, law: str) -> Series:
    x = np.asarray(line.get_xdata(), dtype=float)
    y = np.asarray(line.get_ydata(), dtype=float)
    every = slice(None, None, -(-len(x) // _MAX_POINTS))
    name = str(line.get_label()).removeprefix("_")
    return Series(name, _find_law(line) or law, x[every], y[every])


# --- fields ---------------------------------------------------------------------------------------


def _extract_field(figure: Figure, axes: Axes) -> FieldData | None:
    """Return the values in colours with a bar, at the centres of cells over the panel."""
    meshes = [mesh for mesh in axes.collections if isinstance(mesh, QuadMesh)]
    images = [image for image in axes.images if np.asarray(image.get_array()).ndim == 2]
    x = _cell_centres(axes.get_xlim(), _MAX_CELLS[0])
    y = _cell_centres(axes.get_ylim(), _MAX_CELLS[1])
    if meshes:
        return FieldData(_field_name(figure, meshes[0]), _resample_mesh(meshes[0], x, y))
    if images:
        return FieldData(_field_name(figure, images[0]), _resample_image(images[0], x, y))
    return None


def _cell_centres(limits: tuple[float, float], count: int) -> FloatArray:
    low, high = limits
    return low + (np.arange(count) + 0.5) * (high - low) / count


def _field_name(figure: Figure, artist: QuadMesh | AxesImage) -> str:
    """Return the label up to the unit of the colour bar, its own or that of the figure."""
    bars = [axes for axes in figure.axes if axes.get_label() == _COLORBAR_LABEL]
    if artist.colorbar:
        bars = [artist.colorbar.ax]
    if not bars:
        return ""
    label: str = bars[0].get_xlabel() or bars[0].get_ylabel()
    name, bracket, _rest = label.partition("]")
    return f"{name}{bracket}"


def _resample_mesh(mesh: QuadMesh, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return values (rows, columns) of a mesh whose first axis is the columns."""
    corners = np.asarray(mesh.get_coordinates())
    count = corners.shape[0] - 1
    height = corners.shape[1] - 1
    values = np.asarray(mesh.get_array(), dtype=float).reshape(count, height)
    resampled = np.full((len(y), len(x)), math.nan)
    for column, i in enumerate(np.searchsorted(corners[:, 0, 0], x) - 1):
        if 0 <= i < count:
            rows = np.searchsorted(0.5 * (corners[i, :, 1] + corners[i + 1, :, 1]), y) - 1
            there = (rows >= 0) & (rows < height)
            resampled[there, column] = values[i, rows[there]]
    return resampled


def _resample_image(image: AxesImage, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return values (rows, columns) of an image whose first row is the lowest."""
    values: FloatArray = np.ma.filled(np.ma.asarray(image.get_array(), dtype=float), math.nan)
    x0, x1, y0, y1 = image.get_extent()
    rows, columns = values.shape
    i = np.clip(((y - y0) / (y1 - y0) * rows).astype(int), 0, rows - 1)
    j = np.clip(((x - x0) / (x1 - x0) * columns).astype(int), 0, columns - 1)
    return np.asarray(values[np.ix_(i, j)])


# --- as JSON, for the script of the page ----------------------------------------------------------


def panels_to_json(panels: Sequence[Panel]) -> str:
    """Return panels as JSON without angle brackets, as it is embedded in a page."""
    text = json.dumps(
        [_panel_dict(panel) for panel in panels], allow_nan=False, separators=(",", ":")
    )
    return text.replace("<", "\\u003c")


def _panel_dict(panel: Panel) -> dict[str, Any]:
    return {
        "name": panel.name,
        "law": panel.law,
        "box": [round(part, 3) for part in panel.box],
        "x": _axis_dict(panel.x, panel.axes.get_xlim(), panel.axes.xaxis),
        "y": _axis_dict(panel.y, panel.axes.get_ylim(), panel.axes.yaxis),
        "series": [_series_dict(series) for series in panel.series],
        "field": _field_dict(panel.field),
    }


def _series_dict(series: Series) -> dict[str, Any]:
    return {
        "name": series.name,
        "law": series.law,
        "x": _compress_steps(series.x),
        "y": _round_values(series.y, _DIGITS),
    }


def _field_dict(field: FieldData | None) -> dict[str, Any] | None:
    if field is None:
        return None
    return {
        "name": field.name,
        "columns": field.values.shape[1],
        "values": _round_values(field.values.ravel(), _FIELD_DIGITS),
    }


def _axis_dict(name: str, limits: tuple[float, float], axis: Any) -> dict[str, Any]:
    """Return name, limits and scale; for a symmetric logarithm also its linear threshold."""
    ends = [float(f"{value:.8g}") for value in limits]
    data = {"name": name, "low": ends[0], "high": ends[1], "scale": axis.get_scale()}
    if data["scale"] == "symlog":
        data["linear"] = axis.get_transform().linthresh
    return data


def _compress_steps(x: FloatArray) -> Any:
    """Return first, last and number of equidistant values, or the values."""
    count = len(x)
    if count > 3 and np.isfinite(x).all():
        even = np.linspace(x[0], x[-1], count)
        if np.abs(x - even).max() <= 1e-5 * abs(x[-1] - x[0]):
            return {"from": float(f"{x[0]:.8g}"), "to": float(f"{x[-1]:.8g}"), "count": count}
    return _round_values(x, _DIGITS)


def _round_values(values: FloatArray, digits: int) -> list[float | int | None]:
    """Return values with a number of digits, ``None`` for one that is not finite."""
    return [_round_value(value, digits) for value in values.tolist()]


def _round_value(value: float, digits: int) -> float | int | None:
    if not math.isfinite(value):
        return None
    rounded = float(f"{value:.{digits}g}")
    return int(rounded) if rounded.is_integer() else rounded


# --- as text --------------------------------------------------------------------------------------

# Up to this number all panels are listed, otherwise those that vary most and least.
_MAX_LISTED_PANELS = 3
# Up to this number quantities are listed by line, otherwise by axis.
_MAX_QUANTITIES = 6
# Up to this number single points are listed, otherwise counted.
_MAX_LISTED_POINTS = 12


def ranges_text(panels: Sequence[Panel]) -> str:
    """Return the range of each quantity, in its panels or in the widest of them.

    Single points are listed with their coordinates.
    """
    groups = _group_ranges(panels, by_line=True)
    if len(groups) > _MAX_QUANTITIES:
        groups = _group_ranges(panels, by_line=False)
    parts = [f"{quantity}: {_members_text(members)}" for quantity, members in groups.items()]
    points = [series for panel in panels for series in panel.series if len(series.x) == 1]
    if len(points) > _MAX_LISTED_POINTS:
        parts.append(f"{len(points)} points")
    elif points:
        listed = "; ".join(
            [f"{series.name} at {series.x[0]:.3g}, {series.y[0]:.3g}" for series in points]
        )
        parts.append(f"{panels[0].x} and {panels[0].y}: {listed}")
    return "".join([f" {_start_sentence(part)}." for part in parts])


def _start_sentence(text: str) -> str:
    """Return a text with a capital letter; symbols keep their case: σ is not Σ."""
    return sentence_case(text) if text[0].isascii() else text


def _group_ranges(
    panels: Sequence[Panel], *, by_line: bool
) -> dict[str, list[tuple[str, float, float]]]:
    """Return panel, least and greatest value by quantity: of each line, or of each axis."""
    groups: dict[str, list[tuple[str, float, float]]] = {}
    for panel in panels:
        for series in panel.series:
            if len(series.x) > 1:
                name = _quantity_name(series.name, panel.y) if by_line else panel.y
                _add_range(groups, name, panel.name, series.y)
        if panel.field is not None:
            _add_range(groups, panel.field.name, panel.name, panel.field.values)
    return groups


def _quantity_name(series: str, axis: str) -> str:
    """Return a quantity with its unit: "normal force [N]"."""
    if series in ("", axis.split(" [", maxsplit=1)[0]):
        return axis
    return f"{series}, {axis}"


def _add_range(
    groups: dict[str, list[tuple[str, float, float]]], name: str, panel: str, values: FloatArray
) -> None:
    known = values[np.isfinite(values)]
    if known.size:
        member = (panel, float(known.min()), float(known.max()))
        groups.setdefault(name, []).append(member)


def _members_text(members: list[tuple[str, float, float]]) -> str:
    if len(members) <= _MAX_LISTED_PANELS:
        return "; ".join(
            [f"{_range_text(low, high)}{_panel_suffix(panel)}" for panel, low, high in members]
        )
    widest = max(members, key=lambda member: member[2] - member[1])
    least = min(members, key=lambda member: member[2] - member[1])
    return (
        f"varies most{_panel_suffix(widest[0])}, {_range_text(*widest[1:])}, "
        f"and least{_panel_suffix(least[0])}, {_range_text(*least[1:])}"
    )


def _panel_suffix(panel: str) -> str:
    return f" in {panel}" if panel else ""


def _range_text(low: float, high: float) -> str:
    ends = [f"{value:.3g}".replace("-", "−") for value in (low, high)]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"
