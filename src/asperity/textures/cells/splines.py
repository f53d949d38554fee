"""Spline surfaces, cut along their own cells.

There every derivative is a polynomial, which its Bernstein coefficients enclose. On blocks of
several cells of a map its B-spline coefficients do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.enclosures.cells import CHUNK, EPS, ORDERS, SAMPLES, Cells, spread
from asperity.enclosures.taylor import Number, Taylor

# From uniform B-spline to Bernstein coefficients on one cell, by degree.
_TO_BERNSTEIN = {
    1: np.eye(2),
    2: np.array([[1.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 1.0, 1.0]]) / 2.0,
    3: np.array(
        [[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]]
    )
    / 6.0,
}


# Cells along the side of the blocks of a map that are looked at first: a power of two.
_BLOCK = 4
_GAPS = {1: (1e-6, 1e-9), 2: (1e-3, 1e-6)}


class SplineCells(Cells):
    """The cells of a spline, in units of its nodes; of a map at first blocks of them.

    Args:
        coefficients: of the B-spline [m], one (row and column) before the first cell, two after;
            shape (n + 3,) for a profile along x.
        pitch: distance of the nodes [m], (p_x, p_y) or (p_x,).
        origin: the first node [m], shape (2,) or (1,).
        derivatives: h, h_x, h_y, h_xx, h_xy, h_yy, (n, 6), at points (n, 2) [m].
    """

    def __init__(
        self,
        coefficients: FloatArray,
        pitch: tuple[float, ...],
        origin: FloatArray,
        derivatives: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._c, self._per, self._origin = coefficients, 1.0 / np.array(pitch), origin
        self._counts = np.array(coefficients.shape[::-1]) - 3
        self._evaluate = derivatives
        self.dimensions = len(pitch)
        self.gap, self.cheap_gap = _GAPS[self.dimensions]

    def start(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        side = _BLOCK if self.dimensions > 1 else 1
        while side > self._counts.min():
            side //= 2
        # The last blocks overlap where the cells are no multiple of the side.
        firsts = [np.append(np.arange(0, n - side, side), n - side) for n in self._counts]
        shape = [len(first) for first in firsts[::-1]]
        total = math.prod(shape)

        def chunks() -> Iterator[FloatArray]:
            for begin in range(0, total, CHUNK):
                index = np.unravel_index(np.arange(begin, min(begin + CHUNK, total)), shape)
                places = zip(firsts, index[::-1], strict=True)
                yield np.stack([first[k] for first, k in places], axis=-1) + 0.5 * side

        return chunks(), np.full(self.dimensions, 0.5 * side)

    def samples(self, count: int = SAMPLES) -> FloatArray:
        """See :class:`Cells`; at nodes, where second derivatives of a spline are extreme."""
        if self.dimensions == 1:
            count = min(count, 4 * int(self._counts[0]))
        return np.asarray(np.round(spread(count, self.dimensions) * self._counts))

    def models(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, Number]:
        """See :class:`Cells`."""
        side = max(1, round(2.0 * float(half.max())))
        first = centres if side == 1 else centres - half
        cell = np.minimum(np.floor(first).astype(np.int64), self._counts - side)
        patch = self._patches(cell, side + 3)
        matrices = _AxisMatrices(centres - half - cell, 2.0 * half)
        slack = 256.0 * EPS * np.abs(patch).max(axis=(0, 1))
        per_x, per_y = (*self._per, 1.0)[:2]
        result: dict[str, Number] = {}
        for name in names:
            nx, ny = ORDERS[name]
            if ny and self.dimensions == 1:
                result[name] = 0.0
                continue
            scale = float(per_x**nx * per_y**ny)
            part = np.diff(np.diff(patch, nx, axis=1), ny, axis=0)
            if side > 1:
                result[name] = _fit_block(part, side, scale, slack)
            else:
                result[name] = _fit(matrices.bernstein(part), scale, slack)
        return result

    def _patches(self, cell: NDArray[np.int64], width: int) -> FloatArray:
        """Return the coefficients from a cell on, (width, width, n), (1, width, n) of a profile."""
        step = np.arange(width)
        columns = (cell[:, 0] + step[:, None])[None]
        if self.dimensions == 1:
            return np.asarray(self._c[columns])
        return np.asarray(self._c[(cell[:, 1] + step[:, None])[:, None], columns])

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._evaluate(self.plane(coordinates))

    def plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        points = self._origin + coordinates / self._per
        return np.ascontiguousarray(np.pad(points, ((0, 0), (0, 2 - self.dimensions))))

    def coordinates(self, xy: FloatArray) -> FloatArray:
        """Return the coordinates (n, d) of points of the plane."""
        return np.asarray((xy[:, : self.dimensions] - self._origin) * self._per)

    def inside(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.clip(coordinates, 0.0, self._counts)


class _AxisMatrices:
    """Matrices from B-spline coefficients to Bernstein coefficients on a part of each cell."""

    def __init__(self, left: FloatArray, width: FloatArray) -> None:
        whole = bool((width >= 1.0).all())
        # On whole cells one matrix serves all, and equal parts of cells share theirs.
        lefts = np.zeros((1, left.shape[1])) if whole else left
        self._parts = [np.unique(column, return_inverse=True) for column in lefts.T]
        self._width = width
        self._known: dict[tuple[int, int], FloatArray] = {}

    def _matrix(self, axis: int, degree: int) -> FloatArray:
        key = (axis, degree)
        if key not in self._known:
            left, index = self._parts[axis]
            split = _subdivision(degree, left, left + self._width[axis]) @ _TO_BERNSTEIN[degree]
            self._known[key] = np.take(
                np.ascontiguousarray(split.transpose(1, 2, 0)), index, axis=2
            )
        return self._known[key]

    def bernstein(self, part: FloatArray) -> FloatArray:
        """Return the tensor Bernstein coefficients of patches (q, p, n); of lines with q = 1."""
        rows, columns, _ = part.shape
        along = _product(part, self._matrix(0, columns - 1).transpose(1, 0, 2))
        return along if rows == 1 else _product(self._matrix(1, rows - 1), along)


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the products of matrices (p, q, n) and (q, r, n)."""
    return np.asarray(np.einsum("pqn,qrn->prn", a, b))


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
    rows, columns, _ = bernstein.shape
    left, right = bernstein[:, 0], bernstein[:, -1]
    gx = 0.25 * (right[0] + right[-1] - left[0] - left[-1])
    slopes = [gx]
    rest = bernstein - gx * np.linspace(-1.0, 1.0, columns)[:, None]
    if rows > 1:
        gy = 0.25 * (left[-1] + right[-1] - left[0] - right[0])
        slopes.append(gy)
        rest -= gy * np.linspace(-1.0, 1.0, rows)[:, None, None]
    low, high = rest.min(axis=(0, 1)), rest.max(axis=(0, 1))
    c = 0.5 * (low + high)
    # The conversion multiplies and adds at most 16 coefficients, each weight at most one.
    e = 0.5 * (high - low) * (1.0 + 8.0 * EPS) + slack
    return Taylor(scale * c, scale * np.stack(slopes), scale * e * (1.0 + 8.0 * EPS))


def _fit_block(part: FloatArray, side: int, scale: float, slack: FloatArray) -> Taylor:
    """Return a linear function on blocks of cells, and the hull of what it leaves out.

    The B-spline coefficients of a linear function are its values at the Greville points; those of
    the rest enclose it.

    Args:
        part: coefficients, shape (side + degree along y, side + degree along x, n).
        side: cells along the side of a block.
        scale: factor of the derivative.
        slack: error of the coefficients by rounding.
    """
    y, x = ((2.0 * np.arange(count) - (count - side - 1) - side) / side for count in part.shape[:2])
    gx = x @ part.mean(axis=0) / (x @ x)
    gy = y @ part.mean(axis=1) / (y @ y)
    rest = part - gx * x[:, None]
    rest -= gy * y[:, None, None]
    low, high = rest.min(axis=(0, 1)), rest.max(axis=(0, 1))
    c, e = 0.5 * (low + high), 0.5 * (high - low) * (1.0 + 8.0 * EPS) + slack
    return Taylor(scale * c, scale * np.stack([gx, gy]), scale * e * (1.0 + 8.0 * EPS))
