"""Textures: height functions in closed form, splines, named surfaces and measured files."""

from __future__ import annotations

from asperity.textures.catalogue import load_texture
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.grating import Grating
from asperity.textures.kinds.named_surfaces import (
    LIBRARY,
    NamedSurface,
    named_surface,
    surface_names,
)
from asperity.textures.kinds.noise import Noise, NoiseProfile
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile
from asperity.textures.texture import Texture

__all__ = [
    "LIBRARY",
    "Domain",
    "Fourier",
    "Grating",
    "HeightMap",
    "NamedSurface",
    "Noise",
    "NoiseProfile",
    "Profile",
    "ScanLine",
    "Sinusoid",
    "Texture",
    "load_texture",
    "named_surface",
    "surface_names",
]
