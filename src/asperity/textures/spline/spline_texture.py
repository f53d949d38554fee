"""Cubic B-splines through heights at grid nodes: profiles and height maps."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray, check_array, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.core.units import format_quantity
from asperity.textures.domain import Domain, GridValues, LineSegments, ScanLine
from asperity.textures.spline.bspline_kernels import SplineArguments
from asperity.textures.spline.pyramid import line_pyramid, plane_pyramid
from asperity.textures.spline.spline_bounds import SplineCells, max_height, spline_segments
from asperity.textures.texture import Texture, TexturePart

MIN_NODES = 4
# Coefficients decay by 0.27 per node next to a flat part. Below this share of the greatest they
# change no height, but their squares are subnormal, which slows a processor down tenfold.
_FLUSH_THRESHOLD = 1e-90


class Spline(Texture):
    """A C² cubic B-spline through heights at the nodes of a grid, see its subclasses.

    A finite spline is mirrored at its border nodes.

    Attributes:
        heights: heights at the nodes [m], shape (n,) or (ny, nx).
        pitch: spacing of the nodes [m], a number for a profile, (p_x, p_y) for a map.
        origin: position of the first node [m], likewise.
        periodic: whether the spline repeats.
    """

    sample_offset: ClassVar[float] = 0.0
    noun: ClassVar[str]
    axes: ClassVar[int]
    pitch: Any
    origin: Any

    def __init__(
        self,
        heights: ArrayLike,
        pitch: float | Sequence[float],
        *,
        periodic: bool = False,
        origin: float | Sequence[float] | None = None,
        preparation: Sequence[str] = (),
        filled_mask: ArrayLike | None = None,
    ) -> None:
        self.heights = node_heights(heights, self.axes)
        self._set_grid(pitch, origin)
        self.periodic = bool(periodic)
        self.preparation = tuple(preparation)
        self.filled_mask = _check_mask(filled_mask, self.heights.shape)

    @abstractmethod
    def _set_grid(self, pitch: Any, origin: Any) -> None:
        """Check and set the pitch and the origin."""

    def stored_heights(self) -> FloatArray:
        """See :class:`Texture`."""
        return self.heights

    def coarsened(self, share: float) -> Texture | None:
        """See :class:`Texture`; the heights of this spline at the nodes of a coarser grid."""
        counts = [int(share * count) for count in self.grid_counts()]
        if min(counts) < MIN_NODES:
            return None
        points, spacing, _repeats = self.domain.grid(counts)
        heights = self.height(points.reshape(-1, 2)).reshape(counts[::-1])
        coarse = fit_spline(heights, spacing, periodic=self.periodic, origin=self.origin)
        lost = format_quantity(self._difference(coarse), "m")
        sizes = [" x ".join(map(str, size)) for size in (counts, self.grid_counts())]
        text = f"resampled to {sizes[0]} of {sizes[1]} points: heights differ by {lost} (sampled)"
        coarse.preparation = (*self.preparation, text)
        return coarse

    def _difference(self, other: Texture) -> float:
        """Return the greatest difference of heights at and between the nodes of this spline [m]."""
        points = self.domain.grid([2 * count for count in self.grid_counts()])[0].reshape(-1, 2)
        return float(np.abs(self.height(points) - other.height(points)).max())

    @abstractmethod
    def _compute_extremes(self) -> tuple[float, float]: ...

    def _compute_bounds(self) -> tuple[float, float]:
        c = self.coefficients
        pitches = self._pitches
        axes = range(c.ndim)[::-1]  # x first, as the pitches
        slopes = [np.abs(np.diff(c, axis=i)).max() / p for i, p in zip(axes, pitches, strict=True)]
        turns = [np.abs(np.diff(c, 2, axis=i)).max() for i in axes]
        second = max(turn / p**2 for turn, p in zip(turns, pitches, strict=True))
        if c.ndim == 2:
            second += np.abs(np.diff(np.diff(c, axis=0), axis=1)).max() / math.prod(pitches)
        inflate = 1.0 + 1e-12  # the rounding of the differences
        return inflate * float(np.hypot.reduce(slopes)), inflate * float(second)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height of the spline [m], certified to rounding."""
        low = float(self.heights.min())
        if low == self.heights.max():  # coefficients differ by rounding
            return low, low
        return get_or_compute("extremes", self.digest, self._compute_extremes)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Greatest differences of coefficients (convex hull property of B-splines)."""
        return get_or_compute("bounds", self.digest, self._compute_bounds)

    def __repr__(self) -> str:
        if self.constructor_arguments:
            return super().__repr__()
        points = " x ".join(map(str, self.heights.shape[::-1]))
        edge = "periodic" if self.periodic else "finite"
        return f"<{type(self).__name__} of {points} points, pitch {self.pitch} m, {edge}>"

    @property
    def _pitches(self) -> tuple[float, ...]:
        return tuple(np.atleast_1d(self.pitch).tolist())

    def texture_part(self) -> TexturePart:
        """See :class:`Texture` and :func:`~asperity.measured.form.decompose_surface`."""
        parts = get_or_compute("texture part", self.digest, self._separate_texture)
        heights, nesting, form, waviness = parts
        rest = fit_spline(heights, self._pitches, periodic=self.periodic, origin=self.origin)
        return TexturePart(rest, nesting, form, waviness)

    def _separate_texture(self) -> tuple[FloatArray, float, float, float]:
        """Return the heights without form and waviness, the nesting index and both ranges."""
        from asperity.measured.form import decompose_surface

        parts = decompose_surface(self.heights, self._pitches, periodic=self.periodic)
        return parts.heights, parts.nesting, parts.form.range, parts.waviness.range

    def closest_lattice(
        self, spacing: tuple[float, ...], z: FloatArray
    ) -> tuple[tuple[ModuleType, ...], list[tuple[Any, ...]]]:
        """See :class:`Texture`."""
        from asperity.textures.spline import lattice_search as search
        from asperity.textures.spline.pyramid import build_lattice

        quick = build_lattice(self, self._pitches, spacing, z)
        thorough = quick._replace(
            beyond=1, descents=search.MOST_DESCENTS, slack=search.THOROUGH_SLACK
        )
        return (search,), [quick, thorough]

    @property
    def _sides(self) -> tuple[float, ...]:
        """One period, or the extent, along each axis [m]."""
        counts = self.heights.shape[::-1]
        return tuple((n - self.is_mirrored) * p for n, p in zip(counts, self._pitches, strict=True))

    def _content(self) -> tuple[Any, ...]:
        return self.heights, self._pitches, np.atleast_1d(self.origin), self.periodic

    @cached_property
    def coefficients(self) -> FloatArray:
        """B-spline coefficients [m], along each axis one before the first cell and two after."""
        from scipy.ndimage import spline_filter

        mode: Literal["grid-wrap", "mirror"] = "grid-wrap" if self.periodic else "mirror"
        inner = spline_filter(self.heights, order=3, output=np.float64, mode=mode)
        _flush_small_values(inner)
        if self.periodic:
            return np.ascontiguousarray(np.pad(inner, (1, 2), mode="wrap"))
        return np.ascontiguousarray(np.pad(inner, 1, mode="reflect"))

    @cached_property
    def domain(self) -> Domain:
        """One period, or the extent."""
        text = "one period" if self.periodic else f"the extent of the {self.noun}"
        corner = np.append(self.origin, 0.0)[:2]
        spans = np.array(self._sides)[:, None] * np.eye(len(self._sides), 2)
        return Domain(corner, spans, periodic=self.periodic, description=text)

    @property
    def is_mirrored(self) -> bool:
        """See :class:`Texture`."""
        return not self.periodic

    def cells(
        self,
        extent: tuple[float, float] | None = None,  # noqa: ARG002 - always the whole spline
        margin: float = 0.0,  # noqa: ARG002 - likewise
    ) -> SplineCells:
        """See :class:`Texture`; all cells of the spline."""
        first = np.atleast_1d(self.origin)
        return SplineCells(self.coefficients, self._pitches, first, self.derivatives)

    def line_segments(self, line: ScanLine, min_count: int) -> LineSegments | None:
        """See :class:`Texture`; a line along an axis, from node to node."""
        return spline_segments(self.cells(), line, min_count)

    def grid_counts(self) -> list[int]:
        """See :class:`Texture`; the nodes."""
        return list(self.heights.shape[::-1])

    def samples(self) -> GridValues:
        """See :class:`Texture`; the nodes."""
        spacing = self._pitches[0], self._pitches[-1]
        return np.atleast_2d(self.heights), spacing, self.periodic

    def scan_line(self) -> ScanLine:
        """Along x, over the whole profile or through the middle of the map."""
        width, *depth = self._sides
        start = self.domain.origin + np.array([0.0, 0.5 * sum(depth)])
        return ScanLine(start, np.array([1.0, 0.0]), width, periodic=self.periodic)

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        points = list(self.heights.shape[::-1])
        return super().describe() | {
            "points": points if self.axes > 1 else points[0],
            "pitch": np.asarray(self.pitch).tolist(),
            "periodic": self.periodic,
            "preparation": list(self.preparation),
        }


def node_heights(heights: ArrayLike, axes: int) -> FloatArray:
    """Return a copy of heights at the nodes of a grid.

    Raises:
        ParameterError: for heights that are not finite, or fewer than 4 along an axis.
    """
    require_memory(*np.shape(heights)[::-1])
    result = check_array("heights", heights, (None,) * axes, "m").copy()
    if min(result.shape) < MIN_NODES:
        smallest = " x ".join([str(MIN_NODES)] * axes)
        size = " x ".join(map(str, result.shape))
        raise ParameterError("heights", f"must be at least {smallest} points, got {size}")
    return result


def _check_mask(mask: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
    if mask is None:
        return None
    result = np.ascontiguousarray(mask)
    if result.dtype != np.bool_ or result.shape != shape:
        reason = f"must be true or false for each height, shape {shape}"
        raise ParameterError("filled_mask", reason, f"{result.dtype} of shape {result.shape}")
    return result


def _flush_small_values(values: FloatArray) -> None:
    """Set values whose square would be subnormal to zero, in place, row by row."""
    smallest = _FLUSH_THRESHOLD * max(float(values.max()), -float(values.min()))
    for row in np.atleast_2d(values):
        row[np.abs(row) < smallest] = 0.0


# Least number of samples of a dense search.
_MIN_SAMPLES = 4096


class Profile(Spline):
    """The C² cubic B-spline through heights[j] at x = origin + j pitch; constant along y.

    A finite profile is mirrored at its border nodes; a periodic one repeats after n pitch.

    Args:
        heights: [m], shape (n,), at least 4.
        pitch: spacing of the nodes [m].
        periodic: whether the profile repeats.
        origin: position of heights[0] [m].
        preparation: steps of the preparation of the heights, for reports.
        filled_mask: where missing heights have been interpolated, shape (n,).

    Raises:
        ParameterError: for fewer than 4 heights, heights that are not finite, or a pitch that
            is not positive.

    Example:
        >>> ridge = Profile([0.0, 0.0, 1e-3, 0.0, 0.0], pitch=1e-3)
        >>> ridge.height([[2e-3, 7.0], [2e-3, 9.0]]).round(9)
        array([0.001, 0.001])
    """

    kind: ClassVar[str] = "profile"
    noun: ClassVar[str] = "profile"
    axes: ClassVar[int] = 1
    pitch: float
    origin: float

    def _set_grid(self, pitch: Any, origin: Any) -> None:
        self.pitch = check_positive("pitch", pitch, "m")
        self.origin = check_real("origin", 0.0 if origin is None else origin, "m")

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.textures.spline import profile_sampler

        return profile_sampler, *_search_modules()

    @cached_property
    def arguments(self) -> SplineArguments:
        """See :class:`Texture`."""
        c = self.coefficients
        pyramid = line_pyramid(c, self.pitch)
        row = c.reshape(1, -1)
        return SplineArguments(
            row, 1.0 / self.pitch, 1.0, self.origin, 0.0, self.periodic, *pyramid
        )

    def _compute_extremes(self) -> tuple[float, float]:
        c = np.lib.stride_tricks.sliding_window_view(self.coefficients, 4)
        c0, c1, c2, c3 = c.T
        # h'(t) = a t² + b t + d on the cell, t in [0, 1].
        a = 0.5 * (c3 - 3 * c2 + 3 * c1 - c0)
        b = c0 - 2 * c1 + c2
        d = 0.5 * (c2 - c0)
        root = np.sqrt(np.maximum(b * b - 4 * a * d, 0.0))
        half = -0.5 * (b + np.copysign(root, b))
        with np.errstate(divide="ignore", invalid="ignore"):
            candidates = np.stack([half / a, d / half, np.zeros_like(a), np.ones_like(a)])
        t = np.clip(np.nan_to_num(candidates, nan=0.0), 0.0, 1.0)
        h = (c0 + 4 * c1 + c2) / 6 + t * (d + t * (b / 2 + t * a / 3))
        return float(h.min()), float(h.max())

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; a whole number per cell."""
        cells = len(self.heights) - self.is_mirrored
        return [cells * max(1, -(-_MIN_SAMPLES // cells))]


# Greatest number of samples of a dense search; cells are subdivided up to it.
_MAX_SAMPLES = 1_200_000


class HeightMap(Spline):
    """The C² bicubic B-spline through heights[i, j] at (x, y) = origin + (j p_x, i p_y).

    A finite map is mirrored at its border nodes, so that the surface is unbounded; a periodic one
    repeats after nx p_x and ny p_y.

    Args:
        heights: [m], shape (ny, nx), at least 4 × 4.
        pitch: spacing of the nodes [m], one number or (p_x, p_y).
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

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.textures.spline import heightmap_block_sampler, heightmap_sampler

        return heightmap_sampler, *_search_modules(), heightmap_block_sampler

    @cached_property
    def arguments(self) -> SplineArguments:
        """See :class:`Texture`."""
        x0, y0 = self.origin.tolist()
        c = self.coefficients
        (px, py) = self.pitch
        pyramid = plane_pyramid(c, self.pitch)
        return SplineArguments(c, 1.0 / px, 1.0 / py, x0, y0, self.periodic, *pyramid)

    def _compute_extremes(self) -> tuple[float, float]:
        return -max_height(-self.coefficients), max_height(self.coefficients)

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; whole cells, or equal parts of them."""
        counts = [n - self.is_mirrored for n in self.heights.shape[::-1]]
        while counts[0] * counts[1] * 4 <= _MAX_SAMPLES // 4:
            counts = [2 * n for n in counts]
        while counts[0] * counts[1] > _MAX_SAMPLES:
            counts = [-(-n // 2) for n in counts]
        return counts


def _search_modules() -> tuple[ModuleType, ...]:
    """Return the compiled modules that profiles and maps share."""
    from asperity.contacts import closest_search, distance_bounds
    from asperity.textures.spline import bspline_kernels, spline_pruning, spline_search

    return bspline_kernels, spline_search, spline_pruning, closest_search, distance_bounds


def fit_spline(heights: ArrayLike, pitch: Sequence[float], **options: Any) -> Profile | HeightMap:
    """Return the profile or the height map through heights, whose pitch is given for each axis."""
    if np.ndim(heights) == 1:
        return Profile(heights, pitch[0], **options)
    return HeightMap(heights, pitch, **options)
