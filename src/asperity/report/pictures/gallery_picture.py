"""A small picture of a texture that tells it apart from others by its relief."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from asperity.report.pictures import style
from asperity.report.pictures.surface_picture import draw_scale_bar, map_grid, relief
from asperity.textures.texture import Texture

_MAP_POINTS = 420
_SECTION_POINTS = 900
# A neutral material: what tells the surfaces apart is their relief.
_MATERIAL = ("#5f5547", "#b9ab92", "#ddd1ba")


def gallery_figure(texture: Texture) -> Figure:
    """Return the map of a texture, lit from the side, and a section below it."""
    figure = style.new_figure(4.4, 2.0 if texture.is_profile else 5.0)
    if texture.is_profile:
        _draw_section(figure.subplots(), texture)
        return figure
    upper, lower = figure.subplots(2, 1, height_ratios=[4.0, 1.0])
    _draw_map(upper, texture)
    _draw_section(lower, texture)
    return figure


def _draw_map(axes: Axes, texture: Texture) -> None:
    grid = map_grid(texture, _MAP_POINTS)
    size, heights = grid.size, texture.height(grid.xy).reshape(grid.shape)
    colours = LinearSegmentedColormap.from_list("material", _MATERIAL)
    shaded = relief(heights, size, colours, steepest=0.7, altitude=45.0)
    axes.imshow(shaded, origin="lower", extent=(0.0, size[0], 0.0, size[1]))
    axes.set_axis_off()
    draw_scale_bar(axes, float(size[0]))


def _draw_section(axes: Axes, texture: Texture) -> None:
    line = texture.scan_line()
    periods = 3.0 if texture.is_profile and texture.peak_to_valley > 0.05 * line.length else 1.0
    along = np.linspace(0.0, periods * line.length, _SECTION_POINTS)
    heights = texture.height(line.start + along[:, None] * line.direction)
    wide, high = style.length_unit(float(along[-1])), style.length_unit(texture.peak_to_valley)
    x, z = along * wide.scale, heights * high.scale
    margin = 0.15 * float(np.ptp(z))
    axes.fill_between(x, z, z.min() - margin, color=style.BODY, linewidth=0.0)
    axes.plot(x, z, color=style.INK, linewidth=0.9)
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(float(z.min()) - margin, float(z.max()) + margin)
    style.dress(axes)
    style.label(axes, f"[{wide.name}]", f"[{high.name}]")
