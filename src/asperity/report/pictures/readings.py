"""What a picture shows as numbers: to be read at the pointer, saved as a table, said in words.

They are taken from the figure itself. A line is read if it has a label; a label that begins with an
underscore stands in no legend, and is read all the same.
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

from asperity.checks import FloatArray
from asperity.report.pictures import style

_BAR = "<colorbar>"  # what matplotlib calls the axes of a colour bar
_MOST_POINTS = 2000  # of a line that are kept
_CELLS = (64, 40)  # at most, of a field: along and up
_DIGITS, _FIELD_DIGITS = 5, 3


@dataclass(frozen=True)
class Series:
    """A line, or points: what it is, its law or none, and values in the units of the axes."""

    name: str
    law: str
    x: FloatArray
    y: FloatArray


@dataclass(frozen=True)
class Field:
    """Values over a panel, of cells of one size: rows upwards, NaN where there are none."""

    name: str
    values: FloatArray


@dataclass(frozen=True)
class Panel:
    """Axes of a picture.

    Attributes:
        name: its title; may be empty.
        law: the letter of the law that it is of; may be empty.
        box: left, top, width, height in the units of the SVG.
        axes: Matplotlib's.
        x: name and unit of what is along.
        y: name and unit of what is up.
        series: its lines.
        field: what is drawn in colours, if anything.
    """

    name: str
    law: str
    box: tuple[float, float, float, float]
    axes: Axes
    x: str
    y: str
    series: list[Series]
    field: Field | None


def panels_of(figure: Figure) -> list[Panel]:
    """Return the panels of a figure, once it was drawn: only then it is known where they are."""
    found = []
    for axes in figure.axes:
        if axes.get_label() != _BAR and axes.get_visible() and axes.axison:
            panel = _panel(figure, axes)
            if panel.series or panel.field is not None:
                found.append(panel)
    return found


def _panel(figure: Figure, axes: Axes) -> Panel:
    wide, high = 72.0 * figure.get_size_inches()
    x0, y0, width, height = axes.get_position().bounds
    law = _law_of(axes)
    return Panel(
        f"{axes.get_label()}" or axes.get_title(loc="left"),
        law,
        (x0 * wide, (1.0 - y0 - height) * high, width * wide, height * high),
        axes,
        axes.get_xlabel() or _neighbour_label(figure, axes, "x"),
        axes.get_ylabel() or _neighbour_label(figure, axes, "y"),
        [_series(line, law) for line in axes.get_lines() if _is_read(axes, line)],
        _field(figure, axes),
    )


def _law_of(artist: Any) -> str:
    said = artist.get_gid() or ""
    return said.removeprefix(style.LAW) if said.startswith(style.LAW) else ""


def _neighbour_label(figure: Figure, axes: Axes, which: str) -> str:
    """Return the label of a panel that stands in the same column, or row, and has one."""

    def place(one: Axes) -> int | None:
        spec = one.get_subplotspec()
        if spec is None:
            return None
        return spec.colspan.start if which == "x" else spec.rowspan.start

    labels = (
        one.get_xlabel() if which == "x" else one.get_ylabel()
        for one in figure.axes
        if one.get_label() != _BAR and place(one) == place(axes)
    )  # fmt: skip
    return next((label for label in labels if label), "")


# --- lines ----------------------------------------------------------------------------------------


def _is_read(axes: Axes, line: Line2D) -> bool:
    name = str(line.get_label())
    own = all(line.get_transform().contains_branch_seperately(axes.transData))
    return own and not name.startswith("_child") and np.size(line.get_xdata()) > 0


def _series(line: Line2D, law: str) -> Series:
    x, y = (np.asarray(v, dtype=float) for v in (line.get_xdata(), line.get_ydata()))
    kept = slice(None, None, -(-len(x) // _MOST_POINTS))
    return Series(str(line.get_label()).removeprefix("_"), _law_of(line) or law, x[kept], y[kept])


# --- fields ---------------------------------------------------------------------------------------


def _field(figure: Figure, axes: Axes) -> Field | None:
    """Return what is drawn in colours with a bar, at the middles of cells over the panel."""
    meshes = [one for one in axes.collections if isinstance(one, QuadMesh)]
    images = [one for one in axes.images if np.asarray(one.get_array()).ndim == 2]
    if not (meshes or images):
        return None
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    x, y = (
        low + (np.arange(count) + 0.5) * (high - low) / count
        for low, high, count in ((x0, x1, _CELLS[0]), (y0, y1, _CELLS[1]))
    )
    values = _in_mesh(meshes[0], x, y) if meshes else _in_image(images[0], x, y)
    drawn = (meshes or images)[0]
    bar = drawn.colorbar.ax if drawn.colorbar else _bar_of(figure)
    words = "" if bar is None else bar.get_xlabel() or bar.get_ylabel()
    return Field(f"{words.split(']')[0]}]" if "]" in words else words, values)


def _bar_of(figure: Figure) -> Axes | None:
    """Return the colour bar that panels share."""
    return next((one for one in figure.axes if one.get_label() == _BAR), None)


def _in_mesh(mesh: QuadMesh, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the values (rows, columns) of a mesh whose columns, its first axis, are upright."""
    corners = np.asarray(mesh.get_coordinates())
    count, height = corners.shape[0] - 1, corners.shape[1] - 1
    values = np.asarray(mesh.get_array(), dtype=float).reshape(count, height)
    found = np.full((len(y), len(x)), math.nan)
    for column, i in enumerate(np.searchsorted(corners[:, 0, 0], x) - 1):
        if 0 <= i < count:
            rows = np.searchsorted(0.5 * (corners[i, :, 1] + corners[i + 1, :, 1]), y) - 1
            there = (rows >= 0) & (rows < height)
            found[there, column] = values[i, rows[there]]
    return found


def _in_image(image: AxesImage, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the values (rows, columns) of a picture whose first row is the lowest."""
    values: FloatArray = np.ma.filled(np.ma.asarray(image.get_array(), dtype=float), math.nan)
    x0, x1, y0, y1 = image.get_extent()
    rows, columns = values.shape
    i = np.clip(((y - y0) / (y1 - y0) * rows).astype(int), 0, rows - 1)
    j = np.clip(((x - x0) / (x1 - x0) * columns).astype(int), 0, columns - 1)
    return np.asarray(values[np.ix_(i, j)])


# --- as JSON, for the script of the page ----------------------------------------------------------


def panels_json(panels: Sequence[Panel]) -> str:
    """Return panels as JSON that may stand in a page: it holds no angle bracket."""
    text = json.dumps([_plain(one) for one in panels], allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def _plain(panel: Panel) -> dict[str, Any]:
    field = panel.field
    return {
        "name": panel.name,
        "law": panel.law,
        "box": [round(part, 2) for part in panel.box],
        "x": _axis(panel.x, panel.axes.get_xlim(), panel.axes.xaxis),
        "y": _axis(panel.y, panel.axes.get_ylim(), panel.axes.yaxis),
        "series": [
            {"name": one.name, "law": one.law, "x": _steps(one.x), "y": _rounded(one.y, _DIGITS)}
            for one in panel.series
        ],
        "field": None if field is None else {
            "name": field.name,
            "columns": field.values.shape[1],
            "values": _rounded(field.values.ravel(), _FIELD_DIGITS),
        },
    }  # fmt: skip


def _axis(name: str, limits: tuple[float, float], axis: Any) -> dict[str, Any]:
    """Return name, limits and scale; a symmetric logarithm with where it begins to be one."""
    low, high = (float(f"{value:.8g}") for value in limits)
    said = {"name": name, "low": low, "high": high, "scale": axis.get_scale()}
    if said["scale"] == "symlog":
        said["linear"] = axis.get_transform().linthresh
    return said


def _steps(x: FloatArray) -> Any:
    """Return the first, the last and the number of values in even steps, or the values."""
    count = len(x)
    if count > 3 and np.isfinite(x).all():
        even = np.linspace(x[0], x[-1], count)
        if np.abs(x - even).max() <= 1e-5 * abs(x[-1] - x[0]):
            return {"from": float(f"{x[0]:.8g}"), "to": float(f"{x[-1]:.8g}"), "count": count}
    return _rounded(x, _DIGITS)


def _rounded(values: FloatArray, digits: int) -> list[float | int | None]:
    """Return values with so many digits; nothing for one that is not finite."""
    found: list[float | int | None] = []
    for value in values.tolist():
        short = float(f"{value:.{digits}g}") if math.isfinite(value) else None
        found.append(int(short) if short is not None and short == int(short) else short)
    return found


# --- in words -------------------------------------------------------------------------------------

_EACH = 3
"""Panels up to which each is told; of more only those that vary most and least."""
_MOST_QUANTITIES = 6
"""Quantities up to which each is told; of more those of one axis are told together."""
_MOST_TOLD = 12
"""Lone points up to which each is told; of more only how many there are."""


def ranges_text(panels: Sequence[Panel]) -> str:
    """Return from where to where each quantity goes, in its panels or in the widest of them.

    Lone points are told by both of their coordinates.
    """
    groups = _quantities(panels, each=True)
    if len(groups) > _MOST_QUANTITIES:
        groups = _quantities(panels, each=False)
    said = [f"{quantity}: {_told(members)}" for quantity, members in groups.items()]
    points = [one for panel in panels for one in panel.series if len(one.x) == 1]
    if len(points) > _MOST_TOLD:
        said.append(f"{len(points)} points")
    elif points:
        told = "; ".join(f"{one.name} at {one.x[0]:.3g}, {one.y[0]:.3g}" for one in points)
        said.append(f"{panels[0].x} and {panels[0].y}: {told}")
    return "".join(f" {_sentence(words)}." for words in said)


def _sentence(words: str) -> str:
    """Return words with a capital, unless they begin with a symbol: σ is not Σ."""
    return words[0].upper() + words[1:] if words[0].isascii() else words


def _quantities(
    panels: Sequence[Panel], *, each: bool
) -> dict[str, list[tuple[str, float, float]]]:
    """Return panel, least and greatest value by quantity: of each line, or of all on one axis."""
    groups: dict[str, list[tuple[str, float, float]]] = {}
    for panel in panels:
        for one in panel.series:
            if len(one.x) > 1:
                _add(groups, _named(one.name, panel.y) if each else panel.y, panel.name, one.y)
        if panel.field is not None:
            _add(groups, panel.field.name, panel.name, panel.field.values)
    return groups


def _named(series: str, axis: str) -> str:
    """Return a quantity with its unit, once: "normal force [N]"."""
    return axis if series in ("", axis.split(" [", maxsplit=1)[0]) else f"{series}, {axis}"


def _add(
    groups: dict[str, list[tuple[str, float, float]]], name: str, panel: str, values: FloatArray
) -> None:
    known = values[np.isfinite(values)]
    if known.size:
        found = (panel, float(known.min()), float(known.max()))
        groups.setdefault(name, []).append(found)


def _told(members: list[tuple[str, float, float]]) -> str:
    if len(members) <= _EACH:
        return "; ".join(f"{_span(low, high)}{_where(panel)}" for panel, low, high in members)
    widest = max(members, key=lambda one: one[2] - one[1])
    least = min(members, key=lambda one: one[2] - one[1])
    return (
        f"varies most{_where(widest[0])}, {_span(*widest[1:])}, "
        f"and least{_where(least[0])}, {_span(*least[1:])}"
    )


def _where(panel: str) -> str:
    return f" in {panel}" if panel else ""


def _span(low: float, high: float) -> str:
    ends = [f"{value:.3g}".replace("-", "−") for value in (low, high)]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"
