"""A texture as a grid of heights and normals, for tools that take pictures of surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray, positive
from asperity.errors import ParameterError
from asperity.textures.texture import Texture
from asperity.units import engineering

# Rows of a map of a profile, which are all alike.
_PROFILE_ROWS = 16
_LEAST, _MOST = 4, 8192
Pair = float | Sequence[float]


@dataclass(frozen=True, eq=False)
class SampledMap:
    """Heights and normals of a texture at the points of a grid.

    Attributes:
        heights: [m], shape (ny, nx); row i lies i spacings along y from the first.
        normals: unit normals (x, y, z) along the axes of the grid, shape (ny, nx, 3).
        spacing: from point to point along x and y [m].
        repeats: whether the grid is a whole period, so that the picture can be tiled.
        what: the region in words.
    """

    heights: FloatArray
    normals: FloatArray
    spacing: tuple[float, float]
    repeats: bool
    what: str

    def __repr__(self) -> str:
        return f"<SampledMap of {self.words}>"

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the picture [m]: each point stands for a spacing around it."""
        ny, nx = self.heights.shape
        return nx * self.spacing[0], ny * self.spacing[1]

    @property
    def words(self) -> str:
        """What is on the picture."""
        ny, nx = self.heights.shape
        px, py = (engineering(step, "m") for step in self.spacing)
        apart = px if px == py else f"{px} x {py}"
        return f"{self.what}, {nx} x {ny} points, {apart} apart"


def sample_map(
    texture: Texture, extent: Pair | None = None, spacing: Pair | None = None
) -> SampledMap:
    """Return heights and normals on a grid.

    Args:
        texture: the texture.
        extent: of the map along x and y [m]; default: one period or the whole surface, along its
            own axes; of a sum that never repeats, 16 of its longest waves.
        spacing: from point to point along x and y [m]; default: that of a measured map, else
            eight points on the shortest wave.

    Raises:
        ParameterError: for a length that is not positive, or a grid of fewer than 4 or more than
            8192 points along a side.

    Example:
        >>> import asperity as asp
        >>> sample_map(asp.Sinusoid(amplitude=0.2e-3, period=2e-3))
        <SampledMap of one period, 16 x 16 points, 125 µm apart>
    """
    domain = texture.domain
    if extent is None and spacing is None:
        points, steps, repeats = domain.grid(texture.grid_counts())
        if len(points) == 1:  # the rows of a profile are all alike
            points, steps = np.repeat(points, _PROFILE_ROWS, axis=0), (steps[0], steps[0])
        spans = domain.upright()[0]
        along = spans[0] / np.hypot(*spans[0])
        return _sampled(texture, points, steps, along, repeats, domain.description)
    sides = np.hypot(*domain.upright()[0].T)
    own = domain.grid(texture.grid_counts())[1]
    steps = _pair("spacing", spacing) or (own if len(sides) > 1 else (own[0], own[0]))
    size = _pair("extent", extent) or (float(sides[0]), float(sides[-1]))
    counts = [_count(side, step) for side, step in zip(size, steps, strict=True)]
    ticks = [step * np.arange(count) for step, count in zip(steps, counts, strict=True)]
    points = domain.origin + np.stack(np.meshgrid(*ticks), axis=-1)
    what = " x ".join(engineering(side, "m") for side in size)
    return _sampled(texture, points, steps, np.array([1.0, 0.0]), False, what)


def _count(side: float, step: float) -> int:
    count = round(side / step) if side / step < 1e9 else _MOST + 1
    if not _LEAST <= count <= _MOST:
        words = f"gives {count} points on {engineering(side, 'm')}; {_LEAST} to {_MOST} are written"
        raise ParameterError("spacing", words, step)
    return count


def _pair(name: str, value: Pair | None) -> tuple[float, float] | None:
    if value is None:
        return None
    both = [value] * 2 if isinstance(value, (int, float)) else list(value)
    if len(both) != 2:
        raise ParameterError(name, "must be one length, or two for x and y [m]", value)
    return positive(name, both[0], "m"), positive(name, both[1], "m")


def _sampled(
    texture: Texture, points: FloatArray, steps: tuple[float, float], along: FloatArray,
    repeats: bool, what: str,
) -> SampledMap:  # fmt: skip
    shape, flat = points.shape[:2], np.ascontiguousarray(points.reshape(-1, 2))
    heights, slopes = texture.height(flat), texture.gradient(flat)
    across = np.array([-along[1], along[0]])
    normals = np.column_stack([-slopes @ along, -slopes @ across, np.ones(len(flat))])
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    return SampledMap(
        heights.reshape(shape), normals.reshape(*shape, 3), (float(steps[0]), float(steps[1])),
        repeats, what,
    )  # fmt: skip
