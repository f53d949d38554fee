"""An argument declared once: name, unit, bounds, default and words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Literal

from asperity.checks import positive, real
from asperity.errors import ParameterError, nearest_names
from asperity.files import record
from asperity.units import engineering

Form = Literal["quantity", "pair", "vector", "items", "vectors", "integer", "text"]
"""How an argument is written as text: one quantity; one or two ("10mm; 5mm"); a vector ("1 0.4");
a list ("1mm; 2mm"); a list of vectors ("3000 500; -1000 4000"); a whole number; a word."""


@dataclass(frozen=True)
class Argument:
    """One argument of a texture kind, a law or a preparation.

    Attributes:
        name: as in Python and on the command line.
        words: what it is, in a few words.
        unit: SI unit; empty for a pure number.
        default: value [unit]; ``None`` where ``default_words`` says it.
        default_words: the default in words, such as "size / 32".
        form: how it is written as text.
        required: whether it has no default.
        low: least value that can be used [unit].
        high: greatest value that can be used [unit].
        positive: whether only values above zero can be used.
        choices: the words that can be used, for a text.
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

    def checked(self, value: Any) -> Any:
        """Return the value if it can be used.

        Raises:
            ParameterError: with the bounds or the choice.
        """
        if self.form == "text":
            return self._word(value)
        if self.form == "integer":
            return whole(self.name, value)
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
        return self.default_words if self.default is None else self.readable(self.default)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return record(self, without=("low", "high", "positive"))


def whole(name: str, value: Any) -> int:
    """Return a whole number that is not negative; 3.0 counts as 3.

    Raises:
        ParameterError: for anything else.
    """
    number = real(name, value)
    if number < 0.0 or number != int(number):
        raise ParameterError(name, "must be a whole number, 0 or more", value)
    return int(number)


SEED = Argument("seed", "same seed, same surface", default=0, form="integer")
