"""The plan of a sweep: its scene, the values of its cases, and what is computed for each."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument
from asperity.core.errors import ParameterError
from asperity.core.files import package_digest
from asperity.core.version import __version__
from asperity.devices import load_device
from asperity.laws import find_law, find_laws
from asperity.recording.replay import file_digest
from asperity.scene.scene_file import DEVICE_ID, read_scene
from asperity.scene.scene_keys import find_varied_arguments
from asperity.sweeps import variations
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
            self.column(key): variations.table_value(argument, values[key])
            for key, argument in self.arguments.items()
        }

    def column(self, key: str) -> str:
        """Return the column of a key, "texture.period [m]"."""
        unit = self.arguments[key].unit
        return f"{key} [{unit}]" if unit else key

    def describe(self) -> dict[str, Any]:
        """Return plain data that identifies the sweep, with its files and versions."""
        template = self.template
        texts = set[str]()
        for choices in (*template.sections.values(), *(one for axis in self.axes for one in axis)):
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
        letters = tuple(one.letter for one in find_laws(laws if isinstance(laws, str) else [*laws]))
    find_run(run).check_options(options or {}, letters)
    arguments, axes = _parse_axes(sections, vary, design)
    if not axes or (letters and LAW_KEY in arguments):
        words = f"cannot be given while {LAW_KEY} is varied" if axes else "is missing: KEY=a,b,c"
        raise ParameterError("laws" if axes else "vary", words)
    device = sections.get("device", {})
    if "id" in device:
        device["id"] = _absolute(device["id"])
    template = CaseTemplate(
        sections, folder.resolve(), run, letters, dict(options or {}), package_digest(), prepare
    )
    return SweepPlan(template, arguments, tuple(axes), dict(vary), design, scene)


def _parse_axes(
    sections: Mapping[str, Mapping[str, Any]], vary: Mapping[str, str], design: str
) -> tuple[dict[str, Argument], list[list[dict[str, Any]]]]:
    """Return the declarations of the varied keys, and the choices that are combined."""
    found = find_varied_arguments(sections, {key: text.split(",") for key, text in vary.items()})
    ranges: dict[str, variations.Range] = {}
    axes: list[list[dict[str, Any]]] = []
    for key, text in vary.items():
        argument = found[key]
        name = found[key].name
        if design and variations.is_range(argument, text):
            ranges[name], _ = variations.parse_range(argument, text, in_design=True)
            continue
        values = variations.parse_values(argument, text)
        for value in values:
            _CHECKS.get(name, str)(value)  # an unknown law or device
        axes.append([{name: _absolute(value)} for value in values])
    arguments = {argument.name: argument for argument in found.values()}
    return arguments, [variations.design_points(design, ranges), *axes] if design else axes


def _absolute(value: Any) -> Any:
    """Return a device file by its full path, since workers may run in other folders."""
    is_file = isinstance(value, str) and value.lower().endswith(".toml")
    return str(Path(value).resolve()) if is_file else value
