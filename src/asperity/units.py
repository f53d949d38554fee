"""Quantities as text, at the edges only: "0.8 mm" is 0.0008 everywhere else.

What has a dimension is written with its unit, always: a bare number would be read as metres by one
and as millimetres by another.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from asperity.errors import ParameterError

if TYPE_CHECKING:
    import pint

_BARE = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
# A unit is words with small whole powers, between them *, / or a blank; nothing is evaluated.
_FACTOR = r"[^\W\d_]+(?:\s*(?:\^|\*\*)\s*[+-]?[1-9]|⁻?[¹²³])?|[°%]"
_UNIT = re.compile(rf"(?:1\s*/\s*)?(?:{_FACTOR})(?:\s*[*/·\s]\s*(?:{_FACTOR}))*")
_LONGEST_UNIT = 64
_USUAL = {
    "m": ("mm", "um", "m"),
    "rad": ("deg", "rad"),
    "rad/m": ("rad/mm", "rad/m"),
    "s": ("s", "ms"),
    "kg": ("g", "kg"),
    "N": ("N", "mN"),
    "B": ("MB", "GB"),
}
"""The units in which people write a quantity, the likeliest first; else the SI unit itself."""
_FACTORS = {
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
"""What the commonest units are, as pint says; its own start takes longer than a kept answer."""


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def quantity(name: str, given: str | float, unit: str) -> float:
    """Return a quantity in SI units.

    Args:
        name: of the argument, for the error message.
        given: a number with a unit, "500N/m" or "500 N/m"; only zero needs none.
        unit: the SI unit, such as "m", "N/m" or "rad"; "" for a number without unit.

    Raises:
        ParameterError: if it is no finite quantity of that dimension; for a number without its
            unit, with the units that it may have.

    Example:
        >>> quantity("period", "1.5 mm", "m"), quantity("stiffness", "0.5N/mm", "N/m")
        (0.0015, 500.0)
        >>> quantity("stiffness", "500", "N/m")
        Traceback (most recent call last):
        ...
        asperity.errors.ParameterError: stiffness needs a unit: write 500N/m, got '500'
    """
    if isinstance(given, bool) or not isinstance(given, (str, int, float)):
        raise ParameterError(name, _wanted(unit), given)
    number = _bare_number(given)
    bare = number is not None
    if number is None:
        number = _with_unit(name, str(given), unit)
    if not math.isfinite(number):
        shown = given if isinstance(given, str) else number  # an int may have too many digits
        raise ParameterError(name, f"must be finite; {_wanted(unit)}", shown)
    if bare and unit and number != 0.0:
        raise ParameterError(name, f"needs a unit: write {_with_usual_units(given, unit)}", given)
    return number


def _with_usual_units(number: str | float, unit: str) -> str:
    written = number.strip() if isinstance(number, str) else f"{number:g}"
    return " or ".join(f"{written}{usual}" for usual in _USUAL.get(unit, (unit,)))


def _wanted(unit: str) -> str:
    return f"must be a quantity such as '1.5 {unit}'" if unit else "must be a number"


def _bare_number(text: str | float) -> float | None:
    try:
        return float(text)
    except OverflowError:  # an int beyond the largest float
        return math.inf
    except ValueError:
        return None


def _with_unit(name: str, text: str, unit: str) -> float:
    match = _BARE.match(text.strip())
    if match is None or not unit:
        raise ParameterError(name, _wanted(unit), text)
    words = text.strip()[match.end() :].strip()
    factor = _factor(words, unit) if len(words) <= _LONGEST_UNIT else "is not understood"
    if isinstance(factor, str):
        raise ParameterError(name, f"{_wanted(unit)}; the unit {factor}", text)
    return _scaled(match.group(), factor)


@lru_cache(maxsize=1024)
def _factor(words: str, unit: str) -> float | str:
    """Return how many SI units a unit is; or what is wrong with it."""
    if (known := _FACTORS.get(unit, {}).get(words)) is not None:
        return known
    if _UNIT.fullmatch(words) is None:
        return "is not understood"
    import pint

    try:
        # The number is converted as text would be: 0.8 mm is 0.0008, not 0.8 * 0.001.
        return float(_registry().Quantity(1.0, words).to(unit).magnitude)
    except pint.DimensionalityError:
        return "is of another dimension"
    except Exception:  # pint lets errors of its tokenizer through
        return "is not understood"


def _scaled(number: str, factor: float) -> float:
    """Return number · factor, exact where the factor is a power of ten."""
    exponent = round(math.log10(factor)) if factor > 0.0 else 0
    if factor > 0.0 and abs(factor / 10.0**exponent - 1.0) < 1e-15:
        mantissa, _, power = number.lower().partition("e")
        if len(power) < 20:  # beyond that it is nothing or infinite, whatever the factor
            return float(f"{mantissa}e{int(power or 0) + exponent}")
    return float(number) * factor


_PREFIXES = {0: "", -3: "m", -6: "µ", -9: "n", -12: "p", 3: "k", 6: "M"}


def engineering(value: float, unit: str, digits: int = 3) -> str:
    """Return a quantity for reading, with an SI prefix.

    Example:
        >>> engineering(0.0008, "m"), engineering(5000.0, "N/m"), engineering(0.0, "J")
        ('0.8 mm', '5000 N/m', '0 J')
    """
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    # Stiffnesses are read in N/m, whatever their size.
    if "/" in unit and abs(value) >= 1.0:
        return f"{float(f'{value:.{digits}g}'):.10g} {unit}"
    exponent = 3 * math.floor((math.log10(abs(value)) + 1e-12 + 0.1) / 3)
    exponent = min(max(exponent, min(_PREFIXES)), max(_PREFIXES))
    return f"{float(f'{value / 10.0**exponent:.{digits}g}'):.10g} {_PREFIXES[exponent]}{unit}"


def rounded_down(value: float, digits: int = 3) -> float:
    """Return the value with so many digits, never more than it is: a limit stays one.

    Example:
        >>> rounded_down(995.9), rounded_down(1000.0), rounded_down(0.0)
        (995.0, 1000.0, 0.0)
    """
    if value <= 0.0 or not math.isfinite(value):
        return value
    step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    # What rounding of the value itself took away is given back: 1000.0 stays 1000.
    return round(math.floor(value / step * (1.0 + 1e-12)) * step, 12)


def rounded_up(value: float, digits: int = 3) -> float:
    """Return the value with so many digits, never less than it is.

    Example:
        >>> rounded_up(10.2, 2), rounded_up(20.0, 2), rounded_up(0.0)
        (11.0, 20.0, 0.0)
    """
    if value <= 0.0 or not math.isfinite(value):
        return value
    step = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    return round(math.ceil(value / step * (1.0 - 1e-12)) * step, 12)
