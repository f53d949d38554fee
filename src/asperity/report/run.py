"""A simulated run: in a terminal, and as a page."""

from __future__ import annotations

from rich.console import Console

from asperity.report import page, terminal
from asperity.report.page import PAPER, Page, Row, Section, added_sections, assumed, pictured
from asperity.report.terminal import Column, say
from asperity.report.words.run_words import answer, closing_words, facts, ledger_rows
from asperity.scene.setup import Setup
from asperity.simulation import Run

FOOTER = f"{PAPER}, section V"
_ENERGIES = ("energy", "x", "y", "z", "sum")


def print_run(setup: Setup, run: Run, console: Console) -> None:
    """Print answer, ledger and assumptions."""
    say(console, answer(setup, run), "bold")
    console.print()
    columns = [Column(name, right=i > 0, wraps=i == 0) for i, name in enumerate(_ENERGIES)]
    rows = [([name, *cells], "") for name, cells in ledger_rows(run)]
    console.print(terminal.table(columns, rows, gap=2, ruled=False))
    say(console, closing_words(run), "dim")
    console.print()
    for name, value in facts(setup, run):
        say(console, f"{name}: {value}", "dim")
    terminal.print_assumptions(console, setup.assumptions)


def run_page(setup: Setup, run: Run) -> Page:
    """Return the report of a run, its trace in memory."""
    rows = [Row([name, *cells]) for name, cells in ledger_rows(run)]
    table = page.Table(_ENERGIES, rows, numbers=(1, 2, 3, 4))
    return Page(
        title=f"Law {setup.surface.law.letter} in the loop, {setup.device.name}",
        answer=answer(setup, run),
        facts=facts(setup, run),
        sections=[
            *_pictures(setup, run),
            Section("Where the energy went", [table], caption=closing_words(run)),
            *added_sections(Run, setup, run),
            *assumed(setup.assumptions),
        ],
        footer=FOOTER,
    )


def _pictures(setup: Setup, run: Run) -> list[Section]:
    if len(run.time) < 2:
        return []
    from asperity.report.pictures.run_picture import run_figure

    caption = (
        "Brown: the body, as high as it is below the handle. The exact energy is the work of the "
        "held force on the true motion; the paper's sum multiplies command and step of the same "
        "sample, which turns the sign of what sampling adds."
    )
    return [pictured("Motion, force, energy, phase", run_figure(setup, run), caption)]
