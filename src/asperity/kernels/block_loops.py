"""Loops over probe points in blocks, of laws without state that ask for the height at the probe.

A kind whose samples are loads from all over a table gets a block of points at once: what lies in a
row of the block lies side by side, and the arithmetic goes many points at a time.
"""

from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.contacts.sampler import BLOCK, BLOCK_ROWS, block_point, sample_block
from asperity.kernels.law_functions import probe_force, probe_jacobian

KERNELS = Kernels(
    requires=("block_point", "probe_force", "probe_jacobian", "sample_block"),
    loops=("force_batch", "jacobian_batch"),
)


def take_block(points: FloatArray, first: int, count: int, where: FloatArray) -> None:
    """Copy rows of points (n, 3) into columns of a block."""
    for k in range(count):
        # A number without a sign is not looked at for being counted from the end.
        i: Any = np.uint64(first + k)
        where[0, k] = points[i, 0]
        where[1, k] = points[i, 1]
        where[2, k] = points[i, 2]


def store_block(block: FloatArray, from_row: int, first: int, count: int, out: FloatArray) -> None:
    """Copy columns of a block, from a row on, into rows of an array."""
    for k in range(count):
        i: Any = np.uint64(first + k)
        for d in range(out.shape[1]):
            out[i, d] = block[from_row + d, k]


def force_batch(points: FloatArray, out: FloatArray, texture: object, law: object) -> None:
    """Write the forces (n, 3) [N] at points (n, 3) [m]."""
    if points.shape[1] != 3 or out.shape[1] != 3:
        return  # never; with known lengths of rows copies are quick
    where = local_array((3, BLOCK))
    known = local_array((BLOCK_ROWS, BLOCK))
    found = local_array((3, BLOCK))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        take_block(points, first, count, where)
        sample_block(where, count, known, texture)
        for k in range(count):
            here = block_point(known, k, texture)
            found[0, k], found[1, k], found[2, k] = probe_force(
                where[0, k], where[1, k], where[2, k], 0.0, 0.0, here, law
            )
        store_block(found, 0, first, count, out)


def jacobian_batch(
    points: FloatArray, force: FloatArray, jacobian: FloatArray, texture: object, law: object
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m] at points (n, 3) [m]."""
    if points.shape[1] != 3 or force.shape[1] != 3 or jacobian.shape[1:] != (3, 3):
        return  # see force_batch
    where = local_array((3, BLOCK))
    known = local_array((BLOCK_ROWS, BLOCK))
    found = local_array((12, BLOCK))
    flat = jacobian.reshape((jacobian.shape[0], 9))
    for first in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - first)
        take_block(points, first, count, where)
        sample_block(where, count, known, texture)
        for k in range(count):
            here = block_point(known, k, texture)
            values = probe_jacobian(
                where[0, k], where[1, k], where[2, k], 0.0, 0.0, 1.0, 0.0, 1.0, here, law
            )
            for d in range(12):
                found[d, k] = values[d]
        store_block(found, 0, first, count, force)
        store_block(found, 3, first, count, flat)
