"""The force field as arrows over its curl, one panel per law, on shared scales."""

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
from asperity.report.pictures.vertical_cut import (
    CurlField,
    PlaneForces,
    Stretch,
    arrow_field,
    curl_field,
    feature_length,
    field_range,
    stretch_of,
)
from asperity.report.words.number_words import law_title
from asperity.surface import Surface

_WIDTH = 10.0
_MOST_COLUMNS = 3
# Body and width of a panel are drawn true to scale unless that makes it flatter or taller.
_FLATTEST, _TALLEST = 2.4, 0.8


@dataclass(frozen=True)
class Window:
    """The part of a vertical plane that a picture shows.

    Attributes:
        stretch: of the line that the plane stands on.
        bottom: [m].
        top: [m].
    """

    stretch: Stretch
    bottom: float
    top: float

    @property
    def units(self) -> tuple[style.Unit, style.Unit]:
        """The units in which its width and its height are best read."""
        return style.length_unit(self.stretch.length), style.length_unit(self.top - self.bottom)


@dataclass(frozen=True)
class _Scene:
    """What all panels share."""

    window: Window
    wide: style.Unit
    high: style.Unit
    limit: float
    per_inch: float


def field_stretch(surfaces: Sequence[Surface]) -> Stretch:
    """Return the part of the scan line that the pictures of the field show."""
    texture = surfaces[0].texture
    depth = max(surface.max_depth for surface in surfaces)
    length = feature_length(texture)
    wanted = 1.3 * (texture.peak_to_valley + depth)
    return stretch_of(texture, min(max(wanted, length), 3.0 * length), 3.0 * length)


def field_size(surfaces: Sequence[Surface]) -> tuple[float, float]:
    """Return width and height of the picture [inch]."""
    columns = _columns(len(surfaces))
    ratio = _panel_ratio(surfaces)
    panel = (_WIDTH - 1.0) / columns
    rows = math.ceil(len(surfaces) / columns)
    return _WIDTH, rows * (panel / ratio + 0.5) + 1.2


def _columns(count: int) -> int:
    return min(count, _MOST_COLUMNS if count > 4 else 2)


def _panel_ratio(surfaces: Sequence[Surface]) -> float:
    window = field_window(surfaces)
    return min(max(window.stretch.length / (window.top - window.bottom), _TALLEST), _FLATTEST)


def field_window(surfaces: Sequence[Surface]) -> Window:
    """Return the part of the plane along the scan line that shows the fields."""
    stretch = field_stretch(surfaces)
    return Window(stretch, *field_range(surfaces, stretch))


def draw_fields(
    figure: Figure | SubFigure,
    surfaces: Sequence[Surface],
    remarks: Sequence[str] = (),
    window: Window | None = None,
) -> list[Axes]:
    """Draw the field of every law: arrows over the curl, the same scales for all.

    Args:
        figure: where to.
        surfaces: one per law, on the same texture.
        remarks: a line below the title of each panel.
        window: what to show; see :func:`field_window` for what is shown by default.

    Returns:
        The panels, one per law; lengths on their axes are in the units that
        :func:`asperity.report.pictures.style.length_unit` gives for width and height of the window.
    """
    window = window or field_window(surfaces)
    stretch, bottom, top = window.stretch, window.bottom, window.top
    curls = [curl_field(surface, stretch, bottom) for surface in surfaces]
    arrows = [arrow_field(surface, stretch, bottom, top) for surface in surfaces]
    scene = _scene(surfaces, window, curls, arrows)
    x, y = f"along the scan line [{scene.wide.name}]", f"z [{scene.high.name}]"
    panels = style.panels(figure, len(surfaces), _columns(len(surfaces)), x=x, y=y)
    mesh: Any = None
    quiver: Any = None
    for index, (axes, surface) in enumerate(zip(panels, surfaces, strict=True)):
        mesh = _draw_curl(axes, curls[index], scene)
        quiver = _draw_arrows(axes, arrows[index], scene)
        _draw_outline(axes, surface, scene)
        remark = remarks[index] if index < len(remarks) else ""
        style.entitle(axes, surface.law.letter, law_title(surface.law.name), remark)
        style.of_law(axes, surface.law.letter)
    _finish(figure, panels, scene, (mesh, quiver))
    return panels


def _scene(
    surfaces: Sequence[Surface],
    window: Window,
    curls: Sequence[CurlField],
    arrows: Sequence[PlaneForces],
) -> _Scene:
    strong = [np.abs(c.curl).ravel() for c in curls if np.abs(c.curl).max() > 1e-9 * c.norm]
    limit = float(np.quantile(np.concatenate(strong), 0.97)) if strong else surfaces[0].stiffness
    sizes = np.concatenate([np.hypot(a.tangential, a.normal) for a in arrows])
    usual = float(np.quantile(sizes, 0.9)) if sizes.size else 1.0
    rounded = 2.0 * style.nice_length(0.5 * limit) if limit > 0.0 else 1.0
    return _Scene(window, *window.units, rounded, usual / 0.32)


def _draw_curl(axes: Axes, field: CurlField, scene: _Scene) -> Any:
    mesh = axes.pcolormesh(
        field.along * scene.wide.scale,
        field.z * scene.high.scale,
        field.curl,
        cmap=style.CURL,
        vmin=-scene.limit,
        vmax=scene.limit,
        shading="flat",
        rasterized=True,
        zorder=1,
    )
    axes.set_facecolor(style.FREE)
    return mesh


def _draw_arrows(axes: Axes, field: PlaneForces, scene: _Scene) -> Any:
    return axes.quiver(
        field.along * scene.wide.scale,
        field.z * scene.high.scale,
        field.tangential,
        field.normal,
        angles="uv",
        units="inches",
        scale_units="inches",
        scale=scene.per_inch,
        width=0.011,
        headwidth=4.0,
        headlength=4.5,
        headaxislength=4.0,
        minlength=0.6,
        color=style.on_field(style.INK),
        zorder=4,
    )


def _draw_outline(axes: Axes, surface: Surface, scene: _Scene) -> None:
    """Draw the textured body, the surface where contact begins if another, and the scan."""
    along = scene.window.stretch.steps(600)
    x = along * scene.wide.scale
    xy = scene.window.stretch.xy(along)
    heights = surface.texture.height(xy) * scene.high.scale
    contact = surface.law.contact
    felt = contact.begins_on_texture
    ink, green = style.on_field(style.INK), style.on_field(style.GREEN)
    axes.plot(x, heights, color=ink, linewidth=1.3, linestyle="-" if felt else ":")
    if not felt:
        tops = contact.begin(surface.texture, xy) * scene.high.scale
        axes.plot(x, tops, color=ink, linewidth=1.3)
    axes.axhline(
        scan_height(surface) * scene.high.scale, color=green, linewidth=1.0, linestyle="--"
    )


def _finish(figure: Figure | SubFigure, panels: list[Axes], scene: _Scene, drawn: Any) -> None:
    mesh, quiver = drawn
    window = scene.window
    true_to_scale = _TALLEST <= window.stretch.length / (window.top - window.bottom) <= _FLATTEST
    for axes in panels:
        axes.set_xlim(0.0, window.stretch.length * scene.wide.scale)
        axes.set_ylim(window.bottom * scene.high.scale, window.top * scene.high.scale)
        if true_to_scale and scene.wide == scene.high:
            axes.set_aspect("equal")
    bar = figure.colorbar(
        mesh, ax=panels, location="bottom", shrink=0.5, aspect=40, extend="both", pad=0.02
    )
    style.dress_bar(bar, "curl [N/m]: white is conservative")
    force = style.nice_length(0.35 * scene.per_inch)
    unit = style.force_unit(force)
    # In the group of the bar, which no law takes along when it is hidden.
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
