"""Warm-started split god-object: the search starts from the atoms of the last tick.

Newton's method on the optimality conditions moves them with the probe. One query at the new y then
shows that no surface point is closer, so that the result is that of a search without a start. If a
point is closer, the search continues from there.
"""

import math
from typing import Any

import numpy as np

from asperity.contacts.closest.closest_warm import record_error_bound
from asperity.contacts.split.solver import split_compute_atoms
from asperity.contacts.warm_start import BUDGET, FIRST_POINT, POINT_COUNT
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array

KERNELS = Kernels(provides=("split_contact_warm",), iterates=True)


def split_contact_warm(
    x: float, y: float, z: float, continuity: float, warm_start: FloatArray, texture: object
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m].

    The recorded error bound is that of this vector, √(2 (1 + c) gap); 0 unless truncated.
    """
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    warm_count: Any = np.int64(warm_start[POINT_COUNT])
    for i in range(warm_count):
        for d in range(4):
            atoms[i, d] = warm_start[FIRST_POINT + 4 * i + d]
    count, gap, evaluations, truncated = split_compute_atoms(
        x, y, z, continuity, warm_count, warm_start[BUDGET], p, atoms, offset, texture
    )
    warm_start[POINT_COUNT] = count
    for i in range(count):
        for d in range(4):
            warm_start[FIRST_POINT + 4 * i + d] = atoms[i, d]
    error = math.sqrt(2.0 * (1.0 + continuity) * gap) if truncated else 0.0
    record_error_bound(warm_start, error, evaluations)
    return offset[0], offset[1], offset[2]
