"""Conversion between quantities as text, such as "0.8 mm", and SI values.

A quantity with a dimension requires a unit, since a bare number is ambiguous.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from asperity.core.errors import ParameterError

if TYPE_CHECKING:
    import pint

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
# A unit is a sequence of names with small integer powers, joined by *, / or a space.
_UNIT_FACTOR_PATTERN = r"[^\W\d_]+(?:\s*(?:\^|\*\*)\s*[+-]?[1-9]|⁻?[¹²³])?|[°%]"
_UNIT_PATTERN = re.compile(
    rf"(?:1\s*/\s*)?(?:{_UNIT_FACTOR_PATTERN})(?:\s*[*/·\s]\s*(?:{_UNIT_FACTOR_PATTERN}))*"
)
_MAX_UNIT_LENGTH = 64
# Units suggested in messages, by SI unit, most common first; default: the SI unit.
_COMMON_UNITS = {
    "m": ("mm", "um", "m"),
    "rad": ("deg", "rad"),
    "rad/m": ("rad/mm", "rad/m"),
    "s": ("s", "ms"),
    "kg": ("g", "kg"),
    "N": ("N", "mN"),
    "B": ("MB", "GB"),
}
# SI values of common units, by SI unit, so that pint is imported for other units only.
_SI_FACTORS = {
    "m": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "nm": 1e-9, "cm": 1e-2},
    "rad": {"rad": 1.0},
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "kg": {"kg": 1.0, "g": 1e-3},
    "N": {"N": 1.0, "mN": 1e-3},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "N/m": {"N/m": 1.0, "N/mm": 1e3, "kN/m": 1e3},
    "N*s/m": {"N*s/m": 1.0, "N s/m": 1.0},
    "N s/m": {"N*s/m": 1.0, "N s/m": 1.0},
    "N*m*s": {"N*m*s": 1.0, "mN*m*s": 1e-3},
    "m/s": {"m/s": 1.0, "mm/s": 1e-3, "cm/s": 1e-2},
    "rad/m": {"rad/m": 1.0, "rad/mm": 1e3},
    "B": {"B": 1.0, "kB": 1e3, "MB": 1e6, "GB": 1e9},
}


@lru_cache(maxsize=1)
def _unit_registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def parse_quantity(name: str, value: str | float, unit: str) -> float:
    """Return a quantity in SI units.

    Args:
        name: name of the argument, for the error message.
        value: a number with a unit, "500N/m" or "500 N/m"; zero needs no unit.
        unit: the SI unit, such as "m", "N/m" or "rad"; "" for a number without unit.

    Raises:
        ParameterError: for a value that is not a finite quantity of that dimension, or for a
            number without its unit.

    Example:
        >>> parse_quantity("period", "1.5 mm", "m"), parse_quantity("stiffness", "0.5N/mm", "N/m")
        (0.0015, 500.0)
        >>> parse_quantity("stiffness", "500", "N/m")
        Traceback (most recent call last):
        ...
        asperity.core.errors.ParameterError: stiffness needs a unit: write 500N/m, got '500'
    """
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise ParameterError(name, _requirement(unit), value)
    number = _parse_number(value)
    bare = number is not None
    if number is None:
        number = _parse_with_unit(name, str(value), unit)
    if not math.isfinite(number):
        shown = value if isinstance(value, str) else number  # an int may have too many digits
        raise ParameterError(name, f"must be finite; {_requirement(unit)}", shown)
    if bare and unit and number != 0.0:
        raise ParameterError(name, f"needs a unit: write {_with_common_units(value, unit)}", value)
    return number


def parse_size(name: str, value: object) -> int:
    """Return a size of memory [bytes].

    Raises:
        ParameterError: for a value that is not a size, or has no unit.

    Example:
        >>> parse_size("memory", "4 GB"), parse_size("memory", "2GiB"), parse_size("memory", "0")
        (4000000000, 2147483648, 0)
    """
    match = re.fullmatch(r"\s*(\d{1,15}(?:\.\d{1,6})?)\s*([kMGT]?)(i?)(B?)\s*", str(value))
    if match is None:
        raise ParameterError(name, "must be a size such as '4GB', '500MB' or '2GiB'", value)
    number, prefix, binary, byte = match.groups()
    if not prefix + byte:
        parse_quantity(name, number, "B")
    base = 1024.0 if binary else 1000.0
    return int(float(number) * base ** " kMGT".index(prefix or " "))


def _with_common_units(number: str | float, unit: str) -> str:
    written = str(number).strip()
    return " or ".join([f"{written}{usual}" for usual in _COMMON_UNITS.get(unit, (unit,))])


def _requirement(unit: str) -> str:
    if not unit:
        return "must be a number"
    return f"must be a quantity such as '1.5 {unit}'"


def _parse_number(text: str | float) -> float | None:
    try:
        return float(text)
    except OverflowError:  # an int beyond the largest float
        return math.inf
    except ValueError:
        return None


def _parse_with_unit(name: str, text: str, unit: str) -> float:
    match = _NUMBER.match(text.strip())
    if match is None or not unit:
        raise ParameterError(name, f"{_requirement(unit)}{_correction(text[:80], unit)}", text)
    unit_text = text.strip()[match.end() :].strip()
    try:
        return _scale(match.group(), _find_unit_factor(unit_text, unit))
    except ValueError as error:
        reason = f"the unit {error}{_correction(text[:80], unit)}"
        raise ParameterError(name, f"{_requirement(unit)}; {reason}", text) from None


def _correction(text: str, unit: str) -> str:
    """Return how to write a list, a decimal comma or the case of a unit; empty for no hint."""
    if re.search(r"\d\S*\s+\d", text):
        return "; several values are separated by commas or semicolons"
    if re.fullmatch(r"\s*\d+,\d+[^\d,]*", text):
        return f"; with a decimal point {text.replace(',', '.')}"
    written = _NUMBER.sub("", text.strip(), count=1).strip()
    spellings = {name.lower(): name for name in _SI_FACTORS.get(unit, ())}
    if written.lower() not in spellings:
        return ""
    return f"; write {text.replace(written, spellings[written.lower()])}"


@lru_cache(maxsize=1024)
def _find_unit_factor(unit_text: str, unit: str) -> float:
    """Return the SI value of a unit; for an invalid one the message of the error is the reason."""
    known: float | None = _SI_FACTORS.get(unit, {}).get(unit_text)
    if known is not None:
        return known
    if len(unit_text) > _MAX_UNIT_LENGTH or _UNIT_PATTERN.fullmatch(unit_text) is None:
        raise ValueError("is not understood")
    import pint

    try:
        # See _scale: 0.8 mm is 0.0008, not 0.8 * 0.001.
        return float(_unit_registry().Quantity(1.0, unit_text).to(unit).magnitude)
    except pint.DimensionalityError:
        raise ValueError("is of another dimension") from None
    except Exception:  # pint also raises errors of its tokenizer
        raise ValueError("is not understood") from None


def _scale(number: str, factor: float) -> float:
    """Return number · factor, correctly rounded if the factor is a power of ten."""
    if factor <= 0.0:
        return float(number) * factor
    exponent = round(math.log10(factor))
    if abs(factor / 10.0**exponent - 1.0) < 1e-15:
        mantissa, _, power = number.lower().partition("e")
        if len(power) < 20:  # longer exponents give zero or infinity for any factor
            return float(f"{mantissa}e{int(power or 0) + exponent}")
    return float(number) * factor


_PREFIXES = {0: "", -3: "m", -6: "µ", -9: "n", -12: "p", 3: "k", 6: "M"}


def format_quantity(value: float, unit: str, digits: int = 3) -> str:
    """Return a quantity as text with an SI prefix.

    Example:
        >>> format_quantity(0.0008, "m"), format_quantity(5000.0, "N/m"), format_quantity(0.0, "J")
        ('0.8 mm', '5000 N/m', '0 J')
        >>> format_quantity(0.7, "1")
        '0.7'
    """
    if unit in {"", "1"}:
        return f"{value:g}"
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    # Stiffnesses are given in N/m at any magnitude.
    if "/" in unit and abs(value) >= 1.0:
        return f"{float(f'{value:.{digits}g}'):.10g} {unit}"
    exponent = 3 * math.floor((math.log10(abs(value)) + 1e-12 + 0.1) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    return f"{float(f'{value / 10.0**exponent:.{digits}g}'):.10g} {_PREFIXES[exponent]}{unit}"


def count_text(count: float, noun: str) -> str:
    """Return a number of things.

    Example:
        >>> count_text(1, "law"), count_text(3, "law"), count_text(0.5, "sample")
        ('1 law', '3 laws', '0.5 samples')
    """
    return f"{count:.10g} {noun}" if count == 1 else f"{count:.10g} {noun}s"


def format_stiffness(stiffness: float) -> str:
    """Return a stiffness as it was typed or computed, neither prefixed nor rounded for display.

    Example:
        >>> format_stiffness(219.7), format_stiffness(1480.0)
        ('219.7 N/m', '1480 N/m')
    """
    return format_quantity(stiffness, "N/m", digits=6)


def round_down(value: float, digits: int = 3) -> float:
    """Return the value rounded down to a number of significant digits.

    Example:
        >>> round_down(995.9), round_down(1000.0), round_down(0.0)
        (995.0, 1000.0, 0.0)
    """
    # The factor compensates the rounding of the division: 1000.0 stays 1000.
    return _round_to_digits(value, digits, lambda ratio: math.floor(ratio * (1.0 + 1e-12)))


def round_up(value: float, digits: int = 3) -> float:
    """Return the value rounded up to a number of significant digits.

    Example:
        >>> round_up(10.2, 2), round_up(20.0, 2), round_up(0.0)
        (11.0, 20.0, 0.0)
    """
    return _round_to_digits(value, digits, lambda ratio: math.ceil(ratio * (1.0 - 1e-12)))


def _round_to_digits(value: float, digits: int, to_integer: Callable[[float], int]) -> float:
    if value <= 0.0 or not math.isfinite(value):
        return value
    step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return round(to_integer(value / step) * step, 12)
