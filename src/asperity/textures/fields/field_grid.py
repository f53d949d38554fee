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
# Steps over which the share of a smoothing pass rises from 0 to 1.
RAMP = 5
# Below the surface the depth is computed at every so many levels and interpolated, with a share
# that rises from 0 to 1 over so many levels.
COARSE_STEP = 2
BLENDED = 5
_MIN_STEPS = 4
_MIN_BELOW = 2
# Height above the surface at which coefficients end, in nodes: a cell with contact has no node
# farther outside. The last part of it only adds levels of no effect.
_MARGIN = 2.75
_CUT = 0.05

SingleArray = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class FieldGrid:
    """The nodes of a baked field.

    Attributes:
        steps: from node to node along each axis of the texture [m], shape (d, 2).
        cells: number of steps along each of them.
        start: the first node [m], shape (2,).
        levels: number of levels of nodes along z, up to the margin above the highest point.
        level_spacing: distance of the levels [m].
        floor: z down to which the field is that of the spline [m].
        below: number of cells below the floor, at least 1; the lowest ends halfway between the two
            lowest levels.
        border: what the field is beyond its first and last node.
        deep: number of levels below the surface, whose depth is interpolated along z.
    """

    steps: FloatArray
    cells: tuple[int, ...]
    start: FloatArray
    levels: int
    level_spacing: float
    floor: float
    below: int
    border: int
    deep: int = 0

    @staticmethod
    def fit(
        domain: Domain,
        heights: tuple[float, float],
        max_depth: float,
        fade: float,
        resolution: float,
    ) -> FieldGrid:
        """Return the coarsest grid whose nodes are at most the resolution apart.

        Args:
            domain: the domain of the texture.
            heights: its least and greatest height [m].
            max_depth: depth of the floor below the least height [m].
            fade: least height of the cells below the floor [m].
            resolution: [m].
        """
        lengths = np.hypot(*domain.spans.T)
        cells = [max(math.ceil(length / resolution), _MIN_STEPS) for length in lengths]
        floor = heights[0] - max_depth
        inside = max(math.ceil((heights[1] - floor) / resolution), _MIN_STEPS)
        spacing = (heights[1] - floor) / inside
        below = max(math.ceil(fade / spacing), _MIN_BELOW)
        grid = FieldGrid(
            steps=domain.spans / np.array(cells)[:, None],
            cells=tuple(cells),
            start=domain.origin,
            levels=inside + below + 2,
            level_spacing=spacing,
            floor=floor,
            below=below,
            border=PERIODIC if domain.periodic else MIRRORED,
            deep=below + int(max_depth / spacing),
        )
        return replace(grid, levels=grid.levels + math.ceil(grid.margin / grid.level_spacing))

    @staticmethod
    def around(lower: FloatArray, upper: FloatArray, spacing: float) -> FieldGrid:
        """Return the grid of a closed body: its box and at least three nodes around it.

        Args:
            lower: corner of the box of least coordinates [m], shape (3,).
            upper: the opposite corner [m].
            spacing: of the nodes along all axes [m].
        """
        counts = np.ceil((upper - lower) / spacing).astype(int) + 6
        origin = 0.5 * (lower + upper - counts * spacing)
        return FieldGrid(
            steps=spacing * np.eye(2),
            cells=(int(counts[0]), int(counts[1])),
            start=origin[:2],
            levels=int(counts[2]) + 1,
            level_spacing=spacing,
            floor=float(origin[2] + 1.5 * spacing),
            below=1,
            border=ZERO,
        )

    @property
    def node_counts(self) -> tuple[int, ...]:
        """Number of distinct nodes along each axis of the plane, and of levels."""
        extra = int(self.border != PERIODIC)
        return (*(count + extra for count in self.cells), self.levels)

    @property
    def spacing(self) -> tuple[float, ...]:
        """Distance of the nodes along each axis [m], z last."""
        return (*(float(length) for length in np.hypot(*self.steps.T)), self.level_spacing)

    @property
    def margin(self) -> float:
        """Distance outside of the surface at which coefficients end [m]."""
        return _MARGIN * max(self.spacing)

    def height(self, level: Any) -> Any:
        """Return z of a level [m]."""
        return self.floor + (level - self.below - 0.5) * self.level_spacing

    def level_weights(self) -> tuple[NDArray[np.intp], FloatArray]:
        """Return the levels of which depths are computed, and their weights at all levels.

        Deep levels are interpolated by a quadratic B-spline, whose coefficients are computed.

        Returns:
            The numbers of the levels, rising, shape (n,), and the weights (n, levels).
        """
        from scipy.interpolate import BSpline

        if not self.deep:
            return np.arange(self.levels), np.eye(self.levels)
        deep = np.arange(self.deep)
        exact = np.arange(max(self.deep - BLENDED + 1, 0), self.levels)
        coarse = np.arange(-COARSE_STEP, self.deep + COARSE_STEP + 1, COARSE_STEP)
        computed = np.union1d(coarse, exact)
        weights = np.zeros((len(computed), self.levels))
        weights[np.searchsorted(computed, exact), exact] = 1.0
        rise = np.minimum((self.deep - deep) / BLENDED, 1.0)
        share = rise**3 * (10.0 - 15.0 * rise + 6.0 * rise**2)
        knots = COARSE_STEP * (np.arange(len(coarse) + 3) - 2.5)
        weights[:, : self.deep] *= 1.0 - share
        spline = BSpline.design_matrix(deep, knots, 2).toarray()
        weights[np.searchsorted(computed, coarse), : self.deep] += share * spline.T
        return computed, weights

    def positions(self, index: NDArray[np.intp] | FloatArray) -> FloatArray:
        """Return x and y [m], (n, 2), of nodes of the plane (n, d)."""
        return np.asarray(self.start + index @ self.steps)

    def stored_nodes(self, axis: int) -> NDArray[np.intp]:
        """Return the node stored at each place along an axis, beyond the borders too; -1: none."""
        count = self.cells[axis]
        last = self.node_counts[axis] - 1
        index = np.arange(-1, count + 2)
        if self.border == PERIODIC:
            return np.asarray(index % count, dtype=np.intp)
        if self.border == MIRRORED:
            return np.asarray(count - np.abs(count - np.abs(index)), dtype=np.intp)
        return np.where((index < 0) | (index > last), -1, index)

    def spread(self, passes: int) -> float:
        """Return the greatest variance [m²] of the points of which S is the mean of the depth.

        A quadratic B-spline has the variance 1/4 of a squared step along each axis, and a smoothing
        pass adds at most 1/4; the spline by which depths are interpolated has that of its steps.
        """
        variance = 0.25 + 2.0 * NEIGHBOUR_WEIGHT * passes
        variance *= float(np.square(self.spacing).sum())
        if self.deep:
            variance += 0.25 * (COARSE_STEP * self.level_spacing) ** 2
        return variance

    def onset_bound(self, passes: int) -> float:
        """Return a proved bound of the distance [m] above the surface at which contact begins.

        S is the mean of the depth, cut at -margin, over points whose distances from the probe have
        the root mean square σ. It is not positive where the probe is more than σ outside: where σ
        is less than twice the margin, as after ten passes, the cut does not change that. A field
        that was loaded does not say which levels are interpolated, so some are assumed to be.
        """
        return math.sqrt(replace(self, deep=max(self.deep, 1)).spread(passes))

    def error_bounds(
        self, gain: float, passes: int = 0, largest: float = 0.0
    ) -> tuple[float, float]:
        """Return proved bounds of |∇T - ∇U| [m] and of |T - U| [m²].

        S is the mean of the exact depth D, which is 1-Lipschitz, over points around the probe p
        with p as their mean; :meth:`spread` is their variance σ². Its derivative along a step h is
        the difference of two such means over h, at ±h/2, with mean squares τ² = σ² + h²/4 of the
        distances from p. For every point x, D(p) (D(x) - D(p)) is ∇U(p) · (x - p) up to
        (L + 1) |x - p|²/2, so D(p) times the derivative is that of U up to (L + 1) τ²/h; and S
        differs from D(p) by at most σ. The derivative of S is at most 1, and a smoothing pass may
        add to it, since its weights differ between nodes. So does the share of an interpolated
        depth along z, by at most 1.875/n between levels; that depth differs by at most a quarter of
        a coarse step, since the depth falls along z. T is at most the mean of U; it is less by
        at most the variance of S where all points are inside, and by σ times the depth otherwise.
        Single precision rounds a coefficient at most three times, and less than 5 times in a pass.

        Args:
            gain: Lipschitz constant L of ∇U [1].
            passes: number of smoothing passes.
            largest: greatest coefficient that is stored in single precision [m].
        """
        rounding = (3.0 + 5.0 * passes) * largest * 0.5 * float(np.finfo(np.float32).eps)
        steps = np.array(self.spacing)
        spread = self.spread(passes)
        square = np.square(steps)
        change = NEIGHBOUR_WEIGHT * (1.0 / RAMP + 3.0 / 255.0)  # of the weight, and its rounding
        growth = 1.0 + 2.0 * change * steps.max() / steps.min()
        slope = growth ** (passes * (len(steps) - 1))
        if self.deep:
            slope *= 1.0 + 1.875 / BLENDED * 0.25 * COARSE_STEP
        components = (gain + 1.0) * (spread + 0.25 * square) / steps + slope * math.sqrt(spread)
        components += rounding * (slope + 2.0 * largest / steps)
        rates = np.linalg.pinv(self.steps).T * np.hypot(*self.steps.T)[:, None]
        # Derivatives along non-orthogonal steps amplify an error of the gradient.
        skew = max(1.0, float(np.linalg.norm(rates, 2)))
        width = 1.5 * (1 + COARSE_STEP * bool(self.deep))
        reach = (width + passes) * math.sqrt(float(square.sum()))
        potential = max(0.5 * (gain + 1.0) * spread, reach * math.sqrt(spread))
        return skew * float(np.linalg.norm(components)), potential + largest * rounding

    def arguments(self, depths: SingleArray, lift: float = 0.0) -> FieldArguments:
        """Return the record of a field from its depths at the nodes.

        Args:
            depths: [m], shape ``node_counts``: first axis, second axis, z.
            lift: vertical force over the stiffness below the floor, less the depth there, at least
                about [m].
        """
        rows = np.swapaxes(depths if len(self.cells) == 2 else depths[:, None], 0, 1)
        # One row after the other, since masks of a large field would take more memory than it does.
        cut = (_CUT - 1.0) * self.margin
        first, end = np.stack([_column_limits(row, cut) for row in rows], axis=1)
        reach = np.stack([_column_limits(row, 0.0)[1] for row in rows])
        starts = (np.cumsum(end - first) - (end - first).ravel()).reshape(first.shape)
        values = np.empty(int((end - first).sum()), np.float32)
        level = np.arange(self.levels)
        for row, low, high, start in zip(rows, first, end, starts[:, 0], strict=True):
            part = row[(level >= low[:, None]) & (level < high[:, None])]
            values[start : start + len(part)] = np.maximum(part + self.margin, 0.0)
        table = np.stack([starts - first, first, end, reach], axis=-1).astype(np.int32)
        table = self._with_borders(table)
        counts = {"levels": self.levels, "below": self.below, "border": self.border}
        return FieldArguments(values, table, **self.scales(), lift=lift, **counts)

    def scales(self) -> dict[str, Any]:
        """Return the numbers of the record that follow from the nodes."""
        x0, y0 = self.start.tolist()
        rates = np.zeros((2, 2))
        # Rows of the pseudo-inverse's transpose: nodes per metre along each axis.
        rates[: len(self.cells)] = np.linalg.pinv(self.steps).T
        (m00, m01), (m10, m11) = rates.tolist()
        scales = {"x0": x0, "y0": y0, "z0": float(self.height(0))}
        scales |= {"m00": m00, "m01": m01, "m10": m10, "m11": m11}
        return scales | {"iz": 1.0 / self.level_spacing, "margin": self.margin}

    def _with_borders(self, table: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the columns (rows, columns, 4) with those beyond the borders, and their reach."""
        from scipy.ndimage import maximum_filter

        axes = [self.stored_nodes(axis) for axis in range(len(self.cells))]
        for axis, nodes in zip((1, 0), axes, strict=False):
            table = np.take(table, nodes, axis=axis)
            outside = np.expand_dims(nodes < 0, 0 if axis == 1 else 1)
            table[np.broadcast_to(outside, table.shape[:2])] = 0
        table[..., 3] = maximum_filter(table[..., 3], 3, mode="constant")
        return np.ascontiguousarray(table)


def _column_limits(row: SingleArray, least: float) -> NDArray[np.intp]:
    """Return the first level of each column that exceeds a depth, and the one after the last."""
    inside = row > least
    end = inside.shape[-1] - inside[:, ::-1].argmax(axis=-1)
    return np.where(inside.any(axis=-1), [inside.argmax(axis=-1), end], 0)
