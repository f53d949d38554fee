"""The analysis in a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.analysis.analyze import Analysis
from asperity.report.words.analysis_words import (
    down_text,
    holds_text,
    jump_rows,
    leak_facts,
    limit_text,
    margin_text,
    merit_facts,
    notes,
    numbers,
    open_criteria,
    reproduction,
    up_text,
    witness_text,
)
from asperity.report.words.number_words import law_title


def numbers_table(analysis: Analysis) -> Table:
    """Return one row per number: lower, upper, method and the point that attains lower."""
    table = _plain_table()
    table.add_column("number", no_wrap=True)
    for heading in ("lower", "upper"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("method", no_wrap=True)
    table.add_column("attained at", overflow="fold")
    for name, bound in numbers(analysis):
        cells = [name, down_text(bound.lower), up_text(bound.upper), bound.method,
                 witness_text(bound)]  # fmt: skip
        table.add_row(*[Text(cell) for cell in cells])
    return table


def criteria_table(analysis: Analysis) -> Table:
    """Return one row per criterion of passivity; the one that decides carries an arrow."""
    table = _plain_table()
    table.add_column("", no_wrap=True)
    table.add_column("criterion", max_width=18)
    table.add_column("condition", no_wrap=True)
    table.add_column("holds", no_wrap=True)
    table.add_column("limit", justify="right", no_wrap=True)
    table.add_column("margin", justify="right", no_wrap=True)
    for criterion in analysis.passivity.criteria:
        decides = criterion.name == analysis.passivity.decided_by
        cells = ["→" if decides else "", criterion.name, criterion.formula, holds_text(criterion),
                 limit_text(criterion), margin_text(criterion)]  # fmt: skip
        style = "bold" if decides else "dim" if criterion.holds is None else ""
        table.add_row(*[Text(cell) for cell in cells], style=style)
    return table


def jumps_table(analysis: Analysis) -> Table:
    """Return one row per depth at which a jump was located."""
    table = _plain_table()
    table.add_column("at depth", justify="right", no_wrap=True)
    table.add_column("jumps by", justify="right", no_wrap=True)
    table.add_column("near (both witnesses are in the JSON)", overflow="fold")
    for row in jump_rows(analysis):
        table.add_row(*[Text(cell) for cell in row])
    return table


def print_analysis(analysis: Analysis, console: Console, texture: str = "") -> None:
    """Print the verdict, the numbers, the criteria, the worst loop, the jumps, and three lines.

    Args:
        analysis: the result.
        console: where to.
        texture: an expression of Python that makes the texture; see
            :func:`asperity.report.words.analysis_words.reproduction`.
    """
    law = analysis.surface.law
    console.print(Text(analysis.answer, style="bold"))
    _head(console, f"Law {law.letter}, {law_title(law.name)}: suprema over the working region")
    console.print(numbers_table(analysis))
    for line in notes(analysis):
        console.print(Text(line, style="dim"))
    _head(console, f"Passive on the {analysis.device.name}? {analysis.passivity.verdict}")
    console.print(criteria_table(analysis))
    console.print(_pairs(open_criteria(analysis), "dim"))
    _head(console, "Worst loop")
    console.print(_pairs(leak_facts(analysis)))
    _head(console, "Continuity")
    console.print(Text(analysis.continuity.reason))
    if analysis.continuity.jumps:
        console.print(jumps_table(analysis))
    _head(console, "On a straight scan")
    console.print(_pairs(merit_facts(analysis)))
    _head(console, "Reproduce q")
    for line in reproduction(analysis, texture):
        console.print(Text(line), soft_wrap=True)
    _head(console, "Assumed")
    console.print(_pairs(("-", sentence) for sentence in analysis.assumptions))


def _head(console: Console, words: str) -> None:
    console.print()
    console.print(Text(words, style="bold"))


def _plain_table() -> Table:
    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, pad_edge=False)


def _pairs(rows: Iterable[tuple[str, str]], style: str = "") -> Table:
    """Return a list of two columns: a short word, and what is said of it."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(style=style, max_width=26)
    table.add_column(style=style, overflow="fold")
    for word, words in rows:
        table.add_row(Text(word), Text(words))
    return table
