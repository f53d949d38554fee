"""The six limits in a terminal."""

from __future__ import annotations

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from asperity.analysis.limits.limit_result import Limits, RenderedWave
from asperity.analysis.limits.limit_rules import RULES, Limit
from asperity.analysis.limits.limit_words import percent, speed_text, speeds_text, stiffness_text
from asperity.units import engineering

MOST_WAVES = 16
"""Waves that a table lists: those that carry most of the heights."""

_NAMES_FROM = 96
"""Console width [characters] from which the limits' names are not broken."""

ON_WAVES = tuple(rule.number for rule in RULES if rule.number != 5)


def side_text(side: float | None, unit: str) -> str:
    """Return a side of an inequality for reading; "–" where it is not known.

    Example:
        >>> side_text(5e-5, "m"), side_text(float("inf"), "N/m"), side_text(None, "Hz")
        ('50 µm', '∞', '–')
    """
    if side is None:
        return "–"
    return "∞" if side == float("inf") else engineering(side, unit)


def holds_text(holds: bool | None) -> str:
    """Return yes, no, or ? for what cannot be decided."""
    return "?" if holds is None else "yes" if holds else "no"


def allows_text(limit: Limit) -> str:
    """Return the speeds that a limit allows, or what it needs to be decided."""
    return f"needs {', '.join(limit.needs)}" if limit.needs else speeds_text(limit.speeds)


def share_text(limit: Limit) -> str:
    """Return the share of the height variance that meets a limit; empty where it has none."""
    return "" if limit.share is None else percent(limit.share)


def _plain_table() -> Table:
    return Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False, pad_edge=False)


def limits_table(result: Limits, width: int = 100) -> Table:
    """Return one row per limit, the first column its number in the paper alone.

    Args:
        result: the limits.
        width: of the console in characters; names are broken on a narrow one.

    Returns:
        A Rich table.
    """
    table = _plain_table()
    table.add_column("", no_wrap=True)
    wide = width >= _NAMES_FROM
    table.add_column("limit", max_width=None if wide else 14)
    table.add_column("condition", no_wrap=True)
    table.add_column("left", justify="right", no_wrap=True)
    table.add_column("right", justify="right", no_wrap=True)
    table.add_column("holds", no_wrap=True)
    if wide:
        table.add_column("for", justify="right", no_wrap=True)
    table.add_column("at speeds")
    for limit in result.limits:
        cells = [
            str(limit.number),
            limit.name,
            limit.inequality,
            side_text(limit.left, limit.unit),
            side_text(limit.right, limit.unit),
            holds_text(limit.holds),
            *([share_text(limit)] if wide else []),
            allows_text(limit),
        ]
        style = "bold red" if limit.holds is False else "dim" if limit.holds is None else ""
        table.add_row(*[Text(cell) for cell in cells], style=style)
    return table


def shown_waves(result: Limits) -> list[RenderedWave]:
    """Return the waves that a table lists, the longest first."""
    most = sorted(result.waves, key=lambda wave: -wave.share)[:MOST_WAVES]
    return sorted(most, key=lambda wave: -wave.wavelength)


def waves_table(result: Limits) -> Table:
    """Return one row per wave: what it is, its force, and whether it meets each limit (y, n, ?)."""
    table = _plain_table()
    for heading in ("wavelength", "amplitude", "share", "frequency", "force"):
        table.add_column(heading, justify="right", no_wrap=True)
    for number in ON_WAVES:
        table.add_column(str(number), no_wrap=True)
    table.add_column("at speeds", no_wrap=True)
    for wave in shown_waves(result):
        cells = [
            engineering(wave.wavelength, "m"),
            engineering(wave.amplitude, "m"),
            percent(wave.share),
            engineering(wave.frequency, "Hz"),
            engineering(wave.force, "N", digits=2),
            *[holds_text(wave.holds.get(number))[0] for number in ON_WAVES],
            speeds_text((0.0, wave.top_speed)),
        ]
        table.add_row(*[Text(cell) for cell in cells])
    return table


def print_limits(result: Limits, console: Console) -> None:
    """Print the answer, the limits, the waves and what was assumed.

    Args:
        result: the limits.
        console: where to; its width decides about the columns.
    """
    console.print(Text(result.answer, style="bold"))
    console.print()
    console.print(limits_table(result, console.width))
    console.print()
    for line in caption(result):
        console.print(Text(line, style="dim"))
    if result.waves:
        console.print()
        console.print(waves_table(result))
        more = len(result.waves) - MOST_WAVES
        if more > 0:
            console.print(Text(f"and {more} more with less of the height variance", style="dim"))
    console.print()
    console.print(Text("Assumed:", style="bold"))
    listed = Table.grid(padding=(0, 1, 0, 0))
    for sentence in result.assumptions:
        listed.add_row(Text("-"), Text(sentence))
    console.print(listed)


def caption(result: Limits) -> list[str]:
    """Return what the symbols mean, with the values that went in."""
    device, surface = result.device, result.surface
    symbols = {
        "T": "update_rate",
        "δ": "position_resolution",
        "b": "force_resolution",
        "K₀": "max_stiffness",
        "F₀": "bandwidth",
    }
    known = []
    for symbol, field in symbols.items():
        if field not in device.data:
            continue
        datum = device.data[field]
        text = f"1/({datum.text})" if symbol == "T" else datum.text
        known.append(f"{symbol} = {text}{'' if datum.verified else ' (not verified)'}")
    q = "∞" if result.gain.value == float("inf") else f"{result.gain.value:.4g}"
    return [
        f"v = {speed_text(result.speed)}, α = {result.time_samples:g}, "
        f"β = {result.position_samples:g}, γ = {result.force_steps:g}; {device.name}: "
        f"{', '.join(known) or 'nothing known'}",
        f"Law {surface.law.letter} at k = {stiffness_text(result)}: "
        f"{result.gain_symbol} = {q} ({result.gain.method})",
        "Left and right: of the wave that comes closest to breaking the limit; "
        "for: share of the height variance in waves that meet it",
    ]
