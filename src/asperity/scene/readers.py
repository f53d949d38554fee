"""How the arguments of a scene are read: text, numbers and lists in, SI units out."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from asperity.errors import ParameterError, nearest_names
from asperity.units import quantity

# Reads one argument: its name for messages, and what was given (text, number or list).
Reader = Callable[[str, Any], Any]


def in_unit(unit: str) -> Reader:
    """Read "1.5 mm", or a number in SI units."""
    return lambda name, given: quantity(name, given, unit)


def items(unit: str) -> Reader:
    """Read "1mm; 2mm" or a list."""
    return lambda name, given: [quantity(name, item, unit) for item in _split(given, ";")]


def vector(unit: str) -> Reader:
    """Read "1 0.4" or a list of two numbers."""
    return lambda name, given: [quantity(name, item, unit) for item in _split(given, None)]


def vectors(unit: str) -> Reader:
    """Read "3000 500; -1000 4000" or a list of lists; single numbers lie along x."""

    def read(name: str, given: Any) -> Any:
        rows = [
            [quantity(name, item, unit) for item in _split(row, None)] for row in _split(given, ";")
        ]
        return [row[0] for row in rows] if all(len(row) == 1 for row in rows) else rows

    return read


def _split(given: Any, separator: str | None) -> list[Any]:
    if isinstance(given, list):
        return given
    return [part for part in str(given).split(separator) if part.strip()]


def pair(unit: str) -> Reader:
    """Read "1um" or "1um; 2um", for x and y."""

    def read(name: str, given: Any) -> Any:
        values = [quantity(name, part, unit) for part in _split(given, ";")]
        if len(values) not in {1, 2}:
            raise ParameterError(name, "must be one quantity, or two for x and y: 'a; b'", given)
        return values[0] if len(values) == 1 else values

    return read


def space(unit: str) -> Reader:
    """Read "1mm; 0mm; -2mm" or a list of three, for x, y and z."""

    def read(name: str, given: Any) -> tuple[float, ...]:
        parts = _split(given, ";")
        if len(parts) != 3:
            raise ParameterError(name, f"must be three quantities for x, y and z [{unit}]", given)
        return tuple(quantity(name, part, unit) for part in parts)

    return read


def plane(unit: str) -> Reader:
    """Read "37.5mm; 100mm" or a list of two."""

    def read(name: str, given: Any) -> tuple[float, ...]:
        parts = _split(given, ";")
        if len(parts) != 2:
            raise ParameterError(name, f"must be two quantities [{unit}]", given)
        return tuple(quantity(name, part, unit) for part in parts)

    return read


def axes(unit: str) -> Reader:
    """Read one quantity for all axes, or three."""

    def read(name: str, given: Any) -> float | tuple[float, ...]:
        parts = _split(given, ";") if isinstance(given, (str, list)) else [given]
        return quantity(name, parts[0], unit) if len(parts) == 1 else space(unit)(name, given)

    return read


def text(name: str, given: Any) -> str:
    """Read text as it is."""
    if not isinstance(given, str):
        raise ParameterError(name, "must be text", given)
    return given


def switch(name: str, given: Any) -> bool:
    """Read true, false, "yes" or "no"."""
    words = {"yes": True, "true": True, "no": False, "false": False}
    if isinstance(given, bool):
        return given
    if str(given).strip().lower() not in words:
        raise ParameterError(name, "must be true or false", given)
    return words[str(given).strip().lower()]


def whole(name: str, given: Any) -> int:
    """Read a whole number."""
    number = quantity(name, given, "")
    if number != round(number):
        raise ParameterError(name, "must be a whole number", given)
    return round(number)


def channel(name: str, given: Any) -> str | int:
    """Read the name or the number of a channel."""
    if isinstance(given, bool) or not isinstance(given, (str, int)):
        raise ParameterError(name, "must be a name or a whole number", given)
    return int(given) if str(given).strip().isdecimal() else given


def read_arguments(
    where: str, arguments: Mapping[str, Any], readers: Mapping[str, Reader]
) -> dict[str, Any]:
    """Return the arguments of a section, each read by its reader.

    Raises:
        ParameterError: for an unknown argument, the nearest offered, or a wrong value.
    """
    for name in arguments:
        if name not in readers:
            raise ParameterError(f"{where}.{name}", f"is unknown; {nearest_names(name, readers)}")
    return {name: readers[name](name, value) for name, value in arguments.items()}
