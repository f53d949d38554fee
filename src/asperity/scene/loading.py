"""From text to a surface: a specification, a scene file or a measured file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from asperity.devices import Device, load_device, parse_device
from asperity.errors import ParameterError, nearest_names
from asperity.textures import Texture, load_texture
from asperity.textures.arguments import Argument, Form
from asperity.textures.catalogue import CATALOGUE
from asperity.units import quantity

# Reads one argument: its name for messages, and what was given (text, number or list).
Reader = Callable[[str, Any], Any]


@dataclass(frozen=True)
class Scene:
    """What a specification, a scene file or a measured file says.

    Attributes:
        texture: the texture.
        surface: arguments of :class:`~asperity.surface.Surface` that were given.
        device: the device, if one was given.
    """

    texture: Texture
    surface: Mapping[str, Any] = field(default_factory=dict)
    device: Device | None = None


def _quantity(unit: str) -> Reader:
    return lambda name, given: quantity(name, given, unit)


def _items(unit: str) -> Reader:
    """Read "1mm; 2mm" or a list."""
    return lambda name, given: [quantity(name, item, unit) for item in _split(given, ";")]


def _vector(unit: str) -> Reader:
    """Read "1 0.4" or a list of two numbers."""
    return lambda name, given: [quantity(name, item, unit) for item in _split(given, None)]


def _vectors(unit: str) -> Reader:
    """Read "3000 500; -1000 4000" or a list of lists; single numbers lie along x."""

    def read(name: str, given: Any) -> Any:
        rows = [
            [quantity(name, item, unit) for item in _split(row, None)] for row in _split(given, ";")
        ]
        return [row[0] for row in rows] if all(len(row) == 1 for row in rows) else rows

    return read


def _split(given: Any, separator: str | None) -> list[Any]:
    if isinstance(given, list):
        return given
    return [part for part in str(given).split(separator) if part.strip()]


def _pair(unit: str) -> Reader:
    """Read "1um" or "1um; 2um", for x and y."""

    def read(name: str, given: Any) -> Any:
        values = [quantity(name, part, unit) for part in _split(given, ";")]
        if len(values) not in {1, 2}:
            raise ParameterError(name, "must be one quantity, or two for x and y: 'a; b'", given)
        return values[0] if len(values) == 1 else values

    return read


def _text(name: str, given: Any) -> str:
    if not isinstance(given, str):
        raise ParameterError(name, "must be text", given)
    return given


def _switch(name: str, given: Any) -> bool:
    words = {"yes": True, "true": True, "no": False, "false": False}
    if isinstance(given, bool):
        return given
    if str(given).strip().lower() not in words:
        raise ParameterError(name, "must be true or false", given)
    return words[str(given).strip().lower()]


def _whole(name: str, given: Any) -> int:
    number = quantity(name, given, "")
    if number != round(number):
        raise ParameterError(name, "must be a whole number", given)
    return round(number)


def _channel(name: str, given: Any) -> str | int:
    if isinstance(given, bool) or not isinstance(given, (str, int)):
        raise ParameterError(name, "must be a name or a whole number", given)
    return int(given) if str(given).strip().isdecimal() else given


FILE_ARGUMENTS: dict[str, Reader] = {
    "channel": _channel,
    "unit": _text,
    "integrate_normals": _switch,
    "pitch": _pair("m"),
    "height_range": _quantity("m"),
    "outliers": _quantity(""),
    "max_missing": _quantity(""),
    "form": _whole,
    "cutoff": _quantity("m"),
    "l_cutoff": _quantity("m"),
    "tip_radius": _quantity("m"),
    "periodic": _switch,
    "blend": _quantity("m"),
    "magnify": _quantity(""),
    "magnify_height": _quantity(""),
}


def _reader(argument: Argument) -> Reader:
    unit = argument.unit
    readers: dict[Form, Reader] = {
        "quantity": _quantity(unit),
        "pair": _pair(unit),
        "vector": _vector(unit),
        "items": _items(unit),
        "vectors": _vectors(unit),
        "integer": _whole,
        "text": _text,
    }
    return readers[argument.form]


# Texture kinds: what makes one, its required and its optional arguments.
KINDS: dict[str, tuple[Callable[..., Texture], dict[str, Reader], dict[str, Reader]]] = {
    kind.name: (
        kind.make,
        {argument.name: _reader(argument) for argument in kind.required},
        {argument.name: _reader(argument) for argument in kind.optional},
    )
    for kind in CATALOGUE.values()
} | {"file": (load_texture, {"path": _text}, FILE_ARGUMENTS)}

SURFACE_ARGUMENTS: dict[str, Reader] = {
    "law": _text,
    "stiffness": _quantity("N/m"),
    "max_depth": _quantity("m"),
    "friction": _quantity(""),
    "max_deflection": _quantity("m"),
    "modulation_depth": _quantity(""),
    "clamp": _text,
    "continuity": _quantity(""),
}


def load_scene(source: str, file_arguments: Mapping[str, Any] | None = None) -> Scene:
    """Return the scene that a text names.

    Args:
        source: ``kind:argument=value,...`` ("sinusoid:amplitude=0.8mm,period=1mm"), the path of
            a scene file (TOML), or of a measured surface.
        file_arguments: arguments of :func:`~asperity.textures.load_texture`, for a measured
            surface.

    Raises:
        ParameterError: for an unknown kind or argument (the nearest are offered), or a value
            that cannot be used.
        SurfaceFileError: for a file that cannot be read.

    Example:
        >>> load_scene("sinusoid:amplitude=0.8mm,period=1 mm").texture.period
        0.001
    """
    extra = dict(file_arguments or {})
    match = re.match(r"([A-Za-z][\w-]+):", source)
    if match and not Path(source).exists():
        _refuse_file_arguments(extra)
        return Scene(build_texture(match[1].lower(), _parse_arguments(source[match.end() :])))
    if source.lower().endswith(".toml"):
        return _load_scene_file(Path(source), extra)
    return Scene(load_texture(source, **extra))


def _refuse_file_arguments(extra: Mapping[str, Any]) -> None:
    for name in extra:
        raise ParameterError(name, "applies to measured surfaces only")


def _parse_arguments(text: str) -> dict[str, str]:
    arguments: dict[str, str] = {}
    for part in text.split(",") if text.strip() else ():
        name, equals, value = part.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name:
            raise ParameterError("surface", "must be kind:argument=value,...", part.strip())
        if name in arguments:
            raise ParameterError(name, "is given twice")
        arguments[name] = value.strip()
    return arguments


def build_texture(kind: str, arguments: Mapping[str, Any]) -> Texture:
    """Return a texture from its kind and its arguments as text, numbers or lists.

    Raises:
        ParameterError: for an unknown kind or argument, one that is missing, or a wrong value.
    """
    if kind not in KINDS:
        raise ParameterError("surface", f"kind is unknown: {kind!r}; {nearest_names(kind, KINDS)}")
    make, required, optional = KINDS[kind]
    values = _read_arguments(kind, arguments, required | optional)
    missing = [name for name in required if name not in values]
    if missing:
        raise ParameterError(missing[0], f"is missing: a {kind} needs {', '.join(required)}")
    return make(**values)


def _read_arguments(
    where: str, arguments: Mapping[str, Any], readers: Mapping[str, Reader]
) -> dict[str, Any]:
    for name in arguments:
        if name not in readers:
            raise ParameterError(f"{where}.{name}", f"is unknown; {nearest_names(name, readers)}")
    return {name: readers[name](name, value) for name, value in arguments.items()}


def _load_scene_file(path: Path, extra: Mapping[str, Any]) -> Scene:
    content = _read_toml(path)
    for name in content:
        if name not in {"texture", "surface", "device"}:
            hint = nearest_names(name, ["texture", "surface", "device"])
            raise ParameterError("scene", f"{path.name} has an unknown section [{name}]; {hint}")
    for name, section in content.items():
        if not isinstance(section, dict):
            raise ParameterError("scene", f"{path.name}: [{name}] must be a section", section)
    texture = dict(content.get("texture", {}))
    kind = texture.pop("kind", None)
    if not isinstance(kind, str):
        raise ParameterError("scene", f"{path.name} needs [texture] with kind = {_kinds()}", kind)
    if kind == "file":
        texture |= extra
        if isinstance(texture.get("path"), str):
            texture["path"] = str(path.parent / texture["path"])
    else:
        _refuse_file_arguments(extra)
    surface = _read_arguments("surface", content.get("surface", {}), SURFACE_ARGUMENTS)
    device = _scene_device(content["device"]) if "device" in content else None
    return Scene(build_texture(kind, texture), surface, device)


def _kinds() -> str:
    return " | ".join(f'"{kind}"' for kind in KINDS)


def _scene_device(section: Mapping[str, Any]) -> Device:
    if set(section) == {"id"}:
        return load_device(str(section["id"]))
    return parse_device(section, "the scene's device")


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("scene", f"{path} cannot be read: {reason}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ParameterError("scene", f"{path} is not valid TOML: {error}") from None
