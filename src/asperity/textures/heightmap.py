"""A measured or painted surface: a bicubic B-spline through the heights of a grid."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.kept import kept
from asperity.textures.bernstein import greatest_height
from asperity.textures.pyramid import plane_pyramid
from asperity.textures.samplers.heightmap import HeightMapArguments
from asperity.textures.spline import Spline, node_heights

# Samples of a dense search: parts of the cells are looked at as long as there are no more.
_MOST_SAMPLES = 1_200_000


class HeightMap(Spline):
    """The C² bicubic B-spline through heights[i, j] at (x, y) = origin + (j p_x, i p_y).

    A finite map is mirrored at its border nodes, so that the surface has no end; a periodic one
    repeats after nx p_x and ny p_y.

    Args:
        heights: [m], shape (ny, nx), at least 4 × 4.
        pitch: distance of the nodes [m], one number or (p_x, p_y).
        periodic: whether the map repeats.
        origin: position of heights[0, 0] [m].
        preparation: what was done to the heights, in words, for reports.
        filled: where heights were missing and have been interpolated, shape (ny, nx), so that
            pictures can mask them.

    Raises:
        ParameterError: for fewer than 4 × 4 heights, heights that are not finite, or a pitch
            that is not positive.

    Example:
        >>> bumps = HeightMap(np.eye(4) * 1e-3, pitch=1e-3)
        >>> bumps.height([[1e-3, 1e-3], [2e-3, 1e-3]]).round(9).tolist()[0]
        0.001
    """

    kind: ClassVar[str] = "heightmap"
    noun: ClassVar[str] = "map"
    pitch: tuple[float, float]
    origin: FloatArray

    def __init__(
        self,
        heights: ArrayLike,
        pitch: float | Sequence[float],
        *,
        periodic: bool = False,
        origin: Sequence[float] = (0.0, 0.0),
        preparation: Sequence[str] = (),
        filled: ArrayLike | None = None,
    ) -> None:
        self.heights = node_heights(heights, 2)
        pair = (pitch, pitch) if np.ndim(pitch) == 0 else tuple(pitch)  # type: ignore[arg-type]  # narrowed by ndim
        if len(pair) != 2:
            raise ParameterError("pitch", "must be one number or (p_x, p_y) [m]", pitch)
        self.pitch = (positive("pitch", pair[0], "m"), positive("pitch", pair[1], "m"))
        self.origin = array("origin", origin, (2,), "m")
        self._keep(periodic, preparation, filled)

    def __repr__(self) -> str:
        ny, nx = self.heights.shape
        edge = "periodic" if self.periodic else "finite"
        return f"<HeightMap {nx} x {ny} points, pitch {self.pitch} m, {edge}>"

    def with_heights(self, heights: ArrayLike) -> HeightMap:
        """See :class:`Spline`."""
        return HeightMap(heights, self.pitch, periodic=self.periodic, origin=tuple(self.origin))

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.nearest import plane_search, plane_within
        from asperity.textures.samplers import (
            heightmap,
            heightmap_block,
            heightmap_cells,
            heightmap_search,
            heightmap_window,
            spline,
        )

        search = heightmap_search, heightmap_window, heightmap_cells, plane_search, plane_within
        return heightmap, spline, *search, heightmap_block

    @cached_property
    def arguments(self) -> HeightMapArguments:
        """See :class:`Texture`."""
        x0, y0 = (float(value) for value in self.origin)
        c, (px, py) = self.coefficients, self.pitch
        pyramid = plane_pyramid(c, self.pitch)
        return HeightMapArguments(c, 1.0 / px, 1.0 / py, x0, y0, self.periodic, *pyramid)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height of the spline [m], certified by Bernstein hulls."""
        return kept("extremes", self.content, self._extremes)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Greatest differences of coefficients (convex hull property of B-splines)."""
        return kept("bounds", self.content, self._bounds)

    def _extremes(self) -> tuple[float, float]:
        return -greatest_height(-self.coefficients), greatest_height(self.coefficients)

    def _bounds(self) -> tuple[float, float]:
        c, (px, py) = self.coefficients, self.pitch

        def greatest(values: FloatArray) -> float:
            return max(float(values.max()), -float(values.min()))

        gx, gy = greatest(np.diff(c, axis=1)) / px, greatest(np.diff(c, axis=0)) / py
        hxx = greatest(np.diff(c, 2, axis=1)) / px**2
        hyy = greatest(np.diff(c, 2, axis=0)) / py**2
        hxy = greatest(np.diff(np.diff(c, axis=0), axis=1)) / (px * py)
        # Inflated against the rounding of the differences.
        inflate = 1.0 + 1e-12
        return inflate * float(np.hypot(gx, gy)), inflate * (max(hxx, hyy) + hxy)

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; whole parts of the cells."""
        counts = [n - self.ends for n in self.heights.shape[::-1]]
        while counts[0] * counts[1] * 4 <= _MOST_SAMPLES // 4:
            counts = [2 * n for n in counts]
        while counts[0] * counts[1] > _MOST_SAMPLES:
            counts = [-(-n // 2) for n in counts]
        return counts
