"""Spline surfaces, cut along their own cells.

There every derivative is a polynomial, which its Bernstein coefficients enclose. On blocks of
several cells of a map its B-spline coefficients do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from asperity.checks import FloatArray
from asperity.enclosures.cells import CHUNK, EPS, ORDERS, SAMPLES, Cells, spread
from asperity.enclosures.taylor import Number, Taylor

Evaluate = Callable[[FloatArray], FloatArray]

# From uniform B-spline to Bernstein coefficients on one cell, by degree.
_TO_BERNSTEIN = {
    0: np.ones((1, 1)),
    1: np.eye(2),
    2: np.array([[1.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 1.0, 1.0]]) / 2.0,
    3: np.array(
        [[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]]
    )
    / 6.0,
}


# Cells along the side of the blocks that are looked at first: a power of two.
_BLOCK = 4


class MapCells(Cells):
    """The cells of a bicubic spline, in units of its nodes, and at first blocks of them.

    Args:
        coefficients: of the B-spline [m], one row and column before the first cell, two after.
        pitch: distance of the nodes (p_x, p_y) [m].
        origin: the first node [m], shape (2,).
        derivatives: h, h_x, h_y, h_xx, h_xy, h_yy, (n, 6), at points (n, 2) [m].
    """

    dimensions, gap, cheap_gap = 2, 1e-3, 1e-6

    def __init__(
        self,
        coefficients: FloatArray,
        pitch: tuple[float, float],
        origin: FloatArray,
        derivatives: Evaluate,
    ) -> None:
        self._c, self._per, self._origin = coefficients, 1.0 / np.array(pitch), origin
        self._counts = np.array([coefficients.shape[1] - 3, coefficients.shape[0] - 3])
        self._evaluate = derivatives

    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        side = _BLOCK
        while side > self._counts.min():
            side //= 2
        # The last blocks overlap where the cells are no multiple of the side.
        x, y = (np.append(np.arange(0, n - side, side), n - side) for n in self._counts)
        total = len(x) * len(y)

        def chunks() -> Iterator[FloatArray]:
            for first in range(0, total, CHUNK):
                rows, columns = np.divmod(np.arange(first, min(first + CHUNK, total)), len(x))
                yield np.stack([x[columns], y[rows]], axis=-1) + 0.5 * side

        return chunks(), np.full(2, 0.5 * side)

    def samples(self, count: int = SAMPLES) -> FloatArray:
        """See :class:`Cells`; at nodes, where second derivatives of a spline are extreme."""
        return np.asarray(np.round(spread(count, 2) * self._counts))

    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """See :class:`Cells`."""
        side = max(1, round(2.0 * float(half.max())))
        first = centres if side == 1 else centres - half
        cell = np.minimum(np.floor(first).astype(np.int64), self._counts - side)
        step = np.arange(side + 3)
        patch = self._c[
            (cell[:, 1, None] + step)[:, :, None], (cell[:, 0, None] + step)[:, None, :]
        ]
        matrices = _AxisMatrices(centres - half - cell, 2.0 * half)
        slack = 256.0 * EPS * np.abs(patch).max(axis=(1, 2))
        result: dict[str, Number] = {}
        for name in names:
            nx, ny = ORDERS[name]
            scale = float(self._per[0] ** nx * self._per[1] ** ny)
            part = np.diff(np.diff(patch, nx, axis=2), ny, axis=1)
            if side > 1:
                result[name] = _fit_block(part, side, scale, slack)
            else:
                result[name] = _fit(matrices.both(part), scale, slack)
        return result

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._evaluate(self.plane(coordinates))

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.ascontiguousarray(self._origin + coordinates / self._per)

    def coordinates(self, xy: FloatArray) -> FloatArray:
        """Return the coordinates (n, 2) of points of the plane."""
        return np.asarray((xy - self._origin) * self._per)

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.clip(coordinates, 0.0, self._counts)


class ProfileCells(Cells):
    """The cells of a cubic spline along x, in units of its nodes; see :class:`MapCells`."""

    dimensions, gap, cheap_gap = 1, 1e-6, 1e-9

    def __init__(
        self, coefficients: FloatArray, pitch: float, origin: float, derivatives: Evaluate
    ) -> None:
        self._c, self._per, self._origin = coefficients, 1.0 / pitch, origin
        self._count = len(coefficients) - 3
        self._evaluate = derivatives

    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        firsts = range(0, self._count, CHUNK)

        def chunks() -> Iterator[FloatArray]:
            for first in firsts:
                cells = np.arange(first, min(first + CHUNK, self._count), dtype=float)
                yield cells[:, None] + 0.5

        return chunks(), np.array([0.5])

    def samples(self, count: int = SAMPLES) -> FloatArray:
        """See :class:`Cells`; at nodes, where second derivatives of a spline are extreme."""
        return np.round(spread(min(count, 4 * self._count), 1) * self._count)

    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """See :class:`Cells`."""
        cell = np.minimum(np.floor(centres).astype(np.int64), self._count - 1)
        patch = self._c[cell + np.arange(4)][:, None, :]
        matrices = _AxisMatrices(centres - half - cell, 2.0 * half)
        slack = 256.0 * EPS * np.abs(patch).max(axis=(1, 2))
        result: dict[str, Number] = {}
        for name in names:
            nx, ny = ORDERS[name]
            if ny:
                result[name] = 0.0
                continue
            part = np.diff(patch, nx, axis=2)
            result[name] = _fit(matrices.along_x(part), float(self._per**nx), slack)
        return result

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._evaluate(self.plane(coordinates))

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        x = self._origin + coordinates[:, 0] / self._per
        return np.ascontiguousarray(np.stack([x, np.zeros_like(x)], axis=-1))

    def coordinates(self, xy: FloatArray) -> FloatArray:
        """Return the coordinates (n, 1) of points of the plane."""
        return np.asarray((xy[:, :1] - self._origin) * self._per)

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.clip(coordinates, 0.0, self._count)


class _AxisMatrices:
    """Matrices from B-spline coefficients to Bernstein coefficients on a part of each cell."""

    def __init__(self, left: FloatArray, width: FloatArray) -> None:
        whole = bool((width >= 1.0).all())
        # On whole cells one matrix serves all.
        self._left = np.zeros((1, left.shape[1])) if whole else left
        self._width = width
        self._known: dict[tuple[int, int], FloatArray] = {}

    def _matrix(self, axis: int, degree: int) -> FloatArray:
        key = (axis, degree)
        if key not in self._known:
            left = self._left[:, axis]
            split = _subdivision(degree, left, left + self._width[axis])
            self._known[key] = split @ _TO_BERNSTEIN[degree]
        return self._known[key]

    def along_x(self, part: FloatArray) -> FloatArray:
        """Return the Bernstein coefficients of rows (n, q, p)."""
        m = self._matrix(0, part.shape[2] - 1)
        if len(m) == 1:
            return np.asarray(part @ m[0].T)
        return np.asarray(part @ m.transpose(0, 2, 1))

    def both(self, part: FloatArray) -> FloatArray:
        """Return the tensor Bernstein coefficients of patches (n, q, p)."""
        m = self._matrix(1, part.shape[1] - 1)
        return np.asarray(m @ self.along_x(part))


def _subdivision(degree: int, left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the matrices, (n, p + 1, p + 1), of de Casteljau's algorithm for [left, right]."""
    rows = []
    for k in range(degree + 1):
        points = np.broadcast_to(np.eye(degree + 1), (len(left), degree + 1, degree + 1))
        for u in [left] * (degree - k) + [right] * k:
            t = u[:, None, None]
            points = (1.0 - t) * points[:, :-1] + t * points[:, 1:]
        rows.append(points[:, 0])
    return np.stack(rows, axis=1)


def _fit(bernstein: FloatArray, scale: float, slack: FloatArray) -> Taylor:
    """Return the linear function through the corners, and the hull of what it leaves out."""
    n, rows, columns = bernstein.shape
    left, right = bernstein[:, :, 0], bernstein[:, :, -1]
    gx = 0.25 * (right[:, 0] + right[:, -1] - left[:, 0] - left[:, -1])
    slopes = [gx]
    linear = gx[:, None, None] * np.linspace(-1.0, 1.0, columns)
    if rows > 1:
        gy = 0.25 * (left[:, -1] + right[:, -1] - left[:, 0] - right[:, 0])
        slopes.append(gy)
        linear = linear + gy[:, None, None] * np.linspace(-1.0, 1.0, rows)[:, None]
    rest = (bernstein - linear).reshape(n, -1)
    low, high = rest.min(axis=1), rest.max(axis=1)
    c = 0.5 * (low + high)
    # The conversion multiplies and adds at most 16 coefficients, each weight at most one.
    e = 0.5 * (high - low) * (1.0 + 8.0 * EPS) + slack
    return Taylor(scale * c, scale * np.stack(slopes), scale * e * (1.0 + 8.0 * EPS))


def _fit_block(part: FloatArray, side: int, scale: float, slack: FloatArray) -> Taylor:
    """Return a linear function on blocks of cells, and the hull of what it leaves out.

    The B-spline coefficients of a linear function are its values at the Greville points; those of
    the rest enclose it.

    Args:
        part: coefficients, shape (n, side + degree along y, side + degree along x).
        side: cells along the side of a block.
        scale: factor of the derivative.
        slack: error of the coefficients by rounding.
    """
    y, x = ((2.0 * np.arange(count) - (count - side - 1) - side) / side for count in part.shape[1:])
    gx = part.mean(axis=1) @ x / (x @ x)
    gy = part.mean(axis=2) @ y / (y @ y)
    rest = part - gx[:, None, None] * x - gy[:, None, None] * y[:, None]
    low, high = rest.min(axis=(1, 2)), rest.max(axis=(1, 2))
    c, e = 0.5 * (low + high), 0.5 * (high - low) * (1.0 + 8.0 * EPS) + slack
    return Taylor(scale * c, scale * np.stack([gx, gy]), scale * e * (1.0 + 8.0 * EPS))
