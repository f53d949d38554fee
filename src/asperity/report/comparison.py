"""The comparison of laws: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from rich.console import Console
from rich.table import Table

from asperity.analysis.compare import Comparison
from asperity.analysis.passivity.judgement import Basis
from asperity.analysis.row import LawRow
from asperity.analysis.words.passivity import allowed_text
from asperity.arguments import Argument
from asperity.report import page, terminal
from asperity.report.devices import datum_text, numbers_table
from asperity.report.stages import surface_sections
from asperity.report.words import glossary
from asperity.report.words.number_words import (
    NONE,
    SAMPLED,
    bound_text,
    force_text,
    holds_text,
    is_sampled,
    law_title,
    leak_text,
    merit_text,
    place_text,
    strength_has_unit,
)
from asperity.textures.catalogue import CATALOGUE
from asperity.units import engineering, rounded_down

_NAMES_FROM = 112
"""Console width [characters] from which the law's name has a column."""

_AIRY_FROM = 90
"""Console width [characters] from which columns stand two characters apart."""

_HEADINGS = (
    "law", "name", "q", "q⁺", "stiffness\nup to", "worth", "conser-\nvative", "worst\nleak",
    "contin-\nuous", "T", "S", "texture\nforce",
)  # fmt: skip
_NAME = 1
_NUMBERS = (2, 3, 4, 7, 9, 10, 11)


SAMPLED_NOTE = (
    "~ found by sampling, not proved: the true q, q⁺ and leak may be larger, "
    "the true safe stiffness smaller."
)
# Of maps and profiles, which are no arguments of a kind.
_WORTHS: dict[Basis, str] = {
    "proved": "proved",
    "plausible": "plausible",
    "bounded": "bounded",
    "quiet against buzz": "quiet",
    "none": "–",
}
_LENGTHS = {"pitch", "cutoff"}
_UNSAID = {"kind", "preparation", "phase", "direction", "phases", "wavevectors"}


# --- what it says of each law, in words -----------------------------------------------------------


def stiffness_text(row: LawRow) -> str:
    """Return the stiffness up to which the device renders the law: "995 N/m", or "none"."""
    if row.safe_stiffness <= 0.0:
        return "none"
    mark = SAMPLED if row.allowed.sampled else ""
    return f"{mark}{engineering(rounded_down(row.safe_stiffness), 'N/m')}"


def any_sampled(comparison: Comparison) -> bool:
    """Return whether any number of the table carries the ~."""
    return any(
        is_sampled(row.q) or is_sampled(row.one_sided) or row.leak.method == "sampled"
        for row in comparison.rows
    )


def described(description: dict[str, Any]) -> str:
    """Return the kind of a texture and its plain arguments in words.

    Example:
        >>> described({"kind": "sinusoid", "amplitude": 8e-4, "period": 1e-3, "phase": 0.0})
        'sinusoid: amplitude 0.8 mm, period 1 mm'
    """
    kind = CATALOGUE.get(description["kind"])
    declared = {} if kind is None else {argument.name: argument for argument in kind.arguments}
    parts = []
    for name, value in description.items():
        if name in _UNSAID:
            continue
        values = value if isinstance(value, list) else [value]
        if len(values) > 4:
            parts.append(f"{len(values)} {name}")
            continue
        shown = [_value_text(name, one, declared.get(name)) for one in values]
        parts.append(f"{law_title(name)} {' × '.join(shown)}")
    return f"{description['kind']}: {', '.join(parts)}"


def _value_text(name: str, value: Any, argument: Argument | None) -> str:
    if isinstance(value, bool):
        return holds_text(value)
    if argument is not None:
        return argument.readable(value)
    return engineering(value, "m") if name in _LENGTHS and isinstance(value, float) else f"{value}"


# --- tables ---------------------------------------------------------------------------------------


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
        page.Cell(_WORTHS[row.allowed.basis], note=allowed_text(row.allowed)),
        page.Cell(holds_text(row.conservative), note=row.conservative_reason),
        page.Cell(leak_text(row, comparison), note=row.leak.description),
        page.Cell(holds_text(row.continuous), note=row.continuous_reason),
        page.Cell(merit_text(row.strength)),
        page.Cell(merit_text(row.support)),
        page.Cell(force_text(row.texture_force) if row.safe_stiffness or row.textureless else NONE),
    ]


def _rows(
    comparison: Comparison, cells: Callable[[LawRow], Sequence[str | page.Cell]]
) -> list[page.Row]:
    """Return a row per law, the recommended one marked."""
    best = comparison.recommended_row
    return [page.Row(cells(row), "best" if row is best else "") for row in comparison.rows]


def _table(comparison: Comparison) -> page.Table:
    rows = _rows(comparison, lambda row: _cells(row, comparison))
    return page.Table(_headings(comparison), rows, _NUMBERS)


def _verdicts(comparison: Comparison) -> page.Table:
    return page.Table(
        (), _rows(comparison, lambda row: [page.Cell(row.law.letter, "l"), row.verdict])
    )


# --- in a terminal --------------------------------------------------------------------------------


def comparison_table(comparison: Comparison, width: int = 120) -> Table:
    """Return one row per law, the first column the law's letter alone.

    Args:
        comparison: the result.
        width: of the console in characters; names of the laws are left out on a narrow one.

    Returns:
        A Rich table.
    """
    return terminal.table(
        _table(comparison),
        wraps=(_NAME,),
        most={_NAME: 24},
        without=() if width >= _NAMES_FROM else (_NAME,),
        gap=1 if width >= _AIRY_FROM else 0,
    )


def _meanings(comparison: Comparison) -> list[tuple[str, str]]:
    """Return what the columns mean, one line each."""
    stiffness = engineering(comparison.stiffness, "N/m")
    meanings = [
        ("q, q⁺", "by how much the law multiplies stiffness at worst; smaller is better"),
        ("stiffness up to", f"on the {comparison.device.name}; what it is worth stands beside it"),
        (
            "worth",
            "proved passive; bounded: but for steps of an encoder; plausible: a smooth wall of "
            "that gain held, no proof; quiet: against buzz, yet it feeds the hand below v*",
        ),
        ("worst leak", f"energy that one loop can give to the hand at {stiffness}"),
        ("T, S", "strength of the texture, support of the hand, for the same q"),
        ("texture force", "RMS at that stiffness"),
    ]
    if any_sampled(comparison):
        meanings.append(("~", "sampled, not proved: leak and q may be larger, the limit lower"))
    return meanings


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
    console.print(terminal.table(_verdicts(comparison), wraps=(1,)))
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
            page.Section("What will go wrong", [_verdicts(comparison)]),
            *_pictures(comparison),
            *surface_sections(comparison.texture),
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
        ("K₀, stiffest smooth wall", datum_text(device.wall_test)),
        ("Stiffness asked for", engineering(comparison.stiffness, "N/m")),
        ("Pressed to", engineering(comparison.max_depth, "m")),
    ]


def _laws(comparison: Comparison) -> page.Section:
    table = _table(comparison)
    headings = [text.replace("-\n", "").replace("\n", " ") for text in table.headings]
    notes = [SAMPLED_NOTE] if any_sampled(comparison) else []
    return page.Section("The laws compared", [replace(table, headings=headings)], notes=notes)


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
