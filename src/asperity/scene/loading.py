"""From text to a scene: a scene file, or what names a texture alone."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asperity.arguments import Argument, read_arguments
from asperity.devices import Device, changed_device, load_device, parse_device
from asperity.errors import ParameterError, nearest_names
from asperity.files import read_toml
from asperity.recording.recording import open_recording
from asperity.recording.replay import recorded_texture
from asperity.scene.sections import surface_arguments
from asperity.textures import naming
from asperity.textures.naming import as_texture, build_texture, is_scene, specified
from asperity.textures.texture import Kind, Texture

RECORDED = Kind(
    "recording",
    "the surface that a recording holds",
    lambda path: recorded_texture(open_recording(path)),
    (Argument("path", "the recording, relative to the scene", form="path", required=True),),
)
KINDS: Mapping[str, Kind] = ChainMap({RECORDED.name: RECORDED}, *naming.KINDS.maps)
"""What [texture] of a scene can be."""
_ID = Argument("device.id", "device of the catalogue", form="text")
LOOP_SECTIONS = ("hand", "motion", "run", "servo")
SECTIONS = ("texture", "surface", "device", *LOOP_SECTIONS)


@dataclass(frozen=True)
class Scene:
    """What a specification, a scene file or a measured file says.

    Attributes:
        texture: the texture.
        surface: arguments of :class:`~asperity.surface.Surface` that were given.
        device: the device, if one was given.
        loop: the sections [hand], [motion], [run] and [servo] as they were given; see
            :func:`~asperity.scene.setup.make_setup`.
        folder: to which paths in these sections are relative.
        files: that it was read from, the scene file and a measured surface.
    """

    texture: Texture
    surface: Mapping[str, Any] = field(default_factory=dict)
    device: Device | None = None
    loop: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    folder: Path = Path()
    files: tuple[Path, ...] = ()


def load_scene(source: str, file_arguments: Mapping[str, Any] | None = None) -> Scene:
    """Return the scene that a text names.

    Args:
        source: ``kind:argument=value,...`` ("sinusoid:amplitude=0.8mm,period=1mm", or "cloth"
            with its defaults), the path of a scene file (TOML), or of a measured surface.
        file_arguments: arguments of :func:`~asperity.textures.load_texture`; of those other
            textures take the ones of :func:`~asperity.textures.drawn.prepare_texture`.

    Raises:
        ParameterError: for an unknown kind or argument (the nearest are offered), or a value
            that cannot be used.
        SurfaceFileError: for a file that cannot be read.

    Example:
        >>> load_scene("sinusoid:amplitude=0.8mm,period=1 mm").texture.period
        0.001
    """
    extra = dict(file_arguments or {})
    if is_scene(source) and specified(source) is None:
        return _load_scene_file(Path(source), extra)
    return Scene(as_texture(source, extra))


def _load_scene_file(path: Path, extra: Mapping[str, Any]) -> Scene:
    content = read_toml("scene", path)
    _refuse_code(content)
    for name in content:
        if name not in SECTIONS:
            hint = nearest_names(name, SECTIONS)
            raise ParameterError("scene", f"{path.name} has an unknown section [{name}]; {hint}")
    for name, section in content.items():
        if not isinstance(section, dict):
            raise ParameterError("scene", f"{path.name}: [{name}] must be a section", section)
    texture = dict(content.get("texture", {}))
    kind = texture.pop("kind", None)
    if not isinstance(kind, str):
        known = " | ".join(f'"{name}"' for name in KINDS)
        raise ParameterError("scene", f"{path.name} needs [texture] with kind = {known}", kind)
    surface = read_arguments("surface", content.get("surface", {}), surface_arguments())
    device = _scene_device(content["device"]) if "device" in content else None
    loop = {name: content[name] for name in LOOP_SECTIONS if name in content}
    built = build_texture(kind, texture, path.parent, extra, KINDS)
    files = [path.parent / texture["path"]] if "path" in texture else []
    return Scene(built, surface, device, loop, path.parent, (path, *files))


def _refuse_code(content: Mapping[str, Any]) -> None:
    """Refuse a scene that names code: only who runs a command may do that."""
    sections = [section for section in content.values() if isinstance(section, dict)]
    for name in (name for section in (content, *sections) for name in section):
        if name.replace("-", "_").lower() in {"law_module", "law_modules"}:
            words = "a scene never runs code; name the file on the command line, --law-module FILE"
            raise ParameterError(name, f"is refused: {words}")


def _scene_device(section: Mapping[str, Any]) -> Device:
    """Return a device of the catalogue, with what the scene says besides; or one of its own."""
    own = {name: value for name, value in section.items() if name != "id"}
    if "id" not in section:
        return parse_device(own, "the scene's device", from_file=True)
    return changed_device(load_device(_ID.read(section["id"])), own)
