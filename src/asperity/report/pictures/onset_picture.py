"""The stiffness at which limit cycles begin against delay, with what the criteria allow."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.report.pictures import style
from asperity.simulation.prediction import Prediction

_COLUMNS = 3


def onset_figure(found: Sequence[Prediction]) -> Figure:
    """Return onset stiffness against delay, one panel per law, with the predictions."""
    laws = list(dict.fromkeys(one.onset.law for one in found))
    figure = style.new_figure(10.0, 2.3 * math.ceil(len(laws) / _COLUMNS) + 0.5)
    panels = style.panels(figure, len(laws), _COLUMNS, x="delay [samples]", y="stiffness [N/m]")
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
        style.entitle(axes, law, "conservative" if proved else "not conservative: no proof")
    style.legend(panels[0])
    return figure


def _look(colour: str, dashes: str, width: float = 1.1, marker: str = "") -> dict[str, Any]:
    return {"color": colour, "ls": dashes, "lw": width, "marker": marker, "ms": 4.0}


def _finite(values: Sequence[float]) -> list[float]:
    """Return the values, those that a logarithmic axis has no place for as gaps."""
    return [value if math.isfinite(value) and value > 0.0 else math.nan for value in values]
