"""A straight line over a texture cut into pieces, with the same enclosures as its cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.cells import Cells
from asperity.enclosures.taylor import Number, Taylor
from asperity.textures.cells.splines import SplineCells
from asperity.textures.cells.waves import WaveCells
from asperity.textures.domain import ScanLine
from asperity.textures.plane_waves import PlaneWaves

_ALONG_AN_AXIS = 1e-12


@dataclass(frozen=True)
class Pieces:
    """Pieces of a line, all equally long.

    Attributes:
        centres: in the coordinates of the cells, shape (n, d).
        half: half of a piece in these coordinates, shape (d,).
        length: of a piece [m].
    """

    cells: Cells
    centres: FloatArray
    half: FloatArray
    length: float

    def models(self, names: Sequence[str]) -> dict[str, Number]:
        """Return enclosures of height derivatives, with one coordinate: along the line."""
        found = self.cells.models(self.centres, self.half, names)
        return {name: _along(model) for name, model in found.items()}


def _along(model: Number) -> Number:
    if not isinstance(model, Taylor):
        return model
    return Taylor(model.c, model.g.sum(axis=0, keepdims=True), model.e)


def equal_pieces(cells: Cells, line: ScanLine, least: int, length: float) -> Pieces:
    """Return so many pieces of a line whose cells have one coordinate, 0 to ``length``."""
    half = 0.5 * length / least
    centres: FloatArray = half * (2.0 * np.arange(least, dtype=float)[:, None] + 1.0)
    return Pieces(cells, centres, np.full(1, half), line.length / least)


def wave_pieces(waves: PlaneWaves, line: ScanLine, least: int) -> Pieces:
    """Return so many pieces of a line over a sum of waves."""
    return equal_pieces(_LineOfWaves(waves, line), line, least, line.length)


def spline_pieces(cells: SplineCells, line: ScanLine, least: int) -> Pieces | None:
    """Cut a line at the nodes of a spline and between them; at least so many pieces.

    It must begin and end at nodes, and not run across the cells: else there are none.
    """
    for axis in range(cells.dimensions):
        if abs(abs(line.direction[axis]) - 1.0) < _ALONG_AN_AXIS:
            return _pieces_along(cells, axis, line, least)
    return None


def _pieces_along(cells: SplineCells, axis: int, line: ScanLine, least: int) -> Pieces | None:
    ends = cells.coordinates(np.stack([line.start, line.start + line.length * line.direction]))
    low, high = np.sort(ends[:, axis])
    nodes = round(high - low)
    if abs(low - round(low)) > 1e-6 or abs(high - low - nodes) > 1e-6 or round(low) < 0:
        return None
    parts = max(1, -(-least // nodes))
    half = np.zeros(cells.dimensions)
    half[axis] = 0.5 / parts
    centres = np.tile(ends[0], (nodes * parts, 1))
    centres[:, axis] = round(low) + half[axis] * (2.0 * np.arange(nodes * parts) + 1.0)
    if line.direction[axis] < 0.0:
        centres, half = centres[::-1].copy(), -half
    return Pieces(cells, centres, np.abs(half), line.length / (nodes * parts))


class _LineOfWaves(WaveCells):
    """The waves as they are met along a line; the coordinate is the distance [m]."""

    def __init__(self, waves: PlaneWaves, line: ScanLine) -> None:
        super().__init__(waves, (line.length, line.length))
        self._phases = self._phases + self._waves @ line.start
        self._multiples = self._waves @ line.direction[:, None]
        self._line = line
        self.dimensions, self._extent = 1, (line.length,)

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.ascontiguousarray(self._line.start + coordinates * self._line.direction)
