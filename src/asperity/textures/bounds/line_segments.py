"""Segments of a straight line over a texture, with the same enclosures as its cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.textures.bounds.spline_bounds import SplineCells
from asperity.textures.bounds.wave_cells import WaveCells
from asperity.textures.domain import ScanLine
from asperity.textures.plane_waves import PlaneWaves

_AXIS_TOLERANCE = 1e-12


@dataclass(frozen=True)
class LineSegments:
    """Segments of a line, of equal length.

    Attributes:
        centres: in the coordinates of the cells, shape (n, d).
        half: half of a segment in these coordinates, shape (d,).
        length: of a segment [m].
    """

    cells: Cells
    centres: FloatArray
    half: FloatArray
    length: float

    def models(self, names: Sequence[str]) -> dict[str, TaylorNumber]:
        """Return enclosures of height derivatives, whose one coordinate is along the line."""
        found = self.cells.enclosures(self.centres, self.half, names)
        for name, model in found.items():
            if isinstance(model, TaylorModel):
                found[name] = TaylorModel(model.c, model.g.sum(axis=0, keepdims=True), model.e)
        return found


def equal_segments(cells: Cells, line: ScanLine, min_count: int, length: float) -> LineSegments:
    """Return segments of a line whose cells have one coordinate, 0 to ``length``."""
    half = 0.5 * length / min_count
    centres: FloatArray = half * (2.0 * np.arange(min_count, dtype=float)[:, None] + 1.0)
    return LineSegments(cells, centres, np.full(1, half), line.length / min_count)


def wave_segments(waves: PlaneWaves, line: ScanLine, min_count: int) -> LineSegments:
    """Return segments of a line over a sum of waves."""
    return equal_segments(_WavesAlongLine(waves, line), line, min_count, line.length)


def spline_segments(cells: SplineCells, line: ScanLine, min_count: int) -> LineSegments | None:
    """Return at least ``min_count`` segments of a line, separated at the nodes of a spline.

    ``None`` for a line that does not follow an axis from node to node.
    """
    for axis in range(cells.dimensions):
        if abs(abs(line.direction[axis]) - 1.0) < _AXIS_TOLERANCE:
            return _segments_along_axis(cells, axis, line, min_count)
    return None


def _segments_along_axis(
    cells: SplineCells, axis: int, line: ScanLine, min_count: int
) -> LineSegments | None:
    ends = cells.coordinates(np.stack([line.start, line.start + line.length * line.direction]))
    low, high = np.sort(ends[:, axis])
    nodes = round(high - low)
    if abs(low - round(low)) > 1e-6 or abs(high - low - nodes) > 1e-6 or round(low) < 0:
        return None
    parts = max(1, -(-min_count // nodes))
    half = np.zeros(cells.dimensions)
    half[axis] = 0.5 / parts
    centres = np.tile(ends[0], (nodes * parts, 1))
    centres[:, axis] = round(low) + half[axis] * (2.0 * np.arange(nodes * parts) + 1.0)
    if line.direction[axis] < 0.0:
        centres, half = centres[::-1].copy(), -half
    return LineSegments(cells, centres, np.abs(half), line.length / (nodes * parts))


class _WavesAlongLine(WaveCells):
    """Waves along a line; the coordinate is the distance [m]."""

    def __init__(self, waves: PlaneWaves, line: ScanLine) -> None:
        super().__init__(waves, (line.length, line.length))
        self._phases = self._phases + self._waves @ line.start
        self._multiples = self._waves @ line.direction[:, None]
        self._line = line
        self.dimensions, self._extent = 1, (line.length,)

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.ascontiguousarray(self._line.start + coordinates * self._line.direction)
