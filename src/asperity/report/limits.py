"""The six limits: in a terminal, and as a page."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

from asperity.analysis.limits.limit_result import Limits
from asperity.analysis.words.limits import speed_text, speeds_text, stiffness_text
from asperity.report import page, terminal
from asperity.report.devices import numbers_table
from asperity.report.page import (
    PAPER,
    UNFELT,
    Cell,
    Cells,
    Definitions,
    Page,
    Row,
    Section,
    added_sections,
    assumed,
    holds_cell,
    pictured,
)
from asperity.report.terminal import Column, say
from asperity.report.words import glossary
from asperity.report.words.limits_words import (
    ON_WAVES,
    limit_cells,
    more_text,
    shown_waves,
    symbols,
    wave_cells,
)
from asperity.report.words.number_words import holds_text, law_title
from asperity.units import engineering

_NAMES_FROM = 96
"""Console width [characters] from which the limits' names are not broken."""

_LIMITS = ("", "limit", "condition", "left", "right", "holds", "for", "at speeds")
_NAME, _HOLDS, _FOR, _SPEEDS = 1, 5, 6, 7
_NUMBERS = (3, 4, _FOR)
_WAVES = ("wavelength", "amplitude", "share", "frequency", "force")
_SIDES = "Left and right: of the wave that comes closest to breaking the limit; for: share of the "


# --- in a terminal --------------------------------------------------------------------------------


def limits_table(result: Limits, width: int = 100) -> Table:
    """Return one row per limit, the first column its number in the paper alone.

    Args:
        result: the limits.
        width: of the console in characters; names are broken on a narrow one.

    Returns:
        A Rich table.
    """
    wide = width >= _NAMES_FROM
    columns = [Column(name, right=i in _NUMBERS) for i, name in enumerate(_LIMITS)]
    columns[_NAME] = Column(_LIMITS[_NAME], wraps=True, most=None if wide else 14)
    columns[_SPEEDS] = Column(_LIMITS[_SPEEDS], wraps=True)
    shown = [i for i in range(len(columns)) if i != _FOR or wide]
    rows = []
    for limit in result.limits:
        cells = limit_cells(limit)
        style = "bold red" if limit.holds is False else "dim" if limit.holds is None else ""
        rows.append(([cells[i] for i in shown], style))
    return terminal.table([columns[i] for i in shown], rows)


def _waves_table(result: Limits) -> Table:
    """Return one row per wave: what it is, its force, and whether it meets each limit (y, n, ?)."""
    columns = [Column(name, right=True) for name in _WAVES]
    columns += [Column(str(number)) for number in ON_WAVES]
    rows = []
    for wave in shown_waves(result):
        *cells, speeds = wave_cells(wave)
        holds = [holds_text(wave.holds.get(number))[0] for number in ON_WAVES]
        rows.append(([*cells, *holds, speeds], ""))
    return terminal.table([*columns, Column("at speeds")], rows)


def print_limits(result: Limits, console: Console) -> None:
    """Print the answer, the limits, the waves and what was assumed.

    Args:
        result: the limits.
        console: where to; its width decides about the columns.
    """
    say(console, result.answer, "bold")
    console.print()
    console.print(limits_table(result, console.width))
    console.print()
    for line in (*symbols(result), f"{_SIDES}height variance in waves that meet it"):
        say(console, line, "dim")
    if result.waves:
        console.print()
        console.print(_waves_table(result))
    if more_text(result):
        say(console, more_text(result), "dim")
    terminal.print_assumptions(console, result.assumptions)


# --- as a page ------------------------------------------------------------------------------------


def limits_page(result: Limits) -> Page:
    """Return the report: answer, limits, picture, waves and assumptions."""
    used = [*dict.fromkeys(limit.uses for limit in result.limits), "friction"]
    return Page(
        title=f"Will I feel it? Law {result.surface.law.letter} on {result.device.name}",
        answer=result.answer,
        facts=_facts(result),
        sections=[
            _limits(result),
            _picture(result),
            *_waves(result),
            *added_sections(Limits, result),
            *assumed(result.assumptions, numbers_table(result.device, used)),
            Section("How to read it", [Definitions(glossary.LIMITS)]),
        ],
        footer=f"{PAPER}, section II.B. {UNFELT}",
    )


def _facts(result: Limits) -> list[tuple[str, str]]:
    texture, law = result.texture, result.surface.law
    return [
        ("Surface", str(texture.describe()["kind"])),
        ("Peak to valley", engineering(texture.peak_to_valley, "m")),
        ("Law", f"{law.letter}, {law_title(law.name)}"),
        ("Device", result.device.name),
        ("Scanning speed", speed_text(result.speed)),
        ("Stiffness", stiffness_text(result)),
        ("Speeds at which all decided limits hold", speeds_text(result.speeds)),
        ("Texture force", engineering(result.force.rms, "N", digits=2) + " RMS"),
    ]


def _limits(result: Limits) -> Section:
    rows = []
    for limit in result.limits:
        cells: Cells = [*limit_cells(limit)]
        cells[0] = Cell(str(limit.number), "l")
        cells[_HOLDS] = holds_cell(limit.holds)
        rows.append(Row(cells))
    note = (
        "Left and right are those of the wave that comes closest to breaking the limit. “For” is "
        "the share of the height variance in waves that meet it."
    )
    notes = [*symbols(result), note]
    return Section("The six limits", [page.Table(_LIMITS, rows, _NUMBERS)], notes=notes)


def _picture(result: Limits) -> Section:
    from asperity.report.pictures.limits_picture import limits_figure

    caption = (
        "Amplitude of the waves that the texture is made of, and the force that each makes, "
        "against wavelength. Left of a dashed line a wave is too short for the device at this "
        "speed; below a dashed line it is too weak. Filled: meets every limit on waves that could "
        "be decided."
    )
    return pictured("The waves and their forces", limits_figure(result), caption)


def _waves(result: Limits) -> list[Section]:
    if not result.waves:
        return []
    rows = []
    for wave in shown_waves(result):
        *cells, speeds = wave_cells(wave)
        holds = [holds_cell(wave.holds.get(number)) for number in ON_WAVES]
        rows.append(Row([*cells, *holds, speeds]))
    headings = (*_WAVES, *(f"limit {number}" for number in ON_WAVES), "at speeds")
    table = page.Table(headings, rows, numbers=range(len(_WAVES)))
    more = more_text(result)
    return [Section("Wave by wave", [table], notes=[f"{more.capitalize()}."] if more else [])]
