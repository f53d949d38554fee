"""Several devices and depths in one table: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console

from asperity.analysis.compare import Comparison
from asperity.analysis.several import Comparisons
from asperity.analysis.words.felt import millinewtons, tier_text
from asperity.report import page, terminal
from asperity.report.comparison_columns import described, start_text
from asperity.report.stages import surface_sections
from asperity.report.words.number_words import NONE, limit_text
from asperity.units import engineering

_HEADINGS = ("device", "depth", "law", "start at", "texture", "felt?")
_NUMBERS = (1, 3, 4)
_OPTIONAL = (3, 4)  # what a narrow console leaves out, the more wanted first
_MEANINGS = [
    ("depth", "to which the surface is pressed"),
    ("law", "the one to use there; in brackets the nearest, where nothing is felt"),
    ("start at", "the stiffness to begin with"),
    ("texture", "RMS of the force that is texture and that the device resolves, at the start"),
]


def _row(one: Comparison) -> page.Row:
    depth, best = engineering(one.max_depth, "m"), one.recommended_row or one.nearest_row
    if best is None:
        return page.Row([one.device.name, depth, "none", NONE, NONE, NONE])
    text = best.law.letter if one.recommended else f"({best.law.letter})"
    letter = page.Cell(text, "l", note=one.recommendation)
    said = [limit_text(best.start), millinewtons(best.shown_force), tier_text(best.felt)]
    return page.Row([one.device.name, depth, letter, *said])


def cases_table(found: Comparisons) -> page.Table:
    """Return a row for each device and depth."""
    rows = [_row(one) for one in found.comparisons]
    rows += [page.Row([one.device, NONE, "K₀ missing", NONE, NONE, NONE]) for one in found.lacking]
    return page.Table(_HEADINGS, rows, _NUMBERS)


def _title(one: Comparison) -> str:
    return f"{one.device.name}, {engineering(one.max_depth, 'm')} deep"


def print_comparisons(found: Comparisons, console: Console) -> None:
    """Print a row for each device and depth, then what is to be said of each.

    Args:
        found: the result.
        console: where to.
    """
    terminal.say(console, found.recommendation, "bold")
    console.print()
    table = cases_table(found)
    without = terminal.too_wide(table, _OPTIONAL, console.width)
    console.print(terminal.table(table, wraps=(0,), without=without))
    console.print()
    left = [_HEADINGS[column] for column in without]
    shown = [meaning for meaning in _MEANINGS if meaning[0] not in left]
    console.print(terminal.pairs(shown, "dim"))
    for one in found.comparisons:
        console.print()
        terminal.say(console, f"{_title(one)}: {one.recommendation}")
    for missing in found.lacking:
        console.print()
        terminal.say(console, missing.sentence)
    if found.comparisons:
        terminal.print_assumptions(console, _shared(found.comparisons))


def _shared(comparisons: Sequence[Comparison]) -> list[str]:
    """Return what was assumed in all cases alike."""
    first, *others = (one.assumptions for one in comparisons)
    return [said for said in first if all(said in other for other in others)]


def comparisons_page(found: Comparisons) -> page.Page:
    """Return the report: the table, then each device and depth with its laws and assumptions."""
    texture = found.texture
    return page.Page(
        title="Haptic texture on several devices",
        answer=found.recommendation,
        facts=[
            ("Surface", described(texture.describe())),
            ("Peak to valley", engineering(texture.peak_to_valley, "m")),
        ],
        sections=[
            page.Section("In one table", [cases_table(found), page.Definitions(_MEANINGS)]),
            *[_case(one) for one in found.comparisons],
            *_lacking(found),
            *surface_sections(texture),
        ],
        footer=f"{page.PAPER}. {page.UNFELT}",
    )


def _case(one: Comparison) -> page.Section:
    """Return what is said of one device and depth."""
    rows = [
        page.Row(
            [page.Cell(row.law.letter, "l"), start_text(row), tier_text(row.felt), row.verdict],
            "best" if row is one.recommended_row else "",
            law=row.law.letter,
        )
        for row in one.rows
    ]
    table = page.Table(("law", "start at", "felt?", "verdict"), rows, (1,))
    return page.Section(
        _title(one), [page.Words(one.recommendation), table, page.Items(one.assumptions)]
    )


def _lacking(found: Comparisons) -> list[page.Section]:
    if not found.lacking:
        return []
    return [page.Section("Missing", [page.Items([one.sentence for one in found.lacking])])]
