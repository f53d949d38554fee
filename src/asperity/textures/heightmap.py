"""A measured or painted surface: a bicubic B-spline through the heights of a grid."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.textures.bernstein import greatest_height
from asperity.textures.cells.lines import Pieces, spline_pieces
from asperity.textures.cells.splines import MapCells
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.pyramid import plane_pyramid
from asperity.textures.samplers.heightmap import HeightMapArguments
from asperity.textures.texture import ExactHeight, Texture

LEAST_NODES = 4
# Samples of a dense search: parts of the cells are looked at as long as there are no more.
_MOST_SAMPLES = 1_200_000


class HeightMap(Texture):
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
    sample_offset: ClassVar[float] = 0.0

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
        self.heights = array("heights", heights, (None, None), "m").copy()
        if min(self.heights.shape) < LEAST_NODES:
            ny, nx = self.heights.shape
            raise ParameterError("heights", f"must be at least 4 x 4 points, got {ny} x {nx}")
        pair = (pitch, pitch) if np.ndim(pitch) == 0 else tuple(pitch)  # type: ignore[arg-type]  # narrowed by ndim
        if len(pair) != 2:
            raise ParameterError("pitch", "must be one number or (p_x, p_y) [m]", pitch)
        self.pitch = (positive("pitch", pair[0], "m"), positive("pitch", pair[1], "m"))
        self.periodic = bool(periodic)
        self.origin = array("origin", origin, (2,), "m")
        self.preparation = tuple(preparation)
        self.filled = mask("filled", filled, self.heights.shape)

    def __repr__(self) -> str:
        ny, nx = self.heights.shape
        edge = "periodic" if self.periodic else "finite"
        return f"<HeightMap {nx} x {ny} points, pitch {self.pitch} m, {edge}>"

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.nearest import plane_search as search
        from asperity.textures.samplers import heightmap, spline

        return heightmap, spline, search

    @cached_property
    def coefficients(self) -> FloatArray:
        """B-spline coefficients [m], one row and column before the first cell, two after."""
        return padded_coefficients(self.heights, self.periodic)

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
        return -greatest_height(-self.coefficients), greatest_height(self.coefficients)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Greatest differences of coefficients (convex hull property of B-splines)."""
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

    @property
    def _extent(self) -> tuple[float, float]:
        cells = [n if self.periodic else n - 1 for n in self.heights.shape]
        return cells[1] * self.pitch[0], cells[0] * self.pitch[1]

    @cached_property
    def domain(self) -> Domain:
        """One period, or the extent of the map."""
        text = "one period" if self.periodic else "the extent of the map"
        spans = np.diag(self._extent)
        return Domain(self.origin, spans, periodic=self.periodic, description=text)

    @property
    def ends(self) -> bool:
        """See :class:`Texture`."""
        return not self.periodic

    def exact_height(self) -> ExactHeight:
        """See :class:`Texture`."""
        from asperity.textures.exact import exact_map

        ny, nx = self.heights.shape
        inner = self.coefficients[1 : ny + 1, 1 : nx + 1]
        return exact_map(inner, self.pitch, self.origin, self.periodic)

    def cells(
        self,
        extent: tuple[float, float] | None = None,  # noqa: ARG002 - all of it, always
        margin: float = 0.0,  # noqa: ARG002 - likewise
    ) -> MapCells:
        """See :class:`Texture`; the cells of the spline, all of them."""
        return MapCells(self.coefficients, self.pitch, self.origin, self.derivatives)

    def line_pieces(self, line: ScanLine, least: int) -> Pieces | None:
        """See :class:`Texture`; a line along an axis, from node to node."""
        return spline_pieces(self.cells(), line, least)

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; whole parts of the cells."""
        counts = [n - self.ends for n in self.heights.shape[::-1]]
        while counts[0] * counts[1] * 4 <= _MOST_SAMPLES // 4:
            counts = [2 * n for n in counts]
        while counts[0] * counts[1] > _MOST_SAMPLES:
            counts = [-(-n // 2) for n in counts]
        return counts

    def grid_counts(self) -> list[int]:
        """See :class:`Texture`; the nodes."""
        return list(self.heights.shape[::-1])

    def samples(self) -> tuple[FloatArray, tuple[float, float], bool]:
        """See :class:`Texture`; the nodes."""
        return self.heights, self.pitch, self.periodic

    def scan_line(self) -> ScanLine:
        """Along x through the middle of the map."""
        width, depth = self._extent
        start = self.origin + np.array([0.0, 0.5 * depth])
        return ScanLine(start, np.array([1.0, 0.0]), width, periodic=self.periodic)

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        return {
            "kind": self.kind,
            "points": list(self.heights.shape[::-1]),
            "pitch": list(self.pitch),
            "periodic": self.periodic,
            "preparation": list(self.preparation),
        }


def mask(name: str, value: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
    """Return a mask of the shape, or None for none.

    Raises:
        ParameterError: for another shape, or values that are neither true nor false.
    """
    if value is None:
        return None
    result = np.ascontiguousarray(value)
    if result.dtype != np.bool_ or result.shape != shape:
        wanted = f"must be true or false for each height, shape {shape}"
        raise ParameterError(name, wanted, f"{result.dtype} of shape {result.shape}")
    return result


def padded_coefficients(heights: FloatArray, periodic: bool) -> FloatArray:
    """Return the cubic B-spline coefficients of heights on a grid of any dimension.

    Mirrored or periodic at the border, padded by one coefficient before the first cell and two
    after the last along each axis.
    """
    from scipy.ndimage import spline_filter

    mode: Literal["grid-wrap", "mirror"] = "grid-wrap" if periodic else "mirror"
    inner = spline_filter(heights, order=3, output=np.float64, mode=mode)
    if periodic:
        return np.ascontiguousarray(np.pad(inner, (1, 2), mode="wrap"))
    return np.ascontiguousarray(np.pad(inner, 1, mode="reflect"))
