"""The grid of a baked field of law H: nodes, exact potential there, error and gain bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.analysis.bounds.bound import Bound
from asperity.contacts.split.potential_spline import PotentialSpline
from asperity.core.checks import FloatArray
from asperity.core.processes import available_cores
from asperity.surface import Surface

Progress = Callable[[float], None]

_MIN_STEPS = 4
_NODES_PER_BLOCK = 20_000
# Rounding of a second difference of coefficients, in units of their size, counted generously.
_DIFFERENCE_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class FieldGrid:
    """The nodes of a baked field.

    Attributes:
        steps: from node to node along each axis of the texture [m], shape (d, 2).
        cells: number of steps along each of them.
        start: the first node [m], shape (2,).
        levels: number of nodes along z, the last two of them above the highest point.
        level_spacing: distance of the levels [m].
        floor: z halfway between the two lowest levels [m], the bottom of the spline's cells.
        periodic: whether the field repeats; else it is mirrored at its border.
    """

    steps: FloatArray
    cells: tuple[int, ...]
    start: FloatArray
    levels: int
    level_spacing: float
    floor: float
    periodic: bool

    @staticmethod
    def fit(surface: Surface, resolution: float) -> FieldGrid:
        """Return the coarsest grid whose nodes are at most the resolution apart."""
        domain, (low, high) = surface.texture.domain, surface.texture.extremes
        lengths = np.hypot(*domain.spans.T)
        cells = [max(math.ceil(length / resolution), _MIN_STEPS) for length in lengths]
        floor = low - surface.max_depth
        inside = max(math.ceil((high - floor) / resolution), _MIN_STEPS)
        return FieldGrid(
            steps=domain.spans / np.array(cells)[:, None],
            cells=tuple(cells),
            start=domain.origin,
            levels=inside + 3,
            level_spacing=(high - floor) / inside,
            floor=floor,
            periodic=domain.periodic,
        )

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of stored nodes along each axis, z last."""
        return (*(count + 3 for count in self.cells), self.levels)

    @property
    def spacing(self) -> tuple[float, ...]:
        """Distance of the nodes along each axis [m], z last."""
        return (*(float(length) for length in np.hypot(*self.steps.T)), self.level_spacing)

    @property
    def bytes(self) -> int:
        """Size of the coefficients."""
        return 8 * math.prod(self.shape)

    def height(self, level: Any) -> Any:
        """Return z of a level [m]."""
        return self.floor + (level - 0.5) * self.level_spacing

    def nodes(self, axis: int) -> NDArray[np.intp]:
        """Return the indices of the stored nodes along an axis, repeated or mirrored at borders."""
        count = self.cells[axis]
        index = np.arange(-1, count + 2)
        if self.periodic:
            return np.asarray(index % count, dtype=np.intp)
        return np.asarray(count - np.abs(count - np.abs(index)), dtype=np.intp)

    def kernel_arguments(self, coefficients: FloatArray) -> PotentialSpline:
        """Return the kernel arguments for the potential at the nodes."""
        x0, y0 = (float(value) for value in self.start)
        rates = np.zeros((2, 2))
        # Rows of the pseudo-inverse's transpose: nodes per metre along each axis.
        rates[: len(self.cells)] = np.linalg.pinv(self.steps).T
        (m00, m01), (m10, m11) = rates.tolist()
        z0 = float(self.height(0))
        inverse = (m00, m01, m10, m11)
        return PotentialSpline(
            coefficients, x0, y0, z0, *inverse, 1.0 / self.level_spacing, not self.periodic
        )

    def error_bounds(self, gain: float) -> tuple[float, float]:
        """Return proved bounds of |∇U_T - ∇U| [m] and of |U_T - U| [m²].

        A derivative of U_T along a step is the mean of that derivative of U over points around the
        probe, its potential the mean of U over other points. Both have the probe as their mean;
        along each axis the variance is 1/4 of a squared step, in the first case at most 1/3 along
        the step itself (a linear B-spline, at most 1/4, and the step's own 1/12).

        Args:
            gain: Lipschitz constant of ∇U [1].
        """
        square = np.square(self.spacing)
        spread = 0.25 * square.sum()
        components = gain * np.sqrt(spread + square / 12.0)
        rates = np.linalg.pinv(self.steps).T * np.hypot(*self.steps.T)[:, None]
        # Derivatives along non-orthogonal steps amplify an error of the gradient.
        skew = max(1.0, float(np.linalg.norm(rates, 2)))
        return skew * float(np.linalg.norm(components)), 0.5 * gain * float(spread)


def compute_potentials(surface: Surface, grid: FieldGrid, progress: Progress | None) -> FloatArray:
    """Return U [m²] at the nodes in kernel order, with borders repeated or mirrored."""
    axes = [np.unique(grid.nodes(axis)) for axis in range(len(grid.cells))]
    flat = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
    columns = np.zeros((len(flat), grid.levels))
    at_once = max(_NODES_PER_BLOCK // grid.levels, 1)
    parts = [slice(first, first + at_once) for first in range(0, len(flat), at_once)]

    def fill(part: slice) -> None:
        columns[part] = _column_potentials(surface, grid, flat[part])

    if parts:
        fill(parts[0])  # compiled before the threads start
    _run_in_threads(fill, parts[1:], progress)
    stored = columns.reshape(*(len(axis) for axis in axes), grid.levels)
    for axis in range(len(axes)):
        stored = np.take(stored, grid.nodes(axis), axis=axis)
    # By second axis, first axis, z; a profile has no second axis.
    stored = stored[None] if len(axes) == 1 else np.swapaxes(stored, 0, 1)
    return np.ascontiguousarray(stored)


def _column_potentials(surface: Surface, grid: FieldGrid, index: NDArray[np.intp]) -> FloatArray:
    """Return U [m²] at all levels above nodes of the plane, shape (n, levels)."""
    xy = grid.start + index @ grid.steps
    z = grid.height(np.arange(grid.levels))
    points = np.empty((len(xy), grid.levels, 3))
    points[:, :, :2] = xy[:, None]
    points[:, :, 2] = z
    out = np.empty((points[..., 0].size, 3))
    surface._loops.split_batch(
        points.reshape(-1, 3), out, surface.continuity, surface.texture.arguments
    )
    return np.ascontiguousarray(out[:, 0].reshape(len(xy), grid.levels))


def _run_in_threads(
    function: Callable[[Any], None], parts: Sequence[Any], progress: Progress | None
) -> None:
    """Apply a function to the parts in threads; the compiled loops release the GIL."""
    with ThreadPoolExecutor(max_workers=available_cores()) as pool:
        for done, future in enumerate(as_completed(pool.submit(function, part) for part in parts)):
            future.result()
            if progress is not None:
                progress((done + 1) / len(parts))
    if progress is not None and not parts:
        progress(1.0)


def curvature_bounds(grid: FieldGrid, field: PotentialSpline) -> tuple[Bound, Bound]:
    """Return certified bounds of sup ‖Hess U_T‖ and of its greatest eigenvalue.

    ``upper`` comes from the hull of the second differences of the coefficients, ``lower`` is
    attained from inside a corner of a cell of the spline.
    """
    from asperity.contacts.split import potential_hull as hull
    from asperity.contacts.split import potential_spline as spline
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(hull, spline)
    width = grid.cells[0] + (0 if grid.periodic else 1)
    parts = [(first, min(first + 16, width)) for first in range(0, width, 16)]
    found = np.zeros((len(parts), 2, 5))

    def search(part: int) -> None:
        loops.hull_batch(*parts[part], found[part], field)

    search(0)
    _run_in_threads(search, range(1, len(parts)), None)
    rounding = _DIFFERENCE_ROUNDING * float(field.c.max()) / min(grid.spacing) ** 2
    best = found[np.argmax(found[:, :, 1], axis=0), [0, 1]]
    upper = found[:, :, 0].max(axis=0) + rounding
    positive, negative = (_curvature_bound(grid, float(upper[i]), best[i]) for i in range(2))
    larger = positive if positive.lower >= negative.lower else negative
    norm = Bound(larger.lower, float(upper.max()), "certified", larger.at, larger.note)
    return norm, positive


def _curvature_bound(grid: FieldGrid, upper: float, maximum: FloatArray) -> Bound:
    u, v, w = (float(value) for value in maximum[2:])
    xy = grid.start + np.array([u, v])[: len(grid.cells)] @ grid.steps
    at = (float(xy[0]), float(xy[1]), float(grid.height(w)))
    note = "hull of the second differences of the field; attained on one side of a knot"
    return Bound(float(maximum[1]), upper, "certified", at, note)
