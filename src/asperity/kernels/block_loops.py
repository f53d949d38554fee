"""Loops over probe points in blocks, of laws without state that ask for the height at the probe.

A kind whose samples are loads from all over a table: the compiler cannot tell that results are not
stored there, and goes point by point. A block is memory that nobody else has.
"""

from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.law_functions import probe_force, probe_jacobian
from asperity.kernels.storing import take_point

KERNELS = Kernels(
    requires=("probe_force", "probe_jacobian", "take_point"),
    loops=("force_batch", "jacobian_batch"),
)

BLOCK = 32


def force_batch(points: FloatArray, out: FloatArray, texture: object, law: object) -> None:
    """Write the forces (n, 3) [N] at points (n, 3) [m]."""
    if points.shape[1] != 3 or out.shape[1] != 3:
        return  # never; with known lengths of rows copies are quick
    found = local_array((3, BLOCK))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        for k in range(count):
            # A number without a sign is not looked at for being counted from the end.
            i: Any = np.uint64(first + k)
            x, y, z = take_point(points, i)
            found[0, k], found[1, k], found[2, k] = probe_force(x, y, z, 0.0, 0.0, texture, law)
        store_block(found, 0, first, count, out)


def jacobian_batch(
    points: FloatArray, force: FloatArray, jacobian: FloatArray, texture: object, law: object
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m] at points (n, 3) [m]."""
    if points.shape[1] != 3 or force.shape[1] != 3 or jacobian.shape[1:] != (3, 3):
        return  # see force_batch
    found = local_array((12, BLOCK))
    flat = jacobian.reshape((jacobian.shape[0], 9))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        for k in range(count):
            i: Any = np.uint64(first + k)
            x, y, z = take_point(points, i)
            values = probe_jacobian(x, y, z, 0.0, 0.0, 1.0, 0.0, 1.0, texture, law)
            for d in range(12):
                found[d, k] = values[d]
        store_block(found, 0, first, count, force)
        store_block(found, 3, first, count, flat)


def store_block(block: FloatArray, from_row: int, first: int, count: int, out: FloatArray) -> None:
    """Copy columns of a block, from a row on, into rows of an array."""
    for k in range(count):
        i: Any = np.uint64(first + k)
        for d in range(out.shape[1]):
            out[i, d] = block[from_row + d, k]
