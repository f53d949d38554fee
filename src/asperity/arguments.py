"""An argument declared once: name, form, unit, bounds, default and words.

The command line's options with their help, the keys of scene files, the checks of values and the
reference pages follow from the declaration.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeVar

from asperity.errors import ParameterError, nearest_names
from asperity.files import record
from asperity.units import engineering, quantity

Form = Literal[
    "quantity",  # "1.5 mm"; a bare number only where there is no unit
    "pair",  # "5um", or "5um; 8um" for x and y
    "vector",  # "1 0.4", or a list of numbers
    "items",  # "1mm; 2mm"
    "vectors",  # "3 1 rad/mm; 4 0 rad/mm"; single ones lie along x
    "space",  # "1mm; 0mm; -2mm" for x, y and z
    "plane",  # "37.5mm; 100mm" for x and z
    "axes",  # one quantity for all axes, or three
    "direction",  # x, y, or two numbers "1,0.5"
    "integer",  # a whole number
    "switch",  # true or false
    "size",  # of memory, "4GB"
    "channel",  # a name, or a number counted from 0
    "text",
    "path",  # of a file; in a scene relative to it
]
"""How an argument is written as text; in a scene file also as a list, or a number without unit."""

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Argument:
    """One argument of a texture kind, a law, a preparation, a surface or a scene's section.

    Attributes:
        name: as in Python and in scenes; on the command line with hyphens for underscores.
        words: what it is, in a few words.
        unit: SI unit; empty for a pure number.
        default: value [unit]; ``None`` where ``default_words`` says it, or where there is none.
        default_words: the default in words, such as "size / 32"; they come before the value.
        form: how it is written as text.
        required: whether it must be given.
        low: least value that can be used [unit].
        high: greatest value that can be used [unit].
        positive: whether only values above zero can be used.
        choices: the words that can be used, for a text.
        example: a value as it is typed, for the help.
    """

    name: str
    words: str
    unit: str = ""
    default: float | int | str | None = None
    default_words: str = ""
    form: Form = "quantity"
    required: bool = False
    low: float = 0.0
    high: float = math.inf
    choices: tuple[str, ...] = ()
    positive: bool = False
    example: str = ""

    def read(self, given: Any) -> Any:
        """Return the value [SI] that a text, a number or a list stands for; bounds do not count.

        Raises:
            ParameterError: for what is not of this form, or of another dimension.

        Example:
            >>> Argument("pitch", "of the points", "m", form="pair").read("5 µm; 8 µm")
            [5e-06, 8e-06]
        """
        return _READERS[self.form](self.name, given, self.unit)

    def checked(self, value: Any) -> Any:
        """Return the value if it can be used.

        Raises:
            ParameterError: with the bounds or the choice.
        """
        if self.form in {"text", "channel", "switch", "path"}:
            return self._word(value) if self.choices else value
        if self.form == "integer":
            return whole(self.name, value, int(self.low))
        if isinstance(value, (list, tuple)):
            return type(value)(self.checked(part) for part in value)
        return self._number(value)

    def _number(self, value: Any) -> float:
        # The numerical libraries are not needed to declare an argument.
        from asperity.checks import positive, real

        if self.positive:
            return positive(self.name, value, self.unit)
        number = real(self.name, value, self.unit)
        if number < self.low and self.high == math.inf:
            if self.low == 0.0:
                raise ParameterError(self.name, "must not be negative", value)
            raise ParameterError(self.name, f"must be at least {self.readable(self.low)}", value)
        if not self.low <= number <= self.high:
            bounds = f"must be {self.readable(self.low)} to {self.readable(self.high)}"
            raise ParameterError(self.name, bounds, value)
        return number

    def _word(self, value: Any) -> str:
        known = {choice.lower(): choice for choice in self.choices}
        if not isinstance(value, str) or value.lower() not in known:
            hint = nearest_names(str(value), self.choices)
            raise ParameterError(self.name, f"is unknown: {value!r}; {hint}")
        return known[value.lower()]

    def readable(self, value: float | int | str) -> str:
        """Return a value for reading, with its unit.

        Example:
            >>> Argument("width", "of a yarn", "m").readable(0.37e-3)
            '370 µm'
        """
        if isinstance(value, str) or self.form == "integer":
            return str(value)
        if self.unit == "rad":
            return f"{math.degrees(value):.4g}°"
        return engineering(value, self.unit) if self.unit else f"{value:g}"

    @property
    def default_text(self) -> str:
        """The default for reading, or "required"."""
        if self.required:
            return "required"
        if self.default_words or self.default is None:
            return self.default_words
        return self.readable(self.default)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return record(self, without=("low", "high", "positive", "example"))


def whole(name: str, value: Any, least: int = 0) -> int:
    """Return a whole number that is not less; 3.0 counts as 3.

    Raises:
        ParameterError: for anything else.
    """
    from asperity.checks import real

    number = real(name, value)
    if number < least or number != int(number):
        raise ParameterError(name, f"must be a whole number, {least} or more", value)
    return int(number)


def read_arguments(
    where: str, given: Mapping[str, Any], arguments: Iterable[Argument], folder: Path | None = None
) -> dict[str, Any]:
    """Return the values [SI] of the arguments of a section, by name.

    Args:
        where: the section, for messages.
        given: what it says, text, numbers or lists by name.
        arguments: what it can say.
        folder: to which paths are relative.

    Raises:
        ParameterError: for an unknown argument, the nearest offered, or a wrong value.
    """
    known = {argument.name: argument for argument in arguments}
    for name in given:
        if name not in known:
            raise ParameterError(f"{where}.{name}", f"is unknown; {nearest_names(name, known)}")
    values = {}
    for name, value in given.items():
        read = known[name].read(value)
        values[name] = str(folder / read) if folder and known[name].form == "path" else read
    return values


def described(arguments: Iterable[Argument]) -> Callable[[Function], Function]:
    """Return a decorator that puts the arguments in the place of ``{arguments}`` in a docstring."""
    lines = []
    for argument in arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        default = f"; default {argument.default_text}" if argument.default_text else ""
        lines.append(f"{argument.name}: {argument.words}{unit}{default}.")

    def describe(function: Function) -> Function:
        text = function.__doc__ or ""  # which python -OO leaves out
        before, mark, after = text.partition("{arguments}")
        if mark:
            indent = before[before.rindex("\n") :]  # from Python 3.13 on without that of the code
            function.__doc__ = before + indent.join(lines) + after
        return function

    return describe


SEED = Argument("seed", "same seed, same surface", default=0, form="integer")

DEFAULT_STIFFNESS = 1000.0
STIFFNESS = Argument(
    "stiffness",
    "stiffness that you want",
    "N/m",
    DEFAULT_STIFFNESS,
    positive=True,
    example="500N/m",
)
OWN_STIFFNESS = replace(
    STIFFNESS,
    words="stiffness to ask about",
    default=None,
    default_words="each law's own, the one to begin with",
)
SPEED = Argument("speed", "scanning speed", "m/s", default_words="0.1 m/s", example="0.1m/s")
MAX_DEPTH = Argument(
    "max_depth",
    "depth to press to",
    "m",
    default_words="peak-to-valley height, at most 1 mm",
    positive=True,
    example="0.5mm",
)

MEMORY = Argument(
    "memory",
    "that may be used, an estimate made before there are arrays",
    "B",
    default_words="what the machine has free",
    form="size",
    example="4GB",
)

JOBS = Argument(
    "jobs", "processes that share the work", default_words="one per core", form="integer", low=1
)


# --- how each form is read: the argument's name, text, number or list, and the unit ---------------


def _split(given: Any, separator: str | None = ";") -> list[Any]:
    if isinstance(given, list):
        return given
    if separator is None:
        return str(given).split()
    return [part for part in str(given).split(separator) if part.strip()]


def _quantities(name: str, given: Any, unit: str) -> list[float]:
    return [quantity(name, part, unit) for part in _split(given)]


def _vector(name: str, given: Any, unit: str) -> list[float]:
    parts = _split(given, None)
    last = parts[-1] if len(parts) > 1 else ""
    if unit and isinstance(last, str) and last[:1].isalpha():  # "3 1 rad/mm"
        parts = [f"{part}{last}" for part in parts[:-1]]
    return [quantity(name, part, unit) for part in parts]


def _vectors(name: str, given: Any, unit: str) -> list[Any]:
    rows = [_vector(name, row, unit) for row in _split(given)]
    return [row[0] for row in rows] if all(len(row) == 1 for row in rows) else rows


def _pair(name: str, given: Any, unit: str) -> float | list[float]:
    parts = _split(given)
    if len(parts) not in {1, 2}:
        raise ParameterError(name, "must be one quantity, or two for x and y: 'a; b'", given)
    values = _quantities(name, parts, unit)
    return values[0] if len(values) == 1 else values


def _exactly(count: int, words: str) -> Callable[[str, Any, str], tuple[float, ...]]:
    def read(name: str, given: Any, unit: str) -> tuple[float, ...]:
        parts = _split(given)
        if len(parts) != count:
            raise ParameterError(name, f"must be {words} [{unit}]", given)
        return tuple(quantity(name, part, unit) for part in parts)

    return read


_space = _exactly(3, "three quantities for x, y and z")


def _axes(name: str, given: Any, unit: str) -> float | tuple[float, ...]:
    parts = _split(given) if isinstance(given, (str, list)) else [given]
    return quantity(name, parts[0], unit) if len(parts) == 1 else _space(name, given, unit)


def _direction(name: str, given: Any, _unit: str) -> tuple[float, ...]:
    axes = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
    word = str(given).strip().lower()
    if word in axes:
        return axes[word]
    parts = given if isinstance(given, list) else str(given).replace(",", " ").split()
    if len(parts) != 2:
        raise ParameterError(name, "must be x, y, or two numbers '1,0.5'", given)
    vector = tuple(quantity(name, part, "") for part in parts)
    if not any(vector):
        raise ParameterError(name, "must have a length", given)
    return vector


def _integer(name: str, given: Any, _unit: str) -> int:
    number = quantity(name, given, "")
    if number != round(number):
        raise ParameterError(name, "must be a whole number", given)
    return round(number)


def _size(name: str, given: Any, _unit: str) -> int:
    match = re.fullmatch(r"\s*(\d{1,15}(?:\.\d{1,6})?)\s*([kMGT]?)(i?)(B?)\s*", str(given))
    if match is None:
        raise ParameterError(name, "must be a size such as '4GB', '500MB' or '2GiB'", given)
    number, prefix, binary, byte = match.groups()
    if not prefix + byte:
        quantity(name, number, "B")
    return int(float(number) * (1024.0 if binary else 1000.0) ** " kMGT".index(prefix or " "))


def _switch(name: str, given: Any, _unit: str) -> bool:
    words = {"yes": True, "true": True, "no": False, "false": False}
    word = str(given).strip().lower()
    if word not in words:
        raise ParameterError(name, "must be true or false", given)
    return words[word]


def _channel(name: str, given: Any, _unit: str) -> str | int:
    if isinstance(given, bool) or not isinstance(given, (str, int)):
        raise ParameterError(name, "must be a name or a whole number", given)
    text = str(given).strip()
    return int(text) if text.isdecimal() and len(text) < 10 else given


def _text(name: str, given: Any, _unit: str) -> str:
    if not isinstance(given, str):
        raise ParameterError(name, "must be text", given)
    return given


_READERS: dict[Form, Callable[[str, Any, str], Any]] = {
    "quantity": quantity,
    "pair": _pair,
    "vector": _vector,
    "items": _quantities,
    "vectors": _vectors,
    "space": _space,
    "plane": _exactly(2, "two quantities"),
    "axes": _axes,
    "direction": _direction,
    "integer": _integer,
    "switch": _switch,
    "size": _size,
    "channel": _channel,
    "text": _text,
    "path": _text,
}
