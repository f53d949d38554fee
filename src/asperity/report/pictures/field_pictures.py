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

    def limit_axes(self, axes: Axes) -> None:
        """Limit axes, which are in its units, to the window."""
        wide, high = self.units
        top = self.top * high.scale
        axes.set(xlim=(0.0, self.segment.length * wide.scale), ylim=(self.bottom * high.scale, top))


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
    curl_limit, force_per_inch = _choose_scales(surfaces, curls, arrows)
    (wide, high), columns = window.units, _column_count(len(surfaces))
    x, y = f"along the scan line [{wide.name}]", f"z [{high.name}]"
    panels = style.axes_grid(figure, len(surfaces), columns, x=x, y=y)
    is_true_to_scale = wide == high and _MIN_ASPECT <= window.aspect <= _MAX_ASPECT
    for index, (axes, surface) in enumerate(zip(panels, surfaces, strict=True)):
        mesh = _draw_curl(axes, curls[index], window, curl_limit)
        quiver = _draw_arrows(axes, arrows[index], window, force_per_inch)
        _draw_outline(axes, surface, window)
        style.title_law(axes, surface.law, remarks[index] if index < len(remarks) else "")
        window.limit_axes(axes)
        axes.set_aspect("equal" if is_true_to_scale else "auto")
    label = "curl [N/m]: white is conservative"
    bar = style.add_colorbar(figure, mesh, panels, label, **style.WIDE_COLORBAR)
    _draw_force_key(bar, quiver, style.nice_length(0.35 * force_per_inch))
    return panels


def _choose_scales(
    surfaces: Sequence[Surface], curls: Sequence[CurlField], arrows: Sequence[PlaneForces]
) -> tuple[float, float]:
    """Return the greatest curl of the colours [N/m] and the force of an inch of arrow [N]."""
    strong = [np.abs(c.curl).ravel() for c in curls if np.abs(c.curl).max() > 1e-9 * c.max_norm]
    limit = float(np.quantile(np.concatenate(strong), 0.97)) if strong else surfaces[0].stiffness
    sizes = np.concatenate([np.hypot(a.tangential, a.normal) for a in arrows])
    usual = float(np.quantile(sizes, 0.9)) if sizes.size else 1.0
    rounded = 2.0 * style.nice_length(0.5 * limit) if limit > 0.0 else 1.0
    return rounded, usual / 0.32


def _draw_curl(axes: Axes, field: CurlField, window: Window, limit: float) -> Any:
    axes.set_facecolor(style.FREE_SPACE)
    wide, high = window.units
    places = (field.along * wide.scale, field.z * high.scale)
    colours: dict[str, Any] = {"cmap": style.CURL, "vmin": -limit, "vmax": limit, "zorder": 1}
    return axes.pcolormesh(*places, field.curl, shading="flat", rasterized=True, **colours)


def _draw_arrows(axes: Axes, field: PlaneForces, window: Window, force_per_inch: float) -> Any:
    wide, high = window.units
    places = (field.along * wide.scale, field.z * high.scale)
    options = _ARROWS | {"scale": force_per_inch, "color": style.unthemed_colour(style.INK)}
    return axes.quiver(*places, field.tangential, field.normal, zorder=4, **options)


def _draw_outline(axes: Axes, surface: Surface, window: Window) -> None:
    """Draw the textured body, the contact surface if it is another, and the scan."""
    wide, high = window.units
    along = window.segment.distances(600)
    x = along * wide.scale
    xy = window.segment.xy(along)
    heights = surface.texture.height(xy) * high.scale
    contact = surface.law.contact
    on_texture = contact.begins_on_texture
    ink, green = style.unthemed_colour(style.INK), style.unthemed_colour(style.GREEN)
    axes.plot(x, heights, color=ink, linewidth=1.3, linestyle="-" if on_texture else ":")
    if not on_texture:
        tops = contact.contact_height(surface.texture, xy) * high.scale
        axes.plot(x, tops, color=ink, linewidth=1.3)
    axes.axhline(scan_height(surface) * high.scale, color=green, lw=1.0, ls="--")


def _draw_force_key(bar: Any, quiver: Any, force: float) -> None:
    """Draw an arrow of a force [N] in the axes of a colour bar, which no law hides."""
    unit = style.force_unit(force)
    text = f"{force * unit.scale:g} {unit.name}"
    options: dict[str, Any] = {"color": style.INK, "labelcolor": style.INK, "labelpos": "W"}
    font = {"size": style.TICK}
    bar.ax.quiverkey(quiver, 0.92, 1.04, force, text, fontproperties=font, **options)
