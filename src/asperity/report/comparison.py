"""The comparison of laws: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rich.console import Console
from rich.table import Table

from asperity.analysis.compare import Comparison
from asperity.analysis.gain.answers import surface_content
from asperity.analysis.passivity.judgement import Basis
from asperity.analysis.row import LawRow
from asperity.analysis.words.felt import speed_text, tier_text
from asperity.analysis.words.passivity import allowed_text
from asperity.arguments import Argument
from asperity.files import json_text
from asperity.kept import content_digest
from asperity.report import page, terminal
from asperity.report.devices import datum_text, numbers_table
from asperity.report.stages import surface_sections
from asperity.report.words import glossary, seen
from asperity.report.words.number_words import (
    NONE,
    SAMPLED,
    bound_text,
    force_text,
    holds_text,
    in_one_unit,
    is_sampled,
    law_title,
    leak_text,
    limit_text,
    merit_text,
    place_text,
    strength_has_unit,
)
from asperity.textures.catalogue import CATALOGUE
from asperity.units import engineering, rounded_down

_AIRY_FROM = 90
"""Console width [characters] from which columns stand two characters apart."""

_VERDICT_FROM = 72
"""Console width [characters] from which the verdicts stand in the table, not below it."""


@dataclass(frozen=True)
class _Column:
    """A column of the table of laws.

    Attributes:
        heading: in a terminal, broken into lines.
        cell: what it says of a law.
        number: whether it is set to the right.
        least: width of the console [characters] from which it is shown.
        means: what it means, in a few words; empty where the heading says it.
    """

    heading: str
    cell: Callable[[LawRow, Comparison], page.Cell]
    number: bool = False
    least: int = 0
    means: str = ""


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


def start_text(row: LawRow) -> str:
    """Return the stiffness to begin with: "3050 N/m", or "none"."""
    return limit_text(row.start) if row.start else "none"


def _texture_text(row: LawRow, comparison: Comparison) -> str:
    """Return RMS of the texture that the device shows, all laws in one unit."""
    if row.felt is None:
        return NONE
    forces = [row.shown_force, *(other.shown_force for other in comparison.rows)]
    return in_one_unit(forces, "N", digits=2)[0]


_LETTER = _Column("law", lambda row, _: page.Cell(row.law.letter, "l"))
_TITLE = _Column("name", lambda row, _: page.Cell(law_title(row.law.name)), least=112)
_VERDICT = _Column("verdict", lambda row, _: page.Cell(row.verdict), least=_VERDICT_FROM)
_SHORT = (
    _LETTER,
    _TITLE,
    _Column(
        "start at",
        lambda row, _: page.Cell(start_text(row), note=allowed_text(row.allowed)), True,
        means="stiffness to begin with on this device; none: no stiffness is known to do",
    ),
    _Column(
        "texture", lambda row, all_: page.Cell(_texture_text(row, all_)), True, 44,
        "RMS of the force that is texture and that the device resolves, at the start",
    ),
    _Column(
        "felt?", lambda row, _: page.Cell(tier_text(row.felt)),
        means="whether a hand can feel that on this device",
    ),
    _Column(
        "feeds?",
        lambda row, all_: page.Cell(leak_text(row, all_), note=row.leak.description), True, 44,
        "energy that one loop can give to the hand: the surface feels alive; 0: proved none",
    ),
    _Column(
        "clicks?",
        lambda row, _: page.Cell(holds_text(row.jumps), note=row.continuous_reason), least=36,
        means="whether the force jumps",
    ),
)  # fmt: skip
_FULL = (
    _LETTER,
    _TITLE,
    _Column(
        "q", lambda row, _: page.Cell(bound_text(row.q), note=f"{row.q.method}: {row.q.note}"),
        True, means="by how much the law multiplies stiffness at worst; smaller is better",
    ),
    _Column(
        "q⁺",
        lambda row, _: page.Cell(
            bound_text(row.one_sided), note=f"{row.one_sided.method}: {row.one_sided.note}"
        ),
        True, means="the same where only what stiffens counts: no delay",
    ),
    _Column(
        "stiffness\nup to", lambda row, _: page.Cell(stiffness_text(row)), True,
        means="limit on this device; the start is below it",
    ),
    _Column(
        "worth",
        lambda row, _: page.Cell(_WORTHS[row.allowed.basis], note=allowed_text(row.allowed)),
        means="proved passive; bounded: but for steps of an encoder; plausible: a smooth wall of "
        "that gain held, no proof; quiet: against buzz, yet it feeds the hand below v*",
        least=60,
    ),
    _Column(
        "conser-\nvative",
        lambda row, _: page.Cell(holds_text(row.conservative), note=row.conservative_reason),
        means="no closed path of the field gives energy", least=80,
    ),
    _Column(
        "worst\nleak",
        lambda row, all_: page.Cell(leak_text(row, all_), note=row.leak.description),
        True, 60, "energy that one loop can give to the hand",
    ),
    _Column(
        "contin-\nuous",
        lambda row, _: page.Cell(holds_text(row.continuous), note=row.continuous_reason),
        means="the force does not jump", least=80,
    ),
    _Column(
        "T", lambda row, _: page.Cell(merit_text(row.strength)), True, 80,
        "strength of the texture for the same q",
    ),
    _Column(
        "S", lambda row, _: page.Cell(merit_text(row.support)), True, 80,
        "support of the hand for the same q",
    ),
    _Column(
        "texture\nforce",
        lambda row, _: page.Cell(
            force_text(row.texture_force) if row.start or row.textureless else NONE
        ),
        True, 80, "RMS of all that oscillates, at the start",
    ),
)  # fmt: skip


def _heading(column: _Column, comparison: Comparison) -> str:
    unit = " [m]" if column.heading == "T" and strength_has_unit(comparison) else ""
    return f"{column.heading}{unit}"


def _plain(heading: str) -> str:
    """Return a heading in one line."""
    return heading.replace("-\n", "").replace("\n", " ")


def _rows(
    comparison: Comparison, cells: Callable[[LawRow], Sequence[str | page.Cell]]
) -> list[page.Row]:
    """Return a row per law, the recommended one marked."""
    best = comparison.recommended_row
    return [
        page.Row(cells(row), "best" if row is best else "", law=row.law.letter)
        for row in comparison.rows
    ]


def _table(comparison: Comparison, columns: Sequence[_Column]) -> page.Table:
    rows = _rows(comparison, lambda row: [one.cell(row, comparison) for one in columns])
    numbers = [i for i, one in enumerate(columns) if one.number]
    return page.Table([_heading(one, comparison) for one in columns], rows, numbers)


def _verdicts(comparison: Comparison) -> page.Table:
    return page.Table(
        (), _rows(comparison, lambda row: [page.Cell(row.law.letter, "l"), row.verdict])
    )


# --- in a terminal --------------------------------------------------------------------------------


def comparison_table(comparison: Comparison, width: int = 120, full: bool = False) -> Table:
    """Return one row per law, the first column the law's letter alone.

    Args:
        comparison: the result.
        width: of the console in characters; on a narrow one columns are left out.
        full: whether to show q, q⁺, the limit with its worth, leak, T and S instead of the answer
            in short.

    Returns:
        A Rich table.
    """
    columns = _columns(full, width)
    wrapping = [i for i, one in enumerate(columns) if one in (_TITLE, _VERDICT)]
    most = {i: 24 for i in wrapping if columns[i] is _TITLE}
    gap = 1 if width >= _AIRY_FROM else 0
    return terminal.table(_table(comparison, columns), wraps=wrapping, most=most, gap=gap)


def _columns(full: bool, width: int) -> list[_Column]:
    """Return the columns for which there is room."""
    every = _FULL if full else (*_SHORT, _VERDICT)
    return [one for one in every if one.least <= width]


def print_comparison(comparison: Comparison, console: Console, full: bool = False) -> None:
    """Print the answer, the table, the verdicts and what was assumed.

    Args:
        comparison: the result.
        console: where to; its width decides about the columns.
        full: whether to show every number instead of the answer in short.
    """
    columns = _columns(full, console.width)
    meanings = [(_plain(one.heading), one.means) for one in columns if one.means]
    if any_sampled(comparison):
        meanings.append(("~", "sampled, not proved: leak and q may be larger, the limit lower"))
    terminal.say(console, comparison.recommendation, "bold")
    console.print()
    console.print(comparison_table(comparison, console.width, full))
    console.print()
    console.print(terminal.pairs(meanings, "dim"))
    if _VERDICT not in columns:
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
            *_laws(comparison),
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
        ("Stiffness asked for", _asked(comparison)),
        ("Pressed to", engineering(comparison.max_depth, "m")),
        ("Scanned at", speed_text(comparison.speed)),
    ]


def _asked(comparison: Comparison) -> str:
    asked = comparison.stiffness
    return "each law's own, to begin with" if asked is None else engineering(asked, "N/m")


def answers_table(comparison: Comparison) -> page.Table:
    """Return one row per law: the answer in short, and what will go wrong."""
    return _one_line(comparison, (*_SHORT, _VERDICT))


def _one_line(comparison: Comparison, columns: Sequence[_Column]) -> page.Table:
    """Return a table whose headings are not broken into lines."""
    table = _table(comparison, columns)
    return replace(table, headings=[_plain(heading) for heading in table.headings])


def _laws(comparison: Comparison) -> list[page.Section]:
    short, full = _one_line(comparison, _SHORT), _one_line(comparison, _FULL)
    notes = [SAMPLED_NOTE] if any_sampled(comparison) else []
    return [
        page.Section("The laws compared", [short]),
        page.Section("What will go wrong", [_verdicts(comparison)]),
        page.Section("Every number", [full], notes=notes),
    ]


def _pictures(comparison: Comparison) -> list[page.Section]:
    depth, stiffness = engineering(comparison.max_depth, "m"), _asked(comparison)
    content = _content(comparison)
    return [
        page.Section(
            title,
            [page.kept_picture(name, content, partial(_picture, comparison, name))],
            words.format(depth=depth, stiffness=stiffness),
        )
        for name, (title, words) in _CAPTIONS.items()
    ]


def _picture(comparison: Comparison, name: str) -> page.Picture:
    from asperity.report.pictures.plots import PICTURES

    return page.picture(PICTURES[name](comparison), seen.COMPARISON[name](comparison))


def _content(comparison: Comparison) -> str | None:
    """Return a digest of all that a comparison's pictures show; ``None`` where it is not known."""
    contents = [surface_content(row.surface) for row in comparison.rows]
    known = [content for content in contents if content is not None]
    if len(known) < len(contents):
        return None
    return content_digest(json_text(comparison), comparison.texture.filled, tuple(known))


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
            ],
            law=row.law.letter,
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
        "for laws that act below it). Stiffness: {stiffness}.",
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
