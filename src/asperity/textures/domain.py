"""The domain of a texture, which represents all of it, its scan line, and its cells.

The cells of any texture follow from proved bounds of its derivatives and values at the centres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

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

GridValues = tuple[FloatArray, tuple[float, float], bool]
"""Values on a grid, its spacing (x, y) [m], and whether it covers a whole period."""


@dataclass(frozen=True)
class Domain:
    """A region of the plane that represents the whole texture.

    Attributes:
        origin: one corner [m], shape (2,).
        spans: edge vectors [m], shape (1, 2) for a profile, (2, 2) for a map.
        periodic: whether the texture repeats along every span.
        description: phrase for tables.
    """

    origin: FloatArray
    spans: FloatArray
    periodic: bool
    description: str

    def points(self, fractions: FloatArray) -> FloatArray:
        """Return the points (n, 2) [m] at fractions (n, d) of the spans."""
        return np.ascontiguousarray(self.origin + fractions @ self.spans)

    def expand(self, margin: float) -> Domain:
        """Return the region extended by a margin [m] on every side."""
        unit = self.spans / np.hypot(*self.spans.T)[:, None]
        spans = self.spans + 2.0 * margin * unit
        return replace(self, origin=self.origin - margin * unit.sum(axis=0), spans=spans)

    def repeats_after(self, x: float, y: float) -> bool:
        """Return whether the texture repeats after steps of x along x and of y along y [m]."""
        periods = np.diag((x, y)) @ np.linalg.pinv(self.spans)
        return self.periodic and bool(np.abs(periods - np.rint(periods)).max() < 1e-9)

    def orthogonal_spans(self) -> tuple[FloatArray, bool]:
        """Return orthogonal spans [m], and whether the texture is periodic along them."""
        if len(self.spans) == 1:
            return self.spans, self.periodic
        along = self.spans[0] / np.hypot(*self.spans[0])
        across = self.spans[1] - float(self.spans[1] @ along) * along
        skew = float(np.hypot(*(self.spans[1] - across)))
        square = skew < 1e-9 * float(np.hypot(*across))
        return np.array([self.spans[0], across]), self.periodic and square

    def grid(self, counts: Sequence[int], max_count: int | None = None) -> GridValues:
        """Return equally spaced points along orthogonal spans.

        Args:
            counts: points along each span.
            max_count: greatest number of points along each side, taken from the middle of the grid.

        Returns:
            Points [m], shape (ny, nx, 2), (1, nx, 2) for a profile; spacing (x, y) [m]; whether
            they cover a whole period.
        """
        spans, repeats = self.orthogonal_spans()
        sides = np.hypot(*spans.T)
        number = np.array(counts, dtype=np.intp)
        # A finite map has nodes at both ends; a periodic one does not repeat its first node.
        steps = sides / (number - (not self.periodic))
        first = np.zeros_like(number)
        if max_count is not None and number.max() > max_count:
            repeats = False
            first = np.maximum((number - max_count) // 2, 0)
            number = np.minimum(number, max_count)
        ticks = [
            (start + np.arange(count)) * step / side
            for start, count, step, side in zip(first, number, steps, sides, strict=True)
        ]
        points = self.origin + np.stack(np.meshgrid(*ticks), axis=-1) @ spans
        if len(ticks) == 1:
            points = points[None]
        return points, (float(steps[0]), float(steps[-1])), repeats


@dataclass(frozen=True)
class ScanLine:
    """A straight line over the texture.

    Attributes:
        start: first point [m], shape (2,).
        direction: unit vector, shape (2,).
        length: one period, or the extent [m].
        periodic: whether the texture repeats after this length.
    """

    start: FloatArray
    direction: FloatArray
    length: float
    periodic: bool

    def points(self, count: int) -> FloatArray:
        """Return points (count, 2) [m] in the middle of equal steps."""
        steps = (np.arange(count) + 0.5) * (self.length / count)
        return np.ascontiguousarray(self.start + steps[:, None] * self.direction)


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
        corners = [steps.sum(axis=0), steps[0] - steps[1:].sum(axis=0)]
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
        for name, order, value, bound in checks:
            above = ~(value <= bound * _INFLATION + 2.0 * self._rounding_errors[order])
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
        models = self.cells.enclosures(self.centres, self.half, names)
        for name, model in models.items():
            if isinstance(model, TaylorModel):
                models[name] = TaylorModel(model.c, model.g.sum(axis=0, keepdims=True), model.e)
        return models


def equal_segments(cells: Cells, line: ScanLine, min_count: int, length: float) -> LineSegments:
    """Return segments of a line whose cells have one coordinate, 0 to ``length``."""
    half = 0.5 * length / min_count
    centres: FloatArray = half * (2.0 * np.arange(min_count, dtype=float)[:, None] + 1.0)
    return LineSegments(cells, centres, np.full(1, half), line.length / min_count)
