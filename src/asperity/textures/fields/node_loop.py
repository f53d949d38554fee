"""Exact depth of law H at columns of nodes, each node warm-started from the one above."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.contacts.sampler_interface import closest_point_within_budget, sample_height
from asperity.contacts.split_optimality import split_evaluate_energy
from asperity.contacts.split_solver import split_compute_atoms
from asperity.contacts.warm_start import UNLIMITED
from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array

KERNELS = Kernels(loops=("column_batch",), iterates=True)


def outside_distance(x: float, y: float, z: float, start: FloatArray, texture: object) -> float:
    """Return the distance of a point above the surface [m]; ``start`` becomes the closest point."""
    fx, fy, h, _hx, _hy, _bound, _evaluations = closest_point_within_budget(
        x, y, z, start[0], start[1], UNLIMITED, texture
    )
    start[0] = fx
    start[1] = fy
    return math.sqrt((x - fx) ** 2 + (y - fy) ** 2 + (z - h) ** 2)


def column_batch(
    xy: FloatArray,
    z: FloatArray,
    out: NDArray[np.float32],
    continuity: float,
    margin: float,
    texture: object,
) -> None:
    """Write √(2U) [m] inside and the negative distance of the surface outside, at least -margin.

    A search that starts from the atoms of the node above mostly takes one query, which proves that
    no point of the surface is closer; its result is that of a search without a start.

    Args:
        xy: x, y of the columns of nodes (n, 2) [m].
        z: of the levels, rising [m].
        out: result, (n, levels).
        continuity: c of law H.
        margin: [m].
        texture: record of the texture.
    """
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    mu = 1.0 / (1.0 + continuity)
    for i in range(xy.shape[0]):
        height = sample_height(xy[i, 0], xy[i, 1], texture)
        count: Any = np.int64(0)
        p[0] = xy[i, 0]
        p[1] = xy[i, 1]
        distance = 0.0
        for m in range(z.shape[0]):
            if z[m] >= height:
                if distance < margin:
                    distance = outside_distance(xy[i, 0], xy[i, 1], z[m], p, texture)
                out[i, m] = -min(distance, margin)
        for m in range(z.shape[0] - 1, -1, -1):
            if z[m] < height:
                count, _gap, _evaluations, _truncated = split_compute_atoms(
                    xy[i, 0],
                    xy[i, 1],
                    z[m],
                    continuity,
                    count,
                    UNLIMITED,
                    p,
                    atoms,
                    offset,
                    texture,
                )
                energy = split_evaluate_energy(atoms, count, p, mu, offset)
                out[i, m] = math.sqrt(max(2.0 * energy, 0.0))
