"""The keys of a scene file, "texture.period" or "device.update_rate", with their declarations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from asperity.core.arguments import Argument
from asperity.core.errors import ParameterError, suggest_names
from asperity.devices import FIELD_TABLE
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.scene.scene_file import DEVICE_ID, TEXTURE_KINDS
from asperity.scene.sections import HANDS, MOTIONS, RUN_ARGUMENTS, SectionKind, surface_arguments
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
        given = sections.get(section, {}).get("kind", "")
        names = {str(given), *(kinds or {}).get(section, ())}
        kind = Argument("kind", f"kind of {section}", form="text", choices=tuple(known))
        own = [one for name in names if name in known for one in known[name].arguments]
        shared = SYNTHETIC_ARGUMENTS if section == "texture" and names - {"file"} else ()
        arguments[section] = (kind, *shared, *own)
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
    name = DEVICE_ID.name if name == "device" else name
    if name not in arguments:
        mine = [one for one in arguments if one.startswith(f"{name.partition('.')[0]}.")]
        near, _, names = suggest_names(name, arguments).partition("known: ")
        listed = ", ".join(mine) if mine else f"the keys of a scene, such as {names[:60]} ..."
        raise ParameterError("vary", f"names no key of the scene: {name}; {near}known: {listed}")
    return arguments[name]


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
    found: dict[str, Argument] = {}
    for key in (*vary, *others):
        argument = find_scene_argument(key, known)
        if argument in found.values():
            raise ParameterError("vary", f"names a key twice: {argument.name}")
        found[key] = argument
    return found


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
