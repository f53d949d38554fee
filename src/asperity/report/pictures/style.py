"""Common style of the figures: colours, font sizes, units, axes; figures as PNG and SVG."""

from __future__ import annotations

import hashlib
import io
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter

from asperity.laws import Law
from asperity.report.sentences.texts import readable_name

BACKGROUND = "#ffffff"
"""Background of every picture."""
FREE_SPACE = "#eceef1"
"""Background of a field where the probe is not in contact."""
INK = "#1d2733"
MUTED = "#5b6673"
FAINT = "#c9ced6"
BODY = "#d9cdb8"
# Okabe and Ito's palette, which colour-blind readers can distinguish.
BLUE = "#0072b2"
ORANGE = "#d55e00"
GREEN = "#009e73"
_THEMED = (BACKGROUND, FREE_SPACE, INK, "#000000", MUTED, FAINT, BODY, BLUE, ORANGE, GREEN)
_VARIABLES = ("card", "free", "ink", "ink", "soft", "faint", "body", "blue", "orange", "green")
THEME_VARIABLES = dict(zip(_THEMED, _VARIABLES, strict=True))
"""CSS variables of the colours that follow the theme of a page.

Their dark values are in ``templates/style.css``; light, in print and as a file a figure has the
colours above.
"""
TITLE = 10.0
LABEL = 9.0
TICK = 8.0
# Distance between the labels of axes beside each other [inch].
_AXES_GAP = 0.2
HEIGHTS = "cividis"
WIDE_COLORBAR: dict[str, Any]
WIDE_COLORBAR = {"location": "bottom", "shrink": 0.5, "aspect": 40, "extend": "both"}
"""Options of a colour bar below all panels."""
INCH_ARROWS: dict[str, Any] = {"angles": "uv", "units": "inches", "scale_units": "inches"}

# Opacity shows the size, so that the pixels fit a light and a dark page; the ink of both has a
# contrast of at least 3 to 1 on the full colours.
_CURL_STOPS = ((0.0, "#8d63c8"), (0.5, "#8d63c800"), (0.5, "#c2690e00"), (1.0, "#c2690e"))
CURL = LinearSegmentedColormap.from_list("asperity_curl", _CURL_STOPS)
"""Colours of the curl over the background; without colour it is zero."""


SizedDrawing = tuple[tuple[float, float], Callable[[Any], object]]
"""Width and height [inch], and a function that draws into a figure or a part of one."""


@dataclass(frozen=True)
class AxisUnit:
    """A unit for an axis.

    Attributes:
        name: such as "mm".
        scale: the number that an SI value is multiplied by.
    """

    name: str
    scale: float


def length_unit(extent: float) -> AxisUnit:
    """Return the best unit of an axis for lengths up to the extent [m].

    Example:
        >>> length_unit(1e-3).name, length_unit(2e-6).name, length_unit(0.5).name
        ('mm', 'µm', 'mm')
    """
    if extent < 2e-7:
        return AxisUnit("nm", 1e9)
    if extent < 1e-4:
        return AxisUnit("µm", 1e6)
    return AxisUnit("mm", 1e3)


def force_unit(extent: float) -> AxisUnit:
    """Return the best unit of an axis for forces up to the extent [N]."""
    if extent < 0.1:
        return AxisUnit("mN", 1e3)
    return AxisUnit("N", 1.0)


def nice_length(target: float) -> float:
    """Return 1, 2 or 5 times a power of ten, at most the target.

    Example:
        >>> nice_length(0.37), nice_length(6.0)
        (0.2, 5.0)
    """
    power: float = 10.0 ** math.floor(math.log10(target))
    step = max([m for m in (1.0, 2.0, 5.0) if m * power <= target * (1.0 + 1e-9)])
    return round(step * power, 12)


class NotebookFigure(Figure):
    """A figure that a notebook displays, with ``%matplotlib inline`` or without."""

    def _repr_png_(self) -> bytes:
        """Return the figure as PNG, as wide as a notebook cell."""
        return to_png(self)


def to_bytes(figure: Figure, **options: Any) -> bytes:
    """Return a figure as the content of a file; options are those of Matplotlib."""
    buffer = io.BytesIO()
    figure.savefig(buffer, **options)
    return buffer.getvalue()


def to_png(figure: Figure) -> bytes:
    """Return a figure as PNG: 720 pixels for its 10 inches."""
    return to_bytes(figure, format="png", dpi=72)


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size [inch], without pyplot or global state."""
    layout = ConstrainedLayoutEngine(w_pad=_AXES_GAP / 2.0)
    figure = NotebookFigure(figsize=(width, height), facecolor=BACKGROUND, layout=layout)
    FigureCanvasAgg(figure)
    return figure


def style_axes(axes: Axes) -> None:
    """Apply the common style to axes."""
    axes.tick_params(which="both", labelsize=TICK, colors=MUTED, length=3, width=0.6)
    for side, spine in axes.spines.items():
        spine.set_visible(side in {"left", "bottom"})
        spine.set_color(FAINT)
        spine.set_linewidth(0.8)


def single_axes(figure: Figure | SubFigure) -> Axes:
    """Return the only axes of a figure, styled."""
    axes: Axes = figure.subplots()
    style_axes(axes)
    return axes


def new_axes(width: float, height: float) -> tuple[Figure, Axes]:
    """Return a new figure of a size [inch] with its only axes."""
    figure = new_figure(width, height)
    return figure, single_axes(figure)


def law_panels(
    count: int, height: float, margin: float, *, x: str, y: str, sharey: bool = True
) -> tuple[Figure, list[Axes]]:
    """Return a new figure with axes for a number of laws, three in a row; see :func:`axes_grid`.

    Args:
        count: of laws.
        height: of a row [inch].
        margin: height of the figure besides its rows [inch].
        x: label of the horizontal axes.
        y: label of the vertical axes.
        sharey: whether all share one vertical scale.
    """
    figure = new_figure(10.0, height * math.ceil(count / 3) + margin)
    return figure, axes_grid(figure, count, 3, x=x, y=y, sharey=sharey)


def draw_zero_line(axes: Axes, min_extent: float = 0.0) -> None:
    """Draw a line at zero, and show at least the least extent above and below it."""
    axes.axhline(0.0, color=FAINT, lw=0.8, zorder=0.0)
    if min_extent:
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -min_extent), max(high, min_extent))


def axes_grid(
    figure: Figure | SubFigure,
    count: int,
    columns: int,
    *,
    x: str = "",
    y: str = "",
    sharey: bool = True,
) -> list[Axes]:
    """Return a grid of styled axes, of which only the outer ones have labels.

    Args:
        figure: receives the axes.
        count: of axes.
        columns: greatest number of axes in a row.
        x: label of the lowest axes.
        y: label of the first axes of each row.
        sharey: whether all share one vertical scale.
    """
    columns = min(columns, count)
    rows = -(-count // columns)
    grid: Any = figure.subplots(rows, columns, sharex=True, sharey=sharey, squeeze=False)
    for index, axes in enumerate(grid.ravel()):
        axes.set_visible(index < count)
        style_axes(axes)
        label_outer_axes(axes, x, y, lowest=index + columns >= count, first=index % columns == 0)
    return list(grid.ravel()[:count])


def add_legend(owner: Axes | Figure | SubFigure, *entries: Any, **options: Any) -> None:
    """Add a legend without a frame; entries and options are those of Matplotlib."""
    owner.legend(*entries, **{"fontsize": TICK, "frameon": False, "labelcolor": MUTED, **options})


def add_note(axes: Axes, text: str, position: tuple[float, float], **options: Any) -> None:
    """Add small text on a plate, above the lines."""
    plate = {"facecolor": BACKGROUND, "edgecolor": "none", "pad": 1.0, "alpha": 0.85}
    place = {"xycoords": "axes fraction", "xytext": (0, 0), "textcoords": "offset points"}
    text_style = {"fontsize": TICK, "color": MUTED, "bbox": plate}
    axes.annotate(text, position, **{**place, **text_style, **options})


LAW_PREFIX = "law-"
"""Prefix of the ``gid`` of an artist that belongs to a law; the letter follows."""


def mark_law(artist: Artist, letter: str) -> None:
    """Mark an artist, or axes with all their artists, as of one law, with which a page hides it."""
    artist.set_gid(f"{LAW_PREFIX}{letter}")


def set_panel_title(axes: Axes, letter: str, name: str, remark: str = "") -> None:
    """Add a title: the letter in bold, the name, and a remark below them."""
    axes.set_label(f"{letter}, {name}" if name else letter)
    above = 0.0
    if remark:
        above = TICK + 6.0
        axes.set_title(remark, loc="left", fontsize=TICK, color=MUTED, pad=5.0)
    text_style: dict[str, Any] = {"fontsize": TITLE, "color": INK, "va": "bottom"}
    text_style |= {"textcoords": "offset points", "parse_math": False, "annotation_clip": False}
    corner: dict[str, Any] = {"xycoords": "axes fraction", "fontweight": "bold"}
    bold = axes.annotate(letter, (0.0, 1.0), (0.0, above + 3.0), **corner, **text_style)
    axes.annotate(name, (1.0, 0.0), (5.0, 0.0), xycoords=bold, **text_style)


def title_law(axes: Axes, law: Law, remark: str = "") -> None:
    """Add the title of a law with a remark, and mark the axes as of that law."""
    set_panel_title(axes, law.letter, readable_name(law.name), remark)
    mark_law(axes, law.letter)


def fill_below(axes: Axes, x: Any, heights: Any, bottom: float) -> None:
    """Fill the body between heights and a bottom."""
    axes.fill_between(x, heights, bottom, color=BODY, linewidth=0.0, alpha=0.7)


def label_axes(axes: Axes, x: str = "", y: str = "") -> None:
    """Label the axes, with units."""
    axes.set_xlabel(x, fontsize=LABEL, color=MUTED)
    axes.set_ylabel(y, fontsize=LABEL, color=MUTED)


def label_log_axes(*axes: Axis) -> None:
    """Write plain numbers on logarithmic axes with limits, more of them on short ones."""
    for axis in axes:
        low, high = axis.get_view_interval()
        digits: tuple[int, ...] = ()
        if high < 100.0 * low:
            digits = (2, 5)
        if high < 8.0 * low:
            digits = tuple(range(2, 10))
        axis.set_major_formatter(FuncFormatter(lambda value, _place: f"{value:g}"))
        axis.set_minor_formatter(FuncFormatter(partial(_minor_text, digits=digits)))


def _minor_text(value: float, _place: int | None, digits: tuple[int, ...]) -> str:
    """Return a value as text if its first digit is one of some."""
    return f"{value:g}" if round(value / 10.0 ** math.floor(math.log10(value))) in digits else ""


def label_outer_axes(axes: Axes, x: str, y: str, *, lowest: bool, first: bool = True) -> None:
    """Label axes of a grid: below the lowest of a column, and beside the first of a row."""
    axes.tick_params(labelbottom=lowest)
    if lowest:
        axes.set_xlabel(x, fontsize=LABEL, color=MUTED)
    if first:
        axes.set_ylabel(y, fontsize=LABEL, color=MUTED)


def add_colorbar(
    figure: Figure | SubFigure, artist: Any, axes: Axes | list[Axes], label: str, **options: Any
) -> Any:
    """Return a new colour bar on the right of axes; options are those of Matplotlib."""
    bar: Any = figure.colorbar(artist, ax=axes, **{"pad": 0.02, "aspect": 18, **options})
    bar.ax.tick_params(labelsize=TICK, colors=MUTED, length=3, width=0.6)
    bar.outline.set_edgecolor(FAINT)
    bar.solids.set_rasterized(True)  # its colours are data and do not follow the theme
    bar.set_label(label, fontsize=LABEL, color=MUTED)
    return bar


# --- SVG of a page --------------------------------------------------------------------------------

# Parts of the panel of a law that stay visible when the law is hidden, as neighbours share them.
_SHARED_ID_PATTERN = r"(?:matplotlib\.axis|legend)_\d+"


def svg_text(figure: Figure, dpi: int = 160) -> str:
    """Return the figure as SVG for a page, the same text for the same figure.

    Colours of the palette are CSS variables with the light colour as fallback. Identifiers begin
    with a digest of the figure, so that a page can contain several figures.

    Args:
        figure: the figure.
        dpi: resolution of rasterized parts.
    """
    options: dict[str, Any] = {"facecolor": BACKGROUND, "metadata": {"Date": None, "Creator": None}}
    text = to_bytes(figure, format="svg", dpi=dpi, **options).decode("utf-8")
    # A page needs no prologue, metadata, comments or indentation.
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"\n *", "\n", re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)).strip()
    # Its style would apply to the whole page; black, Matplotlib's default, becomes ink.
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", text, flags=re.DOTALL)
    whole = f"fill: {INK}; stroke-linejoin: round; stroke-linecap: butt"
    # The page sets the size; namespaces are needed in a separate file only.
    root = re.sub(r' (?:width|height|version|xmlns[:\w]*)="[^"]*"', "", text[: text.index(">")])
    text = root.replace("<svg", f'<svg style="{whole}"') + text[text.index(">") :]
    text = re.sub(r'style="[^"]*"', lambda found: _theme_style(found[0]), text)
    # Three decimals in paths: a thousandth of a point is invisible.
    text = re.sub(r' d="[^"]*"', lambda found: re.sub(r"(\.\d{3})\d+", r"\1", found[0]), text)
    return _renumber_ids(text)


def _theme_style(styles: str) -> str:
    """Return styles with CSS variables for the colours of the palette."""

    def variable(found: re.Match[str]) -> str:
        what, colour = found.groups()
        if colour not in THEME_VARIABLES:
            return found[0]
        name = f"p-{THEME_VARIABLES[colour]}"
        return f"{what}: var(--{name}, {colour})"

    return re.sub(r"(fill|stroke): (#[0-9a-f]{6})", variable, styles)


def _renumber_ids(text: str) -> str:
    """Return the text with numbered identifiers, those without references removed.

    Matplotlib makes some of them random, and others equal in every figure.
    """
    text = re.sub(rf'\bid="{LAW_PREFIX}(\w+)"', r'data-law="\1"', text)
    text = re.sub(rf'\bid="{_SHARED_ID_PATTERN}"', 'class="shared"', text)
    used = re.findall(r'(?:url\(|href=")#([^")]+)', text)
    numbers = {name: f"{number:x}" for number, name in enumerate(dict.fromkeys(used))}

    def plain(found: re.Match[str]) -> str:
        before, name, after = found.groups()
        if name not in numbers:
            return ""
        return f"{before}@{numbers[name]}{after}"

    text = re.sub(r'((?:url\(|href=")#)([^")]+)([")])', plain, text)
    text = re.sub(r'( id=")([^"]+)(")', plain, text)
    digest = hashlib.sha256(text.encode()).hexdigest()[:6]
    return re.sub(r'((?:url\(|href=")#| id=")@', rf"\g<1>p{digest}-", text)
