"""Every texture that can be asked for by name, as data: the command line and scenes read it."""

from __future__ import annotations

import math
import re

from asperity.arguments import Argument
from asperity.errors import ParameterError
from asperity.textures.fourier import Fourier
from asperity.textures.grating import GRATING
from asperity.textures.library.registry import LIBRARY
from asperity.textures.noise import NOISE, NOISE_PROFILE
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Kind

_SINUSOID = Kind(
    "sinusoid",
    "one sinusoid, the classic of haptic texture",
    Sinusoid,
    (
        Argument("amplitude", "half of the peak-to-valley height", "m", required=True),
        Argument("period", "wavelength", "m", required=True),
        Argument("phase", "at the origin", "rad", 0.0, low=-math.inf),
        Argument("direction", "across the waves", default_words="1 0", form="vector"),
    ),
    example={"amplitude": 0.4e-3, "period": 1.5e-3},
)
_FOURIER = Kind(
    "fourier",
    "sum of plane waves",
    Fourier,
    (
        Argument("amplitudes", "of the waves", "m", form="items", required=True),
        Argument("wavevectors", "of the waves", "rad/m", form="vectors", required=True),
        Argument("phases", "of the waves", "rad", default_words="0", form="items"),
    ),
    example={"amplitudes": [2e-4, 1e-4], "wavevectors": [[3000.0, 0.0], [0.0, 6000.0]]},
)

CATALOGUE: dict[str, Kind] = {
    kind.name: kind for kind in (_SINUSOID, _FOURIER, GRATING, NOISE, NOISE_PROFILE)
} | LIBRARY
"""All kinds and all named surfaces; what :func:`register` has added too."""

# What else the command line and scenes take where a kind stands.
_RESERVED = ("file", "recording")


def register(kind: Kind) -> Kind:
    """Make a kind of your own known by its name, on the command line and in scenes too.

    Raises:
        ParameterError: for a name that is taken, or is not lower-case letters, digits and hyphens.

    Example:
        >>> register(Kind("sinusoid", "mine", Sinusoid, ()))
        Traceback (most recent call last):
        ...
        asperity.errors.ParameterError: kind 'sinusoid' is taken: one sinusoid, the classic of haptic texture
    """  # noqa: E501  # doctest compares the whole message
    if not re.fullmatch(r"[a-z][a-z0-9-]+", kind.name):
        requirement = "must have a name of lower-case letters, digits and hyphens"
        raise ParameterError("kind", requirement, kind.name)
    if kind.name in CATALOGUE or kind.name in _RESERVED:
        owner = CATALOGUE[kind.name].summary if kind.name in CATALOGUE else "a measured surface"
        raise ParameterError("kind", f"{kind.name!r} is taken: {owner}")
    CATALOGUE[kind.name] = kind
    return kind
