"""Energy per stroke against speed and depth: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from asperity.report import page, terminal
from asperity.report.page import Cell, Cells, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.run import FOOTER
from asperity.report.terminal import Column, say
from asperity.report.words.run_words import facts_of_loop
from asperity.report.words.scan_words import HEADINGS, NOTES, answer, cells
from asperity.scene.setup import Setup
from asperity.simulation.scan import Stroke

_Y, _SUM, _FIELD = (HEADINGS.index(name) for name in ("y", "sum", "field"))


def print_scans(setup: Setup, found: Sequence[Stroke], console: Console) -> None:
    """Print answer, table and assumptions."""
    say(console, answer(found), "bold")
    console.print()
    shown = [i for i in range(len(HEADINGS)) if i != _Y]
    # A number that is too wide goes on in the next line: no digit is ever cut.
    columns = [Column(HEADINGS[i], right=i > 0, wraps=True) for i in shown]
    rows = []
    for stroke in found:
        texts = [Text(text) for text in cells(stroke)]
        texts[_FIELD].stylize("red" if stroke.feeds else "")
        rows.append(([texts[i] for i in shown], ""))
    console.print(terminal.table(columns, rows, gap=2, ruled=False))
    say(console, f"{' '.join(NOTES)} The y axis: --html, --json.", "dim")
    for reason in sorted({stroke.stopped for stroke in found if stroke.stopped}):
        say(console, f"Stopped: it {reason}", "dim")
    terminal.print_assumptions(console, setup.assumptions)


def scan_page(setup: Setup, found: Sequence[Stroke]) -> Page:
    """Return the report of the strokes."""
    from asperity.report.pictures.scan_picture import scan_figure

    caption = (
        "Energy that the texture supplies per stroke: black the sum, orange along x, blue along z. "
        "Above the line it feeds the hand."
    )
    rows = [Row(_cells(stroke)) for stroke in found]
    table = page.Table(HEADINGS, rows, range(1, len(HEADINGS)))
    return Page(
        title=f"What a stroke gains, {setup.device.name}",
        answer=answer(found),
        facts=facts_of_loop(setup),
        sections=[
            pictured("Energy per stroke", scan_figure(found), caption),
            Section("In numbers", [table], notes=NOTES),
            *added_sections(Stroke, setup, found),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )


def _cells(stroke: Stroke) -> Cells:
    texts: Cells = [*cells(stroke)]
    texts[0] = Cell(stroke.law, "l")
    if stroke.stopped:
        texts[_SUM] = Cell("stopped", summary="Why", details=[("stopped", stroke.stopped)])
    elif stroke.feeds:
        texts[_FIELD] = Cell(cells(stroke)[_FIELD], "no")
    return texts
