"""The surface as a picture, large and small: a map with a section, or a section alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LightSource, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure, SubFigure

from asperity.checks import FloatArray
from asperity.report.pictures import style
from asperity.report.pictures.vertical_cut import Stretch, feature_length, stretch_of
from asperity.textures.texture import Texture


@dataclass(frozen=True)
class MapGrid:
    """The middles of the cells of a rectangle about the domain.

    Attributes:
        low: lower left corner [m], shape (2,).
        size: width and depth [m], shape (2,).
        shape: rows and columns.
        xy: points [m], shape (rows * columns, 2), row by row.
    """

    low: FloatArray
    size: FloatArray
    shape: tuple[int, int]
    xy: FloatArray

    @property
    def frame(self) -> tuple[style.Unit, tuple[float, float, float, float]]:
        """The unit of its axes, and left, right, lower and upper border in it."""
        unit = style.length_unit(float(self.size.max()))
        (x0, y0), (x1, y1) = self.low * unit.scale, (self.low + self.size) * unit.scale
        return unit, (x0, x1, y0, y1)


def map_grid(texture: Texture, count: int) -> MapGrid:
    """Return a grid with so many cells along the longer side."""
    corners = texture.domain.points(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))
    low = corners.min(axis=0)
    size = corners.max(axis=0) - low
    columns, rows = (max(2, round(float(side / size.max()) * count)) for side in size)
    x, y = (
        low[axis] + (np.arange(n) + 0.5) * size[axis] / n for axis, n in enumerate((columns, rows))
    )
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return MapGrid(low, size, (rows, columns), xy)


_MAP_POINTS = 320
_SECTION_POINTS = 1600


def surface_size(texture: Texture) -> tuple[float, float]:
    """Return width and height of the picture [inch]."""
    return (10.0, 2.6) if texture.is_profile else (10.0, 5.4)


def draw_surface(figure: Figure | SubFigure, texture: Texture) -> None:
    """Draw the surface: from above with its scan line, and cut along that line."""
    if texture.is_profile:
        length = feature_length(texture)
        stretch = stretch_of(texture, 4.0 * length, 24.0 * length)
        draw_section(figure.subplots(), texture, stretch)
        return
    upper, lower = figure.subplots(2, 1, height_ratios=[3.0, 1.0])
    _draw_map(figure, upper, texture)
    line = texture.scan_line()
    draw_section(lower, texture, Stretch(line, 0.0, line.length))


def draw_section(axes: Axes, texture: Texture, stretch: Stretch) -> None:
    """Draw the body cut along the stretch, filled, with the exaggeration of its heights."""
    along = stretch.steps(_SECTION_POINTS)
    heights = texture.height(stretch.xy(along))
    wide = style.length_unit(stretch.length)
    high = style.length_unit(texture.peak_to_valley)
    x, z = along * wide.scale, heights * high.scale
    low, top = float(z.min()), float(z.max())
    margin = 0.12 * max(top - low, 1e-9)
    axes.fill_between(x, z, low - 3.0 * margin, color=style.BODY, linewidth=0.0)
    axes.plot(x, z, color=style.INK, linewidth=1.1, label="height")
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(low - 3.0 * margin, top + margin)
    axes.set_facecolor(style.CARD)
    style.dress(axes)
    style.label(axes, f"along the scan line [{wide.name}]", f"height [{high.name}]")
    axes.set_title(
        f"cut along the scan line: {stretch.description}",
        loc="left",
        fontsize=style.LABEL,
        color=style.INK,
    )


def _draw_map(figure: Figure | SubFigure, axes: Axes, texture: Texture) -> None:
    grid = map_grid(texture, _MAP_POINTS)
    heights = texture.height(grid.xy).reshape(grid.shape)
    wide, frame = grid.frame
    high = style.length_unit(texture.peak_to_valley)
    norm = Normalize(float(heights.min()) * high.scale, float(heights.max()) * high.scale)
    colours = matplotlib.colormaps[style.HEIGHTS]
    shaded = _greyed(_relief(heights, grid.size, colours, steepest=1.0, altitude=50.0), texture)
    # Covered by the relief: what the colour bar and the reader of numbers know of the heights.
    known = axes.imshow(heights * high.scale, colours, norm, origin="lower", extent=frame)
    axes.imshow(shaded, origin="lower", extent=frame, interpolation="bilinear")
    axes.set_anchor("W")
    style.dress(axes)
    style.label(axes, f"x [{wide.name}]", f"y [{wide.name}]")
    _draw_scan_line(axes, texture, wide)
    _draw_scale_bar(axes, float(grid.size[0]))
    bar: Any = figure.colorbar(known, ax=axes, pad=0.02, aspect=18)
    style.dress_bar(bar, f"height [{high.name}]")


def _relief(
    heights: FloatArray, size: FloatArray, colours: Colormap, steepest: float, altitude: float
) -> FloatArray:
    """Return a map lit from the upper left as colours (rows, columns, 4).

    Args:
        heights: [m], shape (rows, columns).
        size: width and depth [m], shape (2,).
        colours: of the heights.
        steepest: the slope that the steepest tenth is shown with, whatever the true slopes are.
        altitude: of the light above the horizon [degrees].
    """
    dx, dy = (float(step) for step in size / np.array(heights.shape[::-1]))
    slopes = np.hypot(*np.gradient(heights, dy, dx))
    exaggeration = steepest / max(float(np.quantile(slopes, 0.9)), 1e-300)
    return LightSource(azdeg=315, altdeg=altitude).shade(
        heights, cmap=colours, blend_mode="soft", vert_exag=exaggeration, dx=dx, dy=dy
    )


def _greyed(shaded: FloatArray, texture: Texture) -> FloatArray:
    """Return the picture with the places greyed where heights were missing and are filled in."""
    filled = texture.filled
    if filled is None or not filled.any():
        return shaded
    rows, columns = (
        np.minimum((np.arange(count) + 0.5) * extent / count, extent - 1).astype(int)
        for count, extent in zip(shaded.shape[:2], filled.shape, strict=True)
    )
    there = filled[np.ix_(rows, columns)]
    result = shaded.copy()
    result[there, :3] = 0.25 * result[there, :3] + 0.75 * np.array([0.80, 0.82, 0.85])
    return result


def _draw_scan_line(axes: Axes, texture: Texture, unit: style.Unit) -> None:
    line = texture.scan_line()
    ends = np.stack([line.start, line.start + line.length * line.direction]) * unit.scale
    axes.plot(*ends.T, color="white", linewidth=2.6, solid_capstyle="butt")
    axes.plot(*ends.T, color=style.ORANGE, linewidth=1.4, solid_capstyle="butt")
    start = (float(ends[0, 0]), float(ends[0, 1]))
    style.note(axes, "scan line", start, xycoords="data", xytext=(6, 5), color=style.INK)


def _draw_scale_bar(axes: Axes, width: float) -> None:
    """Draw a bar of a round length in the lower right corner of a map of that width [m]."""
    unit, length = style.length_unit(width), style.nice_length(0.22 * width)
    right, span = 0.97, length / width
    for colour, thickness in (("white", 6.0), (style.INK, 3.0)):
        axes.plot(
            [right - span, right], [0.06, 0.06], transform=axes.transAxes, color=colour,
            linewidth=thickness, solid_capstyle="butt",
        )  # fmt: skip
    words, middle = f"{length * unit.scale:g} {unit.name}", right - 0.5 * span
    style.note(axes, words, (middle, 0.085), ha="center", va="bottom", color=style.INK)


# --- small pictures that tell textures apart by their relief --------------------------------------

_CARD_MAP_POINTS = 420
_CARD_SECTION_POINTS = 900
# A neutral material: what tells the surfaces apart is their relief.
_MATERIAL = ("#5f5547", "#b9ab92", "#ddd1ba")


def gallery_figure(texture: Texture) -> Figure:
    """Return the map of a texture, lit from the side, and a section below it."""
    figure = style.new_figure(4.4, 2.0 if texture.is_profile else 5.0)
    if texture.is_profile:
        _draw_card_section(figure.subplots(), texture)
        return figure
    upper, lower = figure.subplots(2, 1, height_ratios=[4.0, 1.0])
    _draw_card_map(upper, texture)
    _draw_card_section(lower, texture)
    return figure


def _draw_card_map(axes: Axes, texture: Texture) -> None:
    grid = map_grid(texture, _CARD_MAP_POINTS)
    size, heights = grid.size, texture.height(grid.xy).reshape(grid.shape)
    colours = LinearSegmentedColormap.from_list("material", _MATERIAL)
    shaded = _relief(heights, size, colours, steepest=0.7, altitude=45.0)
    axes.imshow(shaded, origin="lower", extent=(0.0, size[0], 0.0, size[1]))
    axes.set_axis_off()
    _draw_scale_bar(axes, float(size[0]))


def _draw_card_section(axes: Axes, texture: Texture) -> None:
    line = texture.scan_line()
    periods = 3.0 if texture.is_profile and texture.peak_to_valley > 0.05 * line.length else 1.0
    along = np.linspace(0.0, periods * line.length, _CARD_SECTION_POINTS)
    heights = texture.height(line.start + along[:, None] * line.direction)
    wide, high = style.length_unit(float(along[-1])), style.length_unit(texture.peak_to_valley)
    x, z = along * wide.scale, heights * high.scale
    margin = 0.15 * float(np.ptp(z))
    axes.fill_between(x, z, z.min() - margin, color=style.BODY, linewidth=0.0)
    axes.plot(x, z, color=style.INK, linewidth=0.9, label="height")
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(float(z.min()) - margin, float(z.max()) + margin)
    style.dress(axes)
    style.label(axes, f"[{wide.name}]", f"[{high.name}]")
