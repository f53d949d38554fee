"""The comparison in a terminal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.report.words.number_words import (
    any_sampled,
    bound_text,
    force_text,
    law_title,
    leak_text,
    merit_text,
    stiffness_text,
    strength_has_unit,
    yes_no,
)
from asperity.units import engineering

_NAMES_FROM = 112
"""Console width [characters] from which the law's name has a column."""

_AIRY_FROM = 90
"""Console width [characters] from which columns stand two characters apart."""


@dataclass(frozen=True)
class _Column:
    """One column: its heading and its cell."""

    heading: str
    cell: Callable[[LawRow], str]
    right: bool = True


def _columns(comparison: Comparison) -> tuple[_Column, ...]:
    strength = "T [m]" if strength_has_unit(comparison) else "T"
    return (
        _Column("q", lambda row: bound_text(row.q)),
        _Column("q⁺", lambda row: bound_text(row.one_sided)),
        _Column("stiffness\nup to", stiffness_text),
        _Column("by\nrule", lambda row: row.rule, right=False),
        _Column("conser-\nvative", lambda row: yes_no(row.conservative), right=False),
        _Column("worst\nleak", lambda row: leak_text(row, comparison)),
        _Column("contin-\nuous", lambda row: yes_no(row.continuous), right=False),
        _Column(strength, lambda row: merit_text(row.strength)),
        _Column("S", lambda row: merit_text(row.support)),
        _Column("texture\nforce", lambda row: force_text(row.texture_force)),
    )


def comparison_table(comparison: Comparison, width: int = 120) -> Table:
    """Return one row per law, the first column the law's letter alone.

    Args:
        comparison: the result.
        width: of the console in characters; names of the laws are left out on a narrow one.

    Returns:
        A Rich table.
    """
    gap = 1 if width >= _AIRY_FROM else 0
    table = Table(box=box.SIMPLE_HEAD, padding=(0, gap, 0, 0), show_edge=False, pad_edge=False)
    table.add_column("law", no_wrap=True)
    named = width >= _NAMES_FROM
    if named:
        table.add_column("name", max_width=24)
    columns = _columns(comparison)
    for column in columns:
        justify: Literal["left", "right"] = "right" if column.right else "left"
        table.add_column(Text(column.heading), justify=justify, no_wrap=True)
    for row in comparison.rows:
        cells = [row.law.letter, *([law_title(row.law.name)] if named else [])]
        cells += [column.cell(row) for column in columns]
        style = "bold" if row.law.letter == comparison.recommended else ""
        table.add_row(*[Text(cell) for cell in cells], style=style)
    return table


def _pairs(style: str = "") -> Table:
    """Return an empty list of two columns: a short word, and what is said of it."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(no_wrap=True, style=style)
    table.add_column(style=style)
    return table


def caption(comparison: Comparison) -> Table:
    """Return what the columns mean, one line each."""
    stiffness = engineering(comparison.stiffness, "N/m")
    meanings = {
        "q, q⁺": "by how much the law multiplies stiffness at worst; smaller is better",
        "stiffness up to": f"what {comparison.device.name} renders by the rule, K₀ over q or q⁺",
        "worst leak": f"energy that one loop can give to the hand at {stiffness}",
        "T, S": "strength of the texture, support of the hand, for the same q",
        "texture force": "RMS at the law's own stiffness limit",
    }
    if any_sampled(comparison):
        meanings["~"] = "sampled, not proved: leak and q may be larger, the limit lower"
    table = _pairs("dim")
    for word, meaning in meanings.items():
        table.add_row(Text(word), Text(meaning))
    return table


def verdicts(comparison: Comparison) -> Table:
    """Return the verdict of every law, one line each where the width allows."""
    table = _pairs()
    for row in comparison.rows:
        style = "bold" if row.law.letter == comparison.recommended else ""
        table.add_row(Text(row.law.letter), Text(row.verdict), style=style)
    return table


def assumptions(comparison: Comparison) -> Table:
    """Return what was assumed, as a list."""
    table = _pairs()
    for sentence in comparison.assumptions:
        table.add_row(Text("-"), Text(sentence))
    return table


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Print the answer, the table, the verdicts and what was assumed.

    Args:
        comparison: the result.
        console: where to; its width decides about the columns.
    """
    console.print(Text(comparison.recommendation, style="bold"))
    console.print()
    console.print(comparison_table(comparison, console.width))
    console.print()
    console.print(caption(comparison))
    console.print()
    console.print(verdicts(comparison))
    console.print()
    console.print(Text("Assumed:", style="bold"))
    console.print(assumptions(comparison))
