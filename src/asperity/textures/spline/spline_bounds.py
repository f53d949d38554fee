"""Certified extremes of a spline surface, and its cells with enclosures of height derivatives.

On a cell every derivative is a polynomial, enclosed by its Bernstein coefficients. On blocks of
several cells of a map it is enclosed by its B-spline coefficients.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.enclosures import cells
from asperity.enclosures.taylor import TaylorModel, TaylorNumber
from asperity.textures.domain import LineSegments, ScanLine

# From uniform B-spline to Bernstein coefficients on one cell, by degree.
_TO_BERNSTEIN = {
    1: np.eye(2),
    2: np.array([[1, 1, 0], [0, 2, 0], [0, 1, 1]]) / 2.0,
    3: np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0,
}
# De Casteljau's algorithm at the middle: the left and the right half.
_LEFT = np.array([[8, 0, 0, 0], [4, 4, 0, 0], [2, 4, 2, 0], [1, 3, 3, 1]]) / 8.0
_RIGHT = _LEFT[::-1, ::-1]
_ROWS_PER_CHUNK = 256
# If so many cells are equally high (along a groove), the hull of the rest is the result.
_MAX_CELLS = 60_000


def max_height(coefficients: FloatArray) -> float:
    """Return the greatest value of a bicubic B-spline over all its cells.

    A polynomial lies in the hull of its Bernstein coefficients and attains those at the corners:
    the hull gives an upper bound of each cell, the corners a lower bound of the maximum. Cells that
    may exceed it are divided into quarters until both bounds agree to rounding.

    Args:
        coefficients: B-spline coefficients [m], shape (ny + 3, nx + 3) for ny × nx cells.
    """
    best = _max_node_height(coefficients)
    open_patches: list[FloatArray] = []
    for first in range(0, coefficients.shape[0] - 3, _ROWS_PER_CHUNK):
        rows = coefficients[first : first + _ROWS_PER_CHUNK + 3]
        # The hull of the 16 coefficients of a cell, cheaper than its Bernstein coefficients.
        hull = np.max([rows[i : rows.shape[0] - 3 + i] for i in range(4)], axis=0)
        hull = np.max([hull[:, j : hull.shape[1] - 3 + j] for j in range(4)], axis=0)
        windows = np.lib.stride_tricks.sliding_window_view(rows, (4, 4))[hull > best]
        patches = _TO_BERNSTEIN[3] @ windows @ _TO_BERNSTEIN[3].T
        open_patches.append(patches[patches.max(axis=(1, 2), initial=-np.inf) > best])
    patches = np.concatenate(open_patches)
    scale = max(float(np.abs(coefficients).max()), 1e-300)
    for _ in range(60):
        patches = patches[patches.max(axis=(1, 2)) > best + 1e-15 * scale]
        if len(patches) == 0 or len(patches) > _MAX_CELLS:
            break
        patches = np.concatenate(
            [rows @ patches @ columns.T for rows in (_LEFT, _RIGHT) for columns in (_LEFT, _RIGHT)]
        )
        best = max(best, float(patches[:, ::3, ::3].max()))
    return max(best, float(patches.max(initial=-np.inf)))


def _max_node_height(coefficients: FloatArray) -> float:
    """Return the greatest height at a node, where the spline is (1 4 1)/6 of coefficients."""
    best = -np.inf
    for first in range(0, coefficients.shape[0] - 2, _ROWS_PER_CHUNK):
        c = coefficients[first : first + _ROWS_PER_CHUNK + 2]
        rows = (c[:-2] + 4.0 * c[1:-1] + c[2:]) / 6.0
        best = max(best, float(((rows[:, :-2] + 4.0 * rows[:, 1:-1] + rows[:, 2:]) / 6.0).max()))
    return best


# Cells along the side of the initial blocks of a map: a power of two.
_BLOCK = 4
_GAPS = {1: (1e-6, 1e-9), 2: (1e-3, 1e-6)}


class SplineCells(cells.Cells):
    """The cells of a spline, in units of its pitch; initially blocks of cells for a map.

    Args:
        coefficients: B-spline coefficients [m], along each axis one before the first cell and two
            after the last; shape (n + 3,) for a profile along x.
        pitch: spacing of the nodes [m], (p_x, p_y) or (p_x,).
        origin: the first node [m], shape (2,) or (1,).
        derivatives: function returning h, h_x, h_y, h_xx, h_xy, h_yy, (n, 6), at points (n, 2)
            [m].
    """

    def __init__(
        self,
        coefficients: FloatArray,
        pitch: tuple[float, ...],
        origin: FloatArray,
        derivatives: Callable[[FloatArray], FloatArray],
    ) -> None:
        self._coefficients = coefficients
        self._origin = origin
        self._nodes_per_metre = 1.0 / np.array(pitch)
        self._counts = np.array(coefficients.shape[::-1]) - 3
        self._evaluate = derivatives
        self.dimensions = len(pitch)
        self.default_gap, self.refined_gap = _GAPS[self.dimensions]

    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        side = _BLOCK if self.dimensions > 1 else 1
        while side > self._counts.min():
            side //= 2
        # The last blocks overlap others if the number of cells is no multiple of the side.
        firsts = [np.append(np.arange(0, n - side, side), n - side) for n in self._counts]
        shape = [len(first) for first in firsts[::-1]]

        def chunks() -> Iterator[FloatArray]:
            for index in cells.grid_index_chunks(shape):
                places = zip(firsts, index.T[::-1], strict=True)
                yield np.stack([starts[k] for starts, k in places], axis=-1) + 0.5 * side

        return chunks(), np.full(self.dimensions, 0.5 * side)

    def sample_coordinates(self, count: int = cells.SAMPLE_COUNT) -> FloatArray:
        """See :class:`Cells`; at nodes, where second derivatives of a spline are extreme."""
        if self.dimensions == 1:
            count = min(count, 4 * int(self._counts[0]))
        fractions = cells.low_discrepancy_points(count, self.dimensions)
        return np.asarray(np.round(fractions * self._counts))

    def enclosures(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, TaylorNumber]:
        """See :class:`Cells`."""
        side = max(1, round(2.0 * float(half.max())))
        first = centres if side == 1 else centres - half
        cell = np.minimum(np.floor(first).astype(np.int64), self._counts - side)
        patch = self._patches(cell, side + 3)
        matrices = _AxisMatrices(centres - half - cell, 2.0 * half)
        slack = 256.0 * cells.EPS * np.abs(patch).max(axis=(0, 1))
        per_x, per_y = (*self._nodes_per_metre, 1.0)[:2]
        result: dict[str, TaylorNumber] = {}
        for name in names:
            nx, ny = cells.DERIVATIVE_ORDERS[name]
            if ny and self.dimensions == 1:
                result[name] = 0.0
                continue
            scale = float(per_x**nx * per_y**ny)
            part = np.diff(np.diff(patch, nx, axis=1), ny, axis=0)
            if side > 1:
                result[name] = _fit_block(part, side, scale, slack)
            else:
                result[name] = _fit_linear(matrices.bernstein(part), scale, slack)
        return result

    def _patches(self, cell: NDArray[np.int64], width: int) -> FloatArray:
        """Return the coefficients from a cell on, (width, width, n); (1, width, n) for profiles."""
        step = np.arange(width)
        columns = (cell[:, 0] + step[:, None])[None]
        if self.dimensions == 1:
            return np.asarray(self._coefficients[columns])
        return np.asarray(self._coefficients[(cell[:, 1] + step[:, None])[:, None], columns])

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._evaluate(self.to_plane(coordinates))

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        points = self._origin + coordinates / self._nodes_per_metre
        return np.ascontiguousarray(np.pad(points, ((0, 0), (0, 2 - self.dimensions))))

    def coordinates(self, xy: FloatArray) -> FloatArray:
        """Return the coordinates (n, d) of points of the plane."""
        return np.asarray((xy[:, : self.dimensions] - self._origin) * self._nodes_per_metre)

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return np.clip(coordinates, 0.0, self._counts)


class _AxisMatrices:
    """Matrices from B-spline to Bernstein coefficients on a part of each cell."""

    def __init__(self, left: FloatArray, width: FloatArray) -> None:
        whole = bool((width >= 1.0).all())
        # All whole cells share one matrix, and equal parts of cells share theirs.
        lefts = np.zeros((1, left.shape[1])) if whole else left
        self._parts = [np.unique(column, return_inverse=True) for column in lefts.T]
        self._width = width
        self._matrices: dict[tuple[int, int], FloatArray] = {}

    def _matrix(self, axis: int, degree: int) -> FloatArray:
        key = (axis, degree)
        if key not in self._matrices:
            left, index = self._parts[axis]
            split = _subdivision(degree, left, left + self._width[axis]) @ _TO_BERNSTEIN[degree]
            self._matrices[key] = np.take(
                np.ascontiguousarray(split.transpose(1, 2, 0)), index, axis=2
            )
        return self._matrices[key]

    def bernstein(self, part: FloatArray) -> FloatArray:
        """Return the tensor Bernstein coefficients of patches (q, p, n), lines having q = 1."""
        rows, columns, _ = part.shape
        along = _matrix_products(part, self._matrix(0, columns - 1).transpose(1, 0, 2))
        return along if rows == 1 else _matrix_products(self._matrix(1, rows - 1), along)


def _matrix_products(a: FloatArray, b: FloatArray) -> FloatArray:
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


def _fit_linear(bernstein: FloatArray, scale: float, slack: FloatArray) -> TaylorModel:
    """Return the linear function through the corners, and the hull of the remainder."""
    rows, columns, _ = bernstein.shape
    left = bernstein[:, 0]
    right = bernstein[:, -1]
    gx = 0.25 * (right[0] + right[-1] - left[0] - left[-1])
    slopes = [gx]
    rest = bernstein - gx * np.linspace(-1.0, 1.0, columns)[:, None]
    if rows > 1:
        gy = 0.25 * (left[-1] + right[-1] - left[0] - right[0])
        slopes.append(gy)
        rest -= gy * np.linspace(-1.0, 1.0, rows)[:, None, None]
    # The conversion sums at most 16 coefficients with weights of at most one.
    return _enclose_remainder(slopes, rest, scale, slack)


def _fit_block(part: FloatArray, side: int, scale: float, slack: FloatArray) -> TaylorModel:
    """Return a linear function on blocks of cells, and the hull of the remainder.

    The B-spline coefficients of a linear function are its values at the Greville points; those of
    the remainder enclose it.

    Args:
        part: coefficients, shape (side + degree along y, side + degree along x, n).
        side: cells along the side of a block.
        scale: factor of the derivative.
        slack: rounding error of the coefficients.
    """
    rows, columns, _ = part.shape
    x = (2.0 * np.arange(columns) - (columns - side - 1) - side) / side
    y = (2.0 * np.arange(rows) - (rows - side - 1) - side) / side
    gx = x @ part.mean(axis=0) / (x @ x)
    gy = y @ part.mean(axis=1) / (y @ y)
    rest = part - gx * x[:, None]
    rest -= gy * y[:, None, None]
    return _enclose_remainder([gx, gy], rest, scale, slack)


def _enclose_remainder(
    slopes: list[FloatArray], rest: FloatArray, scale: float, slack: FloatArray
) -> TaylorModel:
    """Return ``scale`` times a linear function plus the hull of the remainder's coefficients."""
    low = rest.min(axis=(0, 1))
    high = rest.max(axis=(0, 1))
    c = 0.5 * (low + high)
    e = 0.5 * (high - low) * (1.0 + 8.0 * cells.EPS) + slack
    return TaylorModel(scale * c, scale * np.stack(slopes), scale * e * (1.0 + 8.0 * cells.EPS))


_AXIS_TOLERANCE = 1e-12


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
