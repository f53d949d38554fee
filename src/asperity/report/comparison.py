"""The comparison of laws: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from rich.console import Console
from rich.table import Table

from asperity.analysis.compare import Comparison
from asperity.analysis.gain.answers import content_but_stiffness
from asperity.analysis.words.felt import speed_text
from asperity.files import json_text
from asperity.kept import content_digest
from asperity.processes import helped
from asperity.report import page, terminal
from asperity.report.comparison_columns import (
    FULL,
    SHORT,
    TITLE,
    VERDICT,
    Column,
    any_sampled,
    described,
    plain,
    table_of,
    verdicts,
)
from asperity.report.devices import datum_text, numbers_table
from asperity.report.stages import surface_sections
from asperity.report.words import glossary, seen
from asperity.report.words.number_words import bound_text, place_text
from asperity.units import engineering

_AIRY_FROM = 90
"""Console width [characters] from which columns stand two characters apart."""

SAMPLED_NOTE = (
    "~ found by sampling, not proved: the true q, q⁺ and leak may be larger, "
    "the true safe stiffness smaller."
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
    wrapping = [i for i, one in enumerate(columns) if one in (TITLE, VERDICT)]
    most = {i: 24 for i in wrapping if columns[i] is TITLE}
    gap = 1 if width >= _AIRY_FROM else 0
    return terminal.table(table_of(comparison, columns), wraps=wrapping, most=most, gap=gap)


def _columns(full: bool, width: int) -> list[Column]:
    """Return the columns for which there is room."""
    every = FULL if full else (*SHORT, VERDICT)
    return [one for one in every if one.least <= width]


def print_comparison(comparison: Comparison, console: Console, full: bool = False) -> None:
    """Print the answer, the table, the verdicts and what was assumed.

    Args:
        comparison: the result.
        console: where to; its width decides about the columns.
        full: whether to show every number instead of the answer in short.
    """
    columns = _columns(full, console.width)
    meanings = [(plain(one.heading), one.means) for one in columns if one.means]
    if any_sampled(comparison):
        meanings.append(("~", "sampled, not proved: leak and q may be larger, the limit lower"))
    terminal.say(console, comparison.recommendation, "bold")
    console.print()
    console.print(comparison_table(comparison, console.width, full))
    console.print()
    console.print(terminal.pairs(meanings, "dim"))
    if VERDICT not in columns:
        console.print()
        console.print(terminal.table(verdicts(comparison), wraps=(1,)))
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
    return _one_line(comparison, (*SHORT, VERDICT))


def _one_line(comparison: Comparison, columns: Sequence[Column]) -> page.Table:
    """Return a table whose headings are not broken into lines."""
    table = table_of(comparison, columns)
    return replace(table, headings=[plain(heading) for heading in table.headings])


def _laws(comparison: Comparison) -> list[page.Section]:
    short, full = _one_line(comparison, SHORT), _one_line(comparison, FULL)
    notes = [SAMPLED_NOTE] if any_sampled(comparison) else []
    return [
        page.Section("The laws compared", [short]),
        page.Section("What will go wrong", [verdicts(comparison)]),
        page.Section("Every number", [full], notes=notes),
    ]


def _pictures(comparison: Comparison) -> list[page.Section]:
    depth, stiffness = engineering(comparison.max_depth, "m"), _asked(comparison)
    content = _content(comparison)
    sections = []
    with helped(_drawn_ahead, [(comparison, name) for name in _CAPTIONS]) as turns:
        for (name, (title, words)), ahead in zip(_CAPTIONS.items(), turns, strict=True):
            drawn = partial(_picture, comparison, name) if ahead is None else partial(_same, ahead)
            shown = page.kept_picture(name, content, drawn)
            caption = words.format(depth=depth, stiffness=stiffness)
            sections.append(page.Section(title, [shown], caption))
    return sections


def _same(picture: page.Picture) -> page.Picture:
    return picture


def _drawn_ahead(task: tuple[Comparison, str]) -> page.Picture:
    """Return a picture that another process draws; who asked for it keeps it."""
    with page.own_look():
        return _picture(*task)


def _picture(comparison: Comparison, name: str) -> page.Picture:
    from asperity.report.pictures.plots import PICTURES

    return page.picture(PICTURES[name](comparison), seen.COMPARISON[name](comparison))


def _content(comparison: Comparison) -> str | None:
    """Return a digest of all that a comparison's pictures show; ``None`` where it is not known."""
    contents = [content_but_stiffness(row.surface) for row in comparison.rows]
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
