"""The comparison of laws: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.console import Console
from rich.table import Table

from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.report import page, terminal
from asperity.report.devices import numbers_table
from asperity.report.terminal import Column
from asperity.report.words import glossary
from asperity.report.words.comparison_words import (
    SAMPLED_NOTE,
    any_sampled,
    described,
    leak_text,
    stiffness_text,
    strength_has_unit,
)
from asperity.report.words.number_words import (
    bound_text,
    force_text,
    holds_text,
    law_title,
    merit_text,
    place_text,
)
from asperity.units import engineering

_NAMES_FROM = 112
"""Console width [characters] from which the law's name has a column."""

_AIRY_FROM = 90
"""Console width [characters] from which columns stand two characters apart."""

_HEADINGS = (
    "law", "name", "q", "q⁺", "stiffness\nup to", "by\nrule", "conser-\nvative", "worst\nleak",
    "contin-\nuous", "T", "S", "texture\nforce",
)  # fmt: skip
_NAME = 1
_NUMBERS = (2, 3, 4, 7, 9, 10, 11)


def _headings(comparison: Comparison) -> list[str]:
    unit = " [m]" if strength_has_unit(comparison) else ""
    return [f"T{unit}" if heading == "T" else heading for heading in _HEADINGS]


def _cells(row: LawRow, comparison: Comparison) -> list[page.Cell]:
    """Return what the columns say of a law."""
    return [
        page.Cell(row.law.letter, "l"),
        page.Cell(law_title(row.law.name)),
        page.Cell(bound_text(row.q), note=f"{row.q.method}: {row.q.note}"),
        page.Cell(bound_text(row.one_sided), note=f"{row.one_sided.method}: {row.one_sided.note}"),
        page.Cell(stiffness_text(row)),
        page.Cell(row.rule),
        page.Cell(holds_text(row.conservative), note=row.conservative_reason),
        page.Cell(leak_text(row, comparison), note=row.leak.description),
        page.Cell(holds_text(row.continuous), note=row.continuous_reason),
        page.Cell(merit_text(row.strength)),
        page.Cell(merit_text(row.support)),
        page.Cell(force_text(row.texture_force)),
    ]


def _is_best(row: LawRow, comparison: Comparison) -> bool:
    return row is comparison.recommended_row


# --- in a terminal --------------------------------------------------------------------------------


def comparison_table(comparison: Comparison, width: int = 120) -> Table:
    """Return one row per law, the first column the law's letter alone.

    Args:
        comparison: the result.
        width: of the console in characters; names of the laws are left out on a narrow one.

    Returns:
        A Rich table.
    """
    columns = [Column(heading, i in _NUMBERS) for i, heading in enumerate(_headings(comparison))]
    columns[_NAME] = Column("name", wraps=True, most=24)
    shown = [i for i in range(len(columns)) if i != _NAME or width >= _NAMES_FROM]
    rows = []
    for row in comparison.rows:
        cells = _cells(row, comparison)
        rows.append(([cells[i].text for i in shown], "bold" if _is_best(row, comparison) else ""))
    return terminal.table([columns[i] for i in shown], rows, gap=1 if width >= _AIRY_FROM else 0)


def _meanings(comparison: Comparison) -> list[tuple[str, str]]:
    """Return what the columns mean, one line each."""
    stiffness = engineering(comparison.stiffness, "N/m")
    meanings = [
        ("q, q⁺", "by how much the law multiplies stiffness at worst; smaller is better"),
        ("stiffness up to", f"what {comparison.device.name} renders by the rule, K₀ over q or q⁺"),
        ("worst leak", f"energy that one loop can give to the hand at {stiffness}"),
        ("T, S", "strength of the texture, support of the hand, for the same q"),
        ("texture force", "RMS at the law's own stiffness limit"),
    ]
    if any_sampled(comparison):
        meanings.append(("~", "sampled, not proved: leak and q may be larger, the limit lower"))
    return meanings


def _verdicts(comparison: Comparison) -> Table:
    """Return the verdict of every law, one line each where the width allows."""
    rows = [
        ([row.law.letter, row.verdict], "bold" if _is_best(row, comparison) else "")
        for row in comparison.rows
    ]
    return terminal.table([Column(""), Column("", wraps=True)], rows)


def print_comparison(comparison: Comparison, console: Console) -> None:
    """Print the answer, the table, the verdicts and what was assumed.

    Args:
        comparison: the result.
        console: where to; its width decides about the columns.
    """
    terminal.say(console, comparison.recommendation, "bold")
    console.print()
    console.print(comparison_table(comparison, console.width))
    console.print()
    console.print(terminal.pairs(_meanings(comparison), "dim"))
    console.print()
    console.print(_verdicts(comparison))
    terminal.print_assumptions(console, comparison.assumptions)


# --- as a page ------------------------------------------------------------------------------------


def comparison_page(comparison: Comparison) -> page.Page:
    """Return the report: answer, tables, pictures, assumptions and pedigree."""
    return page.Page(
        title=f"Haptic texture on {comparison.device.name}",
        answer=comparison.recommendation,
        facts=_facts(comparison),
        sections=[
            _laws(comparison),
            _troubles(comparison),
            *_pictures(comparison),
            *page.added_sections(Comparison, comparison),
            *page.assumed(
                comparison.assumptions,
                numbers_table(comparison.device, list(comparison.device.data)),
            ),
            _pedigree(comparison),
            page.Section("How to read it", [page.Definitions(glossary.COMPARISON)]),
        ],
        footer=f"{page.PAPER}. {page.UNFELT}",
    )


def _facts(comparison: Comparison) -> list[tuple[str, str]]:
    texture, device = comparison.texture, comparison.device
    return [
        ("Surface", described(texture.describe())),
        ("Peak to valley", engineering(texture.peak_to_valley, "m")),
        ("Device", device.name),
        ("K₀, stiffest smooth wall", engineering(device.max_stiffness, "N/m")),
        ("Stiffness asked for", engineering(comparison.stiffness, "N/m")),
        ("Pressed to", engineering(comparison.max_depth, "m")),
    ]


def _rows(
    comparison: Comparison, cells: Callable[[LawRow], Sequence[str | page.Cell]]
) -> list[page.Row]:
    """Return a row per law, the recommended one tinted."""
    return [
        page.Row(cells(row), "best" if _is_best(row, comparison) else "") for row in comparison.rows
    ]


def _laws(comparison: Comparison) -> page.Section:
    headings = [text.replace("-\n", "").replace("\n", " ") for text in _headings(comparison)]
    rows = _rows(comparison, lambda row: _cells(row, comparison))
    notes = [SAMPLED_NOTE] if any_sampled(comparison) else []
    return page.Section("The laws compared", [page.Table(headings, rows, _NUMBERS)], notes=notes)


def _troubles(comparison: Comparison) -> page.Section:
    rows = _rows(comparison, lambda row: [page.Cell(row.law.letter, "l"), row.verdict])
    return page.Section("What will go wrong", [page.Table((), rows)])


def _pictures(comparison: Comparison) -> list[page.Section]:
    from asperity.report.pictures.plots import PICTURES

    depth = engineering(comparison.max_depth, "m")
    stiffness = engineering(comparison.stiffness, "N/m")
    return [
        page.pictured(
            title, PICTURES[name](comparison), words.format(depth=depth, stiffness=stiffness)
        )
        for name, (title, words) in _CAPTIONS.items()
    ]


def _pedigree(comparison: Comparison) -> page.Section:
    """Return how each number came about."""
    headings = ("law", "q", "attained at", "q⁺", "conservative", "leak", "continuous")
    rows = [
        page.Row(
            [
                page.Cell(row.law.letter, "l"),
                f"{bound_text(row.q)} ({row.q.method}: {row.q.note})",
                place_text(row.q.at),
                f"{bound_text(row.one_sided)} ({row.one_sided.method}: {row.one_sided.note})",
                row.conservative_reason,
                f"{row.leak.method}: {row.leak.description}",
                row.continuous_reason,
            ]
        )
        for row in comparison.rows
    ]
    return page.Section("Where the numbers come from", [page.Table(headings, rows)])


_CAPTIONS = {
    "surface": ("The surface", "As the laws see it, after preparation."),
    "spectrum": (
        "Its spectrum",
        "Amplitude against wavelength along the scan line, with what the device can resolve.",
    ),
    "force": (
        "Force along a scan",
        "Straight scan at constant height, {depth} below the highest point (below the smooth wall "
        "for laws that act below it), at {stiffness}.",
    ),
    "field": (
        "Force field over its curl",
        "Arrows: force on the probe in the vertical plane of the scan. Colour: curl; the probe "
        "gains energy on a loop around one colour. White everywhere: conservative. The dashed "
        "line is the scan. A law with state is drawn sliding, its anchor trailing at full "
        "deflection.",
    ),
    "gain": (
        "Loop gain",
        "‖J‖/k in the same plane: by how much the law multiplies the stiffness of the smooth "
        "wall at each place. The cross is the witness of q where it lies in the picture.",
    ),
    "merit": (
        "Strength and support",
        "How much texture and how much support each law gives for the loop gain that it costs. "
        "Up and to the right is better.",
    ),
}
