"""Study files: a scene with the sections [study], [vary], [method] and [exclusion] (TOML)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from asperity.core.arguments import STIFFNESS, Argument, parse_arguments, read_arguments
from asperity.core.errors import ParameterError
from asperity.scene.scene_file import SECTIONS, read_scene, read_sections
from asperity.scene.scene_keys import find_varied_arguments
from asperity.studies.design import StudyDesign
from asperity.studies.methods import EXCLUSIONS, METHODS
from asperity.sweeps.sweep_plan import parse_values

STUDY_ARGUMENTS = read_arguments(Path(__file__).with_suffix(".toml"))
"""Arguments of the section [study] by name."""
STUDY_ARGUMENTS["kind"] = replace(STUDY_ARGUMENTS["kind"], choices=tuple(METHODS))
_OWN_SECTIONS = ("study", "vary", "method", "exclusion")
_MAX_COUNT = 10_000
_STIFFNESS_KEY = f"surface.{STIFFNESS.name}"


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
    content = read_sections(Path(path), "study", _OWN_SECTIONS)
    folder = Path(path).parent
    scene = content.get("study", {}).pop("scene", None)
    if scene is not None:
        for name in filter(content.__contains__, SECTIONS):
            reason = f"is given beside the section [{name}]: keep one of them"
            raise ParameterError("study.scene", reason, scene)
        sections, folder = read_scene(str(folder / str(scene)))
        content |= sections
    return build_study(content, folder)


def build_study(content: Mapping[str, Any], folder: Path) -> Study:
    """Return the study of the sections of a study file, which do not name another scene.

    Args:
        content: entries by the name of their section.
        folder: folder of relative paths.

    Raises:
        ParameterError: as for :func:`load_study`.
    """
    for name, section in content.items():
        if not isinstance(section, Mapping):
            raise ParameterError("study", f"needs a section [{name}] of entries", section)
    settings = _parse_section("study", content, STUDY_ARGUMENTS.values())
    sections = {name: content[name] for name in SECTIONS if name in content}
    vary = content.get("vary", {})
    method = dict(content.get("method", {}))
    for key, values in vary.items():
        if not isinstance(values, list):
            raise ParameterError("vary", f"{key} must be a list of values", values)
    levels = [str(method["level"])] if "level" in method else []
    texts = {key: [str(value) for value in values] for key, values in vary.items()}
    varied = find_varied_arguments(sections, texts, *levels)
    unit = ""
    arguments = {argument.name: argument for argument in varied.values()}
    for name in arguments:
        if not name.startswith(("texture.", "surface.")):
            raise ParameterError(
                "vary",
                f"{name} "
                "cannot change while the participant holds the device: texture.* and surface.*"
                " can",
            )
    if _STIFFNESS_KEY in arguments and "texture_force" in settings:
        raise ParameterError("study.texture_force", f"sets {_STIFFNESS_KEY}, which is varied, too")
    for level in levels:
        method["level"] = varied[level].name
        unit = varied[level].unit
    kind = METHODS[settings["kind"]]
    options = _parse_section("method", {"method": method}, kind.arguments, unit)
    for name, value in {**options, "participants": settings["participants"]}.items():
        if isinstance(value, int) and value > _MAX_COUNT:
            raise ParameterError(name, f"must be at most {_MAX_COUNT}", value)
    options["exclusion"] = _parse_section("exclusion", content, EXCLUSIONS)
    factors = {}
    for key, values in texts.items():
        argument = varied[key]
        items = parse_values(argument, ", ".join(values))
        factors[argument.name] = tuple(map(argument.parse, items))
    plan = {name: settings[name] for name in ("kind", "question", "seed", "participants")}
    design = StudyDesign(factors=factors, options=options, unit=unit, **plan)
    return Study(design, sections, arguments, folder.resolve(), settings, content)


def _parse_section(
    section: str, content: Mapping[str, Any], arguments: Iterable[Argument], unit: str = ""
) -> dict[str, Any]:
    """Return the values of a section, with its defaults; those without one are left out.

    Args:
        section: its name.
        content: all sections.
        arguments: declarations.
        unit: of options whose declared unit is "level".
    """
    declared = [
        replace(argument, unit=unit) if argument.unit == "level" else argument
        for argument in arguments
    ]
    stated = parse_arguments(section, content.get(section, {}), declared)
    values: dict[str, Any] = {}
    for argument in declared:
        name = argument.name
        if name in stated:
            values[name] = argument.validate(stated[name])
        elif argument.required:
            raise ParameterError(f"{section}.{name}", f"is missing: {argument.description}")
        elif argument.default is not None:
            values[name] = argument.default
    return values
