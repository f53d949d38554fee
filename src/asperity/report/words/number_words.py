"""Numbers, quantities and places as text, the same in the terminal, on a page and in pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.units import engineering, rounded_down

INFINITE = "∞"
NONE = "–"
SAMPLED = "~"
_PREFIXES = {"": 1.0, "m": 1e3, "µ": 1e6, "n": 1e9, "p": 1e12, "k": 1e-3, "M": 1e-6}


def number_text(value: float, digits: int = 3) -> str:
    """Return a number for reading.

    Example:
        >>> number_text(5.02548), number_text(math.inf), number_text(1.0), number_text(0.08765)
        ('5.03', '∞', '1', '0.0877')
    """
    if math.isinf(value):
        return INFINITE
    if math.isnan(value):
        return NONE
    if value != 0.0 and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    return f"{float(f'{value:.{digits}g}'):.10g}"


def merit_text(value: float) -> str:
    """Return a figure of merit with two digits; "–" where there is none to state."""
    return number_text(value, digits=2)


def force_text(value: float) -> str:
    """Return a force for reading: "0.12 N"; "–" where there is none to state."""
    if math.isnan(value):
        return NONE
    return f"{float(f'{value:.2g}'):.10g} N" if value >= 0.01 else engineering(value, "N", digits=2)


def holds_text(holds: bool | None) -> str:
    """Return yes, no, or ? for what cannot be decided."""
    return "?" if holds is None else "yes" if holds else "no"


def law_title(name: str) -> str:
    """Return the name of a law, or of a field of a device, in words.

    Example:
        >>> law_title("groove-wall-normal"), law_title("update_rate")
        ('groove wall normal', 'update rate')
    """
    return name.replace("-", " ").replace("_", " ")


# --- bounds ---------------------------------------------------------------------------------------


def is_sampled(bound: Bound) -> bool:
    """Return whether nothing proves the number."""
    return bound.method == "sampled" and math.isfinite(bound.value)


def bound_text(bound: Bound) -> str:
    """Return a number with its pedigree; a sampled one carries a ~.

    Example:
        >>> bound_text(Bound(2.0, math.inf, "sampled")), bound_text(Bound(1.0, 1.0, "theorem"))
        ('~2', '1')
    """
    mark = SAMPLED if is_sampled(bound) else ""
    return f"{mark}{number_text(bound.value)}"


def down_text(value: float, digits: int = 6) -> str:
    """Return a number with so many digits that is never above it: a lower bound stays one.

    Example:
        >>> down_text(31.58279), down_text(0.9999999999999997), down_text(float("inf"))
        ('31.5827', '1', '∞')
    """
    return _outward(value, digits, ROUND_FLOOR)


def up_text(value: float, digits: int = 6) -> str:
    """Return a number with so many digits that is never below it: an upper bound stays one.

    Example:
        >>> up_text(31.58271), up_text(1.0), up_text(8.0464e-4, 3)
        ('31.5828', '1', '0.000805')
    """
    return _outward(value, digits, ROUND_CEILING)


def _outward(value: float, digits: int, rounding: str) -> str:
    if math.isinf(value):
        return INFINITE if value > 0.0 else f"−{INFINITE}"
    # Thirteen digits first: the rounding of a double is no reason to move a bound by a digit.
    plain = Decimal(f"{value:.12e}")
    rounded = Context(prec=digits, rounding=rounding).create_decimal(plain)
    text = f"{rounded:f}" if 1e-5 <= abs(value) < 1e7 or value == 0.0 else f"{rounded:e}"
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text.lower() else text


def limit_text(stiffness: float | None) -> str:
    """Return a greatest stiffness, rounded down; "–" where none is known.

    Example:
        >>> limit_text(975.6), limit_text(math.inf), limit_text(None)
        ('975 N/m', '∞', '–')
    """
    if stiffness is None:
        return NONE
    return INFINITE if math.isinf(stiffness) else f"{rounded_down(stiffness):.10g} N/m"


def interval_text(bound: Bound) -> str:
    """Return a number with both its ends, rounded outwards.

    Example:
        >>> interval_text(Bound(5.12503, 5.12511, "certified"))
        '5.12503 to 5.12511'
        >>> interval_text(Bound(1, 1, "theorem")), interval_text(Bound(2.0, math.inf, "sampled"))
        ('1', '~2')
    """
    low, high = down_text(bound.lower), up_text(bound.upper)
    if low == high:
        return low
    if math.isinf(bound.upper):
        return f"{SAMPLED}{low}"
    return f"{low} to {high}"


# --- quantities in one unit -----------------------------------------------------------------------


def _unit_of(value: float, unit: str) -> tuple[str, float]:
    """Return the prefixed unit in which a quantity is read, and how many of it are one SI unit."""
    name = engineering(value, unit).split()[1]
    return name, _PREFIXES[name.removesuffix(unit)]


def in_one_unit(values: Sequence[float], unit: str, digits: int = 3) -> list[str]:
    """Return quantities in the unit of the largest, so that they can be compared.

    Example:
        >>> in_one_unit([0.25, 1.5e-3], "m")
        ['250 mm', '1.5 mm']
    """
    name, scale = _unit_of(max((abs(v) for v in values), default=0.0), unit)
    return [f"{float(f'{value * scale:.{digits}g}'):.10g} {name}" for value in values]


def span_text(low: float, high: float, unit: str, digits: int = 5) -> str:
    """Return a quantity between two bounds, in one unit, rounded outwards.

    Example:
        >>> span_text(8.0464e-4, 8.0493e-4, "J"), span_text(0.0, 0.0, "J")
        ('0.80464 to 0.80493 mJ', '0 J')
        >>> span_text(4.9116e-3, math.inf, "J")
        'at least 4.9116 mJ'
    """
    known = high if math.isfinite(high) else low
    if known == 0.0:
        return f"0 {unit}"
    name, scale = _unit_of(known, unit)
    lower, upper = down_text(low * scale, digits), up_text(high * scale, digits)
    if math.isinf(high):
        return f"at least {lower} {name}"
    return f"{lower} {name}" if lower == upper else f"{lower} to {upper} {name}"


def leak_text(row: LawRow, comparison: Comparison) -> str:
    """Return the energy of the worst loop: "0.64 mJ"; "0" where a proof says so.

    All laws are given in one unit, that of the largest, so that a column can be compared.
    """
    leak = row.leak
    if leak.energy == 0.0 and leak.method == "theorem":
        return "0"
    mark = SAMPLED if leak.method == "sampled" else ""
    energies = [leak.worst_per_period, *(other.leak.worst_per_period for other in comparison.rows)]
    return f"{mark}{in_one_unit(energies, 'J', digits=2)[0]}"


def strength_has_unit(comparison: Comparison) -> bool:
    """Return whether T carries metres: a surface without a period has no l to divide by."""
    return not comparison.texture.scan_line().periodic


# --- places ---------------------------------------------------------------------------------------


def place_text(at: tuple[float, float, float] | None) -> str:
    """Return a position in one unit.

    Example:
        >>> place_text((-0.25e-3, -0.0, -1.8e-3)), place_text(None)
        ('(-0.25, 0, -1.8) mm', '–')
    """
    if at is None:
        return NONE
    largest = max(abs(value) for value in at)
    unit, scale = ("mm", 1e3) if largest >= 1e-4 else ("µm", 1e6)
    return f"({', '.join(f'{value * scale + 0.0:.6g}' for value in at)}) {unit}"


def witness_text(bound: Bound) -> str:
    """Return where the lower end is attained, with the state of an anchor; or the onset of ∞.

    Example:
        >>> witness_text(Bound(math.inf, math.inf, "certified", (0.0, 0.0, 1e-3)))
        'onset (0, 0, 1) mm'
    """
    onset = "onset " if math.isinf(bound.lower) and bound.at is not None else ""
    if bound.deflection is None:
        return f"{onset}{place_text(bound.at)}"
    x, y = (f"{1e3 * part + 0.0:.6g}" for part in bound.deflection)
    state = f"deflection ({x}, {y}) mm, {'sliding' if bound.sliding else 'sticking'}"
    return f"{onset}{place_text(bound.at)}, {state}"
