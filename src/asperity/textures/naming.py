"""From text to a texture: a specification such as "sandpaper:grit=P60", or a measured file."""

from __future__ import annotations

import os
import re
from collections import ChainMap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.arguments import Argument, read_arguments
from asperity.errors import ParameterError, nearest_names
from asperity.measured.arguments import DRAWN, FILE_ARGUMENTS
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.drawn import prepare_texture
from asperity.textures.loading import load_texture
from asperity.textures.texture import Kind, Texture

TextureLike = Texture | str | os.PathLike[str]
"""A texture, or what :func:`as_texture` makes one of."""

_FILE = Kind(
    "file",
    "a measured surface",
    load_texture,
    (
        Argument("path", "the file, relative to the scene", form="path", required=True),
        *FILE_ARGUMENTS,
    ),
)

KINDS: ChainMap[str, Kind] = ChainMap({_FILE.name: _FILE}, CATALOGUE)
"""What [texture] can be: a kind of the catalogue, as it stands now, or a file."""


def as_texture(
    texture: TextureLike, values: Mapping[str, Any] | None = None, name: str = "texture"
) -> Texture:
    """Return a texture as it is, or the one that a text or a path names.

    Args:
        texture: a texture, ``kind:argument=value,...`` ("sinusoid:amplitude=0.8mm,period=1mm", or
            "sandpaper" with its defaults), or the path of a measured surface. A text that is the
            path of a file is that file.
        values: arguments of :func:`~asperity.textures.load_texture` [SI]; of those textures that
            are not measured take the ones of :func:`~asperity.textures.drawn.prepare_texture`.
        name: of the argument, for errors.

    Raises:
        ParameterError: for an unknown kind or argument (the nearest are offered), a value that
            cannot be used, another type, or a scene, which says more than a texture.
        SurfaceFileError: for a file that cannot be read.

    Example:
        >>> as_texture("sinusoid:amplitude=0.8mm,period=1 mm")
        Sinusoid(amplitude=0.0008, period=0.001, phase=0.0, direction=(1.0, 0.0))
    """
    if isinstance(texture, Texture):
        return texture
    if not isinstance(texture, (str, os.PathLike)):
        words = "must be a texture, a text such as 'sandpaper:grit=P60', or the path of a file"
        raise ParameterError(name, words, texture)
    extra = dict(values or {})
    if isinstance(texture, str) and (named := specified(texture)) is not None:
        return build_texture(*named, values=extra)
    if is_scene(texture):
        words = "is a scene, which names more than a texture; asperity.scene.load_scene reads it"
        raise ParameterError(name, words, os.fspath(texture))
    return load_texture(texture, **extra)


def is_scene(source: str | os.PathLike[str]) -> bool:
    """Return whether a text or a path names a scene file."""
    return str(source).lower().endswith(".toml")


def specified(source: str) -> tuple[str, dict[str, str]] | None:
    """Return the kind that a text names and its arguments as text; ``None`` for a path.

    Raises:
        ParameterError: for a name that is neither a kind nor a file.
    """
    kind, colon, arguments = source.partition(":")
    if not re.fullmatch(r"[A-Za-z][\w-]+", kind) or os.path.exists(source):
        return None
    named = kind.lower()
    if not colon and (named == _FILE.name or named not in KINDS):
        hint = nearest_names(kind, KINDS)
        words = f"is no file, and no surface that is known by name: {source!r}; {hint}"
        raise ParameterError("surface", words)
    return named, _parse_arguments(arguments)


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


def build_texture(
    kind: str,
    arguments: Mapping[str, Any],
    folder: Path | None = None,
    values: Mapping[str, Any] | None = None,
    kinds: Mapping[str, Kind] = KINDS,
) -> Texture:
    """Return a texture from its kind and its arguments as text or lists.

    Args:
        kind: of the catalogue, or "file".
        arguments: by name, of the kind and of its preparation.
        folder: to which a file is relative.
        values: of arguments of the preparation that were read [SI]; they come first.
        kinds: what it can be.

    Raises:
        ParameterError: for an unknown kind or argument, one that is missing, or a wrong value.
    """
    if kind not in kinds:
        raise ParameterError("surface", f"kind is unknown: {kind!r}; {nearest_names(kind, kinds)}")
    known = kinds[kind]
    own = {argument.name for argument in known.arguments}
    preparing = () if kind == "file" else [one for one in DRAWN if one.name not in own]
    read = read_arguments(kind, arguments, (*known.arguments, *preparing), folder)
    prepared = {name: read.pop(name) for name in set(read) - own} | dict(values or {})
    if kind == "file":
        return known.make(**_complete(known, read | prepared))
    _refuse_others(prepared)
    texture = known.make(**_complete(known, read))
    return prepare_texture(texture, **prepared) if prepared else texture


def _complete(kind: Kind, read: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments if none is missing."""
    required = [argument.name for argument in kind.required]
    for name in required:
        if name not in read:
            raise ParameterError(name, f"is missing: a {kind.name} needs {', '.join(required)}")
    return read


def _refuse_others(given: Mapping[str, Any]) -> None:
    """Refuse what only a measured surface can be told."""
    names = [argument.name for argument in DRAWN]
    for name in given:
        if name not in names:
            words = f"applies to measured surfaces only; others take {', '.join(names)}"
            raise ParameterError(name, words)
