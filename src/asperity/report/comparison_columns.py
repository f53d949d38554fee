"""What a comparison says of each law: the columns of its tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from asperity.analysis.compare import Comparison
from asperity.analysis.passivity.judgement import Basis
from asperity.analysis.row import LawRow
from asperity.analysis.words.felt import tier_text
from asperity.analysis.words.passivity import allowed_text
from asperity.arguments import Argument
from asperity.report import page
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
    strength_has_unit,
)
from asperity.textures.catalogue import CATALOGUE
from asperity.units import engineering, rounded_down

_VERDICT_FROM = 72
"""Console width [characters] from which the verdicts stand in the table, not below it."""


@dataclass(frozen=True)
class Column:
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


_WORTHS: dict[Basis, str] = {
    "proved": "proved",
    "plausible": "plausible",
    "bounded": "bounded",
    "quiet against buzz": "quiet",
    "none": "–",
}
# Of maps and profiles, which are no arguments of a kind.
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


_LETTER = Column("law", lambda row, _: page.Cell(row.law.letter, "l"))
TITLE = Column("name", lambda row, _: page.Cell(law_title(row.law.name)), least=112)
VERDICT = Column("verdict", lambda row, _: page.Cell(row.verdict), least=_VERDICT_FROM)
SHORT = (
    _LETTER,
    TITLE,
    Column(
        "start at",
        lambda row, _: page.Cell(start_text(row), note=allowed_text(row.allowed)), True,
        means="stiffness to begin with on this device; none: no stiffness is known to do",
    ),
    Column(
        "texture", lambda row, all_: page.Cell(_texture_text(row, all_)), True, 44,
        "RMS of the force that is texture and that the device resolves, at the start",
    ),
    Column(
        "felt?", lambda row, _: page.Cell(tier_text(row.felt)),
        means="whether a hand can feel that on this device",
    ),
    Column(
        "feeds?",
        lambda row, all_: page.Cell(leak_text(row, all_), note=row.leak.description), True, 44,
        "energy that one loop can give to the hand: the surface feels alive; 0: proved none",
    ),
    Column(
        "clicks?",
        lambda row, _: page.Cell(holds_text(row.jumps), note=row.continuous_reason), least=36,
        means="whether the force jumps",
    ),
)  # fmt: skip
FULL = (
    _LETTER,
    TITLE,
    Column(
        "q", lambda row, _: page.Cell(bound_text(row.q), note=f"{row.q.method}: {row.q.note}"),
        True, means="by how much the law multiplies stiffness at worst; smaller is better",
    ),
    Column(
        "q⁺",
        lambda row, _: page.Cell(
            bound_text(row.one_sided), note=f"{row.one_sided.method}: {row.one_sided.note}"
        ),
        True, means="the same where only what stiffens counts: no delay",
    ),
    Column(
        "stiffness\nup to", lambda row, _: page.Cell(stiffness_text(row)), True,
        means="limit on this device; the start is below it",
    ),
    Column(
        "worth",
        lambda row, _: page.Cell(_WORTHS[row.allowed.basis], note=allowed_text(row.allowed)),
        means="proved passive; bounded: but for steps of an encoder; plausible: a smooth wall of "
        "that gain held, no proof; quiet: against buzz, yet it feeds the hand below v*",
        least=60,
    ),
    Column(
        "conser-\nvative",
        lambda row, _: page.Cell(holds_text(row.conservative), note=row.conservative_reason),
        means="no closed path of the field gives energy", least=80,
    ),
    Column(
        "worst\nleak",
        lambda row, all_: page.Cell(leak_text(row, all_), note=row.leak.description),
        True, 60, "energy that one loop can give to the hand",
    ),
    Column(
        "contin-\nuous",
        lambda row, _: page.Cell(holds_text(row.continuous), note=row.continuous_reason),
        means="the force does not jump", least=80,
    ),
    Column(
        "T", lambda row, _: page.Cell(merit_text(row.strength)), True, 80,
        "strength of the texture for the same q",
    ),
    Column(
        "S", lambda row, _: page.Cell(merit_text(row.support)), True, 80,
        "support of the hand for the same q",
    ),
    Column(
        "texture\nforce",
        lambda row, _: page.Cell(
            force_text(row.texture_force) if row.start or row.textureless else NONE
        ),
        True, 80, "RMS of all that oscillates, at the start",
    ),
)  # fmt: skip


def _heading(column: Column, comparison: Comparison) -> str:
    unit = " [m]" if column.heading == "T" and strength_has_unit(comparison) else ""
    return f"{column.heading}{unit}"


def plain(heading: str) -> str:
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


def table_of(comparison: Comparison, columns: Sequence[Column]) -> page.Table:
    """Return one row per law with these columns."""
    rows = _rows(comparison, lambda row: [one.cell(row, comparison) for one in columns])
    numbers = [i for i, one in enumerate(columns) if one.number]
    return page.Table([_heading(one, comparison) for one in columns], rows, numbers)


def verdicts(comparison: Comparison) -> page.Table:
    """Return each law's letter and what will go wrong with it."""
    return page.Table(
        (), _rows(comparison, lambda row: [page.Cell(row.law.letter, "l"), row.verdict])
    )
