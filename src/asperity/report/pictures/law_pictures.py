"""Figures with a panel per law: force fields over their curl, forces along a scan, loop gain.

Scales are shared by all laws of a figure. Strength and support have a point per law.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from asperity.analysis.energy.straight_scan import scan_height
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_quantity
from asperity.report.pictures import scan_plane, style
from asperity.report.sentences.texts import bound_text, number_text, strength_has_unit
from asperity.surface import Surface
from asperity.textures.texture import Texture

_WIDTH = 10.0
_MAX_COLUMNS = 3
# Panels are drawn true to scale unless that makes them flatter or taller.
_MAX_ASPECT = 2.4
_MIN_ASPECT = 0.8
_CURL_ROWS = 180
_ARROWS = {**style.INCH_ARROWS, "width": 0.011, "headwidth": 4.0, "headlength": 4.5}
_ARROWS |= {"headaxislength": 4.0, "minlength": 0.6}


@dataclass(frozen=True)
class Window:
    """The part of a vertical plane shown in a figure.

    Attributes:
        segment: of the line below the plane.
        bottom: [m].
        top: [m].
    """

    segment: scan_plane.ScanSegment
    bottom: float
    top: float

    @property
    def units(self) -> tuple[style.AxisUnit, style.AxisUnit]:
        """Best units of its width and of its height."""
        return style.length_unit(self.segment.length), style.length_unit(self.top - self.bottom)

    @property
    def aspect(self) -> float:
        """Width over height."""
        return self.segment.length / (self.top - self.bottom)

    def scale(self, along: Any, z: Any) -> tuple[Any, Any]:
        """Return distances along its segment and heights [m] in its units."""
        wide, high = self.units
        return along * wide.scale, z * high.scale

    def limit_axes(self, axes: Axes) -> None:
        """Limit axes, which are in its units, to the window."""
        right, top = self.scale(self.segment.length, self.top)
        axes.set(xlim=(0.0, right), ylim=(self.scale(0.0, self.bottom)[1], top))


def field_segment(surfaces: Sequence[Surface]) -> scan_plane.ScanSegment:
    """Return the part of the scan line shown in figures of the field."""
    texture = surfaces[0].texture
    depth = max([surface.max_depth for surface in surfaces])
    length = scan_plane.feature_length(texture)
    wanted = 1.3 * (texture.peak_to_valley + depth)
    return scan_plane.choose_segment(texture, min(max(wanted, length), 3.0 * length), 3.0 * length)


def field_size(surfaces: Sequence[Surface]) -> tuple[float, float]:
    """Return width and height of the figure [inch]."""
    columns = _column_count(len(surfaces))
    ratio = min(max(field_window(surfaces).aspect, _MIN_ASPECT), _MAX_ASPECT)
    panel = (_WIDTH - 1.0) / columns
    rows = math.ceil(len(surfaces) / columns)
    return _WIDTH, rows * (panel / ratio + 0.5) + 1.2


def _column_count(count: int) -> int:
    return min(count, _MAX_COLUMNS if count > 4 else 2)


def field_window(surfaces: Sequence[Surface]) -> Window:
    """Return the part of the plane along the scan line shown in figures of the field."""
    segment = field_segment(surfaces)
    return Window(segment, *scan_plane.field_range(surfaces, segment))


def draw_fields(
    figure: Figure | SubFigure,
    surfaces: Sequence[Surface],
    remarks: Sequence[str] = (),
    window: Window | None = None,
) -> list[Axes]:
    """Draw the field of every law: arrows over the curl, the same scales for all.

    Args:
        figure: receives the panels.
        surfaces: one per law, on the same texture.
        remarks: a line below the title of each panel.
        window: the part of the plane; by default that of :func:`field_window`.

    Returns:
        The panels, one per law; lengths on their axes are in the units that
        :func:`asperity.report.pictures.style.length_unit` gives for width and height of the window.
    """
    window = window or field_window(surfaces)
    segment = window.segment
    bottom = window.bottom
    top = window.top
    surfaces, scaling = _to_one_stiffness(surfaces)
    curls = [scan_plane.curl_field(surface, segment, bottom) for surface in surfaces]
    arrows = [scan_plane.arrow_field(surface, segment, bottom, top) for surface in surfaces]
    curl_limit, force_per_inch = _choose_scales(surfaces, curls, arrows)
    (wide, high) = window.units
    columns = _column_count(len(surfaces))
    x = f"along the scan line [{wide.name}]"
    y = f"z [{high.name}]"
    panels = style.axes_grid(figure, len(surfaces), columns, x=x, y=y)
    is_true_to_scale = wide == high and _MIN_ASPECT <= window.aspect <= _MAX_ASPECT
    options = _ARROWS | {"scale": force_per_inch, "color": style.INK}
    for index, (axes, surface) in enumerate(zip(panels, surfaces, strict=True)):
        window.limit_axes(axes)
        image = _draw_curl(axes, curls[index], window, curl_limit)
        field = arrows[index]
        places = window.scale(field.along, field.z)
        quiver = axes.quiver(*places, field.tangential, field.normal, zorder=4, **options)
        _draw_outline(axes, surface, window)
        style.title_law(axes, surface.law, "".join(remarks[index : index + 1]))
        axes.set_aspect("equal" if is_true_to_scale else "auto")
    label = f"{scaling.curl_label}: uncoloured is conservative"
    bar = style.add_colorbar(figure, image, panels, label, **style.WIDE_COLORBAR)
    key = style.nice_length(0.35 * force_per_inch)
    unit = scaling.choose_unit(key)
    text = f"{scaling.factor}{key * unit.scale:g} {unit.name}"
    _draw_force_key(bar, quiver, key, text)
    return panels


@dataclass(frozen=True)
class _ForceScaling:
    """How forces are shown: as they are, or over the stiffness.

    Attributes:
        force_label: name of the force.
        curl_label: name of the curl with its unit.
        factor: in front of a force.
        choose_unit: returns the unit of an axis for forces up to a size.
    """

    force_label: str
    curl_label: str
    factor: str
    choose_unit: Callable[[float], style.AxisUnit]


_FORCES = _ForceScaling("force", "curl [N/m]", "", style.force_unit)
_OVER_STIFFNESS = _ForceScaling("force / k", "curl / k [1]", "k · ", style.length_unit)


def _to_one_stiffness(surfaces: Sequence[Surface]) -> tuple[list[Surface], _ForceScaling]:
    """Return surfaces of one stiffness, and how their forces are shown.

    Where the stiffness differs between laws, forces are over it: those of weak laws would be
    invisible beside those of stiff ones.
    """
    if len({surface.stiffness for surface in surfaces}) == 1:
        return list(surfaces), _FORCES
    return [surface.to_stiffness(1.0) for surface in surfaces], _OVER_STIFFNESS


def _choose_scales(
    surfaces: Sequence[Surface],
    curls: Sequence[scan_plane.CurlField],
    arrows: Sequence[scan_plane.PlaneForces],
) -> tuple[float, float]:
    """Return the greatest curl of the colours [N/m] and the force of an inch of arrow [N]."""
    strong = [np.abs(c.curl).ravel() for c in curls if np.abs(c.curl).max() > 1e-9 * c.max_norm]
    limit = surfaces[0].stiffness
    if strong:
        limit = float(np.quantile(np.concatenate(strong), 0.97))
    sizes = np.concatenate([np.hypot(a.tangential, a.normal) for a in arrows])
    usual = 1.0
    if sizes.size:
        usual = float(np.quantile(sizes, 0.9))
    rounded = 1.0
    if limit > 0.0:
        rounded = 2.0 * style.nice_length(0.5 * limit)
    return rounded, usual / 0.32


def _draw_curl(axes: Axes, field: scan_plane.CurlField, window: Window, limit: float) -> Any:
    """Draw the curl in pixels, since transparent cells of a mesh overlap."""
    heights = (np.arange(_CURL_ROWS) + 0.5) / _CURL_ROWS * (window.top - window.bottom)
    ends = np.stack([field.z[1:, -1:], field.z[:-1, -1:]]) - window.bottom
    cells = (field.curl.shape[1] * heights / ends.mean(axis=0)).astype(int)
    pixels = np.take_along_axis(field.curl, np.minimum(cells, field.curl.shape[1] - 1), axis=1)
    # One more pixel, in part within a cell, is covered by the free space, but not beyond the axes.
    pixels[heights > ends.max(axis=0) + 2.0 * heights[0]] = pixels[:, -1] = np.nan
    place: dict[str, Any] = {"extent": (*axes.get_xlim(), *axes.get_ylim()), "origin": "lower"}
    place |= {"aspect": "auto", "interpolation": "nearest", "rasterized": True, "zorder": 0.4}
    return axes.imshow(pixels.T, style.CURL, vmin=-limit, vmax=limit, **place)


def _draw_outline(axes: Axes, surface: Surface, window: Window) -> None:
    """Draw the textured body, the contact surface if it is another, and the scan."""
    along = window.segment.distances(601)
    xy = window.segment.xy(along)
    contact = surface.law.contact
    x, tops = window.scale(along, contact.contact_height(surface.texture, xy))
    axes.fill_between(x[::3], tops[::3], axes.get_ylim()[1], fc=style.FREE_SPACE, lw=0, zorder=0.5)
    axes.plot(x, tops, color=style.INK, linewidth=1.3)
    if not contact.begins_on_texture:
        heights = window.scale(along, surface.texture.height(xy))[1]
        axes.plot(x, heights, color=style.INK, linewidth=1.3, linestyle=":")
    axes.axhline(window.scale(0.0, scan_height(surface))[1], color=style.GREEN, lw=1.0, ls="--")


def _draw_force_key(bar: Any, quiver: Any, force: float, text: str) -> None:
    """Draw an arrow of a force [N] in the axes of a colour bar, which no law hides."""
    options: dict[str, Any] = {"color": style.INK, "labelcolor": style.INK, "labelpos": "W"}
    font = {"size": style.TICK}
    bar.ax.quiverkey(quiver, 0.92, 1.04, force, text, fontproperties=font, **options)


# --- forces along a scan --------------------------------------------------------------------------

_FORCE_COLUMNS = 2
# Greatest ratio of a panel's range to the usual range, beyond which it is clipped.
_MAX_FORCE_RATIO = 3.0


def force_segment(texture: Texture) -> scan_plane.ScanSegment:
    """Return the part of the scan line shown in figures of forces."""
    length = scan_plane.feature_length(texture)
    return scan_plane.choose_segment(texture, 2.0 * length, 12.0 * length)


def force_size(count: int) -> tuple[float, float]:
    """Return width and height of the figure [inch]."""
    return 10.0, 1.45 * math.ceil(count / _FORCE_COLUMNS) + 1.0


def draw_forces(figure: Figure | SubFigure, surfaces: Sequence[Surface]) -> None:
    """Draw tangential and normal force along the scan for every law, on shared axes."""
    segment = force_segment(surfaces[0].texture)
    surfaces, scaling = _to_one_stiffness(surfaces)
    forces = [scan_plane.scan_forces(surface, segment) for surface in surfaces]
    limits = _shared_limits(forces)
    unit = scaling.choose_unit(max(map(abs, limits)))
    wide = style.length_unit(segment.length)
    x = f"along the scan line [{wide.name}]"
    y = f"{scaling.force_label} [{unit.name}]"
    panels = style.axes_grid(figure, len(surfaces), _FORCE_COLUMNS, x=x, y=y)
    for axes, surface, force in zip(panels, surfaces, forces, strict=True):
        _draw_force_panel(axes, surface, force, (wide, unit))
        _annotate_clipping(axes, force, limits, unit)
    heights = (limits[0] * unit.scale, limits[1] * unit.scale)
    panels[0].set(xlim=(0.0, segment.length * wide.scale), ylim=heights)
    _draw_force_legend(figure, panels[0])


def _shared_limits(forces: Sequence[scan_plane.PlaneForces]) -> tuple[float, float]:
    """Return the limits of the shared axis [N], which clip a law that exceeds the others by far."""
    lows = [min(float(f.tangential.min()), float(f.normal.min()), 0.0) for f in forces]
    highs = [max(float(f.tangential.max()), float(f.normal.max()), 0.0) for f in forces]
    spans = sorted([max(high, -low) for low, high in zip(lows, highs, strict=True)])
    usual = spans[(len(spans) - 1) // 2]
    limit = _MAX_FORCE_RATIO * usual or spans[-1] or 1.0
    low = max(min(lows), -limit)
    high = min(max(highs), limit)
    margin = 0.08 * ((high - low) or 1.0)
    return low - margin, high + margin


def _draw_force_panel(
    axes: Axes,
    surface: Surface,
    force: scan_plane.PlaneForces,
    units: tuple[style.AxisUnit, style.AxisUnit],
) -> None:
    wide, unit = units
    x = force.along * wide.scale
    axes.axhline(0.0, color=style.FAINT, linewidth=0.8)
    axes.plot(x, force.normal * unit.scale, color=style.ORANGE, linewidth=1.3, label="normal")
    axes.plot(x, force.tangential * unit.scale, color=style.BLUE, linewidth=1.3, label="tangential")
    style.title_law(axes, surface.law)
    height = f"z = {format_quantity(scan_height(surface), 'm', digits=2)}"
    axes.set_title(height, loc="right", fontsize=style.TICK, color=style.MUTED)


def _annotate_clipping(
    axes: Axes, force: scan_plane.PlaneForces, limits: tuple[float, float], unit: style.AxisUnit
) -> None:
    """Add the extremes of a curve that leaves the panel."""
    both = np.concatenate([force.tangential, force.normal])
    low = float(both.min())
    high = float(both.max())
    extremes = []
    if high > limits[1]:
        extremes.append(f"up to {high * unit.scale:.2g} {unit.name}")
    if low < limits[0]:
        extremes.append(f"down to {low * unit.scale:.2g} {unit.name}")
    if extremes:
        text = f"clipped: {', '.join(extremes)}"
        style.add_note(axes, text, (0.99, 0.95), ha="right", va="top", color=style.INK)


def _draw_force_legend(figure: Figure | SubFigure, axes: Axes) -> None:
    handles, names = axes.get_legend_handles_labels()
    texts = [f"{name} force" for name in names]
    options: dict[str, Any] = {"fontsize": style.LABEL, "labelcolor": style.INK}
    style.add_legend(figure, handles, texts, loc="outside upper left", ncols=2, **options)


# --- loop gain, strength and support --------------------------------------------------------------

_GAIN_CELLS = (120, 60)


def gain_figure(comparison: Comparison) -> Figure:
    """Return ‖J‖₂/k, one panel per law on one logarithmic scale, with the witness of q.

    The witness is a cross, if it is in the part of the plane that is shown.
    """
    surfaces = [row.surface for row in comparison.rows]
    window = field_window(surfaces)
    place = window.segment, window.bottom, *_GAIN_CELLS
    fields = [
        scan_plane.curl_field(row.surface, *place, jumps=not row.continuous)
        for row in comparison.rows
    ]
    values = np.concatenate([field.gain.ravel() for field in fields])
    highest = max(float(np.quantile(values[np.isfinite(values)], 0.995)), 2.0)
    scale = LogNorm(min(0.5, float(np.quantile(values[values > 0.0], 0.02))), highest)
    wide, high = window.units
    x = f"along the scan line [{wide.name}]"
    y = f"z [{high.name}]"
    figure, panels = style.law_panels(len(surfaces), 2.2, 0.9, x=x, y=y)
    for axes, row, field in zip(panels, comparison.rows, fields, strict=True):
        mesh = draw_gain_field(axes, field, scale, window)
        style.title_law(axes, row.law, f"q = {bound_text(row.q)}")
        _draw_witness(axes, row, window)
        axes.set_ylim(window.scale(0.0, np.array([window.bottom, window.top]))[1])
    add_gain_colorbar(figure, mesh, panels, "‖J‖ / k: loop gain over that of the smooth wall [1]")
    return figure


def _draw_witness(axes: Axes, row: LawRow, window: Window) -> None:
    """Draw a cross at the witness of q, if it is in the part of the plane that is shown."""
    if row.q.at is None:
        return
    segment = window.segment
    along, aside = segment.project(np.array(row.q.at[:2]))
    if 0.0 <= along <= segment.length and aside < 0.01 * segment.length:
        x, y = window.scale(along, row.q.at[2])
        axes.plot(x, y, "x", color=style.BLUE, ms=7, mew=2, zorder=5)


def draw_gain_field(axes: Axes, field: scan_plane.CurlField, scale: LogNorm, window: Window) -> Any:
    """Draw ‖J‖/k of the cells of a vertical plane; return the mesh for a colour bar."""
    axes.set_facecolor(style.FREE_SPACE)
    x, z = window.scale(field.along, field.z)
    gain = np.maximum(field.gain, scale.vmin or 0.0)
    return axes.pcolormesh(x, z, gain, norm=scale, cmap="magma_r", shading="flat", rasterized=True)


def add_gain_colorbar(
    figure: Figure | SubFigure, mesh: Any, axes: Axes | list[Axes], label: str
) -> None:
    """Draw the colour bar of ‖J‖/k."""
    ticks = LogLocator(subs=(1.0, 2.0, 5.0))
    text = FuncFormatter(lambda value, _place: number_text(value))
    options = style.WIDE_COLORBAR | {"ticks": ticks, "format": text}
    bar = style.add_colorbar(figure, mesh, axes, label, **options)
    bar.ax.xaxis.set_minor_locator(NullLocator())


# Width of the panel in a narrow window [points].
_NARROW_WIDTH = 200.0
# Height of the panel [points].
_MERIT_HEIGHT = 275.0
# Width and height of a letter [points].
_LETTER = 11.0


def _free_rise(x: float, y: float, taken: Sequence[tuple[float, float]]) -> float:
    """Return how far above a point a letter is free of points and letters [points]."""
    rises = [sign * step * _LETTER for step in range(1, 10) for sign in (1.0, -1.0)]
    for rise in [rise for rise in rises if y + rise > 0.5 * _LETTER]:
        distances = np.abs(np.array(taken) - (x, y + rise)).max(axis=1)
        if distances.min() >= _LETTER:
            return rise
    return _LETTER


def merit_figure(comparison: Comparison) -> Figure:
    """Return strength T against support S, a point per law.

    Laws with unbounded loop gain are at the origin.
    """
    figure, axes = style.new_axes(10.0, 4.6)
    scale = 1.0
    label = "strength T"
    if strength_has_unit(comparison):
        scale = 1e3
        label = "strength T · l [mm]"
    widest = max(max([row.strength for row in comparison.rows]) * scale, 1e-12)
    places = [
        (row.strength * scale / (1.15 * widest) * _NARROW_WIDTH, row.support / 1.15 * _MERIT_HEIGHT)
        for row in comparison.rows
    ]
    taken = list(places)
    for row, (across, up) in zip(comparison.rows, places, strict=True):
        x = row.strength * scale
        y = row.support
        colour = style.GREEN if row.conservative and row.continuous else style.ORANGE
        name = f"_{row.law.letter}"
        (point,) = axes.plot(x, y, "o", ms=8, color=colour, clip_on=False, label=name)
        weight = "bold" if row is comparison.recommended_row else "normal"
        font: dict[str, Any] = {"fontsize": style.TITLE, "color": style.INK, "fontweight": weight}
        place: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "center"}
        rise = _free_rise(across, up, taken)
        taken.append((across, up + rise))
        if abs(rise) > _LETTER:  # to the point, as other letters are in between
            place["arrowprops"] = {"arrowstyle": "-", "color": style.MUTED, "lw": 0.4}
        letter = axes.annotate(row.law.letter, (x, y), (0, rise), **place, **font)
        for artist in (point, letter):
            style.mark_law(artist, row.law.letter)
    axes.set(xlim=(0.0, 1.15 * widest), ylim=(0.0, 1.15))
    axes.grid(color=style.FAINT, lw=0.5)
    style.label_axes(axes, label, "support S")
    axes.plot([], [], "o", color=style.GREEN, label="conservative and continuous")
    axes.plot([], [], "o", color=style.ORANGE, label="leaks or jumps")
    style.add_legend(axes, loc="upper right")
    return figure
