"""Rebuild a texture from its sampler record, as in a recording.

No file is read again, and everything computed from the texture is the same bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from asperity.core.checks import FloatArray
from asperity.core.digests import content_digest
from asperity.core.errors import ParameterError
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.spline.heightmap import HeightMap
from asperity.textures.spline.heightmap_sampler import HeightMapArguments
from asperity.textures.spline.profile import Profile
from asperity.textures.spline.profile_sampler import ProfileArguments
from asperity.textures.texture import Texture


def rebuild_texture(
    arguments: tuple[Any, ...], sampler: tuple[ModuleType, ...], description: Mapping[str, Any]
) -> Texture | None:
    """Return the texture with this sampler record.

    Splines are rebuilt from the record, other kinds from their description, which must contain the
    arguments declared by their :class:`~asperity.textures.texture.TextureKind`.

    Args:
        arguments: the record that the sampler functions receive.
        sampler: modules of the sampler functions.
        description: description of the texture, see :meth:`Texture.describe`.

    Returns:
        The texture; ``None`` if it cannot be rebuilt.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=0.2e-3, period=2e-3)
        >>> rebuilt = rebuild_texture(wave.arguments, wave.sampler, wave.describe())
        >>> rebuilt, rebuilt.arguments == wave.arguments
        (Sinusoid(amplitude=0.0002, period=0.002, phase=0.0, direction=(1.0, 0.0)), True)
    """
    rebuild = _REBUILDERS.get(type(arguments))
    texture = None if rebuild is None else rebuild(arguments)
    if texture is None or texture.sampler != sampler:
        texture = _rebuild_from_description(description)
    if texture is None or texture.sampler != sampler:
        return None
    # The record itself: computed again, its numbers could differ in their last bits.
    vars(texture)["arguments"] = arguments
    texture.preparation = tuple(map(str, description.get("preparation", ())))
    return texture


def _rebuild_profile(record: ProfileArguments) -> Texture:
    heights, pitch = _node_heights(record.c, record.periodic), 1.0 / record.ix
    texture = Profile(heights, pitch, periodic=record.periodic, origin=record.x0)
    return _set_coefficients(texture, record)


def _rebuild_heightmap(record: HeightMapArguments) -> Texture:
    heights = _node_heights(_node_heights(record.c, record.periodic).T, record.periodic).T
    pitch, origin = (1.0 / record.ix, 1.0 / record.iy), (record.x0, record.y0)
    texture = HeightMap(heights, pitch, periodic=record.periodic, origin=origin)
    return _set_coefficients(texture, record)


def _set_coefficients(
    texture: Profile | HeightMap, record: ProfileArguments | HeightMapArguments
) -> Texture:
    digest = content_digest("rebuilt", type(record).__name__, *record)
    vars(texture).update(coefficients=record.c, digest=digest)
    return texture


def _node_heights(c: FloatArray, periodic: bool) -> FloatArray:
    """Return the heights at the nodes along the first axis, (c₋ + 4 c + c₊)/6."""
    count = len(c) - (3 if periodic else 2)
    heights: FloatArray = (c[:count] + 4.0 * c[1 : count + 1] + c[2 : count + 2]) / 6.0
    return heights


_REBUILDERS: dict[type, Callable[[Any], Texture]] = {
    ProfileArguments: _rebuild_profile,
    HeightMapArguments: _rebuild_heightmap,
}


def _rebuild_from_description(description: Mapping[str, Any]) -> Texture | None:
    """Return a texture of a registered kind from the arguments in its description."""
    kind = CATALOGUE.get(str(description.get("kind")))
    if kind is None:
        return None
    names = [argument.name for argument in kind.arguments if argument.name in description]
    try:
        return kind.factory(**{name: description[name] for name in names})
    except (TypeError, ValueError, ParameterError):
        return None
