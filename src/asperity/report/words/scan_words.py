"""The energy of strokes in words."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from asperity.simulation.scan import Stroke
from asperity.units import engineering

HEADINGS = ("law", "speed", "depth", "x", "y", "z", "sum", "field", "±", "paper's", "lost")
NOTES = (
    "Energies in mJ per stroke: work of the held force on the true motion, mean over whole "
    "turns, there and back, after the first stroke; positive feeds the hand. Field: what the law "
    "itself gives along the true path, without sampling, delay and steps of the encoder, which "
    "make up the rest; ±: from turn to turn, and of its quadrature. Paper's: its sum of force and "
    "step of the same sample. Depth: of the handle below z = 0, on average. Lost: how often per "
    "stroke contact ended.",
)


def milli(value: float, *, sign: bool = True) -> str:
    """Return an energy [J] as text in mJ."""
    size = abs(value)
    digits = 0 if size >= 1.0 else 1 if size >= 0.1 else 2 if size >= 1e-4 else 4
    text = f"{1e3 * value:+.{digits}f}" if sign else f"{1e3 * value:.{digits}f}"
    return "0" if not text.strip("+-0.") else text


def cells(stroke: Stroke) -> list[str]:
    """Return the texts of a row."""
    place = [
        stroke.law, engineering(stroke.speed, "m/s"), engineering(stroke.reached, "m", digits=2),
    ]  # fmt: skip
    if stroke.stopped:
        return [*place, "", "", "", "stopped", "", "", "", ""]
    return [
        *place,
        *[milli(value) for value in stroke.energy],
        milli(stroke.total),
        milli(stroke.field),
        milli(stroke.spread + stroke.error, sign=False),
        milli(stroke.same_sample),
        f"{stroke.lost_contact:.3g}",
    ]


def answer(found: Sequence[Stroke]) -> str:
    """Return which laws feed the hand, and which do so by their field, in two sentences."""
    by_all = _grouped(found, lambda stroke: stroke.total > stroke.spread + stroke.error)
    by_field = _grouped(found, lambda stroke: stroke.feeds)
    return f"A stroke feeds the hand: {by_all}. The law's field itself feeds it: {by_field}."


def _grouped(found: Sequence[Stroke], feeds: Callable[[Stroke], bool]) -> str:
    laws = list(dict.fromkeys(stroke.law for stroke in found))
    groups: dict[str, list[str]] = {"always": [], "at times": [], "never": []}
    for law in laws:
        gains = [feeds(stroke) for stroke in found if stroke.law == law]
        groups["always" if all(gains) else "at times" if any(gains) else "never"].append(law)
    return ", ".join(f"{', '.join(laws)} {when}" for when, laws in groups.items() if laws)
