"""Onsets of limit cycles beside what the criteria allow: picture, page, terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
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
from asperity.simulation.onset import CYCLE_SPEED
from asperity.simulation.prediction import Prediction
from asperity.units import engineering

HEADINGS = (
    "law", "d", "quiet to", "cycles", "starts", "depth", "q", "paper (1)", "delay rule", "K₀/q",
)  # fmt: skip
NUMBERS = tuple(range(1, 10))
NOTES = (
    "Stiffnesses in N/m, d the delay in samples. Quiet to, cycles: the bracket of the onset over "
    "all starts. Starts: how many of them end in a limit cycle where it begins. Depth: how deep "
    "the handle got there; q is that of this depth.",
    "Paper (1): σ₀/(2Tq). Delay rule: σ₀/(T(q⁺/2 + dq)), a proof for conservative laws and exact "
    "positions; in brackets for the other laws, where it proves nothing. K₀/q: the wall's own "
    "onset at that delay, over q; the paper's rule of thumb, not a proof.",
)


def cells(found: Prediction) -> list[str]:
    """Return the texts of a row."""
    onset = found.onset
    rule = newton(found.delay_rule)
    return [
        onset.law,
        str(onset.delay),
        newton(onset.quiet),
        "none" if math.isinf(onset.cycling) else newton(onset.cycling),
        f"{onset.cycles}/{onset.starts}",
        engineering(found.depth, "m", digits=2),
        "∞" if math.isinf(found.q) else newton(found.q),
        newton(found.paper),
        rule if found.conservative else f"({rule})",
        "–" if found.wall_rule is None else newton(found.wall_rule),
    ]


def newton(value: float) -> str:
    """Return a stiffness without its unit, three digits [N/m]."""
    if math.isinf(value):
        return "∞"
    return f"{value:.3g}" if value < 1000.0 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


def kinds(found: Prediction) -> dict[int, str]:
    """Return which cells are misses."""
    marked = {0: "l"}
    if found.missed:
        marked[8] = "no"
    if found.wall_rule_missed:
        marked[9] = "no"
    return marked


def answer(setup: Setup, found: Sequence[Prediction]) -> str:
    """Return what was found in two sentences."""
    missed = [one for one in found if one.missed]
    walls = [one for one in found if one.wall_rule_missed]
    proved = sum(one.conservative for one in found)
    step = setup.servo.position_resolution
    if missed:
        names = ", ".join(
            f"{one.onset.law} at d = {one.onset.delay} ({one.onset.cycling / one.delay_rule:.0%})"
            for one in missed
        )
        said = f"Limit cycles below the delay rule, at so much of it: {names}."
        if step:
            said += f" It is proved for exact positions, not for steps of {engineering(step, 'm')}."
    else:
        cases = "case" if proved == 1 else "cases"
        said = f"No limit cycle below the delay rule, in {proved} {cases} of conservative laws."
    if any(one.wall_rule is not None and one.onset.law != "W" for one in found):
        names = ", ".join(f"{one.onset.law} at d = {one.onset.delay}" for one in walls)
        said += f" K₀/q was too much for: {names}." if walls else " K₀/q was safe in all of them."
    return said


def onset_figure(found: Sequence[Prediction]) -> Figure:
    """Return onset stiffness against delay, one panel per law, with the predictions."""
    laws = list(dict.fromkeys(one.onset.law for one in found))
    columns = min(3, len(laws))
    rows = math.ceil(len(laws) / columns)
    figure = style.new_figure(10.0, 2.3 * rows + 0.5)
    grid: Any = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    panels = list(grid.ravel())
    for axes, law in zip(panels, laws, strict=False):
        mine = [one for one in found if one.onset.law == law]
        delays = np.array([one.onset.delay for one in mine])
        style.dress(axes)
        axes.set_yscale("log")
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        values = [one.onset.value for one in mine]
        axes.plot(delays, _finite(values), "o-", color=style.BLUE, ms=4.0, lw=1.2, label="onset")
        rules: list[tuple[str, list[float], str, str]] = [
            ("delay rule", [one.delay_rule for one in mine], style.GREEN,
             "-" if mine[0].conservative else ":"),
            ("paper (1)", [one.paper for one in mine], style.SOFT, "--"),
            ("K₀/q", [one.wall_rule or math.nan for one in mine], style.ORANGE, "-."),
        ]  # fmt: skip
        for name, limits, colour, dashes in rules:
            axes.plot(delays, _finite(limits), ls=dashes, color=colour, lw=1.1, label=name)
        remark = "conservative" if mine[0].conservative else "not conservative: no proof"
        style.entitle(axes, law, remark)
    panels[0].legend(fontsize=style.TICK, frameon=False, labelcolor=style.SOFT)
    for number, axes in enumerate(panels):
        axes.set_visible(number < len(laws))
        last_row = number + columns >= len(laws)
        style.label(
            axes, "delay [samples]" if last_row else "",
            "stiffness [N/m]" if number % columns == 0 else "",
        )  # fmt: skip
        axes.tick_params(labelbottom=last_row)
    return figure


def _finite(values: Sequence[float]) -> list[float]:
    """Return the values, those that a logarithmic axis has no place for as gaps."""
    return [value if math.isfinite(value) and value > 0.0 else math.nan for value in values]


def onset_html(setup: Setup, found: Sequence[Prediction]) -> str:
    """Return the report of the onsets."""
    source = style.data_uri(onset_figure(found))
    caption = (
        "Stiffness at which the first of the starts ends in a limit cycle, and what the criteria "
        "allow. A solid green line is a proof: no blue point may lie below it."
    )
    rows = [Row(cells(one), kinds(one)) for one in found]
    limit = engineering(CYCLE_SPEED, "m/s")
    words = f"A limit cycle: the velocity varies by more than {limit} RMS in the last quarter."
    parts: list[Picture | Grid] = [
        Picture("Onset against delay", caption, source),
        Grid("In numbers, N/m", words, HEADINGS, rows, NUMBERS, NOTES),
    ]
    title = f"Where it begins to buzz, {setup.device.name}"
    facts = facts_of_loop(setup)
    return page_html(Page(title, answer(setup, found), facts, parts, setup.assumptions, FOOTER))


def print_onsets(setup: Setup, found: Sequence[Prediction], console: Console) -> None:
    """Print answer, table and assumptions."""
    console.print(answer(setup, found), style="bold", markup=False)
    console.print()
    table = Table(box=None, pad_edge=False)
    for number, name in enumerate(HEADINGS):
        # A number that is too wide goes on in the next line: no digit is ever cut.
        side: Literal["left", "right"] = "right" if number in NUMBERS else "left"
        table.add_column(name, justify=side, overflow="fold")
    for one in found:
        marked = kinds(one)
        texts = [
            Text(text, style="red" if marked.get(number) == "no" else "")
            for number, text in enumerate(cells(one))
        ]
        table.add_row(*texts)
    console.print(table)
    console.print(" ".join(NOTES), style="dim", markup=False)
    print_assumptions(setup.assumptions, console)
