"""What the six limits say, in words."""

from __future__ import annotations

from asperity.analysis.limits.limit_result import Limits, RenderedWave
from asperity.analysis.limits.limit_rules import RULES, Limit
from asperity.analysis.words.limits import percent, speed_text, speeds_text, stiffness_text
from asperity.report.words.number_words import INFINITE, NONE, holds_text
from asperity.units import engineering

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


def limit_cells(limit: Limit) -> list[str]:
    """Return number, name, condition, both sides, whether it holds, share, and speeds."""
    return [
        str(limit.number),
        limit.name,
        limit.inequality,
        side_text(limit.left, limit.unit),
        side_text(limit.right, limit.unit),
        holds_text(limit.holds),
        "" if limit.share is None else percent(limit.share),
        f"needs {', '.join(limit.needs)}" if limit.needs else speeds_text(limit.speeds),
    ]


def wave_cells(wave: RenderedWave) -> list[str]:
    """Return wavelength, amplitude, share of the height variance, frequency, force, and speeds."""
    return [
        engineering(wave.wavelength, "m"),
        engineering(wave.amplitude, "m"),
        percent(wave.share),
        engineering(wave.frequency, "Hz"),
        engineering(wave.force, "N", digits=2),
        speeds_text((0.0, wave.top_speed)),
    ]


def shown_waves(result: Limits) -> list[RenderedWave]:
    """Return the waves that a table lists, the longest first."""
    most = sorted(result.waves, key=lambda wave: -wave.share)[:MOST_WAVES]
    return sorted(most, key=lambda wave: -wave.wavelength)


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
