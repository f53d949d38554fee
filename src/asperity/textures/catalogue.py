"""Catalogue of texture kinds, and textures from a specification or a measured file."""

from __future__ import annotations

import os
import re
from collections import ChainMap
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument, document_arguments, parse_arguments
from asperity.core.errors import ParameterError, suggest_names
from asperity.measured.file_arguments import FILE_ARGUMENTS, SYNTHETIC_ARGUMENTS
from asperity.measured.prepared import PreparedSurface
from asperity.measured.reading.measured_file import prepare_file
from asperity.textures.fields.field_file import is_field, load_field
from asperity.textures.kinds import KIND_EXAMPLES
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.grating import Grating
from asperity.textures.kinds.named_surfaces import LIBRARY
from asperity.textures.kinds.noise import Noise, NoiseProfile
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile, fit_spline
from asperity.textures.texture import Texture, TextureKind

_KINDS = (Sinusoid, Fourier, Grating, Noise, NoiseProfile)
CATALOGUE: dict[str, TextureKind] = {
    kind.kind: TextureKind.of_class(kind, **KIND_EXAMPLES[kind.kind]) for kind in _KINDS
} | LIBRARY
"""All texture kinds and named surfaces by name, and those added by :func:`register`."""

# Names that the command line and scenes use for something else.
_RESERVED = ("file",)


def register(kind: TextureKind) -> TextureKind:
    """Register a user-defined kind by its name, also for the command line and scenes.

    Raises:
        ParameterError: for a name that is taken or is not lower-case letters, digits and hyphens.

    Example:
        >>> register(TextureKind("sinusoid", "another", load_texture, ()))
        Traceback (most recent call last):
        ...
        asperity.core.errors.ParameterError: kind 'sinusoid' is taken: one sinusoid, the classic of haptic texture
    """  # noqa: E501  # doctest compares the whole message
    if not re.fullmatch(r"[a-z][a-z0-9-]+", kind.name):
        requirement = "must have a name of lower-case letters, digits and hyphens"
        raise ParameterError("kind", requirement, kind.name)
    if kind.name in CATALOGUE or kind.name in _RESERVED:
        owner = CATALOGUE[kind.name].summary if kind.name in CATALOGUE else "a measured surface"
        raise ParameterError("kind", f"{kind.name!r} is taken: {owner}")
    CATALOGUE[kind.name] = kind
    return kind


TextureLike = Texture | str | os.PathLike[str]
"""A texture, or an argument of :func:`as_texture`."""


def _load_file(path: str | os.PathLike[str], **values: Any) -> Texture:
    """Return the texture of a measured file, or a baked field; see :func:`load_texture`."""
    texture: Texture
    if not is_field(path):
        texture = texture_from_prepared(prepare_file(path, **values))
    else:
        for name in values:
            raise ParameterError(name, f"cannot be applied: {os.fspath(path)} was baked already")
        texture = load_field(path, _build_described)
    texture.file_name = os.path.basename(os.fspath(path))
    return texture


def texture_from_prepared(prepared: PreparedSurface) -> HeightMap | Profile:
    """Return the spline through a prepared surface."""
    texture = fit_spline(
        prepared.heights,
        prepared.pitch,
        periodic=prepared.periodic,
        preparation=prepared.steps,
        filled_mask=prepared.filled_mask,
    )
    texture.history = prepared.history
    return texture


@document_arguments(FILE_ARGUMENTS)
def load_texture(  # noqa: D417 - the others are described where they are declared
    path: str | os.PathLike[str],
    *,
    channel: str | int | None = None,
    unit: str | None = None,
    green: str | None = None,
    pitch: float | Sequence[float] | None = None,
    height_range: float | None = None,
    outliers: float | None = None,
    max_missing: float | None = None,
    form: int | None = None,
    s_cutoff: float | None = None,
    l_cutoff: float | None = None,
    tip_radius: float | None = None,
    periodic: bool = False,
    blend: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
    cutoff: float | None = None,
) -> Texture:
    """Load a measured surface as a texture.

    Reads the file and prepares it: remove outliers, level, fill missing points, Gaussian band
    limit, stylus tip, periodic continuation, magnify. The ``preparation`` of the result lists the
    steps. A file written by ``asperity prepare`` is used as it is, and so is a baked field.

    Args:
        path: the file; its format is recognised by its content.
        {arguments}
        cutoff: another name of ``s_cutoff``; the former name.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used; nothing can be done to a baked field.
    """
    values = dict(locals())  # every argument under its own name
    defaults = load_texture.__kwdefaults__ or {}
    arguments = {name: x for name, x in values.items() if x is not defaults.get(name, ...)}
    if {"cutoff", "s_cutoff"} <= arguments.keys():
        raise ParameterError("cutoff", "is the former name of s_cutoff: give one of them")
    if "cutoff" in arguments:
        arguments["s_cutoff"] = arguments.pop("cutoff")
    return _load_file(**arguments)


def _build_described(description: Mapping[str, Any]) -> Texture:
    """Return the texture of a registered kind from the arguments in its description."""
    name = str(description.get("kind"))
    if name not in CATALOGUE:
        fault = f"is of a kind that is not known here: {name}"
        raise ParameterError("texture", f"{fault}; name its file as {{plugin}}", plugin=None)
    kind = CATALOGUE[name]
    names = [argument.name for argument in kind.arguments if argument.name in description]
    return kind.factory(**{name: description[name] for name in names})


_PATH = Argument("path", "the file, relative to the scene", form="path", required=True)
_FILE = TextureKind("file", "a measured surface", _load_file, (_PATH, *FILE_ARGUMENTS))

KINDS: ChainMap[str, TextureKind] = ChainMap({_FILE.name: _FILE}, CATALOGUE)
"""Texture kinds accepted in [texture]: the catalogue and measured files."""


def as_texture(
    texture: TextureLike, values: Mapping[str, Any] | None = None, name: str = "texture"
) -> Texture:
    """Return a texture from a texture, a specification or a path.

    Args:
        texture: a texture, ``kind:argument=value,...`` ("sinusoid:amplitude=0.8mm,period=1mm", or
            "sandpaper" with its defaults), or the path of a measured surface. A text that is the
            path of an existing file means that file.
        values: arguments of :func:`~asperity.textures.load_texture` [SI]; synthetic textures accept
            those of :func:`~asperity.textures.kinds.prepare_synthetic.prepare_texture`.
        name: name of the argument in error messages.

    Raises:
        ParameterError: for an unknown kind or argument (the nearest are offered), a value that
            cannot be used, another type, or a scene file.
        SurfaceFileError: for a file that cannot be read.

    Example:
        >>> as_texture("sinusoid:amplitude=0.8mm,period=1 mm")
        Sinusoid(amplitude=0.0008, period=0.001, phase=0.0, direction=(1.0, 0.0))
    """
    if isinstance(texture, Texture):
        return texture
    if not isinstance(texture, (str, os.PathLike)) or texture == "":
        requirement = "must be a texture, a text such as 'sandpaper:grit=P60', or a file's path"
        raise ParameterError(name, requirement, texture)
    extra = dict(values or {})
    if isinstance(texture, str) and (named := parse_specification(texture)) is not None:
        return build_texture(*named, values=extra)
    if is_scene(texture):
        reason = "is a scene, which defines more than a texture; use asperity.scene.load_scene"
        raise ParameterError(name, reason, os.fspath(texture))
    return _load_file(texture, **extra)


def is_scene(source: str | os.PathLike[str]) -> bool:
    """Return whether a text or a path is the name of a scene file."""
    return str(source).lower().endswith(".toml")


def parse_specification(source: str) -> tuple[str, dict[str, str]] | None:
    """Return the kind and the arguments in a specification, as text; ``None`` for a path.

    Raises:
        ParameterError: for a name that is neither a kind nor a file.
    """
    kind, colon, arguments = source.partition(":")
    named = kind.lower()
    is_path = os.path.exists(source) and not (named in KINDS and os.path.isdir(source))
    if is_path or not re.fullmatch(r"[A-Za-z][\w-]+", kind):
        return None
    if not colon and (named == _FILE.name or named not in KINDS):
        reason = f"is neither a file nor a named surface: {source!r}"
        raise ParameterError("surface", f"{reason}; {suggest_names(kind, KINDS)}")
    return named, _parse_arguments(arguments)


def _parse_arguments(text: str) -> dict[str, str]:
    arguments: dict[str, str] = {}
    if not text.strip():
        return arguments
    for part in text.split(","):
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
) -> Texture:
    """Return a texture of a kind from its arguments as text or lists.

    Args:
        kind: name in the catalogue, or "file".
        arguments: arguments of the kind and of the preparation, by name.
        folder: folder that the path of a file is relative to.
        values: further arguments of the preparation [SI]; they take precedence.

    Raises:
        ParameterError: for an unknown kind or argument, one that is missing, or a wrong value.
    """
    if kind not in KINDS:
        raise ParameterError("surface", f"kind is unknown: {kind!r}; {suggest_names(kind, KINDS)}")
    entry = KINDS[kind]
    synthetic = () if kind == "file" else SYNTHETIC_ARGUMENTS
    constructing = {argument.name for argument in entry.arguments}
    preparing = [argument for argument in synthetic if argument.name not in constructing]
    read = parse_arguments(kind, arguments, (*entry.arguments, *preparing), folder)
    preparation = {name: read.pop(name) for name in read.keys() - constructing} | dict(values or {})
    if kind == "file":
        return entry.factory(**_require_all(entry, read | preparation))
    _check_preparation(preparation, [argument.name for argument in synthetic])
    texture = entry.factory(**_require_all(entry, read))
    return prepare_texture(texture, **preparation) if preparation else texture


def _check_preparation(names: Iterable[str], allowed: Sequence[str]) -> None:
    """Raise an error for an argument of the preparation that a synthetic surface does not take."""
    for name in names:
        if name not in allowed:
            reason = f"applies to measured surfaces only; others take {', '.join(allowed)}"
            raise ParameterError(name, reason)


def _require_all(kind: TextureKind, arguments: dict[str, Any]) -> dict[str, Any]:
    """Return the arguments if no required one is missing."""
    required = [argument.name for argument in kind.required_arguments]
    for name in required:
        if name not in arguments:
            needs = f"is missing: a {kind.name} needs {', '.join(required)}"
            raise ParameterError(name, needs)
    return arguments
