"""Where the loop gain is: ‖J‖₂/k of every law in the vertical plane of the scan."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.report.pictures import style
from asperity.report.pictures.field_picture import field_stretch
from asperity.report.pictures.vertical_cut import CurlField, Stretch, curl_field, field_range
from asperity.report.words.number_words import bound_text, law_title, number_text

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
    x, y = f"along the scan line [{wide.name}]", f"z [{high.name}]"
    figure, panels = style.law_panels(len(surfaces), 2.2, 0.9, x=x, y=y)
    for axes, row, field in zip(panels, comparison.rows, fields, strict=True):
        mesh = draw_gain_field(axes, field, scale, (wide, high))
        style.entitle(axes, row.law.letter, law_title(row.law.name), f"q = {bound_text(row.q)}")
        style.of_law(axes, row.law.letter)
        _draw_witness(axes, row, stretch, (wide, high))
        axes.set_ylim(bottom * high.scale, top * high.scale)
    gain_bar(figure, mesh, panels, "‖J‖ / k: loop gain over that of the smooth wall [1]")
    return figure


def _draw_witness(
    axes: Axes, row: LawRow, stretch: Stretch, units: tuple[style.Unit, style.Unit]
) -> None:
    """Draw a cross at the witness of q if it lies in the part of the plane that is shown."""
    if row.q.at is None:
        return
    offset = np.array(row.q.at[:2]) - stretch.xy(np.zeros(1))[0]
    along = float(offset @ stretch.line.direction)
    aside = float(np.linalg.norm(offset - along * stretch.line.direction))
    if 0.0 <= along <= stretch.length and aside < 0.01 * stretch.length:
        x, y = along * units[0].scale, row.q.at[2] * units[1].scale
        axes.plot(x, y, "x", color=style.on_field(style.BLUE), ms=7, mew=2, zorder=5)


def draw_gain_field(
    axes: Axes, field: CurlField, scale: LogNorm, units: tuple[style.Unit, style.Unit]
) -> Any:
    """Draw ‖J‖/k of the cells of a vertical plane; return what a colour bar needs."""
    axes.set_facecolor(style.FREE)
    return axes.pcolormesh(
        field.along * units[0].scale, field.z * units[1].scale,
        np.maximum(field.gain, scale.vmin or 0.0),
        norm=scale, cmap="magma_r", shading="flat", rasterized=True,
    )  # fmt: skip


def gain_bar(figure: Figure | SubFigure, mesh: Any, axes: Axes | list[Axes], words: str) -> None:
    """Draw the colour bar of ‖J‖/k."""
    bar = figure.colorbar(
        mesh, ax=axes, location="bottom", shrink=0.5, aspect=40, pad=0.02, extend="both",
        ticks=LogLocator(subs=(1.0, 2.0, 5.0)),
        format=FuncFormatter(lambda value, _place: number_text(value)),
    )  # fmt: skip
    bar.ax.xaxis.set_minor_locator(NullLocator())
    style.dress_bar(bar, words)
