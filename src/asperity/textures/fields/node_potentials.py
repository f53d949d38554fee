"""The exact potential of law H at the nodes of a field, and its smoothing."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from asperity.clamps import NONE
from asperity.core.checks import FloatArray
from asperity.laws import LAWS
from asperity.textures.fields import node_loop
from asperity.textures.fields.field_certificate import Progress, run_in_threads
from asperity.textures.fields.field_grid import NEIGHBOUR_WEIGHT, FieldGrid, SingleArray
from asperity.textures.fields.field_sampler import PERIODIC, ZERO
from asperity.textures.texture import Texture

_NODES_PER_BLOCK = 10_000

# Writes U [m²] in single precision, (n, levels), at columns of nodes at x, y (n, 2) and rising z
# (levels,) [m]; called by several threads at once.
ColumnFunction = Callable[[FloatArray, FloatArray, SingleArray], None]


def split_columns(texture: Texture, continuity: float) -> ColumnFunction:
    """Return the function of the exact potential of law H of a texture, over its stiffness."""
    from asperity.kernels.fuse import fuse_on_texture

    loops = fuse_on_texture(LAWS["H"], texture.sampler, NONE, (node_loop,))
    return lambda xy, z, out: loops.column_batch(xy, z, out, continuity, texture.arguments)


def compute_potentials(
    columns: ColumnFunction, grid: FieldGrid, progress: Progress | None = None
) -> SingleArray:
    """Return U [m²] at the nodes, shape ``grid.node_counts``, in single precision."""
    *plane, levels = grid.node_counts
    result = np.empty((math.prod(plane), levels), np.float32)
    at_once = max(_NODES_PER_BLOCK // levels, 1)
    z = grid.height(np.arange(levels))

    def fill(first: int) -> None:
        part = np.arange(first, min(first + at_once, len(result)))
        xy = grid.positions(np.stack(np.unravel_index(part, plane), axis=-1))
        columns(xy, z, result[first : first + at_once])

    run_in_threads(fill, range(0, len(result), at_once), progress)
    return result.reshape(grid.node_counts)


def smooth(potentials: SingleArray, grid: FieldGrid) -> SingleArray:
    """Return means of potentials with weights 1/8, 3/4, 1/8 along each axis.

    A mean of exact potentials over shifted copies keeps the bounds -c <= Hess U <= 1 (MATH
    section 10). The lowest level is lost, since it has no neighbour.

    Args:
        potentials: [m²], shape ``grid.node_counts``; changed in place.
        grid: the nodes.
    """
    for axis in range(potentials.ndim - 1):
        _smooth_axis(np.moveaxis(potentials, axis, 0), grid.border)
    for rows in potentials.reshape(-1, *potentials.shape[-2:]):
        _smooth_axis(np.moveaxis(rows, -1, 0), ZERO)
    return potentials[..., 1:]


def _smooth_axis(rows: SingleArray, border: int) -> None:
    """Smooth along the first axis, in place; borders repeat, are mirrored, or zero."""
    nothing = np.zeros_like(rows[0])
    before = {PERIODIC: rows[-1], ZERO: nothing}.get(border, rows[1]).copy()
    after = {PERIODIC: rows[0], ZERO: nothing}.get(border, rows[-2]).copy()
    for k in range(len(rows)):
        here = rows[k].copy()
        beyond = rows[k + 1] if k + 1 < len(rows) else after
        rows[k] = (1.0 - 2.0 * NEIGHBOUR_WEIGHT) * here + NEIGHBOUR_WEIGHT * (before + beyond)
        before = here
