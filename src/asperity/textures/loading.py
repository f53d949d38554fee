"""From a file to a texture: read, prepare, fit the spline."""

from __future__ import annotations

import os
from collections.abc import Sequence

from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile


def load_texture(
    path: str | os.PathLike[str],
    *,
    pitch: float | Sequence[float] | None = None,
    height_range: float | None = None,
    cutoff: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> HeightMap | Profile:
    """Return a measured surface as a texture.

    Reads X3P, NPY, text matrices and two-column profiles, then prepares: fill missing points,
    level, Gaussian band limit, magnify. What was done is in the ``preparation`` of the result.

    Args:
        path: the file; its kind is told by its content.
        pitch: distance of the points [m], one number or (p_x, p_y); required where the file has
            none, else it overrides the file's.
        height_range: peak-to-valley height [m] that the heights are scaled to.
        cutoff: cut-off wavelength of the Gaussian filter [m], in the surface's own metres before
            magnification; chosen from the sampling if not given.
        magnify: factor of the lateral size, and of the height unless told otherwise.
        magnify_height: factor of the height.

    Raises:
        SurfaceFileError: for a file that cannot be read, with the reason.
        ParameterError: for an argument that cannot be used.
    """
    from asperity.textures.preparation import prepare
    from asperity.textures.reading import read_surface

    prepared = prepare(
        read_surface(path),
        pitch=pitch,
        height_range=height_range,
        cutoff=cutoff,
        magnify=magnify,
        magnify_height=magnify_height,
    )
    if prepared.heights.ndim == 1:
        return Profile(prepared.heights, prepared.pitch[0], preparation=prepared.steps)
    return HeightMap(prepared.heights, prepared.pitch, preparation=prepared.steps)
