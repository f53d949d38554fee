"""Study files: a scene with the sections [study], [vary], [method] and [exclusion] (TOML)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument, parse_arguments, read_arguments
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import read_toml
from asperity.scene.scene_file import SECTIONS, read_scene
from asperity.scene.scene_keys import find_scene_argument, scene_arguments
from asperity.studies.design import StudyDesign
from asperity.studies.methods import EXCLUSIONS, METHODS

STUDY_ARGUMENTS = read_arguments(Path(__file__).with_suffix(".toml"))
"""Arguments of the section [study]."""
LEVEL_UNIT = "level"
"""Unit of options that are in the unit of the varied level."""
_OWN_SECTIONS = ("study", "vary", "method", "exclusion")
_CHANGEABLE = ("texture.", "surface.")
_MAX_VALUES = 100  # of a factor


@dataclass(frozen=True)
class Study:
    """A study: its design, and how it is presented.

    Attributes:
        design: kind of the method, factors and options.
        sections: sections of the scene whose keys are varied.
        arguments: declarations of the varied keys.
        folder: folder of relative paths in the scene.
        settings: values of the section [study] by name [SI].
        content: all sections, with those of the scene; they identify the study.
    """

    design: StudyDesign
    sections: Mapping[str, Mapping[str, Any]]
    arguments: Mapping[str, Argument]
    folder: Path
    settings: Mapping[str, Any]
    content: Mapping[str, Any]


def load_study(path: str | Path) -> Study:
    """Load a study file.

    Args:
        path: of the file (TOML).

    Raises:
        ParameterError: for an unknown section, key, kind or factor, with the nearest names, or a
            value that cannot be used.
    """
    content = read_toml("study", path)
    for name, section in content.items():
        if name not in (*_OWN_SECTIONS, *SECTIONS):
            hint = suggest_names(name, (*_OWN_SECTIONS, *SECTIONS))
            raise ParameterError(
                "study", f"{Path(path).name} has an unknown section [{name}]; {hint}"
            )
        if not isinstance(section, dict):
            raise ParameterError("study", f"{Path(path).name}: [{name}] must be a section", section)
    return build_study(content, Path(path).parent)


def build_study(content: Mapping[str, Any], folder: Path) -> Study:
    """Return the study of the sections of a study file.

    Args:
        content: entries by the name of their section.
        folder: folder of relative paths.

    Raises:
        ParameterError: as for :func:`load_study`.
    """
    settings = _parse_section("study", content.get("study", {}), STUDY_ARGUMENTS.values())
    if settings["kind"] not in METHODS:
        hint = suggest_names(settings["kind"], METHODS)
        raise ParameterError("study.kind", f"is unknown: {settings['kind']!r}; {hint}")
    own = {name: content[name] for name in _OWN_SECTIONS if name in content}
    sections = {name: content[name] for name in SECTIONS if name in content}
    if "scene" in settings:
        sections, folder = _separate_scene(settings["scene"], sections, folder)
        own["study"] = {name: value for name, value in own["study"].items() if name != "scene"}
    vary = own.get("vary", {})
    kinds = {key.removesuffix(".kind"): map(str, values) for key, values in vary.items()}
    known = scene_arguments(sections, kinds)
    arguments: dict[str, Argument] = {}
    factors: dict[str, tuple[Any, ...]] = {}
    for key, values in vary.items():
        argument = _find_argument(key, known, arguments)
        arguments[argument.name] = argument
        factors[argument.name] = _parse_factor(argument, values)
    options = _parse_method(settings["kind"], content.get("method", {}), known, arguments)
    options["exclusion"] = _parse_section("exclusion", content.get("exclusion", {}), EXCLUSIONS)
    design = StudyDesign(
        settings["kind"], factors, options, settings["question"], settings["seed"],
        settings["participants"],
    )  # fmt: skip
    return Study(design, sections, arguments, folder.resolve(), settings, {**sections, **own})


def _separate_scene(
    scene: str, sections: Mapping[str, Any], folder: Path
) -> tuple[dict[str, Any], Path]:
    """Return the sections of a scene beside the study, and its folder."""
    if sections:
        words = f"is given beside the section [{next(iter(sections))}]: keep one of them"
        raise ParameterError("study.scene", words, scene)
    path = folder / scene
    return read_scene(str(path) if path.exists() else scene)


def _parse_section(
    name: str, entries: Mapping[str, Any], arguments: Iterable[Argument]
) -> dict[str, Any]:
    """Return the values of a section, with its defaults; those without one are left out."""
    declared = list(arguments)
    given = parse_arguments(name, entries, declared)
    values = {}
    for one in declared:
        if one.required and one.name not in given:
            raise ParameterError(f"{name}.{one.name}", f"is missing: {one.description}")
        value = one.validate(given[one.name]) if one.name in given else one.default
        if value is not None:
            values[one.name] = value
    return values


def _find_argument(
    key: str, declared: Mapping[str, Argument], taken: Mapping[str, Argument]
) -> Argument:
    """Return the argument of a varied key, which can change while the loop runs."""
    argument = find_scene_argument(key, declared)
    if argument.name in taken:
        raise ParameterError("vary", f"names a key twice: {argument.name}")
    if not argument.name.startswith(_CHANGEABLE):
        words = "cannot change while the participant holds the device: texture.* and surface.* can"
        raise ParameterError("vary", f"{argument.name} {words}")
    return argument


def _parse_factor(argument: Argument, values: Any) -> tuple[Any, ...]:
    """Return the values of a factor [SI]."""
    if not isinstance(values, list) or not 0 < len(values) <= _MAX_VALUES:
        words = f"{argument.name} must be a list of 1 to {_MAX_VALUES} values"
        raise ParameterError("vary", words, values)
    parsed = tuple(argument.validate(argument.parse(value)) for value in values)
    if len(set(map(str, parsed))) < len(parsed):
        raise ParameterError("vary", f"{argument.name} names a value twice", values)
    return parsed


def _parse_method(
    kind: str,
    entries: Mapping[str, Any],
    keys: Mapping[str, Argument],
    arguments: dict[str, Argument],
) -> dict[str, Any]:
    """Return the options of a method; the level that it varies is added to the arguments."""
    declared: Sequence[Argument] = METHODS[kind].arguments
    unit = ""
    if isinstance(key := entries.get("level"), str):
        level = _find_argument(key, keys, arguments)
        entries, arguments[level.name] = {**entries, "level": level.name}, level
        unit = level.unit
    scaled = [replace(one, unit=unit) if one.unit == LEVEL_UNIT else one for one in declared]
    return _parse_section("method", entries, scaled)
