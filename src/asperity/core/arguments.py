"""Declarations of arguments: name, form, unit, bounds, default and description.

Command-line options with their help, keys of scene files, checks of values and the reference pages
are derived from a declaration.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeVar

from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import OMITTED, Serializable
from asperity.core.units import format_quantity, parse_quantity, parse_size

Form = Literal[
    "quantity",  # "1.5 mm"; a bare number only where there is no unit
    "pair",  # "5um", or "5um; 8um" for x and y; like all lists also with a comma
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
"""Textual form of an argument; scene files also accept lists, and numbers without a unit."""

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Argument(Serializable):
    """An argument of a texture kind, a law, a preparation, a surface or a scene section.

    Attributes:
        name: name in Python and in scenes; options have hyphens for underscores.
        description: a short description.
        unit: SI unit; empty for a pure number.
        default: default value [unit]; ``None`` for none, or with ``default_description``.
        default_description: the default in words, such as "size / 32"; overrides ``default``.
        form: textual form.
        required: whether a value is required.
        minimum: least value [unit].
        maximum: greatest value [unit].
        must_be_positive: whether the value must be above zero.
        choices: accepted values of a text.
        example: example of a value, for the help.
        keyword: name of the Python parameter where it differs from ``name``.
    """

    name: str
    description: str
    unit: str = ""
    default: float | int | str | None = None
    default_description: str = ""
    form: Form = "quantity"
    required: bool = False
    minimum: float = field(default=0.0, metadata=OMITTED)
    maximum: float = field(default=math.inf, metadata=OMITTED)
    choices: tuple[str, ...] = ()
    must_be_positive: bool = field(default=False, metadata=OMITTED)
    example: str = field(default="", metadata=OMITTED)
    keyword: str = field(default="", metadata=OMITTED)

    def parse(self, value: Any) -> Any:
        """Return the value [SI] of a text, a number or a list, without a check of the bounds.

        Raises:
            ParameterError: for a value of another form or dimension.

        Example:
            >>> Argument("pitch", "of the points", "m", form="pair").parse("5 µm; 8 µm")
            (5e-06, 8e-06)
        """
        return _PARSERS[self.form](self.name, value, self.unit)

    def validate(self, value: Any) -> Any:
        """Return the value if it is within the bounds or among the choices.

        Raises:
            ParameterError: otherwise.
        """
        if self.form in {"text", "channel", "switch", "path", "direction"}:
            return self._validate_choice(value) if self.choices else value
        if self.form == "integer":
            return check_integer(self.name, value, int(self.minimum))
        if self.form != "quantity" and isinstance(value, (list, tuple)):
            return type(value)([self.validate(part) for part in value])
        return self._validate_number(value)

    def _validate_number(self, value: Any) -> float:
        # Imported here: declarations do not need NumPy.
        from asperity.core.checks import check_positive, check_real

        if self.must_be_positive:
            return check_positive(self.name, value, self.unit)
        number = check_real(self.name, value, self.unit)
        if self.minimum <= number <= self.maximum:
            return number
        low = self.format_value(self.minimum)
        requirement = f"must be at least {low}"
        if self.maximum < math.inf:
            requirement = f"must be {low} to {self.format_value(self.maximum)}"
        elif not self.minimum:
            requirement = "must not be negative"
        raise ParameterError(self.name, requirement, value)

    def _validate_choice(self, value: Any) -> str:
        known = {choice.lower(): choice for choice in self.choices}
        if not isinstance(value, str) or value.lower() not in known:
            hint = suggest_names(str(value), self.choices)
            raise ParameterError(self.name, f"is unknown: {value!r}; {hint}")
        return known[value.lower()]

    def format_value(self, value: float | int | str) -> str:
        """Return a value as text with its unit.

        Example:
            >>> Argument("width", "of a yarn", "m").format_value(0.37e-3)
            '370 µm'
        """
        if isinstance(value, str) or self.form == "integer":
            return str(value)
        if self.unit == "rad":
            return f"{math.degrees(value):.4g}°"
        return format_quantity(value, self.unit)

    @property
    def default_text(self) -> str:
        """The default as text, or "required"."""
        if self.required:
            return "required"
        if self.default_description or self.default is None:
            return self.default_description
        return self.format_value(self.default)


def read_arguments(
    path: Path, table: str = "", defaults: type | None = None
) -> dict[str, Argument]:
    """Return the declarations in a TOML file of this package, or in one of its tables, by name.

    Args:
        path: the file.
        table: name of the table; empty for the whole file.
        defaults: class whose attributes are the defaults of arguments that state none.
    """
    import tomllib

    content = tomllib.loads(path.read_text("utf-8"))
    declarations = content[table] if table else content
    for name, fields in declarations.items():
        if "default" not in fields and "default_description" not in fields:
            fields["default"] = getattr(defaults, name, None)
    return {name: Argument(name, **fields) for name, fields in declarations.items()}


def check_integer(name: str, value: Any, minimum: int = 0) -> int:
    """Return an integer of at least a minimum; 3.0 is accepted as 3.

    Raises:
        ParameterError: for any other value.
    """
    from asperity.core.checks import check_real

    number = check_real(name, value)
    if number < minimum or number != int(number):
        raise ParameterError(name, f"must be a whole number, {minimum} or more", value)
    return int(number)


def parse_arguments(
    section: str,
    entries: Mapping[str, Any],
    arguments: Iterable[Argument],
    folder: Path | None = None,
) -> dict[str, Any]:
    """Return the values [SI] of the entries of a section, by name.

    Args:
        section: name of the section, for messages.
        entries: texts, numbers or lists by name.
        arguments: declarations of the arguments.
        folder: folder that relative paths refer to.

    Raises:
        ParameterError: for an unknown argument, with the nearest names, or an invalid value.
    """
    known = {argument.name: argument for argument in arguments}
    for name in entries:
        if name not in known:
            raise ParameterError(f"{section}.{name}", f"is unknown; {suggest_names(name, known)}")
    values = {}
    for name, value in entries.items():
        values[name] = known[name].parse(value)
        if folder and known[name].form == "path":
            values[name] = str(folder / values[name])
    return values


def document_arguments(arguments: Iterable[Argument]) -> Callable[[Function], Function]:
    """Return a decorator that replaces ``{arguments}`` in a docstring by a list of arguments."""
    lines = []
    for argument in arguments:
        unit = f" [{argument.unit}]" if argument.unit else ""
        default = f"; default {argument.default_text}" if argument.default_text else ""
        lines.append(f"{argument.name}: {argument.description}{unit}{default}.")

    def describe(function: Function) -> Function:
        text = function.__doc__ or ""  # empty with python -OO
        before, mark, after = text.partition("{arguments}")
        if mark:
            indent = before[before.rindex("\n") :]  # since Python 3.13 docstrings are dedented
            function.__doc__ = before + indent.join(lines) + after
        return function

    return describe


STIFFNESS = Argument(
    "stiffness",
    "stiffness of the surface",
    "N/m",
    default=1000.0,
    must_be_positive=True,
    example="500N/m",
)
DEFAULT_STIFFNESS: Any = STIFFNESS.default
SEED = Argument("seed", "of the random numbers", default=0, form="integer")
MAX_DEPTH = Argument(
    "max_depth",
    "maximum penetration depth",
    "m",
    default_description="peak-to-valley height, at most 1 mm",
    must_be_positive=True,
    example="0.5mm",
)
FIELD = "field"
SEARCH = "search"
RENDERING = Argument(
    "rendering",
    "rendering of law H where it has no closed form: field (a baked potential field) or search "
    "(with an evaluation budget)",
    default=FIELD,
    form="text",
    choices=(FIELD, SEARCH),
)


# --- parsers of the forms: name of the argument, value, unit --------------------------------------


def _split(value: Any, separators: str = "[;,]") -> list[Any]:
    if isinstance(value, list):
        return value
    return [part for part in re.split(separators, str(value)) if part.strip()]


def _parse_quantities(name: str, value: Any, unit: str) -> list[float]:
    return [parse_quantity(name, part, unit) for part in _split(value)]


def _parse_vector(name: str, value: Any, unit: str) -> list[float]:
    parts = _split(value, r"[;,\s]")
    last = parts[-1] if len(parts) > 1 else ""
    if unit and isinstance(last, str) and last[:1].isalpha():  # "3 1 rad/mm"
        parts = [f"{part}{last}" for part in parts[:-1]]
    return [parse_quantity(name, part, unit) for part in parts]


def _parse_vectors(name: str, value: Any, unit: str) -> list[Any]:
    rows = [_parse_vector(name, row, unit) for row in _split(value)]
    if max(map(len, rows), default=1) > 1:
        return rows
    return [row[0] for row in rows]


def _parse_fixed(name: str, value: Any, unit: str, *counts: int) -> tuple[float, ...]:
    if len(_split(value)) not in counts:
        numbers = " or ".join(map(str, counts))
        raise ParameterError(name, f"must be {numbers} quantities 'a; b' [{unit}]", value)
    return tuple(_parse_quantities(name, value, unit))


def _parse_axes(name: str, value: Any, unit: str, count: int = 3) -> float | tuple[float, ...]:
    values = _parse_fixed(name, value, unit, 1, count)
    return values[0] if len(values) == 1 else values


def _parse_direction(name: str, value: Any, _unit: str) -> tuple[float, ...]:
    axes = {"x": (1.0, 0.0), "y": (0.0, 1.0)}
    word = str(value).strip().lower()
    if word in axes:
        return axes[word]
    parts = _split(value, r"[;,\s]")
    if len(parts) != 2:
        raise ParameterError(name, "must be x, y, or two numbers '1,0.5'", value)
    vector = tuple([parse_quantity(name, part, "") for part in parts])
    if not any(vector):
        raise ParameterError(name, "must have a length", value)
    return vector


def _parse_integer(name: str, value: Any, _unit: str) -> int:
    number = parse_quantity(name, value, "")
    if number != round(number):
        raise ParameterError(name, "must be a whole number", value)
    return round(number)


def _parse_switch(name: str, value: Any, _unit: str) -> bool:
    switches = {"yes": True, "true": True, "no": False, "false": False}
    word = str(value).strip().lower()
    if word not in switches:
        raise ParameterError(name, "must be true or false", value)
    return switches[word]


def _parse_channel(name: str, value: Any, _unit: str) -> str | int:
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise ParameterError(name, "must be a name or a whole number", value)
    text = str(value).strip()
    return int(text) if text.isdecimal() and len(text) < 10 else value


def _parse_text(name: str, value: Any, _unit: str) -> str:
    if not isinstance(value, str):
        raise ParameterError(name, "must be text", value)
    return value


_PARSERS: dict[Form, Callable[[str, Any, str], Any]] = {
    "quantity": parse_quantity,
    "pair": lambda name, value, unit: _parse_axes(name, value, unit, 2),
    "vector": _parse_vector,
    "items": _parse_quantities,
    "vectors": _parse_vectors,
    "space": lambda name, value, unit: _parse_fixed(name, value, unit, 3),
    "plane": lambda name, value, unit: _parse_fixed(name, value, unit, 2),
    "axes": _parse_axes,
    "direction": _parse_direction,
    "integer": _parse_integer,
    "switch": _parse_switch,
    "size": lambda name, value, _unit: parse_size(name, value),
    "channel": _parse_channel,
    "text": _parse_text,
    "path": _parse_text,
}
