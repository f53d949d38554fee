"""The exact depth of law H at the nodes of a field, and its smoothing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.processes import run_in_threads
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures.fields import node_loop
from asperity.textures.fields.field_certificate import Progress
from asperity.textures.fields.field_grid import NEIGHBOUR_WEIGHT, RAMP, FieldGrid, SingleArray
from asperity.textures.fields.field_record import MIRRORED, PERIODIC, ZERO
from asperity.textures.texture import Texture

_NODES_PER_BLOCK = 10_000
_MAX_REPLACEMENTS = 10
_REPAIRS_AT_ONCE = 64
_PLANES_PER_BLOCK = 16
# Part of a second derivative of 1 that is left to rounding.
_TOLERANCE = 0.01
# Step of the levels of a lattice where cells are equally high, and the number of those below all.
# Where they are farther apart than deep cells are high, ever more closest points are missed.
_LATTICE_STEP = 2
_LEVELS_BELOW = 12
_MODES: Any = {PERIODIC: "wrap", MIRRORED: "mirror", ZERO: "nearest"}

# Writes the depth [m], (n, levels), at columns of nodes at x, y (n, 2) and rising z (levels,) [m]:
# sqrt(2U) inside, the negative distance of the surface outside, at least -margin, the third
# argument; called by several threads at once.
ColumnFunction = Callable[[FloatArray, FloatArray, float, FloatArray], object]


def split_columns(texture: Texture, continuity: float) -> ColumnFunction:
    """Return the function of the exact depth of law H of a texture."""
    return _column_function(texture, continuity, (), texture.arguments)


def lattice_columns(texture: Texture, continuity: float, grid: FieldGrid) -> list[ColumnFunction]:
    """Return functions of the depth of law H of a texture at the nodes of a grid.

    It is that of close points where the texture finds them from a lattice, in a fraction of the
    time of the exact one: see :meth:`Texture.closest_lattice`. The first function is the quickest,
    each further one misses fewer closest points.
    """
    levels = np.arange(grid.levels)
    z = grid.height(levels)
    used = (levels < grid.stretched) | (levels % _LATTICE_STEP == 0)
    # The probe of law H's search is below the node by its depth over c.
    depth = texture.extremes[1] - z[0]
    deepest = depth * (1.0 + 1.0 / max(continuity, 0.5))
    below = texture.extremes[1] - np.geomspace(deepest, depth, _LEVELS_BELOW, endpoint=False)
    lattice_z = np.concatenate([below, z[used]])
    overrides, records = texture.closest_lattice(grid.spacing[:-1], lattice_z)
    return [_column_function(texture, continuity, overrides, record) for record in records]


def _column_function(
    texture: Texture, continuity: float, overrides: tuple[ModuleType, ...], arguments: Any
) -> ColumnFunction:
    from asperity.kernels.fuse import fuse_on_texture

    loops = fuse_on_texture(LAWS["H"], texture.sampler, NONE, (node_loop,), overrides)
    return lambda xy, z, margin, out: loops.column_batch(xy, z, out, continuity, margin, arguments)


def compute_potentials(
    columns: ColumnFunction,
    grid: FieldGrid,
    progress: Progress | None = None,
    *,
    repairs: Sequence[ColumnFunction] = (),
    continuity: float = 1.0,
) -> SingleArray:
    """Return the depth less the offset of the level [m] at the nodes, in single precision.

    The shape is ``grid.node_counts``.

    Args:
        columns: the depth at columns of nodes.
        grid: the nodes.
        progress: called with the finished fraction.
        repairs: likewise, where ``columns`` may be too deep: they are used one after the other at
            nodes around which the depth is not that of law H, the last one is exact.
        continuity: c of law H.
    """
    *plane, levels = grid.node_counts
    count = math.prod(plane)
    depths = np.empty((count, levels), np.float32)
    _fill(depths, columns, grid, np.arange(count), progress)
    for repair in repairs:
        _replace_wrong(depths, repair, grid, continuity)
    return depths.reshape(grid.node_counts)


def compute_around(columns: ColumnFunction, grid: FieldGrid, xy: FloatArray) -> SingleArray:
    """Return what :func:`compute_potentials` does, at the nodes around places x, y (n, 2) [m].

    They are those by which the field there is determined; all others are outside of the surface.
    """
    nearest = np.rint((xy - grid.start) @ np.linalg.pinv(grid.steps)).astype(np.intp)
    is_used = np.zeros(grid.node_counts[:-1], bool)
    for step in np.ndindex((3,) * is_used.ndim):
        places = [grid.stored_nodes(k)[nearest[:, k] + step[k]] for k in range(is_used.ndim)]
        is_used[tuple(places)] = True
    outside = np.float32(-grid.margin) - grid.offsets().astype(np.float32)
    depths = np.tile(outside, (is_used.size, 1))
    _fill(depths, columns, grid, np.flatnonzero(is_used), None)
    return depths.reshape(grid.node_counts)


def _fill(
    depths: SingleArray,
    columns: ColumnFunction,
    grid: FieldGrid,
    numbers: NDArray[np.intp],
    progress: Progress | None,
) -> None:
    """Write the depths of columns of nodes, which are given by their numbers, in threads."""
    at_once = max(_NODES_PER_BLOCK // grid.levels, 1)
    z = grid.height(np.arange(grid.levels))
    offsets = grid.offsets()

    def fill(first: int) -> None:
        part = numbers[first : first + at_once]
        block = np.empty((len(part), grid.levels))
        columns(_plane_positions(grid, part), z, grid.margin, block)
        depths[part] = block - offsets

    run_in_threads(fill, range(0, len(numbers), at_once), progress)


def _plane_positions(grid: FieldGrid, columns: NDArray[np.intp]) -> FloatArray:
    """Return x and y [m], (n, 2), of columns of nodes that are given by their numbers."""
    index = np.unravel_index(columns, grid.node_counts[:-1])
    return grid.positions(np.stack(index, axis=-1))


def _replace_wrong(
    depths: SingleArray, repair: ColumnFunction, grid: FieldGrid, continuity: float
) -> None:
    """Replace depths at nodes, (columns, levels) [m], around which they are not those of law H.

    Where nodes beside replaced ones are found wrong, too, ever more around them are replaced.
    """
    replaced = np.zeros(depths.shape, bool)
    changed = np.arange(grid.levels)
    for trial in range(_MAX_REPLACEMENTS):
        wrong = np.zeros(depths.shape, bool)
        mark = partial(_mark_wrong, wrong, depths, replaced, grid, continuity, 2**trial)
        run_in_threads(mark, changed.tolist(), None)
        wrong &= ~replaced
        replaced |= wrong
        changed = np.flatnonzero(wrong.any(axis=0))
        columns = np.flatnonzero(wrong.any(axis=1))
        if not len(columns):
            return
        parts = np.split(columns, range(_REPAIRS_AT_ONCE, len(columns), _REPAIRS_AT_ONCE))
        run_in_threads(partial(_replace_columns, depths, repair, grid, wrong), parts, None)


def _mark_wrong(
    wrong: NDArray[np.bool_],
    depths: SingleArray,
    replaced: NDArray[np.bool_],
    grid: FieldGrid,
    continuity: float,
    size: int,
    level: int,
) -> None:
    """Mark the nodes of a level, by columns, less than ``size`` steps from a wrong one.

    Nodes that were replaced before do not count as wrong.
    """
    from scipy import ndimage

    stored = depths[:, level].astype(float)
    whole = stored + grid.offsets()[level]
    rounding = 2.0 * float(np.finfo(np.float32).eps * np.abs(stored).max() * np.abs(whole).max())
    plane = whole.reshape(*grid.node_counts[:-1], 1)
    marks = wrong_nodes(plane, grid, continuity, rounding)[..., 0]
    marks &= ~replaced[:, level].reshape(marks.shape)
    mode = _MODES[grid.border]
    wrong[:, level] = ndimage.maximum_filter(marks, 2 * size - 1, mode=mode).ravel()


def _replace_columns(
    depths: SingleArray,
    repair: ColumnFunction,
    grid: FieldGrid,
    wrong: NDArray[np.bool_],
    columns: NDArray[np.intp],
) -> None:
    """Replace the wrong depths of columns, which are given by their numbers."""
    offsets = grid.offsets()
    z = grid.height(np.arange(grid.levels))
    xy = _plane_positions(grid, columns)
    for k, column in enumerate(columns.tolist()):
        levels = np.flatnonzero(wrong[column])
        found = np.empty((1, len(levels)))
        repair(xy[k : k + 1], z[levels], grid.margin, found)
        depths[column, levels] = found[0] - offsets[levels]


def wrong_nodes(
    depths: FloatArray, grid: FieldGrid, continuity: float, rounding: float = 0.0
) -> NDArray[np.bool_]:
    """Return the nodes whose depth [m] may be greater than that of law H, of the same shape.

    The second derivatives of law H's potential U are between -c and 1, and so is the second
    difference over the square of a step along an axis. If it is less, the node in the middle has
    too great a potential; if it is more, one of its neighbours. The rounding error [m²] of a
    difference is allowed.
    """
    potential = 0.5 * np.square(np.maximum(depths, 0.0))
    wrong = np.zeros(depths.shape, bool)
    for axis, step in enumerate(np.square(grid.spacing[:-1])):
        ends = [(0, 0)] * depths.ndim
        ends[axis] = (1, 1)
        mode: Any = "wrap" if grid.border == PERIODIC else "reflect"
        padded = np.pad(potential, ends, mode=mode)
        second = np.diff(padded, 2, axis=axis)
        wrong |= second < -(continuity + _TOLERANCE) * step - rounding
        high = np.pad(second > (1.0 + _TOLERANCE) * step + rounding, ends, mode=mode)
        count = depths.shape[axis]
        wrong |= high.take(range(count), axis) | high.take(range(2, count + 2), axis)
    return wrong


def smooth(depths: SingleArray, weights: NDArray[np.uint8], grid: FieldGrid) -> None:
    """Replace depths by means with weights w/8, 1 - w/4, w/8 along each axis, plane by plane.

    They lower the gain where second derivatives jump. Where levels are farther apart, the weights
    of neighbours along z are such that a mean has the same variance, and that a linear depth is its
    own mean. The lowest level, which has no neighbour below, is left out along z; above the highest
    the depth is that of the highest.

    Args:
        depths: [m], shape ``grid.node_counts``.
        weights: 255 w at the nodes.
        grid: the nodes.
    """
    for axis in range(depths.ndim):
        is_vertical = axis == depths.ndim - 1
        other = (axis + 1) % depths.ndim
        smooth_block = partial(_smooth_planes, grid, axis - (axis > other), is_vertical)
        _run_in_blocks(smooth_block, (depths, weights), other)


def _run_in_blocks(function: Callable[..., Any], arrays: Sequence[Any], axis: int) -> None:
    """Apply a function to arrays in threads, several planes at once, which are the first axis."""
    planes = [np.moveaxis(array, axis, 0) for array in arrays]
    starts = range(0, len(planes[0]), _PLANES_PER_BLOCK)
    blocks = [[array[k : k + _PLANES_PER_BLOCK] for array in planes] for k in starts]
    run_in_threads(lambda block: function(*block), blocks, None)


def _smooth_planes(
    grid: FieldGrid, axis: int, is_vertical: bool, depths: SingleArray, weights: NDArray[np.uint8]
) -> None:
    """Replace the depths of planes by means along an axis of the planes."""
    from scipy import ndimage

    mode = _MODES[ZERO if is_vertical else grid.border]
    for plane, shares in zip(depths, weights, strict=True):
        if not shares.any():
            continue
        change = ndimage.correlate1d(plane, [1.0, -2.0, 1.0], axis, mode=mode)
        if is_vertical:
            change[..., 0] = 0.0
            count = grid.stretched
            change[..., 1 : count + 1] = _stretched_change(plane[..., : count + 2], grid)
        np.add(plane, np.float32(NEIGHBOUR_WEIGHT / 255.0) * shares * change, out=plane)


def _stretched_change(depths: SingleArray, grid: FieldGrid) -> FloatArray:
    """Return the second derivative of the depth along z times the squared step of equal cells."""
    levels = np.arange(depths.shape[-1])
    steps = np.diff(grid.height(levels)) / grid.level_spacing
    slopes = [np.diff(part, axis=-1) / steps for part in (depths, grid.offsets()[levels])]
    changes = [2.0 * np.diff(slope, axis=-1) / (steps[:-1] + steps[1:]) for slope in slopes]
    return np.asarray(changes[0] + changes[1])


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
            other = (axis + 1) % marks.ndim
            spread = partial(_filter_planes, function, size, axis + (axis < other), mode)
            values = weights
            weights = np.empty_like(values)
            _run_in_blocks(spread, (values, weights), other)
    return before, weights


def _filter_planes(
    function: Callable[..., Any], size: int, axis: int, mode: str, values: Any, out: Any
) -> None:
    """Write what a filter of SciPy makes of planes along an axis."""
    function(values, size, axis=axis, output=out, mode=mode)
