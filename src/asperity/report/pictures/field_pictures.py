"""Force fields as arrows over their curl, one panel per law, on shared scales."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from asperity.analysis.energy.merit import scan_height
from asperity.report.pictures import style
from asperity.report.pictures.scan_plane import (
    CurlField,
    PlaneForces,
    ScanSegment,
    arrow_field,
    choose_segment,
    curl_field,
    feature_length,
    field_range,
)
from asperity.surface import Surface

_WIDTH = 10.0
_MAX_COLUMNS = 3
# Panels are drawn true to scale unless that makes them flatter or taller.
_MAX_ASPECT, _MIN_ASPECT = 2.4, 0.8
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

    segment: ScanSegment
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


@dataclass(frozen=True)
class _PanelLayout:
    """Window and scales shared by all panels."""

    window: Window
    x_unit: style.AxisUnit
    z_unit: style.AxisUnit
    curl_limit: float
    force_per_inch: float


def field_segment(surfaces: Sequence[Surface]) -> ScanSegment:
    """Return the part of the scan line shown in figures of the field."""
    texture = surfaces[0].texture
    depth = max(surface.max_depth for surface in surfaces)
    length = feature_length(texture)
    wanted = 1.3 * (texture.peak_to_valley + depth)
    return choose_segment(texture, min(max(wanted, length), 3.0 * length), 3.0 * length)


def field_size(surfaces: Sequence[Surface]) -> tuple[float, float]:
    """Return width and height of the figure [inch]."""
    columns = _column_count(len(surfaces))
    ratio = _panel_ratio(surfaces)
    panel = (_WIDTH - 1.0) / columns
    rows = math.ceil(len(surfaces) / columns)
    return _WIDTH, rows * (panel / ratio + 0.5) + 1.2


def _column_count(count: int) -> int:
    return min(count, _MAX_COLUMNS if count > 4 else 2)


def _panel_ratio(surfaces: Sequence[Surface]) -> float:
    return min(max(field_window(surfaces).aspect, _MIN_ASPECT), _MAX_ASPECT)


def field_window(surfaces: Sequence[Surface]) -> Window:
    """Return the part of the plane along the scan line shown in figures of the field."""
    segment = field_segment(surfaces)
    return Window(segment, *field_range(surfaces, segment))


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
    segment, bottom, top = window.segment, window.bottom, window.top
    curls = [curl_field(surface, segment, bottom) for surface in surfaces]
    arrows = [arrow_field(surface, segment, bottom, top) for surface in surfaces]
    layout = _make_layout(surfaces, window, curls, arrows)
    x, y = f"along the scan line [{layout.x_unit.name}]", f"z [{layout.z_unit.name}]"
    panels = style.axes_grid(figure, len(surfaces), _column_count(len(surfaces)), x=x, y=y)
    mesh: Any = None
    quiver: Any = None
    for index, (axes, surface) in enumerate(zip(panels, surfaces, strict=True)):
        mesh = _draw_curl(axes, curls[index], layout)
        quiver = _draw_arrows(axes, arrows[index], layout)
        _draw_outline(axes, surface, layout)
        remark = remarks[index] if index < len(remarks) else ""
        style.title_law(axes, surface.law, remark)
    _finish_figure(figure, panels, layout, (mesh, quiver))
    return panels


def _make_layout(
    surfaces: Sequence[Surface],
    window: Window,
    curls: Sequence[CurlField],
    arrows: Sequence[PlaneForces],
) -> _PanelLayout:
    strong = [np.abs(c.curl).ravel() for c in curls if np.abs(c.curl).max() > 1e-9 * c.max_norm]
    limit = float(np.quantile(np.concatenate(strong), 0.97)) if strong else surfaces[0].stiffness
    sizes = np.concatenate([np.hypot(a.tangential, a.normal) for a in arrows])
    usual = float(np.quantile(sizes, 0.9)) if sizes.size else 1.0
    rounded = 2.0 * style.nice_length(0.5 * limit) if limit > 0.0 else 1.0
    return _PanelLayout(window, *window.units, rounded, usual / 0.32)


def _draw_curl(axes: Axes, field: CurlField, layout: _PanelLayout) -> Any:
    mesh = axes.pcolormesh(
        field.along * layout.x_unit.scale,
        field.z * layout.z_unit.scale,
        field.curl,
        cmap=style.CURL,
        vmin=-layout.curl_limit,
        vmax=layout.curl_limit,
        shading="flat",
        rasterized=True,
        zorder=1,
    )
    axes.set_facecolor(style.FREE_SPACE)
    return mesh


def _draw_arrows(axes: Axes, field: PlaneForces, layout: _PanelLayout) -> Any:
    return axes.quiver(
        field.along * layout.x_unit.scale,
        field.z * layout.z_unit.scale,
        field.tangential,
        field.normal,
        scale=layout.force_per_inch,
        color=style.unthemed_colour(style.INK),
        zorder=4,
        **_ARROWS,
    )


def _draw_outline(axes: Axes, surface: Surface, layout: _PanelLayout) -> None:
    """Draw the textured body, the contact surface if it is another, and the scan."""
    along = layout.window.segment.distances(600)
    x = along * layout.x_unit.scale
    xy = layout.window.segment.xy(along)
    heights = surface.texture.height(xy) * layout.z_unit.scale
    contact = surface.law.contact
    on_texture = contact.begins_on_texture
    ink, green = style.unthemed_colour(style.INK), style.unthemed_colour(style.GREEN)
    axes.plot(x, heights, color=ink, linewidth=1.3, linestyle="-" if on_texture else ":")
    if not on_texture:
        tops = contact.contact_height(surface.texture, xy) * layout.z_unit.scale
        axes.plot(x, tops, color=ink, linewidth=1.3)
    axes.axhline(scan_height(surface) * layout.z_unit.scale, color=green, lw=1.0, ls="--")


def _finish_figure(
    figure: Figure | SubFigure, panels: list[Axes], layout: _PanelLayout, artists: Any
) -> None:
    mesh, quiver = artists
    window = layout.window
    for axes in panels:
        axes.set_xlim(0.0, window.segment.length * layout.x_unit.scale)
        axes.set_ylim(window.bottom * layout.z_unit.scale, window.top * layout.z_unit.scale)
        if layout.x_unit == layout.z_unit and _MIN_ASPECT <= window.aspect <= _MAX_ASPECT:
            axes.set_aspect("equal")
    bar = figure.colorbar(
        mesh, ax=panels, location="bottom", shrink=0.5, aspect=40, extend="both", pad=0.02
    )
    style.style_colorbar(bar, "curl [N/m]: white is conservative")
    force = style.nice_length(0.35 * layout.force_per_inch)
    unit = style.force_unit(force)
    # In the axes of the bar, which are not hidden with a law.
    bar.ax.quiverkey(
        quiver,
        0.92,
        1.04,
        force,
        f"{force * unit.scale:g} {unit.name}",
        labelpos="W",
        color=style.INK,
        fontproperties={"size": style.TICK},
        labelcolor=style.INK,
    )
