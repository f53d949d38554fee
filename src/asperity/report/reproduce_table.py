"""The paper's claims and their verdicts in a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.paper import VERDICTS, Result, Verdict
from asperity.paper.claim import Number
from asperity.paper.experiments import Experiments

COLOURS: dict[Verdict, str] = {
    "holds": "green",
    "holds with correction": "yellow",
    "does not hold": "red",
    "undecided": "dim",
}


def counts_text(results: Sequence[Result]) -> str:
    """Return how many claims got each verdict, "55 hold, ..."."""
    counts = {verdict: sum(r.verdict == verdict for r in results) for verdict in VERDICTS}
    words = ("hold", "hold with a correction", "do not hold", "are undecided")
    parts = [f"{count} {word}" for count, word in zip(counts.values(), words, strict=True)]
    return f"Of {len(results)} claims {', '.join(parts)}."


def print_results(
    results: Sequence[Result], experiments: Experiments | None, console: Console
) -> None:
    """Print one row per claim, the counts, and one line per experiment."""
    table = Table(box=None, pad_edge=False)
    table.add_column("claim", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("states", overflow="fold")
    section = ""
    for result in results:
        if result.section != section:
            section = result.section
            table.add_row(Text(f"§ {section}", style="bold"), "", "")
        numbers = ", ".join(result.equations)
        statement = f"{numbers}: {result.statement}" if numbers else result.statement
        verdict = Text(result.verdict, style=COLOURS[result.verdict])
        table.add_row(Text(result.id), verdict, Text(statement))
    console.print(table)
    console.print()
    console.print(counts_text(results), style="bold", markup=False)
    if experiments is not None:
        console.print()
        for name, words in experiments.lines:
            console.print(f"{name}: {words}", markup=False)
    console.print()
    console.print("The evidence of one: asperity reproduce --claim ID", style="dim")


def print_evidence(result: Result, console: Console) -> None:
    """Print a claim with everything that its verdict rests on."""
    console.print(
        f"{result.id} ({', '.join((*result.equations, f'section {result.section}'))})",
        style="bold",
        markup=False,
    )
    console.print(result.statement, markup=False)
    console.print(Text(result.verdict, style=COLOURS[result.verdict]))
    console.print(result.evidence.summary, markup=False)
    if result.evidence.correction:
        console.print(f"Correction: {result.evidence.correction}", markup=False)
    for name, value in result.evidence.numbers.items():
        console.print(f"  {name}: {number_text(value)}", style="dim", markup=False)
    console.print()


def number_text(value: Number) -> str:
    """Return a number of the evidence as text."""
    if isinstance(value, list):
        return ", ".join(f"{item:.10g}" for item in value)
    return value if isinstance(value, str) else f"{value:.10g}"
