"""The exact depth of law H at the nodes of a field, and its smoothing."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures.fields import node_loop
from asperity.textures.fields.field_certificate import Progress, run_in_threads
from asperity.textures.fields.field_grid import NEIGHBOUR_WEIGHT, RAMP, FieldGrid, SingleArray
from asperity.textures.fields.field_sampler import MIRRORED, PERIODIC, ZERO
from asperity.textures.texture import Texture

_NODES_PER_BLOCK = 10_000
_MODES: Any = {PERIODIC: "wrap", MIRRORED: "mirror", ZERO: "nearest"}

# Writes the depth [m] in single precision, (n, levels), at columns of nodes at x, y (n, 2) and
# rising z (levels,) [m]: sqrt(2U) inside, the negative distance of the surface outside, at least
# -margin, the third argument; called by several threads at once.
ColumnFunction = Callable[[FloatArray, FloatArray, float, SingleArray], object]


def split_columns(texture: Texture, continuity: float) -> ColumnFunction:
    """Return the function of the exact depth of law H of a texture."""
    from asperity.kernels.fuse import fuse_on_texture

    loops = fuse_on_texture(LAWS["H"], texture.sampler, NONE, (node_loop,))
    arguments = texture.arguments
    return lambda xy, z, margin, out: loops.column_batch(xy, z, out, continuity, margin, arguments)


def compute_potentials(
    columns: ColumnFunction, grid: FieldGrid, progress: Progress | None = None
) -> SingleArray:
    """Return the depth [m] at the nodes, shape ``grid.node_counts``, in single precision."""
    *plane, levels = grid.node_counts
    result = np.empty((math.prod(plane), levels), np.float32)
    at_once = max(_NODES_PER_BLOCK // levels, 1)
    computed, weights = grid.level_weights()
    z = grid.height(computed)

    def fill(first: int) -> None:
        part = np.arange(first, min(first + at_once, len(result)))
        xy = grid.positions(np.stack(np.unravel_index(part, plane), axis=-1))
        depths = np.empty((len(part), len(z)), np.float32)
        columns(xy, z, grid.margin, depths)
        if grid.deep:
            result[first : first + at_once] = depths @ weights
        else:
            result[first : first + at_once] = depths

    run_in_threads(fill, range(0, len(result), at_once), progress)
    return result.reshape(grid.node_counts)


def interpolate_force(columns: ColumnFunction, grid: FieldGrid, points: FloatArray) -> FloatArray:
    """Return the force over the stiffness [m], (n, 3), at points above the floor (n, 3) [m].

    It is that of the spline of a field that is not smoothed, of which only the nodes around the
    points are computed.
    """
    rates = np.linalg.pinv(grid.steps)
    level = (points[:, 2:] - grid.height(0)) / grid.level_spacing
    index = np.column_stack([(points[:, :2] - grid.start) @ rates, level])
    nearest = np.rint(index)
    plane = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * len(grid.cells), indexing="ij"), axis=-1)
    plane = plane.reshape(-1, len(grid.cells))
    nodes = np.empty((len(points), len(plane), 3), np.float32)

    def fill(row: int) -> None:
        xy = grid.positions(nearest[row, :-1] + plane)
        z = grid.height(nearest[row, -1] + np.array([-1.0, 0.0, 1.0]))
        columns(xy, z, grid.margin, nodes[row])

    run_in_threads(fill, range(len(points)), None)
    part = index - nearest
    weights = np.stack([0.5 * (0.5 - part) ** 2, 0.75 - part**2, 0.5 * (0.5 + part) ** 2], axis=-1)
    rises = np.stack([part - 0.5, -2.0 * part, part + 0.5], axis=-1)
    values = np.maximum(nodes.astype(float) + grid.margin, 0.0)
    values = values.reshape(len(points), *[3] * part.shape[1])
    depth = _weighted_sum(values, weights) - grid.margin
    chosen = np.eye(part.shape[1], dtype=bool)[:, :, None]
    slopes = [_weighted_sum(values, np.where(axis, rises, weights)) for axis in chosen]
    slope = np.stack(slopes, axis=-1)
    gradient = np.column_stack([slope[:, :-1] @ rates.T, slope[:, -1] / grid.level_spacing])
    return np.asarray(-np.maximum(depth, 0.0)[:, None] * gradient)


def _weighted_sum(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the sum of values (n, 3, ..., 3) with products of weights (n, axes, 3)."""
    for axis in reversed(range(weights.shape[1])):
        values = np.einsum("n...i,ni->n...", values, weights[:, axis])
    return values


def smooth(depths: SingleArray, weights: NDArray[np.uint8], grid: FieldGrid) -> None:
    """Replace depths by means with weights w/8, 1 - w/4, w/8 along each axis, plane by plane.

    They lower the gain where second derivatives jump. The lowest level, which has no neighbour
    below, is left out along z; above the highest the depth is that of the highest.

    Args:
        depths: [m], shape ``grid.node_counts``.
        weights: 255 w at the nodes.
        grid: the nodes.
    """
    from scipy import ndimage

    for axis in range(depths.ndim):
        other = (axis + 1) % depths.ndim
        mode = _MODES[grid.border if axis < depths.ndim - 1 else ZERO]
        planes = np.moveaxis(depths, other, 0), np.moveaxis(weights, other, 0)
        for plane, shares in zip(*planes, strict=True):
            change = ndimage.correlate1d(plane, [1.0, -2.0, 1.0], axis - (axis > other), mode=mode)
            if axis == depths.ndim - 1:
                change[..., 0] = 0.0
            np.add(plane, np.float32(NEIGHBOUR_WEIGHT / 255.0) * shares * change, out=plane)


def spread_marks(marks: NDArray[np.uint8], border: int, ramp: int = RAMP) -> tuple[Any, Any]:
    """Return weights, 255 at marked nodes and falling slowly to 0, and the cells they change."""
    from scipy import ndimage

    weights: Any = 255 * (marks > 0).astype(np.uint8)
    largest = ndimage.maximum_filter1d
    mean = ndimage.uniform_filter1d
    steps = [(largest, ramp), (mean, ramp), (largest, 3)]
    for function, size in steps:
        before = weights
        for axis in range(marks.ndim):
            mode = _MODES[border if axis < marks.ndim - 1 else ZERO]
            weights = function(weights, size, axis=axis, mode=mode)
    return before, weights
