"""The grid of a baked field: its nodes, its borders, and its coefficients by columns."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.textures.domain import Domain
from asperity.textures.fields.field_sampler import MIRRORED, PERIODIC, ZERO, FieldArguments

# Weight of both neighbours of a node along an axis in a smoothing pass.
NEIGHBOUR_WEIGHT = 0.125
_MIN_STEPS = 4

SingleArray = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class FieldGrid:
    """The nodes of a baked field.

    Attributes:
        steps: from node to node along each axis of the texture [m], shape (d, 2).
        cells: number of steps along each of them.
        start: the first node [m], shape (2,).
        levels: number of levels of nodes along z, at least two of them above the highest point.
        level_spacing: distance of the levels [m].
        floor: z halfway between the two lowest levels [m], the bottom of the spline's cells.
        border: what the field is beyond its first and last node.
    """

    steps: FloatArray
    cells: tuple[int, ...]
    start: FloatArray
    levels: int
    level_spacing: float
    floor: float
    border: int

    @staticmethod
    def fit(
        domain: Domain,
        heights: tuple[float, float],
        max_depth: float,
        resolution: float,
        margin: int = 0,
    ) -> FieldGrid:
        """Return the coarsest grid whose nodes are at most the resolution apart.

        Args:
            domain: the domain of the texture.
            heights: its least and greatest height [m].
            max_depth: depth below the least height down to which the field extends [m].
            resolution: [m].
            margin: levels above the two that are above the highest point; smoothing needs one a
                pass.
        """
        lengths = np.hypot(*domain.spans.T)
        cells = [max(math.ceil(length / resolution), _MIN_STEPS) for length in lengths]
        floor = heights[0] - max_depth
        inside = max(math.ceil((heights[1] - floor) / resolution), _MIN_STEPS)
        return FieldGrid(
            steps=domain.spans / np.array(cells)[:, None],
            cells=tuple(cells),
            start=domain.origin,
            levels=inside + 3 + margin,
            level_spacing=(heights[1] - floor) / inside,
            floor=floor,
            border=PERIODIC if domain.periodic else MIRRORED,
        )

    @staticmethod
    def around(lower: FloatArray, upper: FloatArray, spacing: float) -> FieldGrid:
        """Return the grid of a closed body: its box and at least two nodes of margin around it.

        Args:
            lower: corner of the box of least coordinates [m], shape (3,).
            upper: the opposite corner [m].
            spacing: of the nodes along all axes [m].
        """
        counts = np.ceil((upper - lower) / spacing).astype(int) + 4
        origin = 0.5 * (lower + upper - counts * spacing)
        return FieldGrid(
            steps=spacing * np.eye(2),
            cells=(int(counts[0]), int(counts[1])),
            start=origin[:2],
            levels=int(counts[2]) + 1,
            level_spacing=spacing,
            floor=float(origin[2] + 0.5 * spacing),
            border=ZERO,
        )

    @property
    def node_counts(self) -> tuple[int, ...]:
        """Number of distinct nodes along each axis of the plane, and of levels."""
        extra = 0 if self.border == PERIODIC else 1
        return (*(count + extra for count in self.cells), self.levels)

    @property
    def spacing(self) -> tuple[float, ...]:
        """Distance of the nodes along each axis [m], z last."""
        return (*(float(length) for length in np.hypot(*self.steps.T)), self.level_spacing)

    def height(self, level: Any) -> Any:
        """Return z of a level [m]."""
        return self.floor + (level - 0.5) * self.level_spacing

    def positions(self, index: NDArray[np.intp] | FloatArray) -> FloatArray:
        """Return x and y [m], (n, 2), of nodes of the plane (n, d)."""
        return np.asarray(self.start + index @ self.steps)

    def extend_down(self, count: int) -> FieldGrid:
        """Return the grid with further levels below the lowest."""
        floor = self.floor - count * self.level_spacing
        return replace(self, levels=self.levels + count, floor=floor)

    def stored_nodes(self, axis: int) -> NDArray[np.intp]:
        """Return the node stored at each place along an axis, beyond the borders too; -1: none."""
        count, last = self.cells[axis], self.node_counts[axis] - 1
        index = np.arange(-1, count + 2)
        if self.border == PERIODIC:
            return np.asarray(index % count, dtype=np.intp)
        if self.border == MIRRORED:
            return np.asarray(count - np.abs(count - np.abs(index)), dtype=np.intp)
        return np.where((index < 0) | (index > last), -1, index)

    def spread(self, passes: int) -> float:
        """Return the variance [m²] of the points of which T is the mean of U.

        A quadratic B-spline has the variance 1/4 of a squared step along each axis, and a smoothing
        pass adds 1/4.
        """
        return (0.25 + 2.0 * NEIGHBOUR_WEIGHT * passes) * float(np.square(self.spacing).sum())

    def error_bounds(
        self, gain: float, passes: int = 0, largest: float = 0.0
    ) -> tuple[float, float]:
        """Return proved bounds of |∇T - ∇U| [m] and of |T - U| [m²].

        A derivative of T along a step is the mean of that derivative of U over points around the
        probe, its potential the mean of U over other points. Both have the probe as their mean;
        :meth:`spread` is the variance of the latter, and in the former the variance along the step
        itself is at most 1/12 of its square greater (a linear B-spline, at most 1/4, and the
        step's own 1/12, for 1/4). Single precision rounds a potential at most twice, and less than
        5 times in a smoothing pass; a slope takes at most twice that over a step.

        Args:
            gain: Lipschitz constant of ∇U [1].
            passes: number of smoothing passes.
            largest: greatest potential that is stored in single precision [m²].
        """
        rounding = (2.0 + 5.0 * passes) * largest * 0.5 * float(np.finfo(np.float32).eps)
        square, spread = np.square(self.spacing), self.spread(passes)
        components = gain * np.sqrt(spread + square / 12.0) + 2.0 * rounding / np.sqrt(square)
        rates = np.linalg.pinv(self.steps).T * np.hypot(*self.steps.T)[:, None]
        # Derivatives along non-orthogonal steps amplify an error of the gradient.
        skew = max(1.0, float(np.linalg.norm(rates, 2)))
        return skew * float(np.linalg.norm(components)), 0.5 * gain * float(spread) + rounding

    def arguments(self, potentials: SingleArray) -> FieldArguments:
        """Return the record of a field from its potentials at the nodes.

        Args:
            potentials: [m²], shape ``node_counts``: first axis, second axis, z.
        """
        rows = np.swapaxes(potentials if len(self.cells) == 2 else potentials[:, None], 0, 1)
        # One row after the other, since masks of a large field would take more memory than it does.
        first, end = np.stack([_column_limits(row) for row in rows], axis=1)
        starts = (np.cumsum(end - first) - (end - first).ravel()).reshape(first.shape)
        values = np.empty(int((end - first).sum()), np.float32)
        level = np.arange(self.levels)
        for row, low, high, start in zip(rows, first, end, starts[:, 0], strict=True):
            part = row[(level >= low[:, None]) & (level < high[:, None])]
            values[start : start + len(part)] = part
        table = np.stack([starts - first, first, end, end], axis=-1).astype(np.int32)
        table = self._with_borders(table)
        x0, y0 = (float(value) for value in self.start)
        rates = np.zeros((2, 2))
        # Rows of the pseudo-inverse's transpose: nodes per metre along each axis.
        rates[: len(self.cells)] = np.linalg.pinv(self.steps).T
        (m00, m01), (m10, m11) = rates.tolist()
        return FieldArguments(
            values, table, x0, y0, float(self.height(0)),
            m00, m01, m10, m11, 1.0 / self.level_spacing, self.levels, self.border,
        )  # fmt: skip

    def _with_borders(self, table: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the columns (rows, columns, 4) with those beyond the borders, and their reach."""
        axes = [self.stored_nodes(axis) for axis in range(len(self.cells))]
        for axis, nodes in zip((1, 0), axes, strict=False):
            table = np.take(table, nodes, axis=axis)
            outside = np.expand_dims(nodes < 0, 0 if axis == 1 else 1)
            table[np.broadcast_to(outside, table.shape[:2])] = 0
        reach = table[..., 2]
        for axis in range(2):
            width = [(1, 1) if k == axis else (0, 0) for k in range(2)]
            wide = np.pad(reach, width)
            parts = [np.take(wide, np.arange(k, k + reach.shape[axis]), axis) for k in range(3)]
            reach = np.maximum.reduce(parts)
        table[..., 3] = reach
        return np.ascontiguousarray(table)


def _column_limits(row: SingleArray) -> NDArray[np.intp]:
    """Return the first level of each column that is not zero, and the one after the last."""
    inside = row > 0.0
    end = inside.shape[-1] - inside[:, ::-1].argmax(axis=-1)
    return np.where(inside.any(axis=-1), [inside.argmax(axis=-1), end], 0)
