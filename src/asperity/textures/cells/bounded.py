"""Cells of any texture, from proved bounds of its derivatives and their values at the centres."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.cells import CHUNK, EPS, NAMES, ORDERS, SAMPLES, Cells, spread
from asperity.enclosures.taylor import Number, Taylor
from asperity.errors import InternalError
from asperity.textures.domain import Domain

# First cells along each coordinate, by their number.
_FIRST = {1: 256, 2: 32}
# Unless third derivatives are bounded, smaller cells soon tell no more of the second ones.
_MOST_CELLS = 250_000
# What a sampler may lose to rounding, in units of the size of what it computes.
_UNITS = 64.0
_ABOVE = 1.0 + 1e-9
# Of each name: the columns of its own derivatives by x and by y.
_NEXT = {"h": (1, 2), "hx": (3, 4), "hy": (4, 5)}


@dataclass(frozen=True)
class DerivativeBounds:
    """What is proved of a height function h over the whole plane.

    Attributes:
        low: least height [m].
        high: greatest height [m].
        slope: M >= |∇h| [1].
        bend: K >= ‖Hess h‖₂ [1/m].
        twist: T >= ‖D³h‖ [1/m²], the rate at which the Hessian changes; infinite if not known.
    """

    low: float
    high: float
    slope: float
    bend: float
    twist: float = math.inf


class BoundedCells(Cells):
    """Boxes of a region in fractions of its spans; Taylor's formula encloses the derivatives.

    At most a distance R from the centre of a box, |h - h₀ - ∇h₀·δ| <= K R²/2,
    |∇h - ∇h₀| <= K R, or |∇h - ∇h₀ - Hess h₀ δ| <= T R²/2 where that is less, and
    ‖Hess h - Hess h₀‖ <= T R. Nothing leaves [low, high], M and K either. Without T the second
    derivatives are known to be within ±K only: honest, and wide.

    Args:
        region: of the plane.
        derivatives: h, h_x, h_y, h_xx, h_xy, h_yy, (n, 6), at points (n, 2) [m]; exact but for
            64 units of round-off of the bounds.
        bounds: what is proved.
    """

    gap, cheap_gap = 1e-3, None

    def __init__(
        self,
        region: Domain,
        derivatives: Callable[[FloatArray], FloatArray],
        bounds: DerivativeBounds,
    ) -> None:
        self._region, self._evaluate, self._bounds = region, derivatives, bounds
        self.dimensions = len(region.spans)
        self.bend = bounds.bend * _ABOVE
        self.most = None if math.isfinite(bounds.twist) else _MOST_CELLS
        size = max(abs(bounds.low), abs(bounds.high))
        reach = float(np.hypot(*region.origin) + np.hypot(*region.spans.T).sum())
        # What rounding costs of the values, and of the position they are taken at.
        known = min(bounds.twist, bounds.bend / reach)
        sizes = (size, bounds.slope, bounds.bend)
        rates = (bounds.slope, bounds.bend, known)
        self._slack = [_UNITS * EPS * (a + b * reach) for a, b in zip(sizes, rates, strict=True)]

    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        count = _FIRST[self.dimensions]
        ticks = (np.arange(count) + 0.5) / count
        centres = np.stack(np.meshgrid(*[ticks] * self.dimensions, indexing="ij"), axis=-1)
        flat = centres.reshape(-1, self.dimensions)
        parts = (flat[first : first + CHUNK] for first in range(0, len(flat), CHUNK))
        return parts, np.full(self.dimensions, 0.5 / count)

    def samples(self, count: int = SAMPLES) -> FloatArray:
        """See :class:`Cells`."""
        return spread(count, self.dimensions)

    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """See :class:`Cells`."""
        values = self.derivatives(centres)
        steps = half[:, None] * self._region.spans
        corners = [steps[0] + sign * steps[-1] for sign in (-1.0, 1.0)] if len(steps) > 1 else steps
        reach = max(float(np.hypot(*corner)) for corner in corners)
        return {name: self._model(name, values, steps, reach) for name in names}

    def _model(self, name: str, values: FloatArray, steps: FloatArray, reach: float) -> Taylor:
        order, b = sum(ORDERS[name]), self._bounds
        value = np.ascontiguousarray(values[:, NAMES.index(name)])
        linear = np.zeros((len(steps), len(value)))
        by_taylor, by_slope = 0.5 * b.twist * reach * reach, b.bend * reach
        error = (0.5 * b.bend * reach * reach, min(by_taylor, by_slope), b.twist * reach)[order]
        if order == 0 or (order == 1 and by_taylor < by_slope):
            linear = steps @ values[:, _NEXT[name]].T
        return self._within(order, Taylor(value, linear, np.full(len(value), error)))

    def _within(self, order: int, model: Taylor) -> Taylor:
        """Return a model, replaced by the whole range where it says no more than that."""
        b = self._bounds
        middle = 0.5 * (b.low + b.high) if order == 0 else 0.0
        limit = (0.5 * (b.high - b.low), b.slope, b.bend)[order]
        wide = model.radius > limit
        c, e = np.where(wide, middle, model.c), np.where(wide, limit, model.e)
        g = np.where(wide, 0.0, model.g)
        return Taylor(c, g, (e + self._slack[order]) * (1.0 + 8.0 * EPS))

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`.

        Raises:
            InternalError: where a value contradicts the bounds: nothing would be a proof.
        """
        points = self.plane(coordinates)
        values = self._evaluate(points)
        b = self._bounds
        middle, most = 0.5 * (b.low + b.high), 0.5 * (b.high - b.low)
        self._check("the extremes", 0, points, np.abs(values[:, 0] - middle), most)
        self._check("the slope bound", 1, points, np.hypot(values[:, 1], values[:, 2]), b.slope)
        self._check("the bend bound", 2, points, _spectral(values[:, 3:]), b.bend)
        if math.isfinite(b.twist):
            # From one point to the next the Hessian changes by at most T times the distance.
            change = _spectral(np.diff(values[:, 3:], axis=0))
            far = b.twist * np.hypot(*np.diff(points, axis=0).T)
            self._check("the twist bound", 2, points, change, far)
        return values

    def _check(
        self, name: str, order: int, points: FloatArray, found: FloatArray, most: float | FloatArray
    ) -> None:
        above = ~(found <= most * _ABOVE + 2.0 * self._slack[order])
        if above.any():
            x, y = points[int(np.argmax(above))]
            raise InternalError(f"the texture exceeds {name} that it claims at ({x:g}, {y:g}) m")

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._region.points(coordinates)

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return coordinates if self._region.periodic else np.clip(coordinates, 0.0, 1.0)


def _spectral(second: FloatArray) -> FloatArray:
    """Return ‖H‖₂, shape (n,), of Hessians given as h_xx, h_xy, h_yy, (n, 3)."""
    xx, xy, yy = second.T
    return np.asarray(0.5 * np.abs(xx + yy) + np.hypot(0.5 * (xx - yy), xy))
