"""The plan of a sweep: its scene, the values of its cases, and what is computed for each.

The values of a key are listed, on a linear or logarithmic grid, or the points of a design.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from asperity.core.arguments import Argument
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import package_digest
from asperity.core.units import parse_quantity
from asperity.core.version import __version__
from asperity.devices import load_device
from asperity.laws import find_law, find_laws
from asperity.recording.replay import file_digest
from asperity.scene.scene_file import DEVICE_ID, read_scene, to_scene_values
from asperity.scene.scene_keys import find_varied_arguments
from asperity.sweeps.case_runs import LAW_KEY, CaseTemplate, find_run

SCHEMA = 1
_CHECKS = {LAW_KEY: find_law, DEVICE_ID.name: load_device}


@dataclass(frozen=True)
class SweepPlan:
    """All cases of a sweep, which are numbered and made when they are needed.

    Attributes:
        template: what they share.
        arguments: declarations of the varied keys.
        axes: choices that are combined, each a value by key; the last one changes fastest.
        vary: values by key, as given.
        design: "sobol:64", whose points are the first axis; empty for all combinations.
        source: scene, as given.
    """

    template: CaseTemplate
    arguments: Mapping[str, Argument]
    axes: tuple[Sequence[Mapping[str, Any]], ...]
    vary: Mapping[str, str]
    design: str
    source: str

    def __len__(self) -> int:
        return math.prod(len(axis) for axis in self.axes)

    def values(self, index: int) -> dict[str, Any]:
        """Return the values of a case by key, as written in a scene."""
        merged: dict[str, Any] = {}
        for axis in reversed(self.axes):
            index, choice = divmod(index, len(axis))
            merged |= axis[choice]
        return merged

    def numbers(self, index: int) -> dict[str, Any]:
        """Return the values of a case by column: SI numbers, or texts."""
        values = self.values(index)
        return {
            self.column(key): table_value(argument, values[key])
            for key, argument in self.arguments.items()
        }

    def column(self, key: str) -> str:
        """Return the column of a key, "texture.period [m]"."""
        unit = self.arguments[key].unit
        if not unit:
            return key
        return f"{key} [{unit}]"

    def describe(self) -> dict[str, Any]:
        """Return plain data that identifies the sweep, with its files and versions."""
        template = self.template
        texts = set[str]()
        for choices in chain(template.sections.values(), *self.axes):
            texts.update(value for value in choices.values() if isinstance(value, str))
        digests = {text: file_digest(template.folder / text) for text in sorted(texts)}
        return {
            "schema": SCHEMA,
            "asperity": __version__,
            "version_digest": template.package,
            **json.loads(template.case_text({})),
            "vary": dict(self.vary),
            "design": self.design,
            "cases": len(self),
            "files": {text: digest for text, digest in digests.items() if digest},
        }


def make_plan(
    scene: str,
    vary: Mapping[str, str],
    run: str,
    *,
    design: str = "",
    laws: str | Sequence[str] | None = None,
    options: Mapping[str, Any] | None = None,
    prepare: bytes = b"",
) -> SweepPlan:
    """Return the plan of a sweep; see :func:`asperity.sweeps.run_sweep.sweep`.

    Args:
        scene: see there, as are the others.
        vary: values by key.
        run: name of the run.
        design: "sobol:64", or empty.
        laws: letters or names.
        options: of the run.
        prepare: see :class:`~asperity.sweeps.case_runs.CaseTemplate`.

    Raises:
        ParameterError: for a key, value, run or option that is unknown or cannot be used.
    """
    sections, folder = read_scene(scene)
    letters = None
    if laws is not None:
        letters = tuple(law.letter for law in find_laws(laws))
    find_run(run).check_options(options or {}, letters)
    _check_texts(vary)
    arguments, axes = _parse_axes(sections, vary, design)
    if not axes:
        raise ParameterError("vary", "is missing: KEY=a,b,c")
    if letters and LAW_KEY in arguments:
        raise ParameterError("laws", f"cannot be given while {LAW_KEY} is varied")
    device = sections.get("device", {})
    if "id" in device:
        device["id"] = _absolute(device["id"])
    template = CaseTemplate(
        sections, folder.resolve(), run, letters, dict(options or {}), package_digest(), prepare
    )
    return SweepPlan(template, arguments, tuple(axes), dict(vary), design, scene)


def _check_texts(vary: Mapping[str, str]) -> None:
    for key, text in vary.items():
        if not isinstance(text, str):
            raise ParameterError(key, 'must be a text, such as "1mm,2mm"', text)


def _parse_axes(
    sections: Mapping[str, Mapping[str, Any]], vary: Mapping[str, str], design: str
) -> tuple[dict[str, Argument], list[list[dict[str, Any]]]]:
    """Return the declarations of the varied keys, and the choices that are combined."""
    declared = find_varied_arguments(sections, {key: text.split(",") for key, text in vary.items()})
    ranges: dict[str, Range] = {}
    axes: list[list[dict[str, Any]]] = []
    for key, text in vary.items():
        argument = declared[key]
        name = argument.name
        if design and is_range(argument, text):
            ranges[name] = parse_range(argument, text, in_design=True)
            continue
        values = parse_values(argument, text)
        for value in values:
            _CHECKS.get(name, str)(value)  # an unknown law or device
        axes.append([{name: _absolute(value)} for value in values])
    if design:
        axes.insert(0, design_points(design, ranges))
    return {argument.name: argument for argument in declared.values()}, axes


def _absolute(value: Any) -> Any:
    """Return a device file by its full path, since workers may run in other folders."""
    if isinstance(value, str) and value.lower().endswith(".toml"):
        return str(Path(value).resolve())
    return value


# Forms of arguments of which a single number is a value.
_NUMBER_FORMS = ("quantity", "integer", "pair", "axes")
_STEPS = re.compile(r"(\d*)\s*(log)?")


class Range(NamedTuple):
    """A range of values.

    Attributes:
        argument: declaration of the key.
        low: first value [SI].
        high: last value [SI].
        is_logarithmic: whether the steps are equal ratios.
        steps: number of values; 0 in a design.
    """

    argument: Argument
    low: float
    high: float
    is_logarithmic: bool
    steps: int

    def at(self, fractions: FloatArray) -> FloatArray:
        """Return the values at fractions of the range, 0 to 1."""
        if self.is_logarithmic:
            return self.low * (self.high / self.low) ** fractions
        return self.low + (self.high - self.low) * fractions


def is_range(argument: Argument, text: str) -> bool:
    """Return whether a text is a range of numbers, START:STOP."""
    return argument.form in _NUMBER_FORMS and ":" in text


def parse_values(argument: Argument, text: str) -> list[Any]:
    """Return the values of a key as they are written in a scene.

    Args:
        argument: declaration, whose name is the key.
        text: "0.5mm:4mm:40" (40 equal steps), "0.5mm:4mm:40log" (40 equal ratios), or values
            separated by commas.

    Raises:
        ParameterError: for an empty or reversed range, or a value that cannot be used.

    Example:
        >>> parse_values(Argument("texture.period", "", "m"), "1mm:4mm:3log")
        ['0.001 m', '0.002 m', '0.004 m']
        >>> parse_values(Argument("device.id", "", form="text"), "touch,omega.3")
        ['touch', 'omega.3']
    """
    if is_range(argument, text):
        _, low, high, is_logarithmic, steps = parse_range(argument, text)
        grid = np.geomspace if is_logarithmic else np.linspace
        values = [scene_value(argument, number) for number in grid(low, high, steps).tolist()]
    else:
        parts = [argument.parse(part.strip()) for part in text.split(",") if part.strip()]
        values = [_canonical(argument, part) for part in parts]
    if not values:
        raise ParameterError("vary", f"{argument.name} needs values: KEY=a,b,c", text)
    if len(set(map(str, values))) < len(values):
        raise ParameterError("vary", f"{argument.name} names a value twice", text)
    return values


def parse_range(argument: Argument, text: str, *, in_design: bool = False) -> Range:
    """Return a range with its number of values; in a design it has none.

    Raises:
        ParameterError: for an empty or reversed range, or a number that cannot be used.
    """
    start, stop, *rest = text.split(":")
    match = _STEPS.fullmatch(":".join(rest).strip())
    usual = "START:STOP or START:STOP:log in a design" if in_design else "START:STOP:COUNT"
    words = f"range of {argument.name} must be {usual}, with log for equal ratios"
    error = ParameterError("vary", f"{words} and two values or more", text)
    if match is None:
        raise error
    steps = int(match[1] or 0)
    if in_design and match[1]:
        raise error
    if not in_design and steps < 2:
        raise error
    low = parse_quantity(argument.name, start, argument.unit)
    high = parse_quantity(argument.name, stop, argument.unit)
    is_logarithmic = match[2] is not None
    words = f"range of {argument.name}: START must be"
    if not low < high:
        raise ParameterError("vary", f"{words} less than STOP: it is empty", text)
    if is_logarithmic and low <= 0.0:
        raise ParameterError("vary", f"{words} positive for equal ratios", text)
    for number in (low, high):
        scene_value(argument, number)
    return Range(argument, low, high, is_logarithmic, steps)


def scene_value(argument: Argument, number: float) -> Any:
    """Return an SI number as it is written in a scene, without the rounding of its computation.

    Fourteen digits are the same on machines whose logarithms differ in the last one.

    Raises:
        ParameterError: for a number out of the bounds of the argument, or a part of a whole one.
    """
    return _canonical(argument, float(f"{number:.14g}"))


def _canonical(argument: Argument, value: Any) -> Any:
    """Return a value [SI] as it is written in a scene: one text for one number."""
    return to_scene_values({argument.name: argument.validate(value)}, [argument])[argument.name]


def table_value(argument: Argument, value: Any) -> Any:
    """Return a value as written in a scene as an SI number, or as a text if it is none.

    Example:
        >>> table_value(Argument("texture.period", "", "m"), "0.5 mm")
        0.0005
    """
    parsed = argument.parse(value)
    if isinstance(parsed, (list, tuple)):
        return "; ".join(map(str, parsed))
    return parsed


def design_points(design: str, ranges: Mapping[str, Range]) -> list[dict[str, Any]]:
    """Return the points of a design: values by key.

    Args:
        design: "sobol:64": that many points of Sobol's sequence, a power of two.
        ranges: by key.

    Raises:
        ParameterError: for another design or number, or no range.
    """
    name, _, count = design.partition(":")
    points = int(count) if name == "sobol" and count.isdecimal() and len(count) < 10 else 0
    if points < 2 or points & (points - 1) or not ranges:
        near = f"sobol:{2 ** min(20, max(1, points.bit_length()))}"
        if points and not ranges:
            raise ParameterError(
                "design", "needs a range to vary, such as {vary}", design, vary="KEY=START:STOP"
            )
        raise ParameterError("design", f"must be sobol:N, N a power of two, such as {near}", design)
    from scipy.stats import qmc

    fractions = qmc.Sobol(len(ranges), scramble=False).random_base2(points.bit_length() - 1)
    columns = {}
    for (key, bounds), column in zip(ranges.items(), fractions.T, strict=True):
        columns[key] = [scene_value(bounds.argument, number) for number in bounds.at(column)]
    rows = zip(*columns.values(), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]
