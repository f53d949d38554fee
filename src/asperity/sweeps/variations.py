"""Varied keys of a scene: values as listed, on a linear or logarithmic grid, or of a design."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.core.arguments import Argument
from asperity.core.errors import ParameterError
from asperity.scene.sections import to_scene_values

_NUMBER_FORMS = ("quantity", "integer", "pair", "axes")
"""Forms of arguments that a single number is a value of."""
_COUNT = re.compile(r"(\d+)\s*(log)?|(log)", re.IGNORECASE)
DESIGN = "sobol"


@dataclass(frozen=True)
class Variation:
    """A key of the scene with the values that it takes.

    Attributes:
        argument: declaration, whose name is the key.
        values: the values as written in a scene; of a range in a design, its two ends.
        is_range: whether the values are numbers of a range.
        is_logarithmic: whether the steps of the range are equal ratios.
    """

    argument: Argument
    values: tuple[Any, ...]
    is_range: bool = False
    is_logarithmic: bool = False

    @property
    def key(self) -> str:
        """The key, "texture.period"."""
        return self.argument.name

    @property
    def column(self) -> str:
        """The key with its unit, "texture.period [m]"."""
        unit = self.argument.unit
        return f"{self.key} [{unit}]" if unit else self.key

    def number(self, value: Any) -> Any:
        """Return the SI number of a value as written in a scene; a text if it is no number.

        Example:
            >>> period = Variation(Argument("texture.period", "", "m"), ())
            >>> period.number("0.5 mm")
            0.0005
        """
        parsed = self.argument.parse(value)
        if isinstance(parsed, (list, tuple)):
            return "; ".join(str(part) for part in parsed)
        return parsed

    def scene_value(self, number: float) -> Any:
        """Return an SI number as written in a scene.

        Raises:
            ParameterError: for a number out of the bounds of the argument, or one that is not
                whole where that is needed.
        """
        value: Any = number
        if self.argument.form == "integer":
            value = round(number) if math.isclose(number, round(number)) else number
        return _canonical(self.argument, self.argument.validate(value))

    def between(self, fractions: Any) -> Any:
        """Return SI numbers at fractions of the range, shape (n,)."""
        low, high = (self.number(value) for value in (self.values[0], self.values[-1]))
        if self.is_logarithmic:
            return low * (high / low) ** np.asarray(fractions)
        return low + (high - low) * np.asarray(fractions)


def _canonical(argument: Argument, value: Any) -> Any:
    """Return a value [SI] as written in a scene: one text for one number."""
    return to_scene_values({argument.name: value}, [argument])[argument.name]


def parse_variation(argument: Argument, text: str, *, in_design: bool = False) -> Variation:
    """Return the values of a key.

    Args:
        argument: declaration, whose name is the key.
        text: "0.5mm:4mm:40" (40 equal steps), "0.5mm:4mm:40log" (40 equal ratios), or values
            separated by commas; in a design "0.5mm:4mm" or "0.5mm:4mm:log".
        in_design: whether ranges are those of a design.

    Raises:
        ParameterError: for an empty or reversed range, or a value that cannot be used.

    Example:
        >>> parse_variation(Argument("texture.period", "", "m"), "1mm:4mm:3log").values
        ('0.001 m', '0.002 m', '0.004 m')
        >>> parse_variation(Argument("device.id", "", form="text"), "touch,omega.3").values
        ('touch', 'omega.3')
    """
    ends = text.split(":")
    is_range = argument.form in _NUMBER_FORMS and len(ends) > 1
    variation = (
        _parse_range(argument, ends, text, in_design) if is_range else _parse_list(argument, text)
    )
    if len(set(map(str, variation.values))) < len(variation.values):
        raise ParameterError("vary", f"names a value of {argument.name} twice", text)
    return variation


def _parse_list(argument: Argument, text: str) -> Variation:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not parts:
        raise ParameterError("vary", f"needs values of {argument.name}: KEY=a,b,c", text)
    values = tuple(_canonical(argument, argument.validate(argument.parse(part))) for part in parts)
    return Variation(argument, values)


def _parse_range(argument: Argument, ends: list[str], text: str, in_design: bool) -> Variation:
    name = f"range of {argument.name}"
    count = _COUNT.fullmatch(ends[2].strip()) if len(ends) == 3 else None
    steps = int(count[1]) if count and count[1] else 0
    usual = "START:STOP or START:STOP:log" if in_design else "START:STOP:COUNT or ...:COUNTlog"
    if len(ends) > 3 or (len(ends) == 3 and not count) or bool(steps) == in_design:
        raise ParameterError("vary", f"{name} must be {usual}", text)
    low, high = (_parse_end(argument, end) for end in ends[:2])
    is_logarithmic = bool(count and (count[2] or count[3]))
    if not low < high:
        raise ParameterError("vary", f"{name} is empty or reversed: START must be less", text)
    if is_logarithmic and low <= 0.0:
        raise ParameterError("vary", f"{name} must be positive to be logarithmic", text)
    if steps == 1:
        raise ParameterError("vary", f"{name} needs two values or more", text)
    bare = Variation(argument, (), is_range=True, is_logarithmic=is_logarithmic)
    grid = np.geomspace if is_logarithmic else np.linspace
    numbers = [low, high] if in_design else grid(low, high, steps).tolist()
    values = tuple(bare.scene_value(_tidy(number)) for number in numbers)
    return Variation(argument, values, is_range=True, is_logarithmic=is_logarithmic)


def _parse_end(argument: Argument, text: str) -> float:
    value = argument.validate(argument.parse(text.strip()))
    if not isinstance(value, (int, float)):
        raise ParameterError("vary", f"range of {argument.name} needs single numbers", text)
    return float(value)


def _tidy(number: float) -> float:
    """Return a number without the rounding of its computation: 0.3, not 0.30000000000000004.

    Fourteen digits are also the same on machines whose logarithms differ in the last one.
    """
    return float(f"{number:.14g}")


def design_points(design: str, variations: Mapping[str, Variation]) -> Any:
    """Return the numbers of a design by case and range, shape (n, ranges).

    Args:
        design: "sobol:64": that many points of Sobol's sequence, a power of two.
        variations: by key; those without a range take each of their values at every point.

    Raises:
        ParameterError: for another design or number, or no range.
    """
    name, _, count = design.partition(":")
    ranges = [one for one in variations.values() if one.is_range]
    if name.strip().lower() != DESIGN or not count.strip().isdecimal():
        raise ParameterError("design", f"must be {DESIGN}:N, such as {DESIGN}:64", design)
    points = int(count)
    if points < 2 or points & (points - 1) or points > 2**30:
        near = 2 ** max(1, min(30, points.bit_length()))
        raise ParameterError("design", f"needs a power of two, such as {DESIGN}:{near}", design)
    if not ranges:
        raise ParameterError("design", "needs a range: --vary KEY=START:STOP")
    from scipy.stats import qmc

    fractions = qmc.Sobol(len(ranges), scramble=False).random_base2(points.bit_length() - 1)
    return np.stack([one.between(fractions[:, i]) for i, one in enumerate(ranges)], axis=1)
