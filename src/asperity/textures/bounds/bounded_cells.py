"""Cells of any texture, from proved bounds of its derivatives and values at the centres."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import InternalError
from asperity.enclosures.cells import (
    DERIVATIVE_NAMES,
    DERIVATIVE_ORDERS,
    EPS,
    SAMPLE_COUNT,
    Cells,
    grid_index_chunks,
    low_discrepancy_points,
)
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.textures.bounds.spline_bounds import SplineCells
from asperity.textures.bounds.wave_cells import WaveCells
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.plane_waves import PlaneWaves

# Initial cells along each coordinate, by the number of coordinates.
_INITIAL_COUNTS = {1: 256, 2: 32}
# Without a bound of third derivatives, smaller cells do not tighten second derivatives.
_MAX_CELLS = 250_000
# Rounding error of a sampler, in units of round-off of the magnitude of its values.
_ROUNDING_UNITS = 64.0
_INFLATION = 1.0 + 1e-9
# Columns of the derivatives by x and by y of each quantity.
_DERIVATIVE_COLUMNS = {"h": (1, 2), "hx": (3, 4), "hy": (4, 5)}


@dataclass(frozen=True)
class DerivativeBounds:
    """Proved bounds of a height function h over the whole plane.

    Attributes:
        low: least height [m].
        high: greatest height [m].
        slope_bound: M >= |∇h| [1].
        hessian_bound: K >= ‖Hess h‖₂ [1/m].
        third_derivative_bound: T >= ‖D³h‖ [1/m²], change of the Hessian; infinite if unknown.
    """

    low: float
    high: float
    slope_bound: float
    hessian_bound: float
    third_derivative_bound: float = math.inf


class BoundedCells(Cells):
    """Boxes of a region in fractions of its spans; Taylor's formula encloses the derivatives.

    Within a distance R of the centre of a box, |h - h₀ - ∇h₀·δ| <= K R²/2, |∇h - ∇h₀| <= K R, or
    |∇h - ∇h₀ - Hess h₀ δ| <= T R²/2 where that is less, and ‖Hess h - Hess h₀‖ <= T R. All stay
    within [low, high], M and K. Without T the second derivatives are bounded by ±K only.

    Args:
        region: region of the plane.
        derivatives: function returning h, h_x, h_y, h_xx, h_xy, h_yy, (n, 6), at points (n, 2)
            [m], exact up to 64 units of round-off of the bounds.
        bounds: proved bounds.
    """

    default_gap = 1e-3
    refined_gap = None

    def __init__(
        self,
        region: Domain,
        derivatives: Callable[[FloatArray], FloatArray],
        bounds: DerivativeBounds,
    ) -> None:
        self._region = region
        self._evaluate = derivatives
        self._bounds = bounds
        self.dimensions = len(region.spans)
        self.hessian_bound = bounds.hessian_bound * _INFLATION
        self.max_cells = None if math.isfinite(bounds.third_derivative_bound) else _MAX_CELLS
        size = max(abs(bounds.low), abs(bounds.high))
        reach = float(np.hypot(*region.origin) + np.hypot(*region.spans.T).sum())
        # Rounding errors of the values and of the positions.
        third = min(bounds.third_derivative_bound, bounds.hessian_bound / reach)
        sizes = (size, bounds.slope_bound, bounds.hessian_bound)
        rates = (bounds.slope_bound, bounds.hessian_bound, third)
        self._rounding_errors = [
            _ROUNDING_UNITS * EPS * (a + b * reach) for a, b in zip(sizes, rates, strict=True)
        ]

    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        count = _INITIAL_COUNTS[self.dimensions]
        chunks = grid_index_chunks([count] * self.dimensions)
        return ((index + 0.5) / count for index in chunks), np.full(self.dimensions, 0.5 / count)

    def sample_coordinates(self, count: int = SAMPLE_COUNT) -> FloatArray:
        """See :class:`Cells`."""
        return low_discrepancy_points(count, self.dimensions)

    def enclosures(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, TaylorNumber]:
        """See :class:`Cells`."""
        values = self.derivatives(centres)
        steps = half[:, None] * self._region.spans
        corners = [steps[0] + sign * steps[-1] for sign in (-1.0, 1.0)] if len(steps) > 1 else steps
        reach = max(float(np.hypot(*corner)) for corner in corners)
        return {name: self._model(name, values, steps, reach) for name in names}

    def _model(self, name: str, values: FloatArray, steps: FloatArray, reach: float) -> TaylorModel:
        order = sum(DERIVATIVE_ORDERS[name])
        b = self._bounds
        value = np.ascontiguousarray(values[:, DERIVATIVE_NAMES.index(name)])
        linear = np.zeros((len(steps), len(value)))
        by_taylor = 0.5 * b.third_derivative_bound * reach * reach
        by_slope = b.hessian_bound * reach
        second = 0.5 * b.hessian_bound * reach * reach
        error = (second, min(by_taylor, by_slope), b.third_derivative_bound * reach)[order]
        if order == 0 or (order == 1 and by_taylor < by_slope):
            linear = steps @ values[:, _DERIVATIVE_COLUMNS[name]].T
        return self._limit_to_range(order, TaylorModel(value, linear, np.full(len(value), error)))

    def _limit_to_range(self, order: int, model: TaylorModel) -> TaylorModel:
        """Return the model, replaced by the whole range where it is wider."""
        b = self._bounds
        middle = 0.5 * (b.low + b.high) if order == 0 else 0.0
        limit = (0.5 * (b.high - b.low), b.slope_bound, b.hessian_bound)[order]
        wide = model.radius > limit
        c = np.where(wide, middle, model.c)
        e = np.where(wide, limit, model.e)
        g = np.where(wide, 0.0, model.g)
        return TaylorModel(c, g, (e + self._rounding_errors[order]) * (1.0 + 8.0 * EPS))

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`.

        Raises:
            InternalError: if a value contradicts the bounds.
        """
        points = self.to_plane(coordinates)
        values = self._evaluate(points)
        b = self._bounds
        slopes = np.hypot(values[:, 1], values[:, 2])
        second = values[:, 3:]
        height = np.abs(values[:, 0] - 0.5 * (b.low + b.high))
        checks = [
            ("extremes", 0, height, 0.5 * (b.high - b.low)),
            ("slope bound", 1, slopes, b.slope_bound),
            ("Hessian bound", 2, _spectral_norms(second), b.hessian_bound),
        ]
        if math.isfinite(b.third_derivative_bound):
            # From one point to the next the Hessian changes by at most T times the distance.
            change = _spectral_norms(np.diff(second, axis=0))
            limit = b.third_derivative_bound * np.hypot(*np.diff(points, axis=0).T)
            checks.append(("third-derivative bound", 2, change, limit))
        for name, order, found, most in checks:
            above = ~(found <= most * _INFLATION + 2.0 * self._rounding_errors[order])
            if above.any():
                x, y = points[int(np.argmax(above))]
                raise InternalError(f"the texture exceeds its {name} at ({x:g}, {y:g}) m")
        return values

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._region.points(coordinates)

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return coordinates if self._region.periodic else np.clip(coordinates, 0.0, 1.0)


def _spectral_norms(second: FloatArray) -> FloatArray:
    """Return ‖H‖₂, shape (n,), of Hessians given as h_xx, h_xy, h_yy, (n, 3)."""
    xx, xy, yy = second.T
    return np.asarray(0.5 * np.abs(xx + yy) + np.hypot(0.5 * (xx - yy), xy))


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
        centres = centres[::-1].copy()
        half = -half
    return LineSegments(cells, centres, np.abs(half), line.length / (nodes * parts))


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
