"""The keys of a scene file, "texture.period" or "device.update_rate", and a template of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument
from asperity.core.errors import ParameterError, suggest_names
from asperity.devices import FIELD_TABLE, device_names
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.scene.loop_sections import HANDS, MOTIONS, RUN_ARGUMENTS, SectionKind
from asperity.scene.scene_file import DEVICE_ID, TEXTURE_KINDS, surface_arguments
from asperity.servo import safety
from asperity.textures.texture import TextureKind

Kinds = Mapping[str, TextureKind] | Mapping[str, SectionKind]
_KINDS: dict[str, Kinds] = {"texture": TEXTURE_KINDS, "hand": HANDS, "motion": MOTIONS}


def scene_arguments(
    sections: Mapping[str, Mapping[str, Any]], kinds: Mapping[str, Iterable[str]] | None = None
) -> dict[str, Argument]:
    """Return the arguments that a scene can have by key, "section.name"; so are they named.

    Args:
        sections: the scene, whose kinds of texture, hand and motion decide which arguments exist.
        kinds: further kinds by section.

    Example:
        >>> known = scene_arguments({"texture": {"kind": "sinusoid"}})
        >>> known["texture.period"].unit, known["device.update_rate"].unit
        ('m', 'Hz')
    """
    arguments: dict[str, Iterable[Argument]] = {
        "surface": surface_arguments(),
        "device": (replace(DEVICE_ID, name="id"), *FIELD_TABLE.values()),
        "run": RUN_ARGUMENTS,
        "servo": safety.ARGUMENTS,
    }
    for section, known in _KINDS.items():
        names = {str(sections.get(section, {}).get("kind", "")), *(kinds or {}).get(section, ())}
        declared = [Argument("kind", f"kind of {section}", form="text", choices=tuple(known))]
        if section == "texture" and names - {"file"}:
            declared += SYNTHETIC_ARGUMENTS
        for name in names & known.keys():
            declared += known[name].arguments
        arguments[section] = declared
    return {
        f"{section}.{argument.name}": replace(argument, name=f"{section}.{argument.name}")
        for section, declared in arguments.items()
        for argument in declared
    }


def find_scene_argument(key: str, arguments: Mapping[str, Argument]) -> Argument:
    """Return the argument of a key; "device" is short for "device.id".

    Raises:
        ParameterError: for an unknown key, with the nearest ones.
    """
    name = key.strip().replace("-", "_")
    if name == "device":
        name = DEVICE_ID.name
    if name in arguments:
        return arguments[name]
    section = name.partition(".")[0]
    of_section = [key for key in arguments if key.startswith(f"{section}.")]
    near, _, names = suggest_names(name, arguments).partition("known: ")
    listed = ", ".join(of_section) or f"the keys of a scene, such as {names[:60]} ..."
    raise ParameterError("vary", f"names no key of the scene: {name}; {near}known: {listed}")


def find_varied_arguments(
    sections: Mapping[str, Mapping[str, Any]], vary: Mapping[str, Iterable[str]], *others: str
) -> dict[str, Argument]:
    """Return the arguments of varied keys, by the keys as they are given.

    Args:
        sections: the scene.
        vary: values by key; those of "texture.kind" decide which arguments exist.
        others: further keys.

    Raises:
        ParameterError: for an unknown key, with the nearest ones, or one that is named twice.
    """
    kinds = {key.removesuffix(".kind"): values for key, values in vary.items()}
    known = scene_arguments(sections, kinds)
    varied: dict[str, Argument] = {}
    for key in (*vary, *others):
        argument = find_scene_argument(key, known)
        if argument in varied.values():
            raise ParameterError("vary", f"names a key twice: {argument.name}")
        varied[key] = argument
    return varied


def with_values(
    sections: Mapping[str, Mapping[str, Any]], values: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return the sections of a scene with other values of some keys.

    Example:
        >>> with_values({"texture": {"kind": "cloth"}}, {"surface.law": "A"})
        {'texture': {'kind': 'cloth'}, 'surface': {'law': 'A'}}
    """
    changed = {name: dict(section) for name, section in sections.items()}
    for key, value in values.items():
        section, _, name = key.partition(".")
        changed.setdefault(section, {})[name] = value
    return changed


_TEMPLATE = Path(__file__).with_name("scene_template.txt")
# Values of the template, in TOML.
_TEXTURE = {"amplitude": '"0.1 mm"', "period": '"2 mm"'}
_SURFACE = {"law": '"C"', "stiffness": '"300 N/m"', "max_depth": '"0.5 mm"'}
_HAND = {
    "stiffness": '["300 N/m", "300 N/m", "0 N/m"]',
    "damping": '"3 N*s/m"',
    "mass": '"50 g"',
    "force": '["0 N", "0 N", "-0.1 N"]',
}
_MOTION = {
    "start": '["-10 mm", "0 mm", "0 mm"]',
    "end": '["10 mm", "0 mm", "0 mm"]',
    "speed": '"0.05 m/s"',
    "count": "2",
}
_AXIS_COUNTS = {"space": 3, "plane": 2}
_FIXED_EXAMPLES = {"switch": "true", "vector": "[1, 0]"}


def scene_template(name: str = "scene.toml") -> str:
    """Return a scene file (TOML) with comments, which runs as it stands.

    Args:
        name: name of the file, for the commands in its header.

    Example:
        >>> [line for line in scene_template().splitlines() if line.startswith("period")]
        ['period = "2 mm"  # wavelength [m]']
    """
    sinusoid = TEXTURE_KINDS["sinusoid"].arguments
    names = {argument.name for argument in sinusoid}
    others = [argument for argument in SYNTHETIC_ARGUMENTS if argument.name not in names]
    texture = _kind_line("sinusoid", TEXTURE_KINDS, "; surfaces lists their arguments")
    hand = _kind_line("spring", HANDS)
    motion = _kind_line("strokes", MOTIONS)
    return _TEMPLATE.read_text("utf-8").format(
        name=name,
        texture=texture + _argument_lines((*sinusoid, *others), _TEXTURE),
        surface=_argument_lines(surface_arguments(), _SURFACE),
        devices=", ".join(device_names()),
        hand=hand + _argument_lines(HANDS["spring"].arguments, _HAND),
        motion=motion + _argument_lines(MOTIONS["strokes"].arguments, _MOTION),
        run=_argument_lines(RUN_ARGUMENTS, {}),
        servo=_argument_lines(safety.ARGUMENTS, {}).rstrip("\n"),
    )


def _kind_line(
    name: str, kinds: Mapping[str, TextureKind] | Mapping[str, SectionKind], more: str = ""
) -> str:
    others = ", ".join(sorted(kinds.keys() - {name}))
    return f'kind = "{name}"  # or {others}{more}\n'


def _argument_lines(arguments: Iterable[Argument], values: Mapping[str, str]) -> str:
    """Return a line for each argument, as a comment if it has no value."""
    lines = []
    for argument in arguments:
        comment = argument.description
        if argument.unit:
            comment += f" [{argument.unit}]"
        if argument.name in values:
            lines.append(f"{argument.name} = {values[argument.name]}  # {comment}")
            continue
        if argument.default_text:
            comment += f"; default {argument.default_text}"
        lines.append(f"# {argument.name} = {_example_value(argument)}  # {comment}")
    return "\n".join(lines) + "\n"


def _example_value(argument: Argument) -> str:
    """Return a value in TOML: the example, the default, or one of this form."""
    quoted = '"{}"'.format
    if argument.form in _FIXED_EXAMPLES:
        return _FIXED_EXAMPLES[argument.form]
    if argument.form in _AXIS_COUNTS:
        zeros = [quoted(f"0 {argument.unit}")] * _AXIS_COUNTS[argument.form]
        return f"[{', '.join(zeros)}]"
    value = argument.default
    if value is None:
        value = 1
    if argument.unit:
        text = argument.format_value(value).replace("°", " deg").replace("µ", "u")
        return quoted(argument.example or text)
    if argument.example:
        return argument.example
    if argument.form == "text":
        return quoted(value)
    return str(value)
