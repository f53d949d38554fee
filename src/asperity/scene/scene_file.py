"""Scenes: files (TOML) or specifications of a texture, and the arguments of their sections."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from asperity.core.arguments import MAX_DEPTH, RENDERING, STIFFNESS, Argument, parse_arguments
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.files import read_toml, to_plain_data
from asperity.devices import Device, load_device, override_device, parse_device
from asperity.laws import SHIPPED_LAW_ARGUMENTS, Law, registered_arguments
from asperity.laws.clamps import CLAMPS, NONE
from asperity.laws.friction import FRICTION_ARGUMENTS
from asperity.textures import catalogue
from asperity.textures.texture import Texture

TEXTURE_KINDS = catalogue.KINDS
DEVICE_ID = Argument("device.id", "device of the catalogue", form="text")
LOOP_SECTIONS = ("hand", "motion", "run", "servo")
SECTIONS = ("texture", "surface", "device", *LOOP_SECTIONS)


@dataclass(frozen=True)
class Scene:
    """The content of a specification, a scene file or a measured file.

    Attributes:
        texture: the texture.
        surface: the given arguments of :class:`~asperity.surface.Surface`.
        device: the device, ``None`` if there is none.
        loop: the sections [hand], [motion], [run] and [servo]; see
            :func:`~asperity.scene.setup.make_setup`.
        folder: folder to which paths in these sections are relative.
        files: the scene file and a measured surface, if it was loaded from them.
        text: the scene file as it was read, or the specification.
    """

    texture: Texture
    surface: Mapping[str, Any] = field(default_factory=dict)
    device: Device | None = None
    loop: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    folder: Path = Path()
    files: tuple[Path, ...] = ()
    text: str = ""


def load_scene(source: str, file_arguments: Mapping[str, Any] | None = None) -> Scene:
    """Load a scene.

    Args:
        source: ``kind:argument=value,...`` ("sinusoid:amplitude=0.8mm,period=1mm", or "cloth"
            with its defaults), the path of a scene file (TOML), or of a measured surface.
        file_arguments: arguments of :func:`~asperity.textures.load_texture`; those of
            :func:`~asperity.textures.kinds.prepare_synthetic.prepare_texture` apply to any
            other texture.

    Raises:
        ParameterError: a kind or argument is unknown (the message suggests the nearest), or a
            value cannot be used.
        SurfaceFileError: a file cannot be read.

    Example:
        >>> load_scene("sinusoid:amplitude=0.8mm,period=1 mm").texture.period
        0.001
    """
    extra = dict(file_arguments or {})
    if catalogue.is_scene(source) and catalogue.parse_specification(source) is None:
        path = Path(source)
        scene = build_scene(read_sections(path), path.parent, path, extra)
        return replace(scene, text=path.read_text(encoding="utf-8-sig"))
    return Scene(catalogue.as_texture(source, extra), text=source)


def read_scene(source: str) -> tuple[dict[str, dict[str, Any]], Path]:
    """Return the sections of a scene without building it, and the folder of its relative paths.

    Args:
        source: as for :func:`load_scene`; a specification or a measured surface becomes a section
            [texture].

    Raises:
        ParameterError: a scene file cannot be read, or contains something else than sections.

    Example:
        >>> read_scene("sinusoid:period=1mm")[0]
        {'texture': {'kind': 'sinusoid', 'period': '1mm'}}
    """
    specification = catalogue.parse_specification(source)
    if specification is not None:
        kind, arguments = specification
        return {"texture": {"kind": kind, **arguments}}, Path()
    path = Path(source)
    if catalogue.is_scene(source):
        return read_sections(path), path.parent
    return {"texture": {"kind": "file", "path": path.name}}, path.parent


def read_sections(
    path: Path, argument: str = "scene", own: Sequence[str] = ()
) -> dict[str, dict[str, Any]]:
    """Return the sections of a scene file, or of a file with further sections.

    Args:
        path: of the file (TOML).
        argument: name for messages.
        own: names of the further sections.

    Raises:
        ParameterError: if it cannot be read, has an unknown section or something else than
            sections, or names code.
    """
    content = read_toml(argument, path)
    known = (*own, *SECTIONS)
    _reject_code(content)
    for name in content:
        if name not in known:
            hint = suggest_names(name, known)
            raise ParameterError(argument, f"{path.name} has an unknown section [{name}]; {hint}")
    for name, section in content.items():
        if not isinstance(section, dict):
            raise ParameterError(argument, f"{path.name}: [{name}] must be a section", section)
    return content


def build_scene(
    sections: Mapping[str, Mapping[str, Any]],
    folder: Path,
    path: Path = Path("the scene"),
    extra: Mapping[str, Any] | None = None,
) -> Scene:
    """Return the scene of sections as they stand in a scene file.

    Args:
        sections: entries by the name of their section.
        folder: folder to which paths in the sections are relative.
        path: the scene file.
        extra: see ``file_arguments`` of :func:`load_scene`.

    Raises:
        ParameterError: as for :func:`load_scene`.
    """
    texture = dict(sections.get("texture", {}))
    kind = texture.pop("kind", None)
    if not isinstance(kind, str):
        known = " | ".join(f'"{name}"' for name in TEXTURE_KINDS)
        raise ParameterError("scene", f"{path.name} needs [texture] with kind = {known}", kind)
    surface = parse_arguments("surface", sections.get("surface", {}), surface_arguments())
    device = _scene_device(sections["device"]) if "device" in sections else None
    loop = {name: sections[name] for name in LOOP_SECTIONS if name in sections}
    built = catalogue.build_texture(kind, texture, folder, extra)
    files = [folder / texture["path"]] if "path" in texture else []
    return Scene(built, surface, device, loop, folder, (path, *files))


def _reject_code(content: Mapping[str, Any]) -> None:
    """Refuse a scene that names code, which only the command line may do."""
    sections = [section for section in content.values() if isinstance(section, dict)]
    for name in (name for section in (content, *sections) for name in section):
        if name.replace("-", "_").lower() in {"law_module", "law_modules", "plugin", "plugins"}:
            raise ParameterError(
                name,
                "is refused: a scene never runs code; name the file to the program, as {plugin}",
                plugin=None,
            )


def _scene_device(section: Mapping[str, Any]) -> Device:
    """Return a device of the catalogue with overridden fields, or one defined in the scene."""
    fields = {name: value for name, value in section.items() if name != "id"}
    if "id" not in section:
        return parse_device(fields, "the scene's device", from_file=True)
    return override_device(load_device(DEVICE_ID.parse(section["id"])), fields)


LAW = Argument("law", "letter or name of the law", default="C", form="text")
CLAMP = Argument(
    "clamp", "limit of the force below max_depth", "", NONE.name, form="text", choices=tuple(CLAMPS)
)
SURFACE_FIELDS = (LAW, STIFFNESS, MAX_DEPTH, CLAMP, RENDERING)
"""Arguments of [surface] besides the parameters of its law."""


def surface_arguments() -> tuple[Argument, ...]:
    """Return the arguments of [surface]: those of the surface and of all registered laws."""
    return (*SURFACE_FIELDS, *registered_arguments().values())


def surface_keywords(values: Mapping[str, Any], *laws: Law) -> dict[str, Any]:
    """Return values of a surface as keywords of :class:`~asperity.surface.Surface`, and rendering.

    Parameters declared by one of the laws, and those unknown to the shipped laws, become
    ``law_parameters``; friction and parameters of other shipped laws are keywords.
    """
    names = set(SHIPPED_LAW_ARGUMENTS) - set(registered_arguments(laws)) | set(FRICTION_ARGUMENTS)
    names |= {argument.name for argument in SURFACE_FIELDS}
    keywords = {name: value for name, value in values.items() if name in names}
    rest = {name: value for name, value in values.items() if name not in names}
    if rest:
        keywords["law_parameters"] = rest
    return keywords


def to_scene_values(values: Mapping[str, Any], arguments: Iterable[Argument]) -> dict[str, Any]:
    """Return the declared values as written in a scene, with their units.

    Args:
        values: values by name [SI]; ``None`` for missing ones.
        arguments: the declared arguments.
    """
    known = {argument.name: argument for argument in arguments}
    return {
        name: _to_scene_value(to_plain_data(value), known[name].unit)
        for name, value in values.items()
        if name in known and value is not None
    }


def _to_scene_value(value: Any, unit: str) -> Any:
    if isinstance(value, (list, tuple)):
        return [_to_scene_value(part, unit) for part in value]
    if isinstance(value, (bool, str)) or not unit:
        return value
    return f"{value!r} {unit}"
