"""Quantities as text, at the edges only: "0.8 mm" is 0.0008 everywhere else."""

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


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry(autoconvert_offset_to_baseunit=True)


def quantity(name: str, text: str | float, unit: str) -> float:
    """Return a quantity in SI units.

    Args:
        name: of the argument, for the error message.
        text: a number with a unit, "500N/m" or "500 N/m"; a bare number is in ``unit``.
        unit: the SI unit, such as "m", "N/m" or "rad"; "" for a number without unit.

    Raises:
        ParameterError: if the text is no finite quantity of that dimension.

    Example:
        >>> quantity("period", "1.5 mm", "m"), quantity("stiffness", "0.5N/mm", "N/m")
        (0.0015, 500.0)
    """
    if isinstance(text, bool) or not isinstance(text, (str, int, float)):
        raise ParameterError(name, _wanted(unit), text)
    number = _bare_number(text)
    if number is None:
        number = _with_unit(name, str(text), unit)
    if not math.isfinite(number):
        shown = text if isinstance(text, str) else number  # an int may have too many digits
        raise ParameterError(name, f"must be finite; {_wanted(unit)}", shown)
    return number


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
    if len(words) > _LONGEST_UNIT or _UNIT.fullmatch(words) is None:
        raise ParameterError(name, f"{_wanted(unit)}; the unit is not understood", text)
    import pint

    registry = _registry()
    try:
        given = registry.Quantity(1.0, words)
        # The number is converted as text would be: 0.8 mm is 0.0008, not 0.8 * 0.001.
        factor = given.to(unit).magnitude
    except pint.DimensionalityError:
        raise ParameterError(name, f"{_wanted(unit)}, not of another dimension", text) from None
    except (pint.PintError, ValueError, TypeError, AttributeError, SyntaxError):
        raise ParameterError(name, f"{_wanted(unit)}; the unit is not understood", text) from None
    except Exception:  # pint lets errors of its tokenizer through
        raise ParameterError(name, f"{_wanted(unit)}; the unit is not understood", text) from None
    return _scaled(match.group(), float(factor))


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
