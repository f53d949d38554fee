"""A simulated run in a terminal."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.report.words.run_words import answer, closing_words, facts, ledger_rows
from asperity.scene.setup import Setup
from asperity.simulation import Run


def print_run(setup: Setup, run: Run, console: Console) -> None:
    """Print answer, ledger and assumptions."""
    console.print(answer(setup, run), style="bold", markup=False)
    console.print()
    table = Table(box=None, pad_edge=False)
    table.add_column("energy", overflow="fold")
    for axis in ("x", "y", "z", "sum"):
        table.add_column(axis, justify="right", no_wrap=True)
    for name, cells in ledger_rows(run):
        table.add_row(Text(name), *[Text(cell) for cell in cells])
    console.print(table)
    console.print(closing_words(run), style="dim", markup=False)
    console.print()
    for name, value in facts(setup, run):
        console.print(f"{name}: {value}", style="dim", markup=False)
    print_assumptions(setup.assumptions, console)


def print_assumptions(assumptions: tuple[str, ...], console: Console) -> None:
    """Print what was assumed, if anything was."""
    if assumptions:
        console.print("\nAssumed:", style="bold")
        for sentence in assumptions:
            console.print(f"- {sentence}", markup=False)
