"""A regular grid over a texture that varies along two directions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.textures.texture import Texture


@dataclass(frozen=True)
class MapGrid:
    """The middles of the cells of a rectangle about the domain.

    Attributes:
        low: lower left corner [m], shape (2,).
        size: width and depth [m], shape (2,).
        shape: rows and columns.
        xy: points [m], shape (rows * columns, 2), row by row.
    """

    low: FloatArray
    size: FloatArray
    shape: tuple[int, int]
    xy: FloatArray


def map_grid(texture: Texture, count: int) -> MapGrid:
    """Return a grid with so many cells along the longer side."""
    corners = texture.domain.points(np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]))
    low = corners.min(axis=0)
    size = corners.max(axis=0) - low
    columns, rows = (max(2, round(float(side / size.max()) * count)) for side in size)
    x, y = (
        low[axis] + (np.arange(n) + 0.5) * size[axis] / n for axis, n in enumerate((columns, rows))
    )
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return MapGrid(low, size, (rows, columns), xy)
