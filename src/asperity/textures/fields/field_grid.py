"""The grid of a baked field: its nodes, its borders, and its coefficients by columns."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.textures.domain import Domain
from asperity.textures.fields.field_bricks import BrickPacker
from asperity.textures.fields.field_record import MIRRORED, PERIODIC, ZERO, FieldArguments

# Weight of both neighbours of a node along an axis in a smoothing pass.
NEIGHBOUR_WEIGHT = 0.125
# Steps over which the share of a smoothing pass rises from 0 to 1.
RAMP = 5
_MIN_STEPS = 4
# Equal cells per stretched one below the lowest place of a surface, at least.
_LEAST_SPARING = 1.5
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
        level_spacing: distance of the levels of equal cells [m].
        floor: z down to which the field is that of the spline [m].
        below: number of cells below the floor, at least 1; the lowest ends halfway between the two
            lowest levels.
        border: what the field is beyond its first and last node.
        knots: ends of the lowest cells along z, which are not equally high, rising [m]; a cell is
            named by the level in its middle, and the highest one is as high as those above.
    """

    steps: FloatArray
    cells: tuple[int, ...]
    start: FloatArray
    levels: int
    level_spacing: float
    floor: float
    below: int
    border: int
    knots: FloatArray = field(default_factory=lambda: np.empty(0))

    @staticmethod
    def fit(
        domain: Domain,
        heights: tuple[float, float],
        max_depth: float,
        fade: float,
        resolution: float,
        growth: float = 1.0,
    ) -> FieldGrid:
        """Return the coarsest grid whose nodes are at most the resolution apart.

        Below the least height those along z may be ever farther apart.

        Args:
            domain: the domain of the texture.
            heights: its least and greatest height [m].
            max_depth: depth of the floor below the least height [m].
            fade: least height of the cells below the floor [m].
            resolution: [m].
            growth: greatest height of a cell below the least height, over that of the one above.
        """
        lengths = np.hypot(*domain.spans.T)
        cells = [max(math.ceil(length / resolution), _MIN_STEPS) for length in lengths]
        floor = heights[0] - max_depth
        spacing, inside, stretched = _cell_heights(heights, floor, resolution, growth)
        lowest = float(stretched[0]) if len(stretched) else spacing
        below = max(math.ceil(fade / lowest), _MIN_BELOW)
        knots = np.empty(0)
        if len(stretched):
            sides = np.concatenate([np.full(below + 1, lowest), stretched, [spacing]])
            knots = floor - (below + 1) * lowest + np.append(0.0, np.cumsum(sides))
        grid = FieldGrid(
            steps=domain.spans / np.array(cells)[:, None],
            cells=tuple(cells),
            start=domain.origin,
            levels=inside + len(stretched) + below + 2,
            level_spacing=spacing,
            floor=floor,
            below=below,
            border=PERIODIC if domain.periodic else MIRRORED,
            knots=knots,
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
        count = self.stretched
        if not count:
            return self.floor + (level - self.below - 0.5) * self.level_spacing
        above = self.knots[-1] + (level + 0.5 - count) * self.level_spacing
        inside = np.interp(np.add(level, 0.5), np.arange(count + 1), self.knots)
        return np.where(np.add(level, 0.5) >= count, above, inside)

    @property
    def stretched(self) -> int:
        """Number of the lowest cells, which are not equally high."""
        return max(len(self.knots) - 1, 0)

    @property
    def fade(self) -> float:
        """Twice the height of the cells below the floor [m]."""
        lowest = self.knots[1] - self.knots[0] if self.stretched else self.level_spacing
        return float(2 * self.below * lowest)

    @property
    def bounded_floor(self) -> float:
        """Least z above which nodes are equally far apart [m]."""
        return float(self.knots[-1]) if self.stretched else self.floor

    def offsets(self) -> FloatArray:
        """Return what is subtracted from the depth at each level before it is stored [m].

        It is the height of the knot below the highest of the stretched cells above the level.
        """
        heights = self.height(np.arange(self.levels))
        if not self.stretched:
            return np.zeros(self.levels)
        return np.asarray(np.maximum(self.knots[-2] - heights, 0.0))

    def stretched_table(self) -> FloatArray:
        """Return the entries of the stretched cells, (n, 7); see :class:`FieldArguments`."""
        count = self.stretched
        if not count:
            return np.zeros((0, 7))
        sides = np.append(np.diff(self.knots), self.level_spacing)
        side = sides[:-1]
        below = np.append(sides[0], side[:-1])
        offsets = np.append(0.0, self.offsets())
        parts = [self.knots[:-1], 1.0 / side, side / (below + side), side / (side + sides[1:])]
        return np.column_stack([*parts, *[offsets[i : i + count] for i in range(3)]])

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
        pass adds at most 1/4.
        """
        variance = 0.25 + 2.0 * NEIGHBOUR_WEIGHT * passes
        return variance * float(np.square(self.spacing).sum())

    def onset_bound(self, passes: int) -> float:
        """Return a proved bound of the distance [m] above the surface at which contact begins.

        S is the mean of the depth, cut at -margin, over points whose distances from the probe have
        the root mean square σ. It is not positive where the depth is less than -σ: where σ is less
        than twice the margin, as after 15 passes, the cut does not change that. Cells at the
        surface are at most two above stretched ones.
        """
        side = self.knots[-2] - self.knots[-3] if self.stretched > 1 else self.level_spacing
        growth = (side / self.level_spacing) ** 2
        square = self.spread(passes) + 0.25 * (growth**2 - 1.0) * self.level_spacing**2
        return math.sqrt(square)

    def error_bounds(
        self, gain: float, passes: int = 0, largest: float = 0.0, step: float = 0.0
    ) -> tuple[float, float]:
        """Return proved bounds of |∇T - ∇U| [m] and of |T - U| [m²] above ``bounded_floor``.

        S is the mean of the exact depth D, which is 1-Lipschitz, over points around the probe p
        with p as their mean; :meth:`spread` is their variance σ². Its derivative along a step h is
        the difference of two such means over h, at ±h/2, with mean squares τ² = σ² + h²/4 of the
        distances from p. For every point x, D(p) (D(x) - D(p)) is ∇U(p) · (x - p) up to
        (L + 1) |x - p|²/2, so D(p) times the derivative is that of U up to (L + 1) τ²/h; and S
        differs from D(p) by at most σ. The derivative of S is at most 1, and a smoothing pass may
        add to it, since its weights differ between nodes. T is at most the mean of U; it is less by
        at most the variance of S where all points are inside, and by σ times the depth otherwise.
        Single precision rounds a coefficient at most three times, and less than 5 times in a pass.

        Args:
            gain: Lipschitz constant L of ∇U [1].
            passes: number of smoothing passes.
            largest: greatest coefficient that is stored in single precision [m].
            step: greatest step to which coefficients are rounded further [m].
        """
        rounding = (3.0 + 5.0 * passes) * largest * 0.5 * float(np.finfo(np.float32).eps)
        rounding += 0.5 * step
        steps = np.array(self.spacing)
        spread = self.spread(passes)
        square = np.square(steps)
        change = NEIGHBOUR_WEIGHT * (1.0 / RAMP + 3.0 / 255.0)  # of the weight, and its rounding
        growth = 1.0 + 2.0 * change * steps.max() / steps.min()
        slope = growth ** (passes * (len(steps) - 1))
        components = (gain + 1.0) * (spread + 0.25 * square) / steps + slope * math.sqrt(spread)
        components += rounding * (slope + 2.0 * largest / steps)
        rates = np.linalg.pinv(self.steps).T * np.hypot(*self.steps.T)[:, None]
        # Derivatives along non-orthogonal steps amplify an error of the gradient.
        skew = max(1.0, float(np.linalg.norm(rates, 2)))
        reach = (1.5 + passes) * math.sqrt(float(square.sum()))
        potential = max(0.5 * (gain + 1.0) * spread, reach * math.sqrt(spread))
        return skew * float(np.linalg.norm(components)), potential + largest * rounding

    def arguments(self, depths: SingleArray, lift: float = 0.0) -> FieldArguments:
        """Return the record of a field from its depths at the nodes.

        Args:
            depths: less the offsets of their levels [m], shape ``node_counts``: first axis, second
                axis, z.
            lift: vertical force over the stiffness below the floor, less the depth there, at least
                about [m].
        """
        rows = self._rows(depths)
        # One row after the other, since masks of a large field would take more memory than it does.
        cut = (_CUT - 1.0) * self.margin
        offsets = self.offsets().astype(np.float32)
        first, end = np.stack([_column_limits(row + offsets, cut) for row in rows], axis=1)
        reach = np.stack([_column_limits(row, 0.0)[1] for row in rows])
        starts = (np.cumsum(end - first) - (end - first).ravel()).reshape(first.shape)
        values = np.empty(int((end - first).sum()), np.float32)
        level = np.arange(self.levels)
        for row, low, high, start in zip(rows, first, end, starts[:, 0], strict=True):
            stored = np.maximum(row + np.float32(self.margin), -offsets)
            part = stored[(level >= low[:, None]) & (level < high[:, None])]
            values[start : start + len(part)] = part
        table = np.stack([starts - first, first, end, reach], axis=-1).astype(np.int32)
        table = self._with_borders(table)
        counts: dict[str, Any] = {"levels": self.levels, "below": self.below, "border": self.border}
        stretched_cells = self.stretched_table()
        return FieldArguments(values, table, stretched_cells, **self.scales(), lift=lift, **counts)

    def to_bricks(self, depths: SingleArray, field: FieldArguments) -> FieldArguments:
        """Return the record of a field with its coefficients rounded to bricks.

        Args:
            depths: see :meth:`arguments`.
            field: its record for them.
        """
        rows = self._rows(depths)
        nodes = self.stored_nodes(1) if len(rows) > 1 else np.zeros(1, np.intp)
        places = nodes, self.stored_nodes(0)
        offsets = self.offsets().astype(np.float32)
        packed = BrickPacker(rows, offsets, self.margin, places, field.columns).pack()
        return field._replace(c=np.empty(0, np.float32), **packed)

    def _rows(self, depths: SingleArray) -> SingleArray:
        """Return depths with the second axis first, which has one node for a profile."""
        return np.swapaxes(depths if len(self.cells) == 2 else depths[:, None], 0, 1)

    def scales(self) -> dict[str, Any]:
        """Return the numbers of the record that follow from the nodes."""
        x0, y0 = self.start.tolist()
        rates = np.zeros((2, 2))
        # Rows of the pseudo-inverse's transpose: nodes per metre along each axis.
        rates[: len(self.cells)] = np.linalg.pinv(self.steps).T
        (m00, m01), (m10, m11) = rates.tolist()
        z0 = float(self.height(self.stretched) - self.stretched * self.level_spacing)
        scales = {"x0": x0, "y0": y0, "z0": z0}
        scales |= {"m00": m00, "m01": m01, "m10": m10, "m11": m11}
        scales |= {"iz": 1.0 / self.level_spacing, "margin": self.margin}
        return scales | {"floor": self.floor, "fade": self.fade}

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


def _cell_heights(
    heights: tuple[float, float], floor: float, resolution: float, growth: float
) -> tuple[float, int, FloatArray]:
    """Return the height of equal cells [m], their number, and the heights of those below them.

    From the floor up; all are equal where the floor is so near that few would be spared.
    """
    low, top = heights
    spacing = min(resolution, (top - floor) / _MIN_STEPS)
    inside = max(math.ceil((top - low) / spacing), 1)
    rest = top - inside * spacing - floor
    count = 1
    while count * spacing < rest and spacing * _growth_sum(growth, count) < rest:
        count += 1
    if _LEAST_SPARING * count * spacing >= rest:
        inside = math.ceil((top - floor) / spacing)
        return (top - floor) / inside, inside, np.empty(0)
    from scipy.optimize import brentq

    ratio = brentq(lambda trial: spacing * _growth_sum(trial, count) - rest, 1.0, growth)
    return spacing, inside, np.asarray(spacing * ratio ** np.arange(count, 0.0, -1.0), float)


def _growth_sum(ratio: float, count: int) -> float:
    return float((ratio ** np.arange(1, count + 1)).sum())


def _column_limits(row: SingleArray, least: float) -> NDArray[np.intp]:
    """Return the first level of each column that exceeds a depth, and the one after the last."""
    inside = row > least
    end = inside.shape[-1] - inside[:, ::-1].argmax(axis=-1)
    return np.where(inside.any(axis=-1), [inside.argmax(axis=-1), end], 0)
