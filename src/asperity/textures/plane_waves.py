"""Sums of plane waves: the lattice of their wave vectors, and cells of their phases.

The lattice gives the periods of a sum and its independent phases. The cells lie on the torus of
these phases: the plane of an aperiodic sum is dense on it, so the supremum is the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Protocol

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.enclosures import cells
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.textures.domain import LineSegments, ScanLine, equal_segments

_MIN_CURVATURE = 1e-30
_MAX_CURVATURE = 1e30


@dataclass(frozen=True, eq=False)
class PlaneWaves:
    """The waves of a height function h(x, y) = Σ a_i sin(k_i · (x, y) + phase_i).

    Attributes:
        amplitudes: a_i [m], shape (n,).
        wavevectors: k_i [rad/m], shape (n, 2).
        phases: [rad], shape (n,).
    """

    amplitudes: FloatArray
    wavevectors: FloatArray
    phases: FloatArray

    @cached_property
    def lattice(self) -> tuple[FloatArray, FloatArray]:
        """Independent wave vectors B [rad/m], (r, 2), and integers N with wavevectors = N @ B."""
        return integer_lattice(self.wavevectors)

    @property
    def shortest_wavelength(self) -> float:
        """Wavelength of the shortest wave [m]."""
        return 2.0 * math.pi / float(np.hypot(*self.wavevectors.T).max())


class SingleWave(Protocol):
    """The one wave A sin(2π (x u_x + y u_y)/l + phase) of a texture with closed forms.

    Attributes:
        amplitude: A [m].
        period: l [m].
        phase: [rad].
        direction: (u_x, u_y), a unit vector.
    """

    amplitude: float
    period: float
    phase: float
    direction: tuple[float, float]


def point_at_phase(wave: SingleWave, phase: float) -> FloatArray:
    """Return the point (2,) [m] on the line through the origin at which a wave has a phase."""
    return (phase - wave.phase) * wave.period / (2.0 * math.pi) * np.array(wave.direction)


_LARGEST_DENOMINATOR = 64
_LARGEST_MULTIPLE = 8
# Relations between more independent waves than this are not searched.
_LARGEST_SEARCHED_RANK = 3
# Relative residual of an exact relation by rounding: a wave number computed from a wavelength has
# four rounding errors, a direction computed from an angle as many more.
_ROUNDING = 4.0 * 2.0**-53
_NEARLY_PARALLEL = 1e-9


def integer_lattice(waves: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a basis B and integers N with waves = N @ B.

    The number of rows of B is the number of independent phases: 1 for a periodic profile, 2 for a
    doubly periodic map, more for aperiodic sums. A ratio counts as rational, up to denominator 64
    (8 where three waves or parallel ones are combined), if its residual is explained by the
    rounding of the numbers: the phase then drifts by no more than the rounding error of the
    phases in the kernels. With any other ratio the phases are independent: far enough out they
    cover the whole torus. An unrecognised relation only increases the number of independent phases:
    a supremum over all phases is then an upper bound, never too low.

    Args:
        waves: wave vectors [rad/m], shape (n, 2).

    Returns:
        B [rad/m], shape (r, 2), and N, shape (n, r).

    Example:
        >>> basis, multiples = integer_lattice(np.array([[4.0, 0.0], [6.0, 0.0]]))
        >>> basis.tolist(), multiples.tolist()
        ([[2.0, 0.0]], [[2.0], [3.0]])
    """
    basis: FloatArray = np.zeros((0, 2))
    multiples: FloatArray = np.zeros((len(waves), 0))
    for index in np.argsort(np.hypot(*waves.T), kind="stable"):
        wave = waves[index]
        if not wave.any():
            continue
        relation = _relation(basis, wave)
        if relation is None:
            basis = np.concatenate([basis, wave[None, :]])
            multiples = np.column_stack([multiples, np.zeros(len(waves))])
            multiples[index, -1] = 1.0
            continue
        denominator, row = relation
        if denominator > 1:
            # The rows of `finer` span the old basis and the wave, in units of basis/denominator.
            identity = denominator * np.eye(len(basis), dtype=int)
            finer = np.array(_row_basis([*identity.tolist(), row]), dtype=float)
            basis = finer @ basis / denominator
            inverse: FloatArray = np.linalg.inv(finer)
            multiples = np.round(denominator * multiples @ inverse)
            row = np.round(np.array(row, dtype=float) @ inverse).tolist()
        multiples[index] = row
    return _shorten(basis, multiples)


def _relation(basis: FloatArray, wave: FloatArray) -> tuple[int, list[int]] | None:
    """Return q and n with q·wave = n @ basis; ``None`` if there are none of moderate size."""
    rank = len(basis)
    if rank == 0:
        return None
    tolerance = _NEARLY_PARALLEL * np.abs(basis).max()
    if rank <= 2 and np.linalg.matrix_rank(basis, tol=tolerance) == rank:
        return _rational_relation(basis, wave)
    if rank > _LARGEST_SEARCHED_RANK:
        return None
    span = np.arange(-_LARGEST_MULTIPLE, _LARGEST_MULTIPLE + 1)
    combinations = np.stack(np.meshgrid(*[span] * rank, indexing="ij"), axis=-1).reshape(-1, rank)
    # Small combinations first, to find the simplest of equal sums.
    combinations = combinations[np.argsort(np.abs(combinations).sum(axis=1), kind="stable")]
    sums = combinations @ basis
    size = float(np.hypot(*wave))
    for q in range(1, _LARGEST_MULTIPLE + 1):
        near = np.abs(sums - q * wave).max(axis=1) <= _NEARLY_PARALLEL * size
        for row in combinations[near].tolist():
            if _is_exact(q, row, basis, wave):
                return q, row
    return None


def _is_exact(q: int, row: list[int], basis: FloatArray, wave: FloatArray) -> bool:
    """Return whether q·wave = row @ basis up to the rounding of the waves."""
    size = q * float(np.hypot(*wave)) + float(np.abs(row) @ np.hypot(*basis.T))
    across = np.abs(basis[:, 0] * wave[1] - basis[:, 1] * wave[0])
    rotated = across > _NEARLY_PARALLEL * np.hypot(*basis.T) * np.hypot(*wave)
    allowed = Fraction((1.0 + rotated.any()) * _ROUNDING * size)
    for axis in (0, 1):
        terms = (n * Fraction(b) for n, b in zip(row, basis[:, axis].tolist(), strict=True))
        if abs(sum(terms, -q * Fraction(float(wave[axis])))) > allowed:
            return False
    return True


def _rational_relation(basis: FloatArray, wave: FloatArray) -> tuple[int, list[int]] | None:
    """Return the relation whose coefficients are ratios of integers, if there is one."""
    real = np.linalg.lstsq(basis.T, wave, rcond=None)[0]
    parts = [Fraction(float(c)).limit_denominator(_LARGEST_DENOMINATOR) for c in real]
    q = math.lcm(*(p.denominator for p in parts))
    row = [int(p * q) for p in parts]
    return (q, row) if _is_exact(q, row, basis, wave) else None


def _row_basis(rows: list[list[int]]) -> list[list[int]]:
    """Return a basis of the integer row space (Hermite normal form by the Euclidean algorithm)."""
    rows = [row[:] for row in rows]
    result = []
    for column in range(len(rows[0])):
        while sum(row[column] != 0 for row in rows) > 1:
            rows.sort(key=lambda row: (row[column] == 0, abs(row[column])))
            pivot = rows[0]
            for row in rows[1:]:
                factor = row[column] // pivot[column]
                row[:] = [a - factor * b for a, b in zip(row, pivot, strict=True)]
        rows.sort(key=lambda row: row[column] == 0)
        if rows and rows[0][column] != 0:
            result.append(rows.pop(0))
    return result


def _shorten(basis: FloatArray, multiples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a basis of short vectors of a planar lattice (Lagrange-Gauss reduction)."""
    if len(basis) != 2 or abs(np.linalg.det(basis)) < _NEARLY_PARALLEL * np.abs(basis).max() ** 2:
        return basis, multiples
    a, b = basis
    while True:
        if a @ a > b @ b:
            a, b = b, a
        shorter = b - round(float(a @ b / (a @ a))) * a
        # A hexagonal lattice has three equally short pairs: rounding would swap them forever.
        if shorter @ shorter >= b @ b * (1.0 - 1e-12):
            break
        b = shorter
    short = np.array([a, b])
    return short, np.round(multiples @ basis @ np.linalg.inv(short))


def check_curvature(name: str, curvature: float, wavelength_name: str) -> None:
    """Reject waves whose curvature is beyond the range in which searches converge.

    Args:
        name: name of the argument with the heights, for the message.
        curvature: greatest curvature, the sum of a |k|² [1/m].
        wavelength_name: name of the argument that gives the wavelengths.

    Raises:
        ParameterError: for a curvature beyond 1e±30, except zero.
    """
    if curvature and not _MIN_CURVATURE <= curvature <= _MAX_CURVATURE:
        limits = f"must be {_MIN_CURVATURE:g}/m to {_MAX_CURVATURE:g}/m"
        fault = f"and {wavelength_name} make a curvature of {curvature:.3g}/m, which {limits}"
        raise ParameterError(name, fault)


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
        self._extent: tuple[float, ...] | None = None
        self._margin = margin
        self._amplitudes = waves.amplitudes
        self._phases = waves.phases
        self._waves = waves.wavevectors
        if extent is None:
            self._basis, self._multiples = waves.lattice
        else:
            self._extent = tuple(side + 2.0 * margin for side in extent)
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
        sizes = self._sizes()
        # Cells on which the phase of the fastest wave changes by about 0.7 rad, but not fewer than
        # can be evaluated at the cost of one.
        fewest = 64 if self.dimensions == 1 else 16
        turns = np.abs(self._multiples).max(axis=0) * sizes
        limit = 4_000_000 ** (1.0 / self.dimensions)
        counts = [int(min(max(math.ceil(turn / 0.7), fewest), limit)) for turn in turns]
        half = 0.5 * sizes / counts
        chunks = cells.grid_index_chunks(counts, self.chunk_size())
        return (half * (2.0 * index + 1.0) for index in chunks), half

    def _sizes(self) -> FloatArray:
        """Return the sizes of the torus, or of the rectangle."""
        if self._extent is None:
            return np.full(self.dimensions, 2.0 * math.pi)
        return np.array(self._extent)

    def sample_coordinates(self, count: int = cells.SAMPLE_COUNT) -> FloatArray:
        """See :class:`Cells`."""
        count = min(count, max(64, _SINES_PER_CHUNK // len(self._amplitudes)))
        if self.dimensions == 1 and self._extent is None:
            count = min(count, _SAMPLES_PER_WAVE * (1 + int(np.abs(self._multiples).max())))
        return np.asarray(cells.low_discrepancy_points(count, self.dimensions) * self._sizes())

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
        phases = np.abs(centres).max(axis=0, initial=0.0) @ np.abs(self._multiples).T
        largest = float((phases + np.abs(self._phases)).max())
        slack = 16.0 * cells.EPS * (1.0 + largest + len(sine[0]))
        result: dict[str, TaylorNumber] = {}
        for name in names:
            weight = self._weights[name]
            odd = sum(cells.DERIVATIVE_ORDERS[name]) % 2
            values = sine
            slopes = cosine
            if odd:
                values = cosine
                slopes = -sine
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
        sign = (1.0, 1.0, -1.0)[nx + ny]
        return np.asarray(sign * weight)

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        angles = coordinates @ self._multiples.T + self._phases
        result = np.empty((len(coordinates), len(cells.DERIVATIVE_NAMES)))
        result[:, _EVEN] = np.sin(angles) @ self._even
        result[:, _ODD] = np.cos(angles) @ self._odd
        return result

    @property
    def are_places(self) -> bool:
        """See :class:`Cells`; more phases than the plane has coordinates are none."""
        is_covered = self.dimensions <= np.linalg.matrix_rank(self._basis)
        return self._extent is not None or bool(is_covered)

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`; for more than two phases the nearest phases among many points."""
        if self._extent is not None:
            return np.ascontiguousarray(coordinates - self._margin)
        if self.dimensions == 1:
            wave = self._basis[0]
            return np.ascontiguousarray(coordinates * (wave / (wave @ wave)))
        if self.are_places:
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
    turns_each = max_turns ** (3 - rank)
    span = np.arange(-turns_each, turns_each + 1)
    turns = np.stack(np.meshgrid(*[span] * rank, indexing="ij"), axis=-1).reshape(-1, rank)
    phases = target[rows] + 2.0 * math.pi * turns
    points = phases @ np.linalg.pinv(basis[rows]).T
    miss = points @ basis[others].T - target[others]
    miss = np.abs(miss - 2.0 * math.pi * np.round(miss / (2.0 * math.pi))).max(axis=1)
    return np.array(points[int(np.argmin(miss))])  # no view, which would hold all points


def _independent_rows(basis: FloatArray, rank: int) -> list[int]:
    rows: list[int] = []
    for row in range(len(basis)):
        if np.linalg.matrix_rank(basis[[*rows, row]]) > len(rows):
            rows.append(row)
        if len(rows) == rank:
            break
    return rows


def wave_segments(waves: PlaneWaves, line: ScanLine, min_count: int) -> LineSegments:
    """Return segments of a line over a sum of waves."""
    return equal_segments(_WavesAlongLine(waves, line), line, min_count, line.length)


class _WavesAlongLine(WaveCells):
    """Waves along a line; the coordinate is the distance [m]."""

    def __init__(self, waves: PlaneWaves, line: ScanLine) -> None:
        super().__init__(waves, (line.length, line.length))
        self._phases = self._phases + self._waves @ line.start
        self._multiples = self._waves @ line.direction[:, None]
        self._line = line
        self.dimensions = 1
        self._extent = (line.length,)

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.ascontiguousarray(self._line.start + coordinates * self._line.direction)
