"""Many runs of one loop: onset against delay by law, energy per stroke against speed by law."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.report.pictures import style
from asperity.simulation.prediction import Prediction
from asperity.simulation.scan import Stroke
from asperity.units import engineering

_DASHES = ("-", "--", ":", "-.")


def onset_figure(found: Sequence[Prediction]) -> Figure:
    """Return onset stiffness against delay, one panel per law, with the predictions."""
    laws = list(dict.fromkeys(one.onset.law for one in found))
    figure, panels = style.law_panels(len(laws), 2.3, 0.5, x="delay [samples]", y="stiffness [N/m]")
    for axes, law in zip(panels, laws, strict=True):
        mine = [one for one in found if one.onset.law == law]
        proved = mine[0].conservative
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        lines: dict[str, tuple[list[float], dict[str, Any]]] = {
            "onset": ([one.onset.value for one in mine], _look(style.BLUE, "-", 1.2, "o")),
            "delay rule": (
                [one.delay_rule for one in mine], _look(style.GREEN, "-" if proved else ":"),
            ),
            "paper (1)": ([one.paper for one in mine], _look(style.SOFT, "--")),
            "K₀/q": ([one.wall_rule or math.nan for one in mine], _look(style.ORANGE, "-.")),
        }  # fmt: skip
        for name, (values, look) in lines.items():
            axes.plot([one.onset.delay for one in mine], _finite(values), label=name, **look)
        if any(one.onset.quiet == 0.0 for one in found):
            below = [math.nan if one.onset.quiet else one.onset.cycling for one in mine]
            look = _look(style.BLUE, "", marker="v") | {"ms": 8.0, "mfc": style.CARD}
            axes.plot([one.onset.delay for one in mine], below, label="the least tried", **look)
        style.entitle(axes, law, "conservative" if proved else "not conservative: no proof")
        style.of_law(axes, law)
    style.legend(panels[0])
    return figure


def _look(colour: str, dashes: str, width: float = 1.1, marker: str = "") -> dict[str, Any]:
    return {"color": colour, "ls": dashes, "lw": width, "marker": marker, "ms": 4.0}


def _finite(values: Sequence[float]) -> list[float]:
    """Return the values, those that a logarithmic axis has no place for as gaps."""
    return [value if math.isfinite(value) and value > 0.0 else math.nan for value in values]


def scan_figure(found: Sequence[Stroke]) -> Figure:
    """Return energy per stroke against speed, one panel per law, one line per depth."""
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    figure, panels = style.law_panels(
        len(laws), 2.3, 0.5, x="speed [m/s]", y="energy per stroke [mJ]", sharey=False
    )
    totals = [abs(one.total) for one in found if math.isfinite(one.total)]
    least = 1e3 * 0.01 * max(totals, default=1e-3)
    for axes, law in zip(panels, laws, strict=True):
        _draw_law(axes, [stroke for stroke in found if stroke.law == law])
        style.zero_line(axes, least)  # what is nothing looks like nothing
        axes.xaxis.set_major_locator(MaxNLocator(5))
        style.entitle(axes, law, "")
        style.of_law(axes, law)
    style.legend(panels[0])
    return figure


def _draw_law(axes: Axes, strokes: Sequence[Stroke]) -> None:
    """Draw one line per depth: the sum, and thinner its parts along x and z."""
    depths = dict.fromkeys(stroke.depth for stroke in strokes)
    for depth, dashes in zip(depths, _DASHES * len(depths), strict=False):
        mine = [one for one in strokes if one.depth == depth]
        speeds = [one.speed for one in mine]
        name = f"{engineering(depth, 'm', digits=3)} deep"
        for i, colour in ((0, style.ORANGE), (2, style.BLUE)):
            values = [1e3 * one.energy[i] for one in mine]
            along = f"_{'xyz'[i]}, {name}"
            axes.plot(speeds, values, dashes, color=colour, lw=0.9, label=along)
        values = [1e3 * one.total for one in mine]
        axes.plot(speeds, values, dashes, color=style.INK, lw=1.5, marker="o", ms=3.0, label=name)
