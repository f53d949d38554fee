"""Onsets of limit cycles: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from asperity.report import page, terminal
from asperity.report.page import Cell, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.run import FOOTER
from asperity.report.terminal import Column, say
from asperity.report.words.onset_words import HEADINGS, NOTES, answer, cells
from asperity.report.words.run_words import facts_of_loop
from asperity.scene.setup import Setup
from asperity.simulation.onset import CYCLE_SPEED
from asperity.simulation.prediction import Prediction
from asperity.units import engineering

_RULE, _WALL = HEADINGS.index("delay rule"), HEADINGS.index("K₀/q")


def _misses(found: Prediction) -> set[int]:
    """Return the columns of rules that allowed what cycled."""
    return {
        column
        for column, missed in ((_RULE, found.missed), (_WALL, found.wall_rule_missed))
        if missed
    }


def print_onsets(setup: Setup, found: Sequence[Prediction], console: Console) -> None:
    """Print answer, table and assumptions."""
    say(console, answer(setup, found), "bold")
    console.print()
    # A number that is too wide goes on in the next line: no digit is ever cut.
    columns = [Column(name, right=i > 0, wraps=True) for i, name in enumerate(HEADINGS)]
    rows = []
    for one in found:
        missed = _misses(one)
        texts = [Text(text, "red" if i in missed else "") for i, text in enumerate(cells(one))]
        rows.append((texts, ""))
    console.print(terminal.table(columns, rows, gap=2, ruled=False))
    say(console, " ".join(NOTES), "dim")
    terminal.print_assumptions(console, setup.assumptions)


def onset_page(setup: Setup, found: Sequence[Prediction]) -> Page:
    """Return the report of the onsets."""
    from asperity.report.pictures.onset_picture import onset_figure

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
            pictured("Onset against delay", onset_figure(found), caption),
            onset_section("In numbers, N/m", found, words),
            *added_sections(Prediction, setup, found),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )


def onset_section(title: str, found: Sequence[Prediction], caption: str = "") -> Section:
    """Return onsets and predictions in numbers."""
    table = page.Table(HEADINGS, [Row(onset_cells(one)) for one in found], range(1, len(HEADINGS)))
    return Section(title, [table], caption, NOTES)


def onset_cells(found: Prediction) -> list[Cell]:
    """Return the cells of a row; rules that allowed what cycled are coloured."""
    missed = _misses(found)
    kinds = {0: "l", **dict.fromkeys(missed, "no")}
    return [Cell(text, kinds.get(i, "")) for i, text in enumerate(cells(found))]
