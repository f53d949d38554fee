"""Numbers of a comparison as words, the same in the terminal and in the HTML report."""

from __future__ import annotations

import math

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.units import engineering, rounded_down

INFINITE = "∞"
SAMPLED = "~"
SAMPLED_NOTE = (
    "~ found by sampling, not proved: the true q, q⁺ and leak may be larger, "
    "the true safe stiffness smaller."
)


def number_text(value: float, digits: int = 3) -> str:
    """Return a number for reading.

    Example:
        >>> number_text(5.02548), number_text(math.inf), number_text(1.0), number_text(0.08765)
        ('5.03', '∞', '1', '0.0877')
    """
    if math.isinf(value):
        return INFINITE
    if math.isnan(value):
        return "–"
    if value != 0.0 and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    return f"{float(f'{value:.{digits}g}'):.10g}"


def bound_text(bound: Bound) -> str:
    """Return a number with its pedigree; a sampled one carries a ~.

    Example:
        >>> bound_text(Bound(2.0, math.inf, "sampled")), bound_text(Bound(1.0, 1.0, "theorem"))
        ('~2', '1')
    """
    mark = SAMPLED if is_sampled(bound) else ""
    return f"{mark}{number_text(bound.value)}"


def is_sampled(bound: Bound) -> bool:
    """Return whether nothing proves the number."""
    return bound.method == "sampled" and math.isfinite(bound.value)


def stiffness_text(row: LawRow) -> str:
    """Return the stiffness up to which the device renders the law: "995 N/m", or "none"."""
    if row.safe_stiffness <= 0.0:
        return "none"
    mark = SAMPLED if is_sampled(limiting_number(row)) else ""
    return f"{mark}{engineering(rounded_down(row.safe_stiffness), 'N/m')}"


def limiting_number(row: LawRow) -> Bound:
    """Return the number, q or q⁺, on which the safe stiffness rests."""
    return row.one_sided if "⁺" in row.rule or "+" in row.rule else row.q


def leak_text(row: LawRow, comparison: Comparison) -> str:
    """Return the energy of the worst loop: "0.64 mJ"; "0" where a proof says so.

    All laws are given in one unit, that of the largest, so that a column can be compared.
    """
    leak = row.leak
    if leak.energy == 0.0 and leak.method == "theorem":
        return "0"
    mark = SAMPLED if leak.method == "sampled" else ""
    largest = max(abs(other.leak.worst) for other in comparison.rows)
    unit = engineering(largest, "J", digits=2).split()[-1]
    scale = {"J": 1.0, "mJ": 1e3, "µJ": 1e6, "nJ": 1e9, "pJ": 1e12}.get(unit)
    if scale is None or not math.isfinite(leak.worst):
        return f"{mark}{engineering(leak.worst, 'J', digits=2)}"
    return f"{mark}{float(f'{leak.worst * scale:.2g}'):g} {unit}"


def yes_no(answer: bool) -> str:
    """Return yes or no."""
    return "yes" if answer else "no"


def force_text(value: float) -> str:
    """Return a force for reading: "0.12 N"; "–" where there is none to state."""
    if math.isnan(value):
        return "–"
    return f"{float(f'{value:.2g}'):.10g} N" if value >= 0.01 else engineering(value, "N", digits=2)


def merit_text(value: float) -> str:
    """Return a figure of merit with two digits; "–" where there is none to state."""
    return "–" if math.isnan(value) else number_text(value, digits=2)


def law_title(name: str) -> str:
    """Return the name of a law in words.

    Example:
        >>> law_title("groove-wall-normal")
        'groove wall normal'
    """
    return name.replace("-", " ")


def strength_has_unit(comparison: Comparison) -> bool:
    """Return whether T carries metres: a surface without a period has no l to divide by."""
    return not comparison.texture.scan_line().periodic


def any_sampled(comparison: Comparison) -> bool:
    """Return whether any number of the table carries the ~."""
    return any(
        is_sampled(row.q) or is_sampled(row.one_sided) or row.leak.method == "sampled"
        for row in comparison.rows
    )


def position_text(at: tuple[float, float, float] | None) -> str:
    """Return a position for reading; empty if there is none.

    Example:
        >>> position_text((0.25e-3, 0.0, -1e-3))
        'x = 250 µm, y = 0 m, z = -1 mm'
    """
    if at is None:
        return ""
    parts = zip("xyz", at, strict=True)
    return ", ".join(f"{axis} = {engineering(value, 'm')}" for axis, value in parts)
