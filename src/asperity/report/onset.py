"""Onsets of limit cycles: in a terminal, and as a page."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Console

from asperity.report import page, terminal
from asperity.report.page import Cell, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.run import FOOTER, facts_of_loop
from asperity.report.terminal import say
from asperity.report.words.number_words import INFINITE, NONE
from asperity.scene.setup import Setup
from asperity.simulation.judging import CYCLE_SPEED
from asperity.simulation.prediction import Prediction
from asperity.units import engineering

HEADINGS = (
    "law", "d", "quiet to", "cycles", "starts", "depth", "q", "paper (1)", "delay rule", "K₀/q",
)  # fmt: skip
NOTES = (
    "Stiffnesses in N/m, d the delay in samples. Quiet to, cycles: the bracket of the onset over "
    "all starts. Starts: how many of them end in a limit cycle where it begins. Depth: how deep "
    "the handle got there; q is that of this depth.",
    "Paper (1): σ₀/(2Tq). Delay rule: σ₀/(T(q⁺/2 + dq)), a proof for conservative laws and exact "
    "positions; in brackets for the other laws, where it proves nothing. K₀/q: the wall's own "
    "onset at that delay, over q; the paper's rule of thumb, not a proof.",
)


def onset_cells(found: Prediction) -> list[Cell]:
    """Return the cells of a row; rules that allowed what cycled are coloured."""
    onset, rule = found.onset, newton(found.delay_rule)
    return [
        Cell(onset.law, "l"),
        Cell(str(onset.delay)),
        Cell(newton(onset.quiet)),
        Cell("none" if math.isinf(onset.cycling) else newton(onset.cycling)),
        Cell(f"{onset.cycles}/{onset.starts}"),
        Cell(engineering(found.depth, "m", digits=2)),
        Cell(newton(found.q)),
        Cell(newton(found.paper)),
        Cell(rule if found.conservative else f"({rule})", "no" if found.missed else ""),
        Cell(
            NONE if found.wall_rule is None else newton(found.wall_rule),
            "no" if found.wall_rule_missed else "",
        ),
    ]


def _table(found: Sequence[Prediction]) -> page.Table:
    return page.Table(
        HEADINGS,
        [Row(onset_cells(one), law=one.onset.law) for one in found],
        range(1, len(HEADINGS)),
    )


def newton(value: float) -> str:
    """Return a stiffness without its unit, three digits [N/m]."""
    if math.isinf(value):
        return INFINITE
    return f"{value:.3g}" if value < 1000.0 else f"{float(f'{value:.3g}'):,.0f}".replace(",", " ")


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
    if any(one.wall_rule is not None and not one.onset.wall for one in found):
        names = ", ".join(f"{one.onset.law} at d = {one.onset.delay}" for one in walls)
        said += f" K₀/q was too much for: {names}." if walls else " K₀/q was safe in all of them."
    return said


def print_onsets(setup: Setup, found: Sequence[Prediction], console: Console) -> None:
    """Print answer, table and assumptions."""
    say(console, answer(setup, found), "bold")
    console.print()
    # A number that is too wide goes on in the next line: no digit is ever cut.
    wraps = range(len(HEADINGS))
    looks = {"no": "red"}
    console.print(terminal.table(_table(found), wraps=wraps, styles=looks, gap=2, ruled=False))
    say(console, " ".join(NOTES), "dim")
    terminal.print_assumptions(console, setup.assumptions)


def onset_page(setup: Setup, found: Sequence[Prediction]) -> Page:
    """Return the report of the onsets."""
    from asperity.report.pictures.sweep_pictures import onset_figure

    caption = (
        "Stiffness at which the first of the starts ends in a limit cycle, and what the criteria "
        "allow. A solid green line is a proof: no blue point may lie below it."
    )
    limit = engineering(CYCLE_SPEED, "m/s")
    words = f"A limit cycle: the velocity varies by more than {limit} RMS in the last quarter."
    return Page(
        title=f"Where it begins to buzz, {setup.device.name}",
        answer=answer(setup, found),
        facts=facts_of_loop(setup),
        sections=[
            pictured("Onset against delay", onset_figure(found), onset_seen(found), caption),
            onset_section("In numbers, N/m", found, words),
            *added_sections(Prediction, setup, found),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )


def onset_seen(found: Sequence[Prediction]) -> str:
    """Return what is seen in the picture of the onsets, without its numbers."""
    laws = ", ".join(dict.fromkeys(one.onset.law for one in found))
    return f"Stiffness at which limit cycles begin, and what rules allow, over delay: {laws}."


def onset_section(title: str, found: Sequence[Prediction], caption: str = "") -> Section:
    """Return onsets and predictions in numbers."""
    return Section(title, [_table(found)], caption, NOTES)
