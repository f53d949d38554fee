"""The plan of a sweep: its scene, the values of its cases, and what is computed for each."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from asperity.core.digests import package_digest
from asperity.core.errors import ParameterError
from asperity.core.version import __version__
from asperity.devices import load_device
from asperity.laws import find_law, find_laws
from asperity.recording.replay import file_digest
from asperity.scene.scene_file import DEVICE_ID, read_scene
from asperity.scene.scene_keys import find_scene_argument, scene_arguments
from asperity.sweeps.run_kinds import find_run
from asperity.sweeps.variations import Variation, design_points, parse_variation

SCHEMA = 1
LAW_KEY = "surface.law"


@dataclass(frozen=True)
class CaseTemplate:
    """What all cases of a sweep share; it is sent to the workers.

    Attributes:
        sections: sections of the scene.
        folder: folder of the paths in the scene.
        device_folder: folder of a device file.
        run: name of the run.
        laws: letters or names of the laws; ``None`` for all.
        options: arguments of the run by name.
        package: digest of the package that a worker must have.
        prepare: pickled function that each worker process calls first; empty for none.
    """

    sections: Mapping[str, Mapping[str, Any]]
    folder: Path
    device_folder: Path
    run: str
    laws: tuple[str, ...] | None
    options: Mapping[str, Any]
    package: str
    prepare: bytes = b""

    def case_sections(self, values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Return the sections of a case, whose values replace those of the scene."""
        sections = {name: dict(section) for name, section in self.sections.items()}
        for key, value in values.items():
            section, _, name = key.partition(".")
            sections.setdefault(section, {})[name] = value
        return sections

    def case_text(self, values: Mapping[str, Any]) -> str:
        """Return the text of a case: its scene and what is computed, the same for the same case."""
        content = {
            "scene": self.case_sections(values),
            "run": self.run,
            "laws": self.laws,
            "options": self.options,
        }
        return json.dumps(content, sort_keys=True, ensure_ascii=False, default=str)


@dataclass(frozen=True)
class SweepPlan:
    """All cases of a sweep; they are numbered, and made when they are needed.

    Attributes:
        template: what they share.
        variations: varied keys, of which the last one changes fastest.
        design: "sobol:64", or empty for all combinations.
        source: scene as given.
    """

    template: CaseTemplate
    variations: tuple[Variation, ...]
    design: str = ""
    source: str = field(default="", compare=False)

    @cached_property
    def points(self) -> Any:
        """Numbers of the design, shape (n, ranges); ``None`` without a design."""
        if not self.design:
            return None
        return design_points(self.design, {one.key: one for one in self.variations})

    @cached_property
    def _sizes(self) -> list[int]:
        """Numbers of choices that are combined: points of the design, then listed values."""
        if self.points is None:
            return [len(one.values) for one in self.variations]
        return [len(self.points), *(len(one.values) for one in self.variations if not one.is_range)]

    def __len__(self) -> int:
        return math.prod(self._sizes)

    def values(self, index: int) -> dict[str, Any]:
        """Return the values of a case by key, as written in a scene."""
        choices = []
        for size in reversed(self._sizes):
            index, choice = divmod(index, size)
            choices.append(choice)
        chosen = iter(reversed(choices))
        if self.points is None:
            return {one.key: one.values[next(chosen)] for one in self.variations}
        row = iter(self.points[next(chosen)])
        return {
            one.key: one.scene_value(float(f"{next(row):.14g}"))
            if one.is_range
            else one.values[next(chosen)]
            for one in self.variations
        }

    def numbers(self, index: int) -> dict[str, Any]:
        """Return the values of a case by column: SI numbers, or texts."""
        values = self.values(index)
        return {one.column: one.number(values[one.key]) for one in self.variations}

    def describe(self) -> dict[str, Any]:
        """Return plain data that identifies the sweep, with its files and versions."""
        template, varied = self.template, {}
        for one in self.variations:
            varied[one.key] = list(one.values)
        return {
            "schema": SCHEMA,
            "asperity": __version__,
            "package": template.package,
            "run": template.run,
            "laws": None if template.laws is None else list(template.laws),
            "options": dict(template.options),
            "scene": dict(template.sections),
            "vary": varied,
            "design": self.design,
            "cases": len(self),
            "files": dict(self._file_digests()),
        }

    def _file_digests(self) -> Iterator[tuple[str, str | None]]:
        """Yield the files of the scene and of its devices, with a digest of their content."""
        template = self.template
        known = scene_arguments(template.sections, _varied_kinds(self.variations))
        values = {
            f"{section}.{name}": [value]
            for section, entries in template.sections.items()
            for name, value in entries.items()
        } | {one.key: list(one.values) for one in self.variations}
        for key, several in values.items():
            for value in map(str, several):
                if key in known and known[key].form == "path":
                    yield value, file_digest(template.folder / value)
                elif key == DEVICE_ID.name and value.lower().endswith(".toml"):
                    yield value, file_digest(template.device_folder / value)


def _varied_kinds(variations: Sequence[Variation]) -> dict[str, list[str]]:
    """Return the kinds among the values, by section."""
    pairs = [(one.key.partition("."), one.values) for one in variations]
    return {key[0]: [*map(str, values)] for key, values in pairs if key[2] == "kind"}


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

    Raises:
        ParameterError: for a key, value, run or option that is unknown or cannot be used.
    """
    sections, folder = read_scene(scene)
    if not vary:
        raise ParameterError("vary", "is missing: name a key and its values, KEY=START:STOP:COUNT")
    letters = None
    if laws is not None:
        letters = tuple(one.letter for one in find_laws(laws if isinstance(laws, str) else [*laws]))
    find_run(run).check_options(options or {}, letters)
    kinds = {key.partition(".")[0]: text.split(",") for key, text in vary.items() if ".kind" in key}
    known = scene_arguments(sections, kinds)
    variations = [
        parse_variation(find_scene_argument(key, known), text, in_design=bool(design))
        for key, text in vary.items()
    ]
    _check_variations(variations, letters)
    template = CaseTemplate(
        sections, folder.resolve(), Path.cwd(), run, letters, dict(options or {}),
        package_digest(), prepare,
    )  # fmt: skip
    plan = SweepPlan(template, tuple(variations), design, scene)
    len(plan)  # the points of a design
    return plan


def _check_variations(variations: Sequence[Variation], laws: tuple[str, ...] | None) -> None:
    """Check the keys, and values that name laws and devices, before anything is computed."""
    keys = [one.key for one in variations]
    if len(set(keys)) < len(keys):
        raise ParameterError("vary", f"names a key twice: {', '.join(keys)}")
    if laws is not None and LAW_KEY in keys:
        raise ParameterError("laws", f"cannot be given while {LAW_KEY} is varied")
    checks = {LAW_KEY: find_law, DEVICE_ID.name: load_device}
    for one in variations:
        for value in one.values if one.key in checks else ():
            checks[one.key](value)
