"""Where the loop gain is: ‖J‖₂/k of every law in the vertical plane of the scan."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from asperity.analysis.compare import Comparison
from asperity.report.pictures import style
from asperity.report.pictures.field_picture import field_stretch
from asperity.report.pictures.vertical_cut import CurlField, curl_field, field_range
from asperity.report.words.number_words import bound_text, law_title

_COLUMNS = 3
_CELLS = (120, 60)


def gain_figure(comparison: Comparison) -> Figure:
    """Return ‖J‖₂/k, one panel per law on one logarithmic scale, with the witness of q.

    The witness is drawn (a cross) where it lies in the part of the plane that is shown.
    """
    surfaces = [row.surface for row in comparison.rows]
    stretch = field_stretch(surfaces)
    bottom, top = field_range(surfaces, stretch)
    fields = [curl_field(surface, stretch, bottom, *_CELLS) for surface in surfaces]
    values = np.concatenate([field.gain.ravel() for field in fields])
    highest = max(float(np.quantile(values[np.isfinite(values)], 0.995)), 2.0)
    scale = LogNorm(min(0.5, float(np.quantile(values[values > 0.0], 0.02))), highest)
    wide, high = style.length_unit(stretch.length), style.length_unit(top - bottom)
    columns = min(_COLUMNS, len(surfaces))
    rows = math.ceil(len(surfaces) / columns)
    figure = style.new_figure(10.0, 2.2 * rows + 0.9)
    grid: Any = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.ravel())
    mesh: Any = None
    for index, (row, field) in enumerate(zip(comparison.rows, fields, strict=True)):
        axes = panels[index]
        mesh = _draw(axes, field, scale, wide.scale, high.scale)
        style.entitle(axes, row.law.letter, law_title(row.law.name), f"q = {bound_text(row.q)}")
        if row.q.at is not None:
            offset = np.array(row.q.at[:2]) - stretch.xy(np.zeros(1))[0]
            along = float(offset @ stretch.line.direction)
            aside = float(np.linalg.norm(offset - along * stretch.line.direction))
            if 0.0 <= along <= stretch.length and aside < 0.01 * stretch.length:
                x, y = along * wide.scale, row.q.at[2] * high.scale
                axes.plot(x, y, "x", color=style.BLUE, ms=7, mew=2, zorder=5)
        lowest = index + columns >= len(surfaces)
        axes.tick_params(labelbottom=lowest)
        style.label(
            axes,
            f"along the scan line [{wide.name}]" if lowest else "",
            f"z [{high.name}]" if index % columns == 0 else "",
        )
        axes.set_ylim(bottom * high.scale, top * high.scale)
    for axes in panels[len(surfaces) :]:
        axes.set_visible(False)
    bar = figure.colorbar(
        mesh,
        ax=panels[: len(surfaces)],
        location="bottom",
        shrink=0.5,
        aspect=40,
        extend="both",
        ticks=LogLocator(subs=(1.0, 2.0, 5.0)),
        format="%g",
    )
    bar.ax.xaxis.set_minor_locator(NullLocator())
    style.dress_bar(bar, "‖J‖ / k: loop gain over that of the smooth wall [1]")
    return figure


def _draw(axes: Any, field: CurlField, scale: LogNorm, wide: float, high: float) -> Any:
    style.dress(axes)
    axes.set_facecolor(style.FREE)
    shown = np.maximum(field.gain, scale.vmin if scale.vmin is not None else 1e-3)
    return axes.pcolormesh(
        field.along * wide,
        field.z * high,
        shown,
        norm=scale,
        cmap="magma_r",
        shading="flat",
        rasterized=True,
    )
