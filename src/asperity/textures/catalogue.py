"""Every texture that can be asked for by name, as data: the command line and scenes read it."""

from __future__ import annotations

import math

from asperity.arguments import Argument
from asperity.textures.fourier import Fourier
from asperity.textures.grating import GRATING
from asperity.textures.kinds import Kind
from asperity.textures.library.registry import LIBRARY
from asperity.textures.noise import NOISE, NOISE_PROFILE
from asperity.textures.sinusoid import Sinusoid

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

TEXTURE_KINDS: dict[str, Kind] = {
    kind.name: kind for kind in (_SINUSOID, _FOURIER, GRATING, NOISE, NOISE_PROFILE)
}
"""The kinds that are given by a formula or a spectrum."""

CATALOGUE: dict[str, Kind] = {**TEXTURE_KINDS, **LIBRARY}
"""All kinds and all named surfaces."""
