"""The pictures of an analysis: field and worst loop, ‖J‖, singular values, jumps."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.patheffects import Stroke, withStroke
from matplotlib.quiver import Quiver
from matplotlib.ticker import FuncFormatter, SymmetricalLogLocator

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.bound import Bound
from asperity.checks import FloatArray
from asperity.report.pictures import style
from asperity.report.pictures.analysis_region import (
    gain_window,
    in_window,
    loop_window,
    top_view,
    witness,
    witness_column,
    working_depth,
)
from asperity.report.pictures.field_picture import Window, draw_fields
from asperity.report.pictures.gain_picture import draw_gain_field, gain_bar
from asperity.report.pictures.vertical_cut import CurlField, curl_field
from asperity.report.words.number_words import interval_text, law_title, span_text
from asperity.units import engineering

Part = Figure | SubFigure
Drawing = tuple[Callable[[Part, Analysis], None], Callable[[Analysis], float]]

_WIDTH = 10.0
# Width and height of a panel [inch]; flatter ones are not drawn true to scale.
_BROAD, _TALL, _LOW = 9.0, 4.6, 2.4
_FLATTEST = 2.4
# Titles, labels and the colour bar below a panel [inch].
_AROUND = 1.9
_GRAPH = 3.6  # height of a graph [inch]
_CELLS = (200, 110)
# What lies on a field has colours that stay in the dark.
_BLUE, _WHITE = style.on_field(style.BLUE), style.on_field(style.CARD)
_HALO = [withStroke(linewidth=4.0, foreground=_WHITE)]
# Where the numbers of a picture grow without bound it is cut off here.
_HIGHEST = 1e3
_ARROWS = 5


def pictures_of(analysis: Analysis) -> dict[str, Drawing]:
    """Return the pictures that an analysis has by name: what draws each, its height [inch]."""
    found: dict[str, Drawing] = {
        "field": (draw_field, lambda result: _plane_height(loop_window(result))),
        "gain": (draw_gain, lambda result: _plane_height(gain_window(result))),
    }
    if not analysis.surface.texture.is_profile:
        found["top"] = (draw_top, _map_height)
    found["depth"] = (draw_depth, lambda _result: _GRAPH)
    if analysis.continuity.jumps:
        found["jumps"] = (draw_jumps, lambda _result: _GRAPH)
    return found


def _plane_height(window: Window) -> float:
    ratio = (window.top - window.bottom) / window.stretch.length
    return min(max(_BROAD * ratio, _LOW), _TALL) + _AROUND


def _map_height(analysis: Analysis) -> float:
    spans = np.abs(analysis.surface.texture.domain.spans).sum(axis=0)
    return min(_BROAD * float(spans[1] / spans[0]), 6.5) + _AROUND


def picture_size(analysis: Analysis, name: str) -> tuple[float, float]:
    """Return width and height of a picture [inch]."""
    return _WIDTH, pictures_of(analysis)[name][1](analysis)


def analysis_figure(analysis: Analysis, name: str) -> Figure:
    """Return one picture of an analysis."""
    figure = style.new_figure(*picture_size(analysis, name))
    pictures_of(analysis)[name][0](figure, analysis)
    return figure


# --- the field and the worst loop -----------------------------------------------------------------


def draw_field(figure: Part, analysis: Analysis) -> None:
    """Draw the force over its curl in the plane of the worst loop, and the loop.

    What lies deeper than the working region is paled; the vertices of the loop are projected on
    the plane.
    """
    window, leak = loop_window(analysis), analysis.leak
    remark = "conservative: no loop gains"
    if len(leak.vertices):
        gain = span_text(leak.energy, leak.upper_per_period, "J")
        remark = f"the worst loop of one period gains {gain}"
    elif not analysis.conservative:
        remark = "no loop found that gains"
    axes = draw_fields(figure, [analysis.surface], [remark], window)[0]
    for arrows in axes.findobj(Quiver):
        # Seen on the darkest curl, too.
        arrows.set_path_effects([withStroke(linewidth=1.2, foreground=_WHITE)])
    wide, high = window.units
    if not _is_true(window):
        axes.set_aspect("auto")
    style.label(axes, f"{_along_text(window)} [{wide.name}]", f"z [{high.name}]")
    field = curl_field(analysis.surface, window.stretch, window.bottom, *_CELLS)
    _pale(axes, analysis, window, field)
    if len(leak.vertices):
        offset = leak.vertices[:, :2] - window.stretch.xy(np.zeros(1))[0]
        along = offset @ window.stretch.line.direction
        _draw_loop(axes, along * wide.scale, leak.vertices[:, 2] * high.scale)


def _is_true(window: Window) -> bool:
    """Return whether a picture true to scale fills its panel well."""
    return _BROAD / _TALL <= window.stretch.length / (window.top - window.bottom) <= _FLATTEST


def _draw_loop(axes: Axes, x: FloatArray, z: FloatArray) -> None:
    """Draw a closed polygon with arrows that tell its sense."""
    x, z = np.append(x, x[0]), np.append(z, z[0])
    axes.plot(x, z, color=_BLUE, lw=1.6, zorder=5.0, path_effects=_HALO)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    steps = np.hypot(np.diff(x) / (right - left), np.diff(z) / (high - low))
    seen = (np.maximum(x[1:], x[:-1]) > left) & (np.minimum(x[1:], x[:-1]) < right)
    passed = np.concatenate([[0.0], np.cumsum(np.where(seen, steps, 0.0))])
    arrow = {"arrowstyle": "-|>", "color": _BLUE, "lw": 1.6, "mutation_scale": 14}
    for part in (np.arange(_ARROWS) + 0.5) / _ARROWS:
        ways = part * passed[-1] + np.array([-0.004, 0.004])
        start, end = zip(np.interp(ways, passed, x), np.interp(ways, passed, z), strict=True)
        axes.annotate("", end, start, arrowprops=arrow, zorder=6.0, annotation_clip=True)


def _pale(axes: Axes, analysis: Analysis, window: Window, field: CurlField) -> None:
    """Pale what is deeper than the working region, and draw its border."""
    points = np.column_stack([window.stretch.xy(field.along.ravel()), field.z.ravel()])
    depth = working_depth(analysis.surface, points).reshape(field.z.shape)
    beyond = depth - analysis.surface.max_depth
    if beyond.max() <= 0.0:
        return
    wide, high = window.units
    places = (field.along * wide.scale, field.z * high.scale)
    axes.contourf(*places, beyond, [0.0, math.inf], colors=[style.FREE], alpha=0.8, zorder=4.5)
    axes.contour(
        *places, beyond, [0.0], colors=[style.on_field(style.SOFT)], linewidths=0.9, zorder=4.6
    )


def _along_text(window: Window) -> str:
    """Return where the horizontal axis begins and where it goes."""
    x, y = (engineering(float(v) + 0.0, "m") for v in window.stretch.xy(np.zeros(1))[0])
    u, v = (float(part) for part in window.stretch.line.direction)
    return f"from x = {x}, y = {y} along ({u:.4g}, {v:.4g})"


# --- the loop gain --------------------------------------------------------------------------------


def _gain_scale(analysis: Analysis, values: FloatArray) -> LogNorm:
    """Return a logarithmic scale that ends at q, or where the picture is cut off."""
    known = values[np.isfinite(values) & (values > 0.0)]
    top = max(analysis.q.lower, 2.0)
    if math.isinf(top):
        top = min(_HIGHEST, max(float(np.quantile(known, 0.995)), 10.0))
    low = min(0.5, 0.5 * top, float(np.quantile(known, 0.02)) if known.size else 0.5)
    return LogNorm(max(low, 1e-3 * top), top)


def draw_gain(figure: Part, analysis: Analysis) -> None:
    """Draw ‖J‖/k in the vertical plane through the witness of q, and the witness."""
    window, surface = gain_window(analysis), analysis.surface
    wide, high = window.units
    field = curl_field(surface, window.stretch, window.bottom, *_CELLS)
    scale = _gain_scale(analysis, field.gain)
    axes = style.panel(figure)
    mesh = draw_gain_field(axes, field, scale, (wide, high))
    _pale(axes, analysis, window, field)
    at = in_window(window, witness(analysis)) if analysis.q.at is not None else None
    if at is not None:
        _mark(axes, at[0] * wide.scale, at[1] * high.scale)
    axes.set_xlim(0.0, window.stretch.length * wide.scale)
    axes.set_ylim(window.bottom * high.scale, window.top * high.scale)
    axes.set_aspect("equal" if wide == high and _is_true(window) else "auto")
    style.label(axes, f"{_along_text(window)} [{wide.name}]", f"z [{high.name}]")
    style.entitle(axes, surface.law.letter, law_title(surface.law.name), _gain_remark(analysis))
    gain_bar(figure, mesh, axes, "‖J‖ / k [1]")


def _gain_remark(analysis: Analysis) -> str:
    if math.isinf(analysis.q.lower):
        return "q = ∞; the cross is where it first becomes so"
    cross = "; the cross attains the lower end" if analysis.q.at is not None else ""
    return f"q = {interval_text(analysis.q)} ({analysis.q.method}){cross}"


def _mark(axes: Axes, x: float, y: float) -> None:
    """Draw a cross that is seen on dark and on light."""
    halo = [Stroke(linewidth=5.0, foreground=_WHITE), withStroke(linewidth=2.0)]
    axes.plot(x, y, "x", color=_BLUE, ms=10, mew=2.2, zorder=7, path_effects=halo[:1])
    axes.plot(x, y, "x", color=_BLUE, ms=10, mew=2.2, zorder=8, clip_on=False)


def draw_top(figure: Part, analysis: Analysis) -> None:
    """Draw the greatest ‖J‖/k found over depth, from above, with the witness of q."""
    (grid, gain), surface = top_view(analysis), analysis.surface
    scale = _gain_scale(analysis, gain)
    unit, (x0, x1, y0, y1) = grid.frame
    axes = style.panel(figure)
    shown = np.maximum(gain, scale.vmin or 0.0)
    mesh = axes.imshow(
        shown, norm=scale, cmap="magma_r", origin="lower", extent=(x0, x1, y0, y1),
        interpolation="nearest",
    )  # fmt: skip
    at = analysis.q.at
    if at is not None:
        spans = surface.texture.domain
        place = _into(np.array(at[:2]), grid.low, grid.size, periodic=spans.periodic)
        x, y = place * unit.scale
        _mark(axes, float(x), float(y))
        line = analysis.leak.line
        start = np.array([x, y])
        axes.axline(
            tuple(start), tuple(start + line.direction), color=_BLUE, lw=0.8, ls=":", zorder=3
        )
        axes.set_xlim(x0, x1)
        axes.set_ylim(y0, y1)
    style.label(axes, f"x [{unit.name}]", f"y [{unit.name}]")
    remark = "greatest of five depths, sampled; dotted: the vertical plane of the other picture"
    style.entitle(axes, surface.law.letter, "seen from above", remark)
    gain_bar(figure, mesh, axes, "‖J‖ / k [1]")


def _into(at: FloatArray, low: FloatArray, size: FloatArray, *, periodic: bool) -> FloatArray:
    """Return a point moved into the rectangle of a texture that repeats along x and y."""
    inside = np.all((at >= low) & (at <= low + size))
    return at if inside or not periodic else low + (at - low) % size


# --- depth ----------------------------------------------------------------------------------------


def draw_depth(figure: Part, analysis: Analysis) -> None:
    """Draw the singular values of J/k against depth at the witness column, with q's bounds."""
    column, surface = witness_column(analysis), analysis.surface
    unit = style.length_unit(surface.max_depth)
    axes = style.panel(figure)
    for index, colour in enumerate((style.BLUE, style.GREEN, style.SOFT)):
        values = np.minimum(column.values[:, index], 2.0 * _HIGHEST)
        look: dict[str, Any] = {"color": colour, "lw": 2.2 - 0.5 * index}
        axes.plot(column.depth * unit.scale, values, label=f"σ{'₁₂₃'[index]}", **look)
    _draw_bounds(axes, analysis.q)
    if analysis.q.at is not None:
        infinite = math.isinf(analysis.q.lower)
        words = "onset: from here down the force jumps" if infinite else "witness"
        axes.axvline(column.witness * unit.scale, color=style.FAINT, lw=1.2, zorder=0)
        _beside(axes, column.witness / surface.max_depth, words)
    top = float(np.quantile(column.values[:, 0], 0.98))
    _scale_values(axes, max(top, analysis.q.lower) if math.isfinite(analysis.q.lower) else top)
    axes.set_xlim(0.0, surface.max_depth * unit.scale)
    along = "along the normal" if abs(column.below[2]) < 1.0 else "below the surface"
    if not surface.law.contact.begins_on_texture:
        along = "below the smooth wall"
    style.label(axes, f"depth {along} [{unit.name}]", "singular values of J/k [1]")
    remark = f"q = {interval_text(analysis.q)} ({analysis.q.method})"
    style.entitle(axes, surface.law.letter, "down to the witness", remark)
    axes.legend(frameon=False, fontsize=style.TICK, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_bounds(axes: Axes, q: Bound) -> None:
    """Draw the ends of q that are finite."""
    if math.isfinite(q.lower):
        axes.axhline(q.lower, color=style.ORANGE, lw=1.1, label="q, lower")
    if math.isfinite(q.upper):
        axes.axhline(q.upper, color=style.INK, lw=1.1, ls=(0, (6, 6)), label="q, upper")


def _scale_values(axes: Axes, top: float) -> None:
    """Scale the vertical axis up to a value; logarithmically above 1 where that is great."""
    great = top > 30.0
    if great:
        axes.set_yscale("symlog", linthresh=1.0)
        axes.yaxis.set_major_locator(SymmetricalLogLocator(base=10, linthresh=1, subs=[1, 2, 5]))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
    highest = 1.12 * min(top, _HIGHEST)
    axes.set_ylim(-0.1 if great else -0.03 * highest, highest)


def _beside(axes: Axes, part: float, words: str) -> None:
    """Write words beside a vertical line at a part of the width, on the side with more room."""
    left = part > 0.5
    side, away = ("right", -4) if left else ("left", 4)
    style.note(axes, words, (min(part, 1.0), 0.5), xytext=(away, 0), ha=side, va="center")


def draw_jumps(figure: Part, analysis: Analysis) -> None:
    """Draw by how much the force jumps at each depth where that was located."""
    jumps = analysis.continuity.jumps
    depth = np.array([jump.depth for jump in jumps])
    size = np.array([jump.size for jump in jumps])
    wide, high = style.length_unit(float(depth.max())), style.force_unit(float(size.max()))
    axes = style.panel(figure)
    axes.plot(
        depth * wide.scale, size * high.scale, "o-", color=style.BLUE, lw=1.0, ms=5.5, label="jump"
    )
    axes.set_xlim(0.0, 1.05 * max(float(depth.max()), 1e-12) * wide.scale)
    axes.set_ylim(0.0, 1.12 * float(size.max()) * high.scale)
    axes.grid(color=style.FAINT, lw=0.5)
    style.label(axes, f"depth [{wide.name}]", f"jump of the force [{high.name}]")
    surface = analysis.surface
    remark = f"at {surface.stiffness:g} N/m; every point has two witnesses on either side"
    style.entitle(axes, surface.law.letter, "how far the force jumps", remark)
