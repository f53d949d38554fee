"""One look for every picture: colours, type sizes, units."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure

CARD = "#ffffff"
"""Background of every picture."""
FREE = "#eceef1"
"""Free space in a field: where the probe touches nothing."""
INK, SOFT, FAINT = "#1d2733", "#5b6673", "#c9ced6"
BODY = "#d9cdb8"
# Okabe and Ito's palette: told apart by colour-blind readers.
BLUE, ORANGE, GREEN = "#0072b2", "#d55e00", "#009e73"
THEMED = {
    CARD: "card", INK: "ink", "#000000": "ink", SOFT: "soft", FAINT: "faint", BODY: "body",
    BLUE: "blue", ORANGE: "orange", GREEN: "green",
}  # fmt: skip
"""The colours that follow the theme of a page: names of the variables that stand for them.

Their values in the dark are in ``templates/style.css``; in the light, in print and in a file of its
own a picture has the colours above.
"""
TITLE, LABEL, TICK = 10.0, 9.0, 8.0
HEIGHTS = "cividis"

# ColorBrewer's PuOr with a middle that is truly white: white is "no curl".
CURL = LinearSegmentedColormap.from_list(
    "asperity_curl",
    ["#4d1a6b", "#8073ac", "#c5bfdf", "#ffffff", "#fbc98a", "#e08214", "#7f3b08"],
)


def on_field(colour: str) -> str:
    """Return a colour of the palette for what lies on a field, which is as light in the dark.

    It is off by one part in 255, so that no variable stands for it.

    Example:
        >>> on_field("#1d2733"), on_field("#ffffff")
        ('#1d2732', '#fffffe')
    """
    value = int(colour[1:], 16)
    return f"#{value - 1 if value & 1 else value + 1:06x}"


@dataclass(frozen=True)
class Unit:
    """A unit for an axis.

    Attributes:
        name: such as "mm".
        scale: the number that an SI value is multiplied by.
    """

    name: str
    scale: float


def length_unit(extent: float) -> Unit:
    """Return the unit in which lengths up to the extent [m] are best read.

    Example:
        >>> length_unit(1e-3).name, length_unit(2e-6).name, length_unit(0.5).name
        ('mm', 'µm', 'mm')
    """
    if extent < 2e-7:
        return Unit("nm", 1e9)
    return Unit("µm", 1e6) if extent < 1e-4 else Unit("mm", 1e3)


def force_unit(extent: float) -> Unit:
    """Return the unit in which forces up to the extent [N] are best read."""
    return Unit("mN", 1e3) if extent < 0.1 else Unit("N", 1.0)


def nice_length(target: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most the target.

    Example:
        >>> nice_length(0.37), nice_length(6.0)
        (0.2, 5.0)
    """
    power: float = 10.0 ** math.floor(math.log10(target))
    step = max(m for m in (1.0, 2.0, 5.0) if m * power <= target * (1.0 + 1e-9))
    return round(step * power, 12)


class Drawn(Figure):
    """A figure that a notebook shows, with ``%matplotlib inline`` or without."""

    def _repr_png_(self) -> bytes:
        """Return the figure as PNG, as wide as a notebook's column."""
        return png(self)


def png(figure: Figure) -> bytes:
    """Return a figure as PNG: 720 pixels for its 10 inches."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=72)
    return buffer.getvalue()


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure [inch] that belongs to nobody: no pyplot, no global state."""
    figure = Drawn(figsize=(width, height), facecolor=CARD, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def dress(axes: Axes) -> None:
    """Give axes the common look."""
    axes.tick_params(which="both", labelsize=TICK, colors=SOFT, length=3, width=0.6)
    for side, spine in axes.spines.items():
        spine.set_visible(side in {"left", "bottom"})
        spine.set_color(FAINT)
        spine.set_linewidth(0.8)


def panel(figure: Figure | SubFigure) -> Axes:
    """Return the only axes of a figure, dressed."""
    axes: Axes = figure.subplots()
    dress(axes)
    return axes


def law_panels(
    count: int, height: float, around: float, *, x: str, y: str, sharey: bool = True
) -> tuple[Figure, list[Axes]]:
    """Return a new figure with axes for so many laws, three in a row; see :func:`panels`.

    Args:
        count: of laws.
        height: of a row [inch].
        around: what the figure is higher than its rows [inch].
        x: what all have along.
        y: what all have upwards.
        sharey: whether all have one vertical scale.
    """
    figure = new_figure(10.0, height * math.ceil(count / 3) + around)
    return figure, panels(figure, count, 3, x=x, y=y, sharey=sharey)


def zero_line(axes: Axes, least: float = 0.0) -> None:
    """Draw where values are zero, and show at least so much above and below it."""
    axes.axhline(0.0, color=FAINT, lw=0.8, zorder=0.0)
    if least:
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -least), max(high, least))


def panels(
    figure: Figure | SubFigure,
    count: int,
    columns: int,
    *,
    x: str = "",
    y: str = "",
    sharey: bool = True,
) -> list[Axes]:
    """Return axes side by side, dressed, in rows; only the outer ones carry words and numbers.

    Args:
        figure: where to.
        count: of axes.
        columns: greatest number of axes in a row.
        x: what all have along, written below the lowest.
        y: what all have upwards, written beside the first of each row.
        sharey: whether all have one vertical scale, too.
    """
    columns = min(columns, count)
    rows = -(-count // columns)
    grid: Any = figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False)
    for index, axes in enumerate(grid.ravel()):
        axes.set_visible(index < count)
        lowest = index + columns >= count
        dress(axes)
        axes.tick_params(labelbottom=lowest)
        label(axes, x if lowest else "", y if index % columns == 0 else "")
    return list(grid.ravel()[:count])


def legend(axes: Axes, **options: Any) -> None:
    """Name the lines, without a frame."""
    axes.legend(**{"fontsize": TICK, "frameon": False, "labelcolor": SOFT, **options})


def note(axes: Axes, words: str, place: tuple[float, float], **options: Any) -> None:
    """Write small words on a plate, so that lines do not run through them."""
    plate = {"facecolor": CARD, "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
    defaults: dict[str, Any] = {
        "xycoords": "axes fraction", "xytext": (0, 0), "textcoords": "offset points",
        "fontsize": TICK, "color": SOFT, "bbox": plate,
    }  # fmt: skip
    axes.annotate(words, place, **{**defaults, **options})


LAW = "law-"
"""Begins the ``gid`` of what belongs to one law; the rest is its letter."""


def of_law(artist: Artist, letter: str) -> None:
    """Say that an artist, or axes with all in them, is of one law: a page can hide it."""
    artist.set_gid(f"{LAW}{letter}")


def entitle(axes: Axes, letter: str, name: str, remark: str = "") -> None:
    """Write a title: the letter bold, the name after it, and a remark below them."""
    axes.set_label(f"{letter}, {name}" if name else letter)
    above = TICK + 6.0 if remark else 0.0
    if remark:
        axes.set_title(remark, loc="left", fontsize=TICK, color=SOFT, pad=5.0)
    look: dict[str, Any] = {
        "textcoords": "offset points", "fontsize": TITLE, "color": INK, "parse_math": False,
        "annotation_clip": False, "va": "bottom",
    }  # fmt: skip
    corner: dict[str, Any] = {"xycoords": "axes fraction", "fontweight": "bold"}
    bold = axes.annotate(letter, (0.0, 1.0), (0.0, above + 3.0), **corner, **look)
    axes.annotate(name, (1.0, 0.0), (5.0, 0.0), xycoords=bold, **look)


def label(axes: Axes, x: str = "", y: str = "") -> None:
    """Name the axes, unit included."""
    axes.set_xlabel(x, fontsize=LABEL, color=SOFT)
    axes.set_ylabel(y, fontsize=LABEL, color=SOFT)


def dress_bar(bar: Any, text: str) -> None:
    """Give a colour bar the common look."""
    bar.ax.tick_params(labelsize=TICK, colors=SOFT, length=3, width=0.6)
    bar.outline.set_edgecolor(FAINT)
    bar.solids.set_rasterized(True)  # its colours are data, whatever the theme
    bar.set_label(text, fontsize=LABEL, color=SOFT)
