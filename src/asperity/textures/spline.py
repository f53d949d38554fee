"""What profiles and maps have in common: a cubic B-spline through the heights of a grid."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.checks import FloatArray, array
from asperity.errors import ParameterError
from asperity.kept import content_digest, is_shipped, kept
from asperity.memory import reserve
from asperity.textures.cells.lines import Pieces, spline_pieces
from asperity.textures.cells.splines import SplineCells
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.texture import ExactHeight, Texture, TexturePart

LEAST_NODES = 4
# Coefficients fall off by 0.27 per node beside what is flat. Below this part of the greatest they
# change no height, but their squares are subnormal, which takes a processor ten times as long.
_LEAST_PART = 1e-90


class Spline(Texture):
    """A C² cubic B-spline; mirrored at the border nodes of a finite grid, or periodic.

    Attributes:
        heights: at the nodes [m], shape (n,) or (ny, nx).
        pitch: distance of the nodes [m], one number of a profile, (p_x, p_y) of a map.
        origin: position of the first node [m], likewise.
        periodic: whether it repeats.
    """

    sample_offset: ClassVar[float] = 0.0
    noun: ClassVar[str]
    heights: FloatArray
    pitch: Any
    origin: Any
    periodic: bool

    def _keep(self, periodic: bool, preparation: Sequence[str], filled: ArrayLike | None) -> None:
        """Keep what both are told besides heights and places."""
        self.periodic = bool(periodic)
        self.preparation = tuple(preparation)
        self.filled = _mask(filled, self.heights.shape)

    @property
    def _pitches(self) -> tuple[float, ...]:
        return tuple(np.atleast_1d(self.pitch).tolist())

    @abstractmethod
    def with_heights(self, heights: ArrayLike) -> Spline:
        """Return the spline through other heights at the same nodes."""

    def texture_part(self) -> TexturePart:
        """See :class:`Texture`; :func:`~asperity.measured.parts.texture_part` says how."""
        heights, nesting, form, waviness = kept("texture part", self.content, self._parts)
        return TexturePart(self.with_heights(heights), nesting, form, waviness)

    def _parts(self) -> tuple[FloatArray, float, float, float]:
        """Take form and waviness away: the heights that are left, nesting index, both ranges."""
        from asperity.measured.parts import texture_part

        parts = texture_part(self.heights, self._pitches, periodic=self.periodic)
        return parts.heights, parts.nesting, parts.form.range, parts.waviness.range

    @property
    def _sides(self) -> tuple[float, ...]:
        """One period, or the extent, along each axis [m]."""
        counts = self.heights.shape[::-1]
        return tuple((n - self.ends) * p for n, p in zip(counts, self._pitches, strict=True))

    @cached_property
    def content(self) -> str | None:
        """See :class:`Texture`; the nodes, and which kind goes through them."""
        if not is_shipped(type(self)):
            return None
        name, pitches, origin = type(self).__qualname__, self._pitches, np.atleast_1d(self.origin)
        return content_digest(name, self.heights, pitches, origin, self.periodic)

    @cached_property
    def coefficients(self) -> FloatArray:
        """B-spline coefficients [m]: along each axis one before the first cell, two after."""
        from scipy.ndimage import spline_filter

        mode: Literal["grid-wrap", "mirror"] = "grid-wrap" if self.periodic else "mirror"
        inner = spline_filter(self.heights, order=3, output=np.float64, mode=mode)
        _drop_tiny(inner)
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
    def ends(self) -> bool:
        """See :class:`Texture`."""
        return not self.periodic

    def exact_height(self) -> ExactHeight:
        """See :class:`Texture`."""
        from asperity.textures.exact import exact_spline

        inner = self.coefficients[tuple(slice(1, n + 1) for n in self.heights.shape)]
        return exact_spline(inner, self._pitches, np.atleast_1d(self.origin), self.periodic)

    def cells(
        self,
        extent: tuple[float, float] | None = None,  # noqa: ARG002 - all of it, always
        margin: float = 0.0,  # noqa: ARG002 - likewise
    ) -> SplineCells:
        """See :class:`Texture`; the cells of the spline, all of them."""
        first = np.atleast_1d(self.origin)
        return SplineCells(self.coefficients, self._pitches, first, self.derivatives)

    def line_pieces(self, line: ScanLine, least: int) -> Pieces | None:
        """See :class:`Texture`; a line along an axis, from node to node."""
        return spline_pieces(self.cells(), line, least)

    def grid_counts(self) -> list[int]:
        """See :class:`Texture`; the nodes."""
        return list(self.heights.shape[::-1])

    def samples(self) -> tuple[FloatArray, tuple[float, float], bool]:
        """See :class:`Texture`; the nodes."""
        spacing = self._pitches[0], self._pitches[-1]
        return np.atleast_2d(self.heights), spacing, self.periodic

    def scan_line(self) -> ScanLine:
        """Along x over the whole profile, or through the middle of the map."""
        width, *depth = self._sides
        start = self.domain.origin + np.array([0.0, 0.5 * sum(depth)])
        return ScanLine(start, np.array([1.0, 0.0]), width, periodic=self.periodic)

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        both = list(self.heights.shape[::-1]), list(self._pitches)
        points, pitch = both if self.heights.ndim > 1 else (along_x[0] for along_x in both)
        return {
            "kind": self.kind,
            "points": points,
            "pitch": pitch,
            "periodic": self.periodic,
            "preparation": list(self.preparation),
        }


def node_heights(heights: ArrayLike, axes: int) -> FloatArray:
    """Return a copy of heights at the nodes of a grid.

    Raises:
        ParameterError: for heights that are not finite, or fewer than 4 along an axis.
    """
    reserve(*np.shape(heights)[::-1])
    result = array("heights", heights, (None,) * axes, "m").copy()
    if min(result.shape) < LEAST_NODES:
        least, given = (" x ".join(map(str, n)) for n in ((LEAST_NODES,) * axes, result.shape))
        raise ParameterError("heights", f"must be at least {least} points, got {given}")
    return result


def _mask(value: ArrayLike | None, shape: tuple[int, ...]) -> NDArray[np.bool_] | None:
    if value is None:
        return None
    result = np.ascontiguousarray(value)
    if result.dtype != np.bool_ or result.shape != shape:
        wanted = f"must be true or false for each height, shape {shape}"
        raise ParameterError("filled", wanted, f"{result.dtype} of shape {result.shape}")
    return result


def _drop_tiny(values: FloatArray) -> None:
    """Set to zero what is so small that its square would be subnormal; in place, row by row."""
    least = _LEAST_PART * max(float(values.max()), -float(values.min()))
    for row in np.atleast_2d(values):
        row[np.abs(row) < least] = 0.0
