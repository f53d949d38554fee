"""A texture cut into cells, with rigorous enclosures of its height derivatives on each."""

from __future__ import annotations

from asperity.enclosures.cells import NAMES, Cells
from asperity.textures.cells.splines import MapCells, ProfileCells
from asperity.textures.cells.waves import WaveCells
from asperity.textures.fourier import Fourier
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture

__all__ = ["LARGEST_TORUS", "NAMES", "Cells", "WaveCells", "cells_of"]

# More independent phases than this need a rectangle of the plane.
LARGEST_TORUS = 3


def cells_of(
    texture: Texture, extent: tuple[float, float] | None = None, margin: float = 0.0
) -> Cells | None:
    """Return the cells of a texture, or nothing for a kind of your own.

    Args:
        texture: the texture.
        extent: width and depth [m] of the part of the plane to look at, for sums of waves; a sum
            of more than three independent phases has no cells without it.
        margin: how far beyond the extent to look on every side [m].
    """
    if isinstance(texture, (Sinusoid, Fourier)):
        cells = WaveCells(texture, extent, margin)
        return cells if cells.dimensions <= LARGEST_TORUS else None
    if isinstance(texture, HeightMap):
        return MapCells(texture)
    if isinstance(texture, Profile):
        return ProfileCells(texture)
    return None
