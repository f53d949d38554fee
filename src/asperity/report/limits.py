"""The six limits: in a terminal, and as a page."""

from __future__ import annotations

from collections.abc import Callable

from rich.console import Console
from rich.table import Table

from asperity.analysis.limits.limit_result import Limits, RenderedWave
from asperity.analysis.limits.limit_rules import RULES
from asperity.analysis.words.felt import amount, speed_text
from asperity.analysis.words.limits import percent, speeds_text, stiffness_text
from asperity.report import page, terminal
from asperity.report.devices import numbers_table
from asperity.report.terminal import say
from asperity.report.words import glossary
from asperity.report.words.number_words import INFINITE, NONE, holds_text, law_title
from asperity.units import engineering

_NAMES_FROM = 96
"""Console width [characters] from which the limits' names are not broken."""

_LIMITS = ("", "limit", "condition", "left", "right", "holds", "for", "at speeds")
_NAME, _FOR, _SPEEDS = 1, 6, 7
_NUMBERS = (3, 4, _FOR)
_WAVES = ("wavelength", "amplitude", "share", "frequency", "force")
_SIDES = "Left and right: of the wave that comes closest to breaking the limit; for: share of the "


MOST_WAVES = 16
"""Waves that a table lists: those that carry most of the heights."""

ON_WAVES = tuple(rule.number for rule in RULES if rule.number != 5)
_SYMBOLS = {
    "T": "update_rate", "δ": "position_resolution", "b": "force_resolution",
    "K₀": "max_stiffness", "F₀": "bandwidth",
}  # fmt: skip


def side_text(side: float | None, unit: str) -> str:
    """Return a side of an inequality for reading; "–" where it is not known.

    Example:
        >>> side_text(5e-5, "m"), side_text(float("inf"), "N/m"), side_text(None, "Hz")
        ('50 µm', '∞', '–')
    """
    if side is None:
        return NONE
    return INFINITE if side == float("inf") else engineering(side, unit)


def six_table(result: Limits) -> page.Table:
    """Return number, name, condition, both sides, whether it holds, share, and speeds."""
    rows = []
    for limit in result.limits:
        cells: page.Cells = [
            page.Cell(str(limit.number), "l"),
            limit.name,
            limit.inequality,
            side_text(limit.left, limit.unit),
            side_text(limit.right, limit.unit),
            page.holds_cell(limit.holds),
            "" if limit.share is None else percent(limit.share),
            f"needs {', '.join(limit.needs)}" if limit.needs else speeds_text(limit.speeds),
        ]
        style = "bold red" if limit.holds is False else "dim" if limit.holds is None else ""
        rows.append(page.Row(cells, style=style))
    return page.Table(_LIMITS, rows, _NUMBERS)


def shown_waves(result: Limits) -> list[RenderedWave]:
    """Return the waves that a table lists, the longest first."""
    most = sorted(result.waves, key=lambda wave: -wave.share)[:MOST_WAVES]
    return sorted(most, key=lambda wave: -wave.wavelength)


def _waves_table(
    result: Limits, holds: Callable[[bool | None], str | page.Cell], heading: str
) -> page.Table:
    """Return what the shown waves are, their forces, and whether each meets each limit.

    Args:
        result: the limits.
        holds: says that a limit holds.
        heading: of a limit, with its number for {}.
    """
    rows = [
        page.Row(
            [
                engineering(wave.wavelength, "m"),
                engineering(wave.amplitude, "m"),
                percent(wave.share),
                engineering(wave.frequency, "Hz"),
                engineering(wave.force, "N", digits=2),
                *[holds(wave.holds.get(number)) for number in ON_WAVES],
                speeds_text((0.0, wave.top_speed)),
            ]
        )
        for wave in shown_waves(result)
    ]
    headings = (*_WAVES, *(heading.format(number) for number in ON_WAVES), "at speeds")
    return page.Table(headings, rows, numbers=range(len(_WAVES)))


def more_text(result: Limits) -> str:
    """Return how many waves are not listed; empty if all are."""
    more = len(result.waves) - MOST_WAVES
    return f"and {more} more with less of the height variance" if more > 0 else ""


def symbols(result: Limits) -> list[str]:
    """Return what the symbols mean, with the values that went in."""
    device, surface = result.device, result.surface
    known = []
    for symbol, field in _SYMBOLS.items():
        if field not in device.data:
            continue
        datum = device.data[field]
        text = f"1/({datum.text})" if field == "update_rate" else datum.text
        known.append(f"{symbol} = {text}{'' if datum.verified else ' (not verified)'}")
    q = INFINITE if result.gain.value == float("inf") else f"{result.gain.value:.4g}"
    return [
        f"v = {speed_text(result.speed)}, α = {result.time_samples:g}, "
        f"β = {result.position_samples:g}, γ = {result.force_steps:g}; {device.name}: "
        f"{', '.join(known) or 'nothing known'}",
        f"Law {surface.law.letter} at k = {stiffness_text(result)}: "
        f"{result.gain_symbol} = {q} ({result.gain.method})",
    ]


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
    return terminal.table(
        six_table(result),
        wraps=(_NAME, _SPEEDS),
        most={} if wide else {_NAME: 14},
        without=() if wide else (_FOR,),
    )


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
        table = _waves_table(result, lambda holds: holds_text(holds)[0], "{}")
        console.print(terminal.table(table))
    if more_text(result):
        say(console, more_text(result), "dim")
    terminal.print_assumptions(console, result.assumptions)


# --- as a page ------------------------------------------------------------------------------------


def limits_page(result: Limits) -> page.Page:
    """Return the report: answer, limits, picture, waves and assumptions."""
    used = [*dict.fromkeys(limit.uses for limit in result.limits), "friction"]
    return page.Page(
        title=f"Will I feel it? Law {result.surface.law.letter} on {result.device.name}",
        answer=result.answer,
        facts=_facts(result),
        sections=[
            _limits(result),
            _picture(result),
            *_waves(result),
            *page.added_sections(Limits, result),
            *page.assumed(result.assumptions, numbers_table(result.device, used)),
            page.Section("How to read it", [page.Definitions(glossary.LIMITS)]),
        ],
        footer=f"{page.PAPER}, section II.B. {page.UNFELT}",
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
        ("Texture force", f"{amount(result.felt)}: {result.felt.tier}"),
    ]


def _limits(result: Limits) -> page.Section:
    note = (
        "Left and right are those of the wave that comes closest to breaking the limit. “For” is "
        "the share of the height variance in waves that meet it."
    )
    notes = [*symbols(result), note]
    return page.Section("The six limits", [six_table(result)], notes=notes)


def _picture(result: Limits) -> page.Section:
    from asperity.report.pictures.limits_picture import limits_figure

    caption = (
        "Amplitude of the waves that the texture is made of, and the force that each makes, "
        "against wavelength. Left of a dashed line a wave is too short for the device at this "
        "speed; below a dashed line it is too weak. Filled: meets every limit on waves that could "
        "be decided."
    )
    met = sum(all(wave.holds.values()) for wave in result.waves)
    seen = f"{len(result.waves)} waves, of which {met} meet every limit."
    return page.pictured("The waves and their forces", limits_figure(result), seen, caption)


def _waves(result: Limits) -> list[page.Section]:
    if not result.waves:
        return []
    table = _waves_table(result, page.holds_cell, "limit {}")
    more = more_text(result)
    return [page.Section("Wave by wave", [table], notes=[f"{more.capitalize()}."] if more else [])]
