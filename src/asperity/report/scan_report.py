"""Energy per stroke against speed and depth: picture, page, terminal."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.report.page import Grid, Page, Picture, Row, page_html
from asperity.report.pictures import style
from asperity.report.run_html import FOOTER
from asperity.report.run_table import print_assumptions
from asperity.report.words.run_words import facts_of_loop
from asperity.scene.setup import Setup
from asperity.simulation.scan import Stroke
from asperity.units import engineering

HEADINGS = ("law", "speed", "depth", "x", "y", "z", "sum", "field", "±", "paper's", "lost")
NUMBERS = tuple(range(1, 11))
FIELD, Y = HEADINGS.index("field"), HEADINGS.index("y")
NOTES = (
    "Energies in mJ per stroke: work of the held force on the true motion, mean over whole "
    "turns, there and back, after the first stroke; positive feeds the hand. Field: what the law "
    "itself gives along the true path, without sampling, delay and steps of the encoder, which "
    "make up the rest; ±: from turn to turn, and of its quadrature. Paper's: its sum of force and "
    "step of the same sample. Depth: of the handle below z = 0, on average. Lost: how often per "
    "stroke contact ended.",
)
_DASHES = ("-", "--", ":", "-.")


def milli(value: float, *, sign: bool = True) -> str:
    """Return an energy [J] as text in mJ."""
    size = abs(value)
    digits = 0 if size >= 1.0 else 1 if size >= 0.1 else 2 if size >= 1e-4 else 4
    text = f"{1e3 * value:+.{digits}f}" if sign else f"{1e3 * value:.{digits}f}"
    return "0" if not text.strip("+-0.") else text


def cells(stroke: Stroke) -> list[str]:
    """Return the texts of a row."""
    place = [
        stroke.law, engineering(stroke.speed, "m/s"), engineering(stroke.reached, "m", digits=2),
    ]  # fmt: skip
    if stroke.stopped:
        return [*place, "", "", "", "stopped", "", "", "", ""]
    return [
        *place,
        *[milli(value) for value in stroke.energy],
        milli(stroke.total),
        milli(stroke.field),
        milli(stroke.spread + stroke.error, sign=False),
        milli(stroke.same_sample),
        f"{stroke.lost_contact:.3g}",
    ]


def answer(found: Sequence[Stroke]) -> str:
    """Return which laws feed the hand, and which do so by their field, in two sentences."""
    by_all = _grouped(found, lambda stroke: stroke.total > stroke.spread + stroke.error)
    by_field = _grouped(found, lambda stroke: stroke.feeds)
    return f"A stroke feeds the hand: {by_all}. The law's field itself feeds it: {by_field}."


def _grouped(found: Sequence[Stroke], feeds: Callable[[Stroke], bool]) -> str:
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    groups: dict[str, list[str]] = {"always": [], "at times": [], "never": []}
    for law in laws:
        gains = [feeds(stroke) for stroke in found if stroke.law == law]
        groups["always" if all(gains) else "at times" if any(gains) else "never"].append(law)
    return ", ".join(f"{', '.join(laws)} {when}" for when, laws in groups.items() if laws)


def scan_figure(found: Sequence[Stroke]) -> Figure:
    """Return energy per stroke against speed, one panel per law, one line per depth."""
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    depths = list(dict.fromkeys(stroke.depth for stroke in found))
    columns = min(3, len(laws))
    rows = math.ceil(len(laws) / columns)
    figure = style.new_figure(10.0, 2.3 * rows + 0.5)
    grid: Any = figure.subplots(rows, columns, sharex=True, squeeze=False)
    panels = list(grid.ravel())
    totals_found = [abs(one.total) for one in found if math.isfinite(one.total)]
    least = 1e3 * 0.01 * max(totals_found, default=1e-3)
    for number, axes in enumerate(panels):
        axes.set_visible(number < len(laws))
        if number >= len(laws):
            continue
        style.dress(axes)
        for depth, dashes in zip(depths, _DASHES * len(depths), strict=False):
            mine = [one for one in found if one.law == laws[number] and one.depth == depth]
            speeds = [one.speed for one in mine]
            name = engineering(depth, "m", digits=3)
            for i, colour in ((0, style.ORANGE), (2, style.BLUE)):
                values = [1e3 * one.energy[i] for one in mine]
                axes.plot(speeds, values, dashes, color=colour, lw=0.9)
            totals = [1e3 * one.total for one in mine]
            axes.plot(speeds, totals, dashes, color=style.INK, lw=1.5, marker="o", ms=3.0,
                      label=f"{name} deep")  # fmt: skip
        axes.axhline(0.0, color=style.FAINT, lw=0.8, zorder=0.0)
        low, high = axes.get_ylim()
        axes.set_ylim(min(low, -least), max(high, least))  # what is nothing looks like nothing
        axes.xaxis.set_major_locator(MaxNLocator(5))
        style.entitle(axes, laws[number], "")
        last_row = number + columns >= len(laws)
        style.label(
            axes,
            "speed [m/s]" if last_row else "",
            "mJ per stroke" if number % columns == 0 else "",
        )
    panels[0].legend(fontsize=style.TICK, frameon=False, labelcolor=style.SOFT)
    return figure


def scan_html(setup: Setup, found: Sequence[Stroke]) -> str:
    """Return the report of the strokes."""
    source = style.data_uri(scan_figure(found))
    caption = (
        "Energy that the texture supplies per stroke: black the sum, orange along x, blue along z. "
        "Above the line it feeds the hand."
    )
    rows = [
        Row(cells(stroke), {0: "l", FIELD: "no" if stroke.feeds else ""},
            details=[("stopped", stroke.stopped)] if stroke.stopped else (), summary="Why",
            details_in=6)
        for stroke in found
    ]  # fmt: skip
    parts: list[Picture | Grid] = [
        Picture("Energy per stroke", caption, source),
        Grid("In numbers", "", HEADINGS, rows, NUMBERS, NOTES),
    ]
    title = f"What a stroke gains, {setup.device.name}"
    return page_html(
        Page(title, answer(found), facts_of_loop(setup), parts, setup.assumptions, FOOTER)
    )


def print_scans(setup: Setup, found: Sequence[Stroke], console: Console) -> None:
    """Print answer, table and assumptions."""
    console.print(answer(found), style="bold", markup=False)
    console.print()
    shown = [number for number in range(len(HEADINGS)) if number != Y]
    table = Table(box=None, pad_edge=False)
    for number in shown:
        # A number that is too wide goes on in the next line: no digit is ever cut.
        side: Literal["left", "right"] = "right" if number else "left"
        table.add_column(HEADINGS[number], justify=side, overflow="fold")
    for stroke in found:
        texts = cells(stroke)
        feeding = "red" if stroke.feeds else ""
        table.add_row(*[Text(texts[i], style=feeding if i == FIELD else "") for i in shown])
    console.print(table)
    console.print(f"{' '.join(NOTES)} The y axis: --html, --json.", style="dim", markup=False)
    stops = {stroke.stopped for stroke in found if stroke.stopped}
    for reason in sorted(stops):
        console.print(f"Stopped: it {reason}", style="dim", markup=False)
    print_assumptions(setup.assumptions, console)
