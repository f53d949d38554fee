"""Loops over probe points in blocks, for laws without state that sample at the probe only.

For a texture kind whose samples are loads from a large table, the compiler cannot prove that the
results do not alias the table, and does not vectorize. A block is local memory without aliases.
"""

from typing import Any

import numpy as np

from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.kernels.loop_functions import load_point
from asperity.kernels.probe_functions import probe_force, probe_jacobian

KERNELS = Kernels(loops=("force_batch", "jacobian_batch"))

BLOCK = 32


def force_batch(points: FloatArray, out: FloatArray, texture: object, law: object) -> None:
    """Write the forces (n, 3) [N] at points (n, 3) [m]."""
    if points.shape[1] != 3 or out.shape[1] != 3:
        return  # never true; the compiler learns the row length and copies faster
    block = local_array((3, BLOCK))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        for k in range(count):
            # An unsigned index needs no wrap-around check.
            i: Any = np.uint64(first + k)
            x, y, z = load_point(points, i)
            block[0, k], block[1, k], block[2, k] = probe_force(x, y, z, 0.0, 0.0, texture, law)
        store_block(block, 0, first, count, out)


def jacobian_batch(
    points: FloatArray, force: FloatArray, jacobian: FloatArray, texture: object, law: object
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m] at points (n, 3) [m]."""
    if points.shape[1] != 3 or force.shape[1] != 3 or jacobian.shape[1:] != (3, 3):
        return  # see force_batch
    block = local_array((12, BLOCK))
    flat = jacobian.reshape((jacobian.shape[0], 9))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        for k in range(count):
            i: Any = np.uint64(first + k)
            x, y, z = load_point(points, i)
            values = probe_jacobian(x, y, z, 0.0, 0.0, 1.0, 0.0, 1.0, texture, law)
            for d in range(12):
                block[d, k] = values[d]
        store_block(block, 0, first, count, force)
        store_block(block, 3, first, count, flat)


def store_block(block: FloatArray, from_row: int, first: int, count: int, out: FloatArray) -> None:
    """Copy columns of a block, starting at a row, into rows of an array."""
    for k in range(count):
        i: Any = np.uint64(first + k)
        for d in range(out.shape[1]):
            out[i, d] = block[from_row + d, k]
