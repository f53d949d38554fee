"""Cells of sums of waves on the torus of their independent phases.

The plane of an aperiodic sum is dense on the torus, so the supremum is the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from asperity.core.checks import FloatArray
from asperity.enclosures import cells
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.textures.plane_waves import PlaneWaves

# Sines per chunk.
_SINES_PER_CHUNK = 2_000_000
# With four coordinates more cells would take minutes, with little gain.
_MAX_CELLS = {4: 1_000_000}
# Initial samples per wave of a profile.
_SAMPLES_PER_WAVE = 64
_ORDERS = [sum(cells.DERIVATIVE_ORDERS[name]) for name in cells.DERIVATIVE_NAMES]
_ODD = [i for i, order in enumerate(_ORDERS) if order == 1]
_EVEN = [i for i, order in enumerate(_ORDERS) if order != 1]


class WaveCells(cells.Cells):
    """Cells on the torus of independent phases of a sum of waves, or on a rectangle.

    Args:
        waves: waves of the texture.
        extent: width and depth [m] of the rectangle from the origin; the whole plane by default.
        margin: width by which the rectangle is extended on every side [m].
    """

    def __init__(
        self, waves: PlaneWaves, extent: tuple[float, ...] | None = None, margin: float = 0.0
    ) -> None:
        self._extent = None if extent is None else tuple(side + 2.0 * margin for side in extent)
        self._margin = margin
        self._amplitudes = waves.amplitudes
        self._phases = waves.phases
        self._waves = waves.wavevectors
        if extent is None:
            self._basis, self._multiples = waves.lattice
        else:
            self._basis = np.eye(2)
            self._multiples = self._waves
            self._phases = self._phases - self._waves.sum(axis=1) * margin
        self._weights = {
            name: self._weight(*cells.DERIVATIVE_ORDERS[name]) for name in cells.DERIVATIVE_NAMES
        }
        every = np.stack(list(self._weights.values()), axis=-1)
        self._even = every[:, _EVEN]
        self._odd = every[:, _ODD]
        self.dimensions = self._multiples.shape[1]
        self.max_cells = _MAX_CELLS.get(self.dimensions)
        self.default_gap = cells.DEFAULT_GAPS.get(self.dimensions, 1e-3)
        self.refined_gap = cells.REFINED_GAPS.get(self.dimensions)

    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        sizes = np.full(self.dimensions, 2.0 * math.pi) if self._extent is None else self._extent
        # Cells on which the phase of the fastest wave changes by about 0.7 rad, but not fewer than
        # can be evaluated at the cost of one.
        least = 64 if self.dimensions == 1 else 16
        turns = np.abs(self._multiples).max(axis=0) * np.asarray(sizes)
        limit = 4_000_000 ** (1.0 / self.dimensions)
        counts = [int(min(max(math.ceil(turn / 0.7), least), limit)) for turn in turns]
        half = 0.5 * np.asarray(sizes) / counts
        chunks = cells.grid_index_chunks(counts, self.chunk_size())
        return (half * (2.0 * index + 1.0) for index in chunks), half

    def sample_coordinates(self, count: int = cells.SAMPLE_COUNT) -> FloatArray:
        """See :class:`Cells`."""
        sizes = np.full(self.dimensions, 2.0 * math.pi) if self._extent is None else self._extent
        count = min(count, max(64, _SINES_PER_CHUNK // len(self._amplitudes)))
        if self.dimensions == 1 and self._extent is None:
            count = min(count, _SAMPLES_PER_WAVE * (1 + int(np.abs(self._multiples).max())))
        return np.asarray(cells.low_discrepancy_points(count, self.dimensions) * np.asarray(sizes))

    def chunk_size(self) -> int:
        """See :class:`Cells`."""
        return max(256, min(cells.CHUNK_SIZE, _SINES_PER_CHUNK // len(self._amplitudes)))

    def enclosures(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, TaylorNumber]:
        """See :class:`Cells`; the sine of a wave differs from its tangent by at most ρ²/2 |sin|.

        ρ is the greatest change of the wave's phase on the cell.
        """
        angles = centres @ self._multiples.T + self._phases
        sine = np.sin(angles)
        cosine = np.cos(angles)
        reach = np.abs(self._multiples) @ half
        second = 0.5 * reach * reach
        rest = [second * np.minimum(1.0, np.abs(part) + reach) for part in (sine, cosine)]
        # Rounding errors of the phases.
        most = np.abs(centres).max(axis=0, initial=0.0) @ np.abs(self._multiples).T
        largest = float((most + np.abs(self._phases)).max())
        slack = 16.0 * cells.EPS * (1.0 + largest + len(sine[0]))
        result: dict[str, TaylorNumber] = {}
        for name in names:
            weight = self._weights[name]
            odd = sum(cells.DERIVATIVE_ORDERS[name]) % 2
            values, slopes = (cosine, -sine) if odd else (sine, cosine)
            if not weight.any():
                result[name] = 0.0
                continue
            g = half[:, None] * (self._multiples.T @ (slopes * weight).T)
            size = np.abs(weight)
            e = (rest[odd] @ size) * (1.0 + 16.0 * cells.EPS) + slack * float(size.sum())
            result[name] = TaylorModel(values @ weight, g, e)
        return result

    def _weight(self, nx: int, ny: int) -> FloatArray:
        """Return the weights of the waves of a derivative: cosines for slopes, otherwise sines."""
        weight = self._amplitudes * self._waves[:, 0] ** nx * self._waves[:, 1] ** ny
        return np.asarray(-weight if nx + ny == 2 else weight)

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        angles = coordinates @ self._multiples.T + self._phases
        result = np.empty((len(coordinates), len(cells.DERIVATIVE_NAMES)))
        result[:, _EVEN] = np.sin(angles) @ self._even
        result[:, _ODD] = np.cos(angles) @ self._odd
        return result

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`; for more than two phases the nearest phases among many points."""
        if self._extent is not None:
            return np.ascontiguousarray(coordinates - self._margin)
        if self.dimensions == 1:
            wave = self._basis[0]
            return np.ascontiguousarray(coordinates * (wave / (wave @ wave)))
        if self.dimensions <= np.linalg.matrix_rank(self._basis):
            inverse = np.linalg.pinv(self._basis)
            return np.ascontiguousarray(coordinates @ inverse.T)
        return np.array([nearest_phases(self._basis, row) for row in coordinates])

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        if self._extent is None:
            return coordinates
        return np.clip(coordinates, 0.0, self._extent)


def nearest_phases(basis: FloatArray, target: FloatArray, max_turns: int = 400) -> FloatArray:
    """Return a point p of the plane whose phases basis @ p are near the target, modulo 2π.

    The phases of linearly independent waves match exactly at the points of a lattice; of many such
    points the result is the one where the other phases are nearest.
    """
    rank = int(np.linalg.matrix_rank(basis))
    rows = _independent_rows(basis, rank)
    others = [row for row in range(len(basis)) if row not in rows]
    most = max_turns if rank == 2 else max_turns**2
    span = np.arange(-most, most + 1)
    turns = np.stack(np.meshgrid(*[span] * rank, indexing="ij"), axis=-1).reshape(-1, rank)
    phases = target[rows] + 2.0 * math.pi * turns
    points = phases @ np.linalg.pinv(basis[rows]).T
    miss = points @ basis[others].T - target[others]
    miss = np.abs(miss - 2.0 * math.pi * np.round(miss / (2.0 * math.pi))).max(axis=1)
    return np.asarray(points[int(np.argmin(miss))])


def _independent_rows(basis: FloatArray, rank: int) -> list[int]:
    rows: list[int] = []
    for row in range(len(basis)):
        if np.linalg.matrix_rank(basis[[*rows, row]]) > len(rows):
            rows.append(row)
        if len(rows) == rank:
            break
    return rows
