"""What a surface looks like: one kind of texture per file, and reading measured ones."""

from __future__ import annotations

from asperity.textures.fourier import Fourier
from asperity.textures.grating import Grating
from asperity.textures.heightmap import HeightMap
from asperity.textures.library import LIBRARY, NamedSurface, named_surface, surface_names
from asperity.textures.loading import load_texture
from asperity.textures.noise import Noise, NoiseProfile
from asperity.textures.profile import Profile
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Domain, ScanLine, Texture

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
