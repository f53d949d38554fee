"""Exact potential of law H at columns of nodes, each node warm-started from the one above."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.sampler_interface import sample_height
from asperity.contacts.split.optimality import split_evaluate_energy
from asperity.contacts.split.solver import split_compute_atoms
from asperity.contacts.warm_start import UNLIMITED
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array

KERNELS = Kernels(loops=("column_batch",), iterates=True)


def column_batch(
    xy: FloatArray, z: FloatArray, out: NDArray[np.float32], continuity: float, texture: object
) -> None:
    """Write U [m²] at columns of nodes, (n, levels), given x, y (n, 2) and rising z (levels,) [m].

    A search that starts from the atoms of the node above mostly takes one query, which proves that
    no point of the surface is closer; its result is that of a search without a start.
    """
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    mu = 1.0 / (1.0 + continuity)
    for i in range(xy.shape[0]):
        height = sample_height(xy[i, 0], xy[i, 1], texture)
        count: Any = np.int64(0)
        for m in range(z.shape[0] - 1, -1, -1):
            out[i, m] = 0.0
            if z[m] < height:
                count, _gap, _evaluations, _truncated = split_compute_atoms(
                    xy[i, 0], xy[i, 1], z[m], continuity, count, UNLIMITED, p, atoms, offset,
                    texture,
                )  # fmt: skip
                out[i, m] = split_evaluate_energy(atoms, count, p, mu, offset)
