"""Energy per stroke against speed, one line per depth."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.report.pictures import style
from asperity.simulation.scan import Stroke
from asperity.units import engineering

_COLUMNS = 3
_DASHES = ("-", "--", ":", "-.")


def scan_figure(found: Sequence[Stroke]) -> Figure:
    """Return energy per stroke against speed, one panel per law, one line per depth."""
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    figure = style.new_figure(10.0, 2.3 * math.ceil(len(laws) / _COLUMNS) + 0.5)
    panels = style.panels(
        figure, len(laws), _COLUMNS, x="speed [m/s]", y="mJ per stroke", sharey=False
    )
    totals = [abs(one.total) for one in found if math.isfinite(one.total)]
    least = 1e3 * 0.01 * max(totals, default=1e-3)
    for axes, law in zip(panels, laws, strict=True):
        _draw_law(axes, [stroke for stroke in found if stroke.law == law])
        axes.axhline(0.0, color=style.FAINT, lw=0.8, zorder=0.0)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -least), max(high, least))  # what is nothing looks like nothing
        axes.xaxis.set_major_locator(MaxNLocator(5))
        style.entitle(axes, law, "")
    style.legend(panels[0])
    return figure


def _draw_law(axes: Axes, strokes: Sequence[Stroke]) -> None:
    """Draw one line per depth: the sum, and thinner its parts along x and z."""
    depths = dict.fromkeys(stroke.depth for stroke in strokes)
    for depth, dashes in zip(depths, _DASHES * len(depths), strict=False):
        mine = [one for one in strokes if one.depth == depth]
        speeds = [one.speed for one in mine]
        for i, colour in ((0, style.ORANGE), (2, style.BLUE)):
            values = [1e3 * one.energy[i] for one in mine]
            axes.plot(speeds, values, dashes, color=colour, lw=0.9)
        name = f"{engineering(depth, 'm', digits=3)} deep"
        values = [1e3 * one.total for one in mine]
        axes.plot(speeds, values, dashes, color=style.INK, lw=1.5, marker="o", ms=3.0, label=name)
