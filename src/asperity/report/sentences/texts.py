"""Texts of the pages, read from ``texts.toml``; numbers, quantities and positions as text."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from functools import lru_cache
from importlib import resources
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import EnergyBalance, Leak
from asperity.analysis.energy.straight_scan import FrictionScan
from asperity.analysis.results.compare import Comparison
from asperity.core.units import format_quantity, round_down


@lru_cache(maxsize=1)
def _load_texts() -> dict[str, Any]:
    return tomllib.loads(
        resources.files("asperity.report").joinpath("texts.toml").read_text("utf-8")
    )


def sentence(name: str, **values: object) -> str:
    """Return a sentence by its name in ``texts.toml``, with values for the names in braces."""
    text: str = _load_texts()["sentences"][name]
    return text.format(**values)


def glossary(result: str) -> list[tuple[str, str]]:
    """Return terms and definitions for a kind of result: "comparison", "analysis" or "limits"."""
    return list(_load_texts()["glossary"][result].items())


def column_meanings(table: str) -> list[tuple[str, str]]:
    """Return headings and meanings of the columns of a table, "laws", "limits" or "cases"."""
    return list(_load_texts()["columns"][table].items())


def table_notes(table: str) -> list[str]:
    """Return the notes of a table or page, by their name in ``texts.toml``."""
    return list(_load_texts()["notes"][table])


def figure_text(name: str, **values: object) -> tuple[str, str, str]:
    """Return title, caption and description of a figure.

    Args:
        name: of its report and of the figure, "comparison.force".
        values: that replace the names in braces.

    Returns:
        The texts; the description is empty where it is more than a sentence with values.
    """
    report, figure = name.split(".")
    text = _load_texts()["figures"][report][figure]
    description = text.get("description", "")
    return text["title"], text["caption"].format(**values), description.format(**values)


def sentence_case(name: str) -> str:
    """Return a name with a capital letter, for the beginning of a sentence or of a title."""
    return f"{name[:1].upper()}{name[1:]}"


INFINITY_SIGN = "∞"
NOT_AVAILABLE = "–"
SAMPLED_MARK = "~"
_ENERGY_DIGITS = ((0, 1.0), (1, 0.1), (2, 1e-4))  # decimal places [mJ], and from which energy [J]
_PREFIXES = {"": 1.0, "m": 1e3, "µ": 1e6, "n": 1e9, "p": 1e12, "k": 1e-3, "M": 1e-6}


def number_text(value: float, digits: int = 3) -> str:
    """Return a number as text.

    Example:
        >>> number_text(5.02548), number_text(math.inf), number_text(1.0), number_text(0.08765)
        ('5.03', '∞', '1', '0.0877')
    """
    if math.isinf(value):
        return INFINITY_SIGN
    if math.isnan(value):
        return NOT_AVAILABLE
    if value != 0.0 and not 1e-4 <= abs(value) < 1e5:
        return f"{value:.{digits - 1}e}"
    return f"{float(f'{value:.{digits}g}'):.10g}"


def merit_text(value: float) -> str:
    """Return a figure of merit with two digits; "–" for none."""
    return number_text(value, digits=2)


FRICTION_PROOF = "friction takes energy from the hand on every closed path, proved"


def balance_text(balance: EnergyBalance) -> str:
    """Return the answer to whether a surface is conservative.

    Example:
        >>> balance_text("conservative"), balance_text("dissipative"), balance_text("leaking")
        ('yes', 'dissipative', 'no')
    """
    return {"conservative": "yes", "leaking": "no"}.get(balance, balance)


def friction_force_text(scan: FrictionScan) -> str:
    """Return how great friction is on a scan, how it varies, and what κ leaves of that.

    Example:
        >>> friction_force_text(FrictionScan(0.05, 0.0121, 0.79))
        'friction of 50 mN varies by 12 mN RMS, 79 % of what its limit does'
    """
    mean, ripple = format_in_one_unit([scan.mean, scan.ripple], "N", digits=2)
    if scan.ripple < 1e-3 * scan.mean:
        return f"constant friction of {mean}"
    remaining = f"{100.0 * scan.remaining:.0f} % of what its limit does"
    return f"friction of {mean} varies by {ripple} RMS, {remaining}"


def yes_no_text(holds: bool | None) -> str:
    """Return yes, no, or ? for an undecidable condition."""
    if holds is None:
        return "?"
    return "yes" if holds else "no"


def readable_name(name: str) -> str:
    """Return the name of a law, or of a field of a device, with spaces.

    Example:
        >>> readable_name("groove-wall-normal"), readable_name("update_rate")
        ('groove wall normal', 'update rate')
    """
    return name.replace("-", " ").replace("_", " ")


# --- bounds ---------------------------------------------------------------------------------------


def is_sampled(bound: Bound) -> bool:
    """Return whether a number is sampled, not proved."""
    return bound.method == "sampled" and math.isfinite(bound.value)


def bound_text(bound: Bound) -> str:
    """Return a number, a sampled one marked with ~.

    Example:
        >>> bound_text(Bound(2.0, math.inf, "sampled")), bound_text(Bound(1.0, 1.0, "theorem"))
        ('~2', '1')
    """
    mark = SAMPLED_MARK if is_sampled(bound) else ""
    return f"{mark}{number_text(bound.value)}"


def lower_bound_text(value: float, digits: int = 6) -> str:
    """Return a lower bound rounded down to a number of digits.

    Example:
        >>> [lower_bound_text(value) for value in (31.58279, 0.9999999999999997, math.inf)]
        ['31.5827', '1', '∞']
    """
    return _round_outward(value, digits, ROUND_FLOOR)


def upper_bound_text(value: float, digits: int = 6) -> str:
    """Return an upper bound rounded up to a number of digits.

    Example:
        >>> upper_bound_text(31.58271), upper_bound_text(1.0), upper_bound_text(8.0464e-4, 3)
        ('31.5828', '1', '0.000805')
    """
    return _round_outward(value, digits, ROUND_CEILING)


def _round_outward(value: float, digits: int, rounding: str) -> str:
    if value == math.inf:
        return INFINITY_SIGN
    if value == -math.inf:
        return f"−{INFINITY_SIGN}"
    # Thirteen digits first, so that the rounding of a double does not change a digit.
    plain = Decimal(f"{value:.12e}")
    rounded = Context(prec=digits, rounding=rounding).create_decimal(plain)
    if value != 0.0 and not 1e-5 <= abs(value) < 1e7:
        return f"{rounded:e}"
    text = f"{rounded:f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def limit_text(stiffness: float | None) -> str:
    """Return a greatest stiffness, rounded down; "–" for none.

    Example:
        >>> limit_text(975.6), limit_text(math.inf), limit_text(None)
        ('975 N/m', '∞', '–')
    """
    if stiffness is None:
        return NOT_AVAILABLE
    if math.isinf(stiffness):
        return INFINITY_SIGN
    return f"{round_down(stiffness):.10g} N/m"


def margin_text(margin: float | None) -> str:
    """Return a margin rounded down; "–" for none."""
    if margin is None:
        return NOT_AVAILABLE
    return lower_bound_text(margin, 3)


def interval_text(bound: Bound) -> str:
    """Return a number with both bounds, rounded outwards.

    Example:
        >>> interval_text(Bound(5.12503, 5.12511, "certified"))
        '5.12503 to 5.12511'
        >>> interval_text(Bound(1, 1, "theorem")), interval_text(Bound(2.0, math.inf, "sampled"))
        ('1', '~2')
    """
    low = lower_bound_text(bound.lower)
    high = upper_bound_text(bound.upper)
    if low == high:
        return low
    if math.isinf(bound.upper):
        return f"{SAMPLED_MARK}{low}"
    return f"{low} to {high}"


# --- quantities in one unit -----------------------------------------------------------------------


def _choose_unit(value: float, unit: str) -> tuple[str, float]:
    """Return the best prefixed unit of a quantity, and its number per SI unit."""
    name = format_quantity(value, unit).split()[1]
    return name, _PREFIXES[name.removesuffix(unit)]


def format_in_one_unit(values: Sequence[float], unit: str, digits: int = 3) -> list[str]:
    """Return quantities in the unit of the largest, for comparison.

    Example:
        >>> format_in_one_unit([0.25, 1.5e-3], "m")
        ['250 mm', '1.5 mm']
    """
    name, scale = _choose_unit(max([abs(v) for v in values], default=0.0), unit)
    return [f"{float(f'{value * scale:.{digits}g}'):.10g} {name}" for value in values]


def range_text(low: float, high: float, unit: str, digits: int = 5) -> str:
    """Return a quantity between two bounds, in one unit, rounded outwards.

    Example:
        >>> range_text(8.0464e-4, 8.0493e-4, "J"), range_text(0.0, 0.0, "J")
        ('0.80464 to 0.80493 mJ', '0 J')
        >>> range_text(4.9116e-3, math.inf, "J")
        'at least 4.9116 mJ'
    """
    size = high if math.isfinite(high) else low
    if size == 0.0:
        return f"0 {unit}"
    name, scale = _choose_unit(size, unit)
    lower = lower_bound_text(low * scale, digits)
    upper = upper_bound_text(high * scale, digits)
    if math.isinf(high):
        return f"at least {lower} {name}"
    return f"{lower} {name}" if lower == upper else f"{lower} to {upper} {name}"


def leak_text(leak: Leak) -> str:
    """Return the energy of the worst loop: "147 µJ"; "0" if proved, "–" if unknown."""
    if leak.energy == 0.0 and leak.method == "theorem":
        return "0"
    if math.isnan(leak.energy):
        return NOT_AVAILABLE
    mark = SAMPLED_MARK if leak.method == "sampled" else ""
    return f"{mark}{format_quantity(leak.worst_per_period, 'J')}"


def strength_has_unit(comparison: Comparison) -> bool:
    """Return whether T is in metres, as for a surface without a period."""
    return not comparison.texture.scan_line().periodic


# --- positions ------------------------------------------------------------------------------------


def position_text(point: tuple[float, float, float] | None) -> str:
    """Return a position in one unit.

    Example:
        >>> position_text((-0.25e-3, -0.0, -1.8e-3)), position_text(None)
        ('(-0.25, 0, -1.8) mm', '–')
    """
    if point is None:
        return NOT_AVAILABLE
    unit = "µm"
    scale = 1e6
    if max(map(abs, point)) >= 1e-4:
        unit = "mm"
        scale = 1e3
    return f"({', '.join([f'{value * scale + 0.0:.6g}' for value in point])}) {unit}"


def witness_text(bound: Bound) -> str:
    """Return the point that attains the lower bound, with its state, or the onset of ∞.

    Example:
        >>> witness_text(Bound(math.inf, math.inf, "certified", (0.0, 0.0, 1e-3)))
        'onset (0, 0, 1) mm'
    """
    place = position_text(bound.at)
    if math.isinf(bound.lower) and bound.at is not None:
        place = f"onset {place}"
    if bound.deflection is None:
        return place
    deflection = ", ".join([f"{1e3 * part + 0.0:.6g}" for part in bound.deflection])
    phase = "sliding" if bound.sliding else "sticking"
    return f"{place}, deflection ({deflection}) mm, {phase}"


def energy_text(value: float) -> str:
    """Return an energy with its sign: "+2.97 mJ"."""
    if value == 0.0:
        return "0 J"
    if not math.isfinite(value):
        return "not finite"
    text = format_quantity(abs(value), "J", digits=3)
    return f"{'+' if value > 0.0 else '-'}{text}"


def loss_text(gain: float) -> str:
    """Return a gain as a loss in whole decibels.

    Example:
        >>> loss_text(0.5), loss_text(1.0), loss_text(1.3)
        ('6 dB less', 'as much', '2 dB more')
    """
    level = round(20.0 * math.log10(max(gain, 1e-6)))
    if not level:
        return "as much"
    return f"{abs(level)} dB {'less' if level < 0 else 'more'}"


def millijoules(value: float, *, signed: bool = True) -> str:
    """Return an energy [J] as text in mJ."""
    # Fewer decimal places for greater energies.
    digits = next((places for places, least in _ENERGY_DIGITS if abs(value) >= least), 4)
    sign = "+" if signed else ""
    text = f"{1e3 * value:{sign}.{digits}f}"
    return text if text.strip("+-0.") else "0"


def decimal_text(value: float) -> str:
    """Return three significant digits, without an exponent if six decimal places suffice.

    Example:
        >>> [decimal_text(value) for value in (1234.5, 12.345, -0.0012345, 1e-9, 0.0)]
        ['1234', '12.3', '-0.00123', '1e-09', '0']
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    places = max(0, 2 - math.floor(math.log10(abs(value))))
    return f"{value:.{places}f}" if places <= 6 else f"{value:.0e}"


def side_text(side: float | None, unit: str) -> str:
    """Return one side of an inequality as text; "–" if it is unknown.

    Example:
        >>> side_text(5e-5, "m"), side_text(float("inf"), "N/m"), side_text(None, "Hz")
        ('50 µm', '∞', '–')
    """
    if side is None:
        return NOT_AVAILABLE
    if math.isinf(side):
        return INFINITY_SIGN
    return format_quantity(side, unit)
