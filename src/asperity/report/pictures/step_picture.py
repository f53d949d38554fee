"""A step of a preparation: the heights before, after, and what was taken away, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from asperity.checks import FloatArray
from asperity.report.pictures import style
from asperity.textures.shown import Change

_TITLES = ("before", "after", "taken away")
_HIGHEST = 4.2


def step_figure(change: Change) -> Figure:
    """Return three maps, or three lines: before, after, taken away."""
    three = (change.before, change.after, change.before - change.after)
    return heights_figure(dict(zip(_TITLES, three, strict=True)), change.sides)


def heights_figure(shown: Mapping[str, FloatArray], sides: tuple[float, ...]) -> Figure:
    """Return maps, or lines, of the same extent.

    Args:
        shown: heights [m] by title, shape (ny, nx) or (n,).
        sides: width and depth of the surface, or its length [m].
    """
    count = len(shown)
    if len(sides) == 1:
        figure = style.new_figure(10.0, 1.6 * count)
        panels: Any = figure.subplots(count, 1, sharex=True, squeeze=False)
        for axes, (title, heights) in zip(panels.ravel(), shown.items(), strict=True):
            _draw_line(axes, heights, sides[0], title)
        unit = style.length_unit(sides[0])
        panels[-1, 0].set_xlabel(
            f"along the profile [{unit.name}]", fontsize=style.LABEL, color=style.SOFT
        )
        return figure
    wide = sides[0] >= 2.0 * sides[1]
    rows, columns = (count, 1) if wide else (1, count)
    width = 10.0 / columns - 0.9
    height = min(width * sides[1] / sides[0], _HIGHEST) + 0.75
    figure = style.new_figure(10.0, rows * height)
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    for axes, (title, heights) in zip(panels.ravel(), shown.items(), strict=True):
        _draw_map(figure, axes, heights, (sides[0], sides[1]), title)
    return figure


def _draw_line(axes: Axes, heights: FloatArray, length: float, title: str) -> None:
    wide = style.length_unit(length)
    known = heights[~np.isnan(heights)]
    high = style.length_unit(float(np.ptp(known)))
    along = np.linspace(0.0, length * wide.scale, len(heights))
    axes.plot(along, heights * high.scale, color=style.INK, linewidth=0.8, label="height")
    axes.set_xlim(along[0], along[-1])
    style.dress(axes)
    style.label(axes, "", f"height [{high.name}]")
    axes.set_title(title, loc="left", fontsize=style.LABEL, color=style.INK)


def _draw_map(
    figure: Figure, axes: Axes, heights: FloatArray, sides: tuple[float, float], title: str
) -> None:
    """Draw a map in the colours of its own heights; none where nothing was measured."""
    wide = style.length_unit(max(sides))
    known = heights[~np.isnan(heights)]
    high = style.length_unit(float(np.ptp(known)))
    frame = (0.0, sides[0] * wide.scale, 0.0, sides[1] * wide.scale)
    # A single spike must not make all else one colour: the middle 99 % have the colours.
    low, top = (float(value) * high.scale for value in np.quantile(known, [0.005, 0.995]))
    image = axes.imshow(
        heights * high.scale, origin="lower", extent=frame, cmap=style.HEIGHTS, vmin=low, vmax=top,
        interpolation="nearest",
    )  # fmt: skip
    style.dress(axes)
    axes.set_title(title, loc="left", fontsize=style.LABEL, color=style.INK)
    style.label(axes, f"x [{wide.name}]", f"y [{wide.name}]")
    bar: Any = figure.colorbar(image, ax=axes, pad=0.02, aspect=18, extend="both")
    style.dress_bar(bar, f"height [{high.name}]")
