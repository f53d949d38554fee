"""Tables that compare laws, and their columns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from rich.table import Table as RichTable

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_stiffness
from asperity.report.document.page import (
    Cell,
    Media,
    Row,
    Section,
    Table,
    TableLayout,
    single_line,
    terminal_section,
)
from asperity.report.document.terminal import rich_table
from asperity.report.sentences.comparison_sentences import (
    recommended_stiffness_text,
    row_limit_text,
)
from asperity.report.sentences.limit_sentences import (
    force_magnitude_text,
    texture_amount_text,
    tier_text,
)
from asperity.report.sentences.passivity_sentences import stability_limit_text
from asperity.report.sentences.texts import (
    FRICTION_PROOF,
    NOT_AVAILABLE,
    balance_text,
    bound_text,
    column_meanings,
    is_sampled,
    leak_text,
    merit_text,
    readable_name,
    strength_has_unit,
    table_notes,
    yes_no_text,
)

# Console width [characters] from which columns are two characters apart.
_WIDE_GAP_CONSOLE = 90


@dataclass(frozen=True)
class LawColumn:
    """A column of the table of laws.

    Attributes:
        heading: in a terminal, broken into lines.
        cell: returns the cell of a law.
        is_numeric: whether it is aligned to the right.
        min_console: console width [characters] from which it is shown.
    """

    heading: str
    cell: Callable[[LawRow, Comparison], Cell]
    is_numeric: bool = False
    min_console: int = 0


_BASIS_TEXT = {"wall gain": "no limit", "none": "–"}


# --- cells ----------------------------------------------------------------------------------------


def has_sampled(comparison: Comparison) -> bool:
    """Return whether any number of the table is marked with ~."""
    rows = comparison.rows
    numbers = [number for row in rows for number in (row.q, row.one_sided)]
    leaks = [row.leak.method == "sampled" for row in rows]
    return any(map(is_sampled, numbers)) or any(leaks)


# --- tables ---------------------------------------------------------------------------------------


def _recommendation_cell(row: LawRow, _comparison: Comparison) -> Cell:
    return Cell(
        recommended_stiffness_text(row),
        note=stability_limit_text(row.stability_limit, row.passivity.loop),
    )


def _given_stiffness_cell(row: LawRow, _comparison: Comparison) -> Cell:
    limit = stability_limit_text(row.stability_limit)
    return Cell(format_stiffness(row.surface.stiffness), note=limit)


def _texture_force_cell(row: LawRow, _comparison: Comparison) -> Cell:
    """Return the RMS texture force that the device resolves."""
    if row.perceptibility is None:
        return Cell(NOT_AVAILABLE)
    text = force_magnitude_text(row.resolved_force)
    return Cell(text, note=texture_amount_text(row.perceptibility))


def _leak_cell(row: LawRow, _comparison: Comparison) -> Cell:
    return Cell(leak_text(row.leak), note=row.leak.description)


def _continuity_cell(row: LawRow, value: bool | None) -> Cell:
    return Cell(yes_no_text(value), note=row.continuous_reason)


def _conservation_cell(row: LawRow, _comparison: Comparison) -> Cell:
    reason = row.conservative_reason
    if row.energy_balance == "dissipative":
        reason = f"{reason}; {FRICTION_PROOF}"
    return Cell(balance_text(row.energy_balance), note=reason)


def _basis_cell(row: LawRow, _comparison: Comparison) -> Cell:
    limit = row.stability_limit
    return Cell(
        _BASIS_TEXT.get(limit.basis, limit.basis),
        note=stability_limit_text(limit, row.passivity.loop),
    )


def _oscillation_cell(row: LawRow, _comparison: Comparison) -> Cell:
    if row.perceptibility is None and not row.is_textureless:
        return Cell(NOT_AVAILABLE)
    return Cell(force_magnitude_text(row.texture_force))


def _bound_cell(bound: Bound) -> Cell:
    return Cell(bound_text(bound), note=f"{bound.method}: {bound.note}")


_LETTER_COLUMN = LawColumn("law", lambda row, _: Cell(row.law.letter, "l"))
NAME_COLUMN = LawColumn("name", lambda row, _: Cell(readable_name(row.law.name)), False, 112)
_START_COLUMN = LawColumn("start at", _recommendation_cell, True)
_GIVEN_COLUMN = LawColumn("at", _given_stiffness_cell, True)
SUMMARY_COLUMNS = (
    _LETTER_COLUMN,
    NAME_COLUMN,
    _START_COLUMN,
    LawColumn("texture", _texture_force_cell, True, 44),
    LawColumn("felt?", lambda row, _: Cell(tier_text(row.perceptibility))),
    LawColumn("leak", _leak_cell, True, 44),
    LawColumn("clicks?", lambda row, _: _continuity_cell(row, not row.continuous), False, 36),
)
FULL_COLUMNS = (
    _LETTER_COLUMN,
    NAME_COLUMN,
    LawColumn("q", lambda row, _: _bound_cell(row.q), True),
    LawColumn("q⁺", lambda row, _: _bound_cell(row.one_sided), True),
    LawColumn("stiffness\nup to", lambda row, _: Cell(row_limit_text(row)), True),
    LawColumn("basis", _basis_cell, False, 60),
    LawColumn("conser-\nvative", _conservation_cell, False, 80),
    LawColumn("worst\nleak", _leak_cell, True, 60),
    LawColumn("contin-\nuous", lambda row, _: _continuity_cell(row, row.continuous), False, 80),
    LawColumn("T", lambda row, _: Cell(merit_text(row.strength)), True, 80),
    LawColumn("S", lambda row, _: Cell(merit_text(row.support)), True, 80),
    LawColumn("RMS\nforce", _oscillation_cell, True, 80),
)


def law_rows(comparison: Comparison, cells: Callable[[LawRow], Sequence[str | Cell]]) -> list[Row]:
    """Return a row per law, the recommended one first and marked."""
    best = comparison.recommended_row
    return [
        Row(cells(row), row is best, law=row.law.letter)
        for row in sorted(comparison.rows, key=lambda row: row is not best)
    ]


def laws_table(comparison: Comparison, columns: Sequence[LawColumn]) -> Table:
    """Return one row per law with these columns."""
    if comparison.stiffness is not None:
        replaced = {id(_START_COLUMN): _GIVEN_COLUMN}
        columns = [replaced.get(id(column), column) for column in columns]
    rows = law_rows(comparison, lambda row: [column.cell(row, comparison) for column in columns])
    names = [single_line(column.heading) for column in columns]
    meanings = dict(column_meanings("laws"))
    layout = TableLayout(
        min_console={i: column.min_console for i, column in enumerate(columns)},
        legend={i: (name, meanings[name]) for i, name in enumerate(names) if name in meanings},
        tight_below=_WIDE_GAP_CONSOLE,
    )
    numeric = [i for i, column in enumerate(columns) if column.is_numeric]
    headings = [column.heading for column in columns]
    if strength_has_unit(comparison):
        headings = ["T [m]" if heading == "T" else heading for heading in headings]
    return Table(headings, rows, numeric, layout)


def verdicts_table(comparison: Comparison) -> Table:
    """Return letter and verdict of each law."""
    rows = law_rows(comparison, lambda row: [Cell(row.law.letter, "l"), row.verdict])
    has_speed = any("v*" in row.verdict for row in comparison.rows)
    legend = {1: ("v*", dict(column_meanings("laws"))["v*"])} if has_speed else {}
    return Table((), rows, layout=TableLayout(wrap=(1,), legend=legend))


# --- sections -------------------------------------------------------------------------------------


def comparison_table(comparison: Comparison, width: int = 120, full: bool = False) -> RichTable:
    """Return one row per law, the first column the letter of the law alone.

    Args:
        comparison: the result.
        width: of the console [characters]; on a narrow one columns are left out.
        full: whether to show q, q⁺, the limit with its basis, leak, T and S instead of the summary.

    Returns:
        A Rich table.
    """
    columns = FULL_COLUMNS if full else SUMMARY_COLUMNS
    return rich_table(laws_table(comparison, columns), width)


def terminal_sections(comparison: Comparison, full: bool) -> list[Section]:
    """Return the tables of a terminal and of a notebook; ``full`` for every number."""
    table = laws_table(comparison, FULL_COLUMNS if full else SUMMARY_COLUMNS)
    if has_sampled(comparison):
        mark = ("~", "sampled, not proved: leak and q may be larger, the limit lower")
        legend = {**table.layout.legend, len(table.headings): mark}
        table = replace(table, layout=replace(table.layout, legend=legend))
    summary = _single_line_table(comparison, SUMMARY_COLUMNS)
    return [
        terminal_section(table),
        terminal_section(verdicts_table(comparison)),
        Section("", [summary, verdicts_table(comparison)], media=Media.NOTEBOOK),
    ]


def _single_line_table(comparison: Comparison, columns: Sequence[LawColumn]) -> Table:
    """Return a table whose headings are not broken into lines."""
    table = laws_table(comparison, columns)
    return replace(table, headings=[single_line(heading) for heading in table.headings])


def law_sections(comparison: Comparison) -> list[Section]:
    """Return the tables of an HTML page."""
    summary = _single_line_table(comparison, SUMMARY_COLUMNS)
    full = _single_line_table(comparison, FULL_COLUMNS)
    notes = table_notes("sampled") if has_sampled(comparison) else []
    wrong = law_rows(comparison, lambda row: [Cell(row.law.letter, "l"), "; ".join(row.artefacts)])
    artefacts = Table((), [row for row in wrong if row.cells[1]])
    sections = [Section("The laws compared", [summary])]
    if artefacts.rows:
        sections.append(Section("What will go wrong", [artefacts]))
    return [*sections, Section("Every number", [full], notes=notes)]
