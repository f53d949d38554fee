"""Figures of an analysis: field and worst loop, loop gain, singular values."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patheffects import Stroke, withStroke
from matplotlib.quiver import Quiver
from matplotlib.ticker import FuncFormatter, SymmetricalLogLocator

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.results.analyze import Analysis
from asperity.core.checks import FloatArray
from asperity.core.units import format_quantity
from asperity.report.pictures import analysis_windows, law_pictures, style
from asperity.report.pictures.scan_plane import CurlField, curl_field
from asperity.report.sentences.analysis_text import gain_remark
from asperity.report.sentences.texts import interval_text, range_text

FigureArea = Figure | SubFigure

_WIDTH = 10.0
# Width and greatest and least height of a panel [inch].
_PANEL_WIDTH = 9.0
_MAX_PANEL_HEIGHT = 4.6
_MIN_PANEL_HEIGHT = 2.4
_MAX_ASPECT = 2.4
# Titles, labels and the colour bar below a panel [inch].
_PANEL_MARGIN = 1.9
_GRAPH_HEIGHT = 3.6  # height of a graph [inch]
_GRID_CELLS = (200, 110)
_HALO = [withStroke(linewidth=4.0, foreground=style.BACKGROUND)]
# Limit of the scale for a gain without bound.
_MAX_GAIN = 1e3
_ARROW_COUNT = 5


def available_pictures(analysis: Analysis) -> dict[str, style.SizedDrawing]:
    """Return size [inch] and drawing function of the figures of an analysis, by name."""
    drawings: dict[str, tuple[Callable[..., None], Callable[[], float]]] = {
        "field": (draw_field, lambda: _plane_height(analysis_windows.loop_window(analysis))),
        "gain": (draw_gain, lambda: _plane_height(analysis_windows.gain_window(analysis))),
        "top": (draw_top_view, lambda: _map_height(analysis)),
        "depth": (draw_depth, lambda: _GRAPH_HEIGHT),
    }
    pictures: dict[str, style.SizedDrawing] = {}
    if analysis.surface.texture.is_profile:
        del drawings["top"]
    for name, (draw, height) in drawings.items():
        pictures[name] = (_WIDTH, height()), partial(draw, analysis=analysis)
    return pictures


def _plane_height(window: law_pictures.Window) -> float:
    height = _PANEL_WIDTH / window.aspect
    return min(max(height, _MIN_PANEL_HEIGHT), _MAX_PANEL_HEIGHT) + _PANEL_MARGIN


def _map_height(analysis: Analysis) -> float:
    spans = np.abs(analysis.surface.texture.domain.spans).sum(axis=0)
    return min(_PANEL_WIDTH * float(spans[1] / spans[0]), 6.5) + _PANEL_MARGIN


# --- the field and the worst loop -----------------------------------------------------------------


def draw_field(figure: FigureArea, analysis: Analysis) -> None:
    """Draw the force over its curl in the plane of the worst loop, and the loop.

    Points deeper than the working region are faded; the vertices of the loop are projected on the
    plane.
    """
    window = analysis_windows.loop_window(analysis)
    leak = analysis.leak
    remark = "conservative: no loop gains energy"
    if len(leak.vertices):
        gain = range_text(leak.energy, leak.upper_per_period, "J")
        remark = f"the worst loop of one period gains {gain}"
    elif math.isnan(leak.energy):
        remark = leak.description
    elif not analysis.conservative:
        remark = "no loop found that gains energy"
    axes = law_pictures.draw_fields(figure, [analysis.surface], [remark], window)[0]
    for arrows in axes.findobj(Quiver):
        # A halo, for dark colours of the curl.
        arrows.set_path_effects([withStroke(linewidth=1.2, foreground=style.BACKGROUND)])
    _scale_axes(axes, window)
    field = curl_field(analysis.surface, window.segment, window.bottom, *_GRID_CELLS)
    _fade_beyond_depth(axes, analysis, window, field)
    if len(leak.vertices):
        offset = leak.vertices[:, :2] - window.segment.xy(np.zeros(1))[0]
        along = offset @ window.segment.line.direction
        _draw_loop(axes, *window.scale(along, leak.vertices[:, 2]))


def _scale_axes(axes: Axes, window: law_pictures.Window) -> None:
    """Limit and label axes in the units of a window, true to scale where that fills the panel."""
    wide, high = window.units
    window.limit_axes(axes)
    fills_panel = _PANEL_WIDTH / _MAX_PANEL_HEIGHT <= window.aspect <= _MAX_ASPECT
    axes.set_aspect("equal" if wide == high and fills_panel else "auto")
    style.label_axes(axes, f"{_horizontal_axis_text(window)} [{wide.name}]", f"z [{high.name}]")


def _draw_loop(axes: Axes, x: FloatArray, z: FloatArray) -> None:
    """Draw a closed polygon with arrows of its direction."""
    x = np.append(x, x[0])
    z = np.append(z, z[0])
    axes.plot(x, z, color=style.BLUE, lw=1.6, zorder=5.0, path_effects=_HALO)
    (left, right) = axes.get_xlim()
    (low, high) = axes.get_ylim()
    steps = np.hypot(np.diff(x) / (right - left), np.diff(z) / (high - low))
    seen = (np.maximum(x[1:], x[:-1]) > left) & (np.minimum(x[1:], x[:-1]) < right)
    passed = np.concatenate([[0.0], np.cumsum(np.where(seen, steps, 0.0))])
    arrow = {"arrowstyle": "-|>", "color": style.BLUE, "lw": 1.6, "mutation_scale": 14}
    for part in (np.arange(_ARROW_COUNT) + 0.5) / _ARROW_COUNT:
        ends = part * passed[-1] + np.array([-0.004, 0.004])
        start, end = zip(np.interp(ends, passed, x), np.interp(ends, passed, z), strict=True)
        axes.annotate("", end, start, arrowprops=arrow, zorder=6.0, annotation_clip=True)


def _fade_beyond_depth(
    axes: Axes, analysis: Analysis, window: law_pictures.Window, field: CurlField
) -> None:
    """Fade the field below the working region, and draw the border of the region."""
    points = np.column_stack([window.segment.xy(field.along.ravel()), field.z.ravel()])
    depth = analysis_windows.working_depth(analysis.surface, points).reshape(field.z.shape)
    beyond = depth - analysis.surface.max_depth
    if beyond.max() <= 0.0:
        return
    places = window.scale(field.along, field.z)
    fade: dict[str, Any] = {"colors": [style.FREE_SPACE], "alpha": 0.8, "zorder": 4.5}
    axes.contourf(*places, beyond, [0.0, math.inf], **fade)
    border: dict[str, Any] = {"colors": [style.MUTED], "linewidths": 0.9}
    axes.contour(*places, beyond, [0.0], zorder=4.6, **border)


def _horizontal_axis_text(window: law_pictures.Window) -> str:
    """Return start and direction of the horizontal axis."""
    start = [format_quantity(float(part) + 0.0, "m") for part in window.segment.xy(np.zeros(1))[0]]
    direction = ", ".join([f"{float(part):.4g}" for part in window.segment.line.direction])
    return f"from x = {start[0]}, y = {start[1]} along ({direction})"


# --- the loop gain --------------------------------------------------------------------------------


def _gain_scale(analysis: Analysis, values: FloatArray) -> LogNorm:
    """Return a logarithmic scale up to q, or up to a limit."""
    known = values[np.isfinite(values) & (values > 0.0)]
    top = max(analysis.q.lower, 2.0)
    if math.isinf(top):
        top = min(_MAX_GAIN, max(float(np.quantile(known, 0.995)), 10.0))
    low = min(0.5, 0.5 * top)
    if known.size:
        low = min(low, float(np.quantile(known, 0.02)))
    return LogNorm(max(low, 1e-3 * top), top)


def draw_gain(figure: FigureArea, analysis: Analysis) -> None:
    """Draw ‖J‖/k in the vertical plane through the witness of q, and the witness."""
    window = analysis_windows.gain_window(analysis)
    surface = analysis.surface
    jumps = math.isinf(analysis.q.lower)
    field = curl_field(surface, window.segment, window.bottom, *_GRID_CELLS, jumps=jumps)
    scale = _gain_scale(analysis, field.gain)
    axes = style.single_axes(figure)
    mesh = law_pictures.draw_gain_field(axes, field, scale, window)
    _fade_beyond_depth(axes, analysis, window, field)
    if analysis.q.at is not None:
        at = analysis_windows.project_on_window(window, np.array(analysis.q.at))
        if at is not None:
            _draw_cross(axes, *window.scale(*at))
    _scale_axes(axes, window)
    style.title_law(axes, surface.law, gain_remark(analysis))
    law_pictures.add_gain_colorbar(figure, mesh, axes, "‖J‖ / k [1]")


def _draw_cross(axes: Axes, x: float, y: float) -> None:
    """Draw a cross that is visible on dark and light colours."""
    halo = [Stroke(linewidth=5.0, foreground=style.BACKGROUND), withStroke(linewidth=2.0)]
    axes.plot(x, y, "x", color=style.BLUE, ms=10, mew=2.2, zorder=7, path_effects=halo[:1])
    axes.plot(x, y, "x", color=style.BLUE, ms=10, mew=2.2, zorder=8, clip_on=False)


def draw_top_view(figure: FigureArea, analysis: Analysis) -> None:
    """Draw the greatest sampled ‖J‖/k over depth, from above, with the witness of q."""
    (grid, gain) = analysis_windows.top_view(analysis)
    surface = analysis.surface
    scale = _gain_scale(analysis, gain)
    unit, (x0, x1, y0, y1) = grid.frame
    axes = style.single_axes(figure)
    options: dict[str, Any] = {"norm": scale, "cmap": "magma_r", "interpolation": "nearest"}
    clipped = np.maximum(gain, scale.vmin or 0.0)
    mesh = axes.imshow(clipped, origin="lower", extent=(x0, x1, y0, y1), **options)
    at = analysis.q.at
    if at is not None:
        spans = surface.texture.domain
        place = _wrap_into_domain(np.array(at[:2]), grid.low, grid.size, periodic=spans.periodic)
        x, y = place * unit.scale
        _draw_cross(axes, float(x), float(y))
        dx, dy = analysis.leak.line.direction
        axes.axline((x, y), (x + dx, y + dy), color=style.BLUE, lw=0.8, ls=":", zorder=3)
        axes.set(xlim=(x0, x1), ylim=(y0, y1))
    style.label_axes(axes, f"x [{unit.name}]", f"y [{unit.name}]")
    remark = "greatest of five depths, sampled; dotted: the vertical plane of the other figure"
    style.set_panel_title(axes, surface.law.letter, "seen from above", remark)
    law_pictures.add_gain_colorbar(figure, mesh, axes, "‖J‖ / k [1]")


def _wrap_into_domain(
    point: FloatArray, low: FloatArray, size: FloatArray, *, periodic: bool
) -> FloatArray:
    """Return a point wrapped into the rectangle of a periodic texture."""
    is_inside = np.all((point >= low) & (point <= low + size))
    if is_inside or not periodic:
        return point
    return low + (point - low) % size


# --- depth ----------------------------------------------------------------------------------------


def draw_depth(figure: FigureArea, analysis: Analysis) -> None:
    """Draw the singular values of J/k over depth at the witness, with the bounds of q."""
    column = analysis_windows.witness_profile(analysis)
    surface = analysis.surface
    unit = style.length_unit(surface.max_depth)
    axes = style.single_axes(figure)
    for index, colour in enumerate((style.BLUE, style.GREEN, style.MUTED)):
        values = np.minimum(column.values[:, index], 2.0 * _MAX_GAIN)
        options: dict[str, Any] = {"color": colour, "lw": 2.2 - 0.5 * index}
        axes.plot(column.depth * unit.scale, values, label=f"σ{'₁₂₃'[index]}", **options)
    _draw_bounds(axes, analysis.q)
    if analysis.q.at is not None:
        text = "witness"
        if math.isinf(analysis.q.lower):
            text = "onset: the force jumps from here down"
        axes.axvline(column.witness_depth * unit.scale, color=style.FAINT, lw=1.2, zorder=0)
        _annotate_line(axes, column.witness_depth / surface.max_depth, text)
    top = float(np.quantile(column.values[:, 0], 0.98))
    if math.isfinite(analysis.q.lower):
        top = max(top, analysis.q.lower)
    _set_value_scale(axes, top)
    axes.set_xlim(0.0, surface.max_depth * unit.scale)
    along = "below the surface"
    if not surface.law.contact.begins_on_texture:
        along = "below the smooth wall"
    elif abs(column.direction[2]) < 1.0:
        along = "along the normal"
    style.label_axes(axes, f"depth {along} [{unit.name}]", "singular values of J/k [1]")
    remark = f"q = {interval_text(analysis.q)} ({analysis.q.method})"
    style.set_panel_title(axes, surface.law.letter, "down to the witness", remark)
    style.add_legend(axes, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_bounds(axes: Axes, q: Bound) -> None:
    """Draw the finite bounds of q."""
    if math.isfinite(q.lower):
        axes.axhline(q.lower, color=style.ORANGE, lw=1.1, label="q, lower")
    if math.isfinite(q.upper):
        axes.axhline(q.upper, color=style.INK, lw=1.1, ls=(0, (6, 6)), label="q, upper")


def _set_value_scale(axes: Axes, max_value: float) -> None:
    """Scale the vertical axis up to a value, logarithmically above 1 for a large value."""
    highest = 1.12 * min(max_value, _MAX_GAIN)
    axes.set_ylim(-0.03 * highest, highest)
    if max_value > 30.0:
        axes.set_ylim(-0.1, highest)
        axes.set_yscale("symlog", linthresh=1.0)
        axes.yaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=1, subs=[1, 2, 5]))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))


def _annotate_line(axes: Axes, fraction: float, text: str) -> None:
    """Add text beside a vertical line at a fraction of the width, on the wider side."""
    place: dict[str, Any] = {"xytext": (4, 0), "ha": "left"}
    if fraction > 0.5:
        place = {"xytext": (-4, 0), "ha": "right"}
    style.add_note(axes, text, (min(fraction, 1.0), 0.5), va="center", **place)
