"""A texture made again from the very numbers that its sampler was given.

So a surface can be had from where those numbers were kept: no file is read again, and what is
computed of it is the same bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.kept import content_digest
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.fourier import Fourier
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile
from asperity.textures.samplers.fourier import FourierArguments
from asperity.textures.samplers.heightmap import HeightMapArguments
from asperity.textures.samplers.profile import ProfileArguments
from asperity.textures.samplers.sinusoid import SinusoidArguments
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture


def remade_texture(
    arguments: tuple[Any, ...], sampler: tuple[ModuleType, ...], said: Mapping[str, Any]
) -> Texture | None:
    """Return the texture whose sampler is given these numbers.

    Splines and sums of waves are made from the numbers themselves. Another kind, of one's own, is
    made from what it says of itself, if the arguments of its :class:`Kind` are among that.

    Args:
        arguments: what the sampler's functions receive.
        sampler: the modules of these functions.
        said: what the texture says of itself, see :meth:`Texture.describe`.

    Returns:
        The texture; ``None`` for one that cannot be made again.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=0.2e-3, period=2e-3)
        >>> again = remade_texture(wave.arguments, wave.sampler, wave.describe())
        >>> again, again.arguments == wave.arguments
        (Sinusoid(amplitude=0.0002, period=0.002, phase=0.0, direction=(1.0, 0.0)), True)
    """
    make = _MAKERS.get(type(arguments))
    texture = None if make is None else make(arguments)
    if texture is None or texture.sampler != sampler:
        return _by_description(sampler, said)
    # The numbers themselves: made again from the others, they could differ in their last bits.
    content = content_digest("remade", type(arguments).__name__, *arguments)
    vars(texture).update(arguments=arguments, content=content)
    texture.preparation = tuple(map(str, said.get("preparation", ())))
    return texture


def _sinusoid(given: SinusoidArguments) -> Texture:
    wave = math.hypot(given.kx, given.ky)
    return Sinusoid(given.amplitude, 2.0 * math.pi / wave, given.phase, (given.kx, given.ky))


def _fourier(given: FourierArguments) -> Texture:
    texture = Fourier(given.amplitudes, np.column_stack([given.kx, given.ky]), given.phases)
    vars(texture)["extremes"] = given.low, given.high
    return texture


def _profile(given: ProfileArguments) -> Texture:
    heights, pitch = _nodes(given.c, given.periodic), 1.0 / given.ix
    texture = Profile(heights, pitch, periodic=given.periodic, origin=given.x0)
    return _with(texture, given.c)


def _map(given: HeightMapArguments) -> Texture:
    heights = _nodes(_nodes(given.c, given.periodic).T, given.periodic).T
    pitch, origin = (1.0 / given.ix, 1.0 / given.iy), (given.x0, given.y0)
    return _with(HeightMap(heights, pitch, periodic=given.periodic, origin=origin), given.c)


def _with(texture: Profile | HeightMap, coefficients: FloatArray) -> Texture:
    vars(texture)["coefficients"] = coefficients
    return texture


def _nodes(c: FloatArray, periodic: bool) -> FloatArray:
    """Return the heights at the nodes along the first axis, (c₋ + 4 c + c₊)/6."""
    count = len(c) - (3 if periodic else 2)
    heights: FloatArray = (c[:count] + 4.0 * c[1 : count + 1] + c[2 : count + 2]) / 6.0
    return heights


_MAKERS: dict[type, Callable[[Any], Texture]] = {
    SinusoidArguments: _sinusoid, FourierArguments: _fourier, ProfileArguments: _profile,
    HeightMapArguments: _map,
}  # fmt: skip


def _by_description(sampler: tuple[ModuleType, ...], said: Mapping[str, Any]) -> Texture | None:
    """Return a texture of a kind of one's own, made with the arguments that it names."""
    kind = CATALOGUE.get(str(said.get("kind")))
    if kind is None:
        return None
    names = [argument.name for argument in kind.arguments]
    try:
        texture = kind.make(**{name: said[name] for name in names if name in said})
    except (TypeError, ValueError, ParameterError):
        return None
    return texture if texture.sampler == sampler else None
