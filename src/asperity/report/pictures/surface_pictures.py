"""Figures of surfaces: maps and sections, cards of the catalogue, and preparation steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, LightSource, LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure, SubFigure

from asperity.core.checks import FloatArray
from asperity.report.pictures import style
from asperity.report.pictures.scan_plane import ScanSegment, choose_segment, feature_length
from asperity.textures.texture import Texture


@dataclass(frozen=True)
class MapGrid:
    """Centres of the cells of a rectangle around the domain.

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
    def frame(self) -> tuple[style.AxisUnit, tuple[float, float, float, float]]:
        """Unit of its axes, and left, right, lower and upper border in that unit."""
        unit = style.length_unit(float(self.size.max()))
        (x0, y0) = self.low * unit.scale
        (x1, y1) = (self.low + self.size) * unit.scale
        return unit, (x0, x1, y0, y1)


def map_grid(texture: Texture, count: int) -> MapGrid:
    """Return a grid with a number of cells along the longer side."""
    corners = texture.domain.points(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))
    low = corners.min(axis=0)
    size = corners.max(axis=0) - low
    counts = [max(2, round(float(side / size.max()) * count)) for side in size]
    centres = [low[i] + (np.arange(n) + 0.5) * size[i] / n for i, n in enumerate(counts)]
    xy = np.stack(np.meshgrid(*centres), axis=-1).reshape(-1, 2)
    return MapGrid(low, size, (counts[1], counts[0]), xy)


_MAP_POINTS = 320
_SECTION_POINTS = 1600


def surface_size(texture: Texture) -> tuple[float, float]:
    """Return width and height of the figure [inch]."""
    if texture.is_profile:
        return 10.0, 2.6
    return (10.0, 5.4) if _is_wide(texture) else (10.0, 3.9)


def _is_wide(texture: Texture) -> bool:
    """Return whether the map of a texture is so wide that its section belongs below it."""
    width, depth = map_grid(texture, _MAP_POINTS).size
    return bool(width > 1.7 * depth)


def draw_surface(figure: Figure | SubFigure, texture: Texture) -> None:
    """Draw a map of the surface with its scan line, and a section along that line."""
    if texture.is_profile:
        length = feature_length(texture)
        segment = choose_segment(texture, 4.0 * length, 24.0 * length)
        draw_section(figure.subplots(), texture, segment)
        return
    if _is_wide(texture):
        first, second = figure.subplots(2, 1, height_ratios=[3.0, 1.0])
    else:
        first, second = figure.subplots(1, 2, width_ratios=[1.0, 1.15])
    _draw_map(figure, first, texture)
    line = texture.scan_line()
    draw_section(second, texture, ScanSegment(line, 0.0, line.length))


def draw_section(axes: Axes, texture: Texture, segment: ScanSegment) -> None:
    """Draw a section of the body along a segment."""
    wide, high = _draw_body(axes, texture, segment, _SECTION_POINTS, (0.36, 0.12))
    axes.set_facecolor(style.BACKGROUND)
    style.label_axes(axes, f"along the scan line [{wide.name}]", f"height [{high.name}]")
    _add_title(axes, f"section along the scan line: {segment.description}")


def _draw_body(
    axes: Axes,
    texture: Texture,
    segment: ScanSegment,
    count: int,
    margins: tuple[float, float],
    width: float = 1.1,
) -> tuple[style.AxisUnit, style.AxisUnit]:
    """Draw a section of the body; return the units of the axes.

    Args:
        axes: receive the section.
        texture: the surface.
        segment: of its scan line.
        count: number of points.
        margins: below and above the surface, as fractions of its height.
        width: of the line [points].
    """
    along = segment.distances(count)
    wide = style.length_unit(segment.length)
    high = style.length_unit(texture.peak_to_valley)
    x = along * wide.scale
    z = texture.height(segment.xy(along)) * high.scale
    low = float(z.min())
    top = float(z.max())
    below = margins[0] * max(top - low, 1e-9)
    above = margins[1] * max(top - low, 1e-9)
    style.fill_below(axes, x, z, low - below)
    axes.plot(x, z, color=style.INK, linewidth=width, label="height")
    axes.set(xlim=(x[0], x[-1]), ylim=(low - below, top + above))
    style.style_axes(axes)
    return wide, high


def _add_title(axes: Axes, text: str) -> None:
    axes.set_title(text, loc="left", fontsize=style.LABEL, color=style.INK)


def _draw_map(figure: Figure | SubFigure, axes: Axes, texture: Texture) -> None:
    grid = map_grid(texture, _MAP_POINTS)
    heights = texture.height(grid.xy).reshape(grid.shape)
    wide, frame = grid.frame
    high = style.length_unit(texture.peak_to_valley)
    norm = Normalize(float(heights.min()) * high.scale, float(heights.max()) * high.scale)
    colours = matplotlib.colormaps[style.HEIGHTS]
    shaded = _shade_relief(heights, grid.size, colours, steepest_slope=1.0, altitude=50.0)
    shaded = _grey_filled(shaded, texture)
    # Covered by the relief: the data of the colour bar and of the numbers of the page.
    known = axes.imshow(heights * high.scale, colours, norm, origin="lower", extent=frame)
    axes.imshow(shaded, origin="lower", extent=frame, interpolation="bilinear")
    style.style_axes(axes)
    style.label_axes(axes, f"x [{wide.name}]", f"y [{wide.name}]")
    _draw_scan_line(axes, texture, wide)
    style.add_colorbar(figure, known, axes, f"height [{high.name}]")


def _shade_relief(
    heights: FloatArray, size: FloatArray, colours: Colormap, steepest_slope: float, altitude: float
) -> FloatArray:
    """Return a map lit from the upper left, as colours of shape (rows, columns, 4).

    Args:
        heights: [m], shape (rows, columns).
        size: width and depth [m], shape (2,).
        colours: of the heights.
        steepest_slope: slope to which the 90 % quantile of the slopes is scaled.
        altitude: of the light above the horizon [degrees].
    """
    dx = float(size[0] / heights.shape[1])
    dy = float(size[1] / heights.shape[0])
    slopes = np.hypot(*np.gradient(heights, dy, dx))
    exaggeration = steepest_slope / max(float(np.quantile(slopes, 0.9)), 1e-300)
    return LightSource(azdeg=315, altdeg=altitude).shade(
        heights, cmap=colours, blend_mode="soft", vert_exag=exaggeration, dx=dx, dy=dy
    )


def _grey_filled(shaded: FloatArray, texture: Texture) -> FloatArray:
    """Return the map with filled-in heights in grey."""
    filled = texture.filled_mask
    if filled is None or not filled.any():
        return shaded
    indices = [
        np.minimum((np.arange(count) + 0.5) * extent / count, extent - 1).astype(int)
        for count, extent in zip(shaded.shape[:2], filled.shape, strict=True)
    ]
    there = filled[np.ix_(*indices)]
    result = shaded.copy()
    result[there, :3] = 0.25 * result[there, :3] + 0.75 * np.array([0.80, 0.82, 0.85])
    return result


def _draw_scan_line(axes: Axes, texture: Texture, unit: style.AxisUnit) -> None:
    line = texture.scan_line()
    ends = np.stack([line.start, line.start + line.length * line.direction]) * unit.scale
    axes.plot(*ends.T, color="white", linewidth=2.6, solid_capstyle="butt")
    axes.plot(*ends.T, color=style.ORANGE, linewidth=1.4, solid_capstyle="butt")
    start = (float(ends[0, 0]), float(ends[0, 1]))
    style.add_note(axes, "scan line", start, xycoords="data", xytext=(6, 5), color=style.INK)


# --- thin parts of a body -------------------------------------------------------------------------


def thin_parts_figure(texture: Texture, half: FloatArray) -> Figure:
    """Return a map of half of the thickness of a baked body where it is thin, from above."""
    wide, frame = map_grid(texture, max(half.shape)).frame
    deep = style.length_unit(float(np.nanmax(half)))
    height = min(max(6.4 * half.shape[0] / half.shape[1], 1.6), 6.4) + 0.8
    figure, axes = style.new_axes(8.0, height)
    options: dict[str, Any] = {"origin": "lower", "extent": frame, "interpolation": "nearest"}
    body = np.full((*half.shape, 4), matplotlib.colors.to_rgba(style.BODY))
    if texture.filled_mask is not None:
        body[texture.filled_mask] = 0.0
    axes.imshow(body, **options)
    image = axes.imshow(half * deep.scale, style.HEIGHTS, vmin=0.0, **options)
    x, y, _z = texture.thin_regions[0].at
    axes.plot(x * wide.scale, y * wide.scale, "x", color=style.ORANGE, markersize=9.0, mew=2.0)
    style.label_axes(axes, f"x [{wide.name}]", f"y [{wide.name}]")
    style.add_colorbar(figure, image, axes, f"depth [{deep.name}]")
    return figure


# --- cards of the catalogue -----------------------------------------------------------------------

_CARD_MAP_POINTS = 420
_CARD_SECTION_POINTS = 900
# A neutral material, so that surfaces differ by their relief alone.
_MATERIAL_COLOURS = ("#5f5547", "#b9ab92", "#ddd1ba")


def gallery_figure(texture: Texture) -> Figure:
    """Return the map of a texture, lit from the side, and a section below it."""
    if texture.is_profile:
        figure = style.new_figure(4.4, 2.0)
        _draw_card_section(figure.subplots(), texture)
        return figure
    figure = style.new_figure(4.4, 5.0)
    upper, lower = figure.subplots(2, 1, height_ratios=[4.0, 1.0])
    _draw_card_map(upper, texture)
    _draw_card_section(lower, texture)
    return figure


def _draw_card_map(axes: Axes, texture: Texture) -> None:
    grid = map_grid(texture, _CARD_MAP_POINTS)
    size = grid.size
    heights = texture.height(grid.xy).reshape(grid.shape)
    colours = LinearSegmentedColormap.from_list("material", _MATERIAL_COLOURS)
    shaded = _shade_relief(heights, size, colours, steepest_slope=0.7, altitude=45.0)
    axes.imshow(shaded, origin="lower", extent=(0.0, size[0], 0.0, size[1]))
    axes.set_axis_off()
    _draw_scale_bar(axes, float(size[0]))


def _draw_scale_bar(axes: Axes, width: float) -> None:
    """Draw a bar of a round length in the lower right corner of a map of that width [m]."""
    unit = style.length_unit(width)
    length = style.nice_length(0.22 * width)
    right = 0.97
    span = length / width
    for colour, thickness in (("white", 6.0), (style.INK, 3.0)):
        options: dict[str, Any] = {"color": colour, "lw": thickness, "solid_capstyle": "butt"}
        axes.plot([right - span, right], [0.06, 0.06], transform=axes.transAxes, **options)
    text = f"{length * unit.scale:g} {unit.name}"
    middle = right - 0.5 * span
    style.add_note(axes, text, (middle, 0.085), ha="center", va="bottom", color=style.INK)


def _draw_card_section(axes: Axes, texture: Texture) -> None:
    line = texture.scan_line()
    periods = 3.0 if texture.is_profile and texture.peak_to_valley > 0.05 * line.length else 1.0
    segment = ScanSegment(line, 0.0, periods * line.length)
    wide, high = _draw_body(axes, texture, segment, _CARD_SECTION_POINTS, (0.15, 0.15), 0.9)
    style.label_axes(axes, f"[{wide.name}]", f"[{high.name}]")


_MAX_MAP_HEIGHT = 4.2


def heights_figure(heights_by_title: Mapping[str, FloatArray], sides: tuple[float, ...]) -> Figure:
    """Return maps, or profiles, of the same extent.

    Args:
        heights_by_title: heights [m] by title, shape (ny, nx) or (n,).
        sides: width and depth of the surface, or its length [m].
    """
    count = len(heights_by_title)
    if len(sides) == 1:
        figure = style.new_figure(10.0, 1.6 * count)
        x = f"along the profile [{style.length_unit(sides[0]).name}]"
        panels = style.axes_grid(figure, count, 1, x=x, sharey=False)
        for axes, (title, heights) in zip(panels, heights_by_title.items(), strict=True):
            _draw_profile(axes, heights, sides[0], title)
        return figure
    rows = 1
    columns = count
    if sides[0] >= 2.0 * sides[1]:
        rows = count
        columns = 1
    width = 10.0 / columns - 0.9
    height = min(width * sides[1] / sides[0], _MAX_MAP_HEIGHT) + 0.75
    figure = style.new_figure(10.0, rows * height)
    panels = style.axes_grid(figure, count, columns)
    for axes, (title, heights) in zip(panels, heights_by_title.items(), strict=True):
        _draw_height_map(figure, axes, heights, (sides[0], sides[1]), title)
    return figure


def _draw_profile(axes: Axes, heights: FloatArray, length: float, title: str) -> None:
    wide = style.length_unit(length)
    known = heights[~np.isnan(heights)]
    high = style.length_unit(float(np.ptp(known)))
    along = np.linspace(0.0, length * wide.scale, len(heights))
    axes.plot(along, heights * high.scale, color=style.INK, linewidth=0.8, label="height")
    axes.set_xlim(along[0], along[-1])
    axes.set_ylabel(f"height [{high.name}]", fontsize=style.LABEL, color=style.MUTED)
    _add_title(axes, title)


def _draw_height_map(
    figure: Figure, axes: Axes, heights: FloatArray, sides: tuple[float, float], title: str
) -> None:
    """Draw a map with a colour scale of its own heights, blank where nothing was measured."""
    wide = style.length_unit(max(sides))
    known = heights[~np.isnan(heights)]
    high = style.length_unit(float(np.ptp(known)))
    frame = (0.0, sides[0] * wide.scale, 0.0, sides[1] * wide.scale)
    # The colours span the middle 99 % of the heights, so that spikes do not dominate them.
    span = np.quantile(known, [0.005, 0.995]) * high.scale
    colours: dict[str, Any] = {"cmap": style.HEIGHTS, "vmin": span[0], "vmax": span[1]}
    options: dict[str, Any] = {"origin": "lower", "extent": frame, "interpolation": "nearest"}
    image = axes.imshow(heights * high.scale, **colours, **options)
    _add_title(axes, title)
    style.label_axes(axes, f"x [{wide.name}]", f"y [{wide.name}]")
    style.add_colorbar(figure, image, axes, f"height [{high.name}]", extend="both")
