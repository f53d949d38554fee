"""A height map h(x, y): a bicubic B-spline through the heights of a grid."""

from __future__ import annotations

from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_positive
from asperity.core.errors import ParameterError
from asperity.textures.bounds.pyramid import plane_pyramid
from asperity.textures.bounds.spline_bounds import max_height
from asperity.textures.spline.heightmap_sampler import HeightMapArguments
from asperity.textures.spline.spline_texture import Spline

# Greatest number of samples of a dense search; cells are subdivided up to it.
_MAX_SAMPLES = 1_200_000


class HeightMap(Spline):
    """The C² bicubic B-spline through heights[i, j] at (x, y) = origin + (j p_x, i p_y).

    A finite map is mirrored at its border nodes, so that the surface is unbounded; a periodic one
    repeats after nx p_x and ny p_y.

    Args:
        heights: [m], shape (ny, nx), at least 4 × 4.
        pitch: distance of the nodes [m], one number or (p_x, p_y).
        periodic: whether the map repeats.
        origin: position of heights[0, 0] [m].
        preparation: steps of the preparation of the heights, for reports.
        filled_mask: where missing heights have been interpolated, shape (ny, nx), to be masked in
            pictures.

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
    axes: ClassVar[int] = 2
    pitch: tuple[float, float]
    origin: FloatArray

    def _set_grid(self, pitch: Any, origin: Any) -> None:
        pair = (pitch, pitch) if np.ndim(pitch) == 0 else tuple(pitch)
        if len(pair) != 2:
            raise ParameterError("pitch", "must be one number or (p_x, p_y) [m]", pitch)
        self.pitch = (check_positive("pitch", pair[0], "m"), check_positive("pitch", pair[1], "m"))
        self.origin = check_array("origin", (0.0, 0.0) if origin is None else origin, (2,), "m")

    def with_heights(self, heights: ArrayLike) -> HeightMap:
        """See :class:`Spline`."""
        return HeightMap(heights, self.pitch, periodic=self.periodic, origin=tuple(self.origin))

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.closest import plane_budget, plane_search
        from asperity.textures.spline import (
            bspline_kernels,
            heightmap_block_sampler,
            heightmap_pruning,
            heightmap_sampler,
            heightmap_search,
        )

        search = heightmap_search, heightmap_pruning, plane_search, plane_budget
        return heightmap_sampler, bspline_kernels, *search, heightmap_block_sampler

    @cached_property
    def arguments(self) -> HeightMapArguments:
        """See :class:`Texture`."""
        x0, y0 = (float(value) for value in self.origin)
        c, (px, py) = self.coefficients, self.pitch
        pyramid = plane_pyramid(c, self.pitch)
        return HeightMapArguments(c, 1.0 / px, 1.0 / py, x0, y0, self.periodic, *pyramid)

    def _compute_extremes(self) -> tuple[float, float]:
        return -max_height(-self.coefficients), max_height(self.coefficients)

    def _compute_bounds(self) -> tuple[float, float]:
        c, (px, py) = self.coefficients, self.pitch

        def greatest(values: FloatArray) -> float:
            return max(float(values.max()), -float(values.min()))

        gx, gy = greatest(np.diff(c, axis=1)) / px, greatest(np.diff(c, axis=0)) / py
        hxx = greatest(np.diff(c, 2, axis=1)) / px**2
        hyy = greatest(np.diff(c, 2, axis=0)) / py**2
        hxy = greatest(np.diff(np.diff(c, axis=0), axis=1)) / (px * py)
        inflate = 1.0 + 1e-12  # the rounding of the differences
        return inflate * float(np.hypot(gx, gy)), inflate * (max(hxx, hyy) + hxy)

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; whole cells, or equal parts of them."""
        counts = [n - self.is_mirrored for n in self.heights.shape[::-1]]
        while counts[0] * counts[1] * 4 <= _MAX_SAMPLES // 4:
            counts = [2 * n for n in counts]
        while counts[0] * counts[1] > _MAX_SAMPLES:
            counts = [-(-n // 2) for n in counts]
        return counts
