"""What is asked of law H at a probe: the pull, its derivative, the energy; see ``solver.py``."""

from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.contacts.memory import UNLIMITED
from asperity.contacts.sampler import height
from asperity.contacts.split.conditions import (
    split_moving,
    split_projection,
    split_solve,
    split_system,
    split_value,
)
from asperity.contacts.split.solver import split_atoms

KERNELS = Kernels(
    provides=("split_contact", "split_derivative", "split_energy"),
    loops=("split_batch",),
    requires=(
        "height", "split_atoms", "split_moving", "split_projection", "split_solve", "split_system",
        "split_value",
    ),
    merged=("split_contact", "split_derivative", "split_energy"),
    iterates=True,
)  # fmt: skip


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    none: Any = np.int64(0)
    split_atoms(x, y, z, continuity, none, UNLIMITED, p, atoms, pull, texture)
    return pull[0], pull[1], pull[2]


def split_energy(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, int, float]:
    """Return U [m²], the number of atoms, and the gap between primal and dual [m²]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    none: Any = np.int64(0)
    count, gap, _looks, _short = split_atoms(
        x, y, z, continuity, none, UNLIMITED, p, atoms, pull, texture
    )
    return split_value(atoms, count, p, 1.0 / (1.0 + continuity), pull), count, gap


def split_response(
    p: FloatArray, continuity: float, atoms: FloatArray, count: int, pull: FloatArray,
    m: FloatArray, texture: object,
) -> None:  # fmt: skip
    """Write M = ∂(z̄ - p)/∂p, (3, 3).

    One atom: P - I with P the derivative of the foot. Several: z̄ = (p - (1 - μ) y)/μ with
    ∂y/∂p from the conditions of optimality, so M = c (I - ∂y/∂p).
    """
    a = local_array((7, 10))
    y = local_array((3,))
    mu = 1.0 / (1.0 + continuity)
    n = 3 + count
    for r in range(3):
        y[r] = p[r] - pull[r] / continuity
        for s in range(3):
            m[r, s] = 0.0
    if count == 1:
        if split_projection(p, atoms, count - 1, m, texture):
            for d in range(3):
                m[d, d] -= 1.0
        return
    split_system(atoms, count, p, y, mu, a)
    for r in range(n):
        for s in range(3):
            a[r, n + s] = 1.0 if r == s else 0.0
    if split_moving(atoms, count, y, mu, a, texture) and split_solve(a, n, n + 3):
        for r in range(3):
            for s in range(3):
                m[r, s] = -continuity * a[r, n + s]
            m[r, r] += continuity


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and M = ∂(z̄ - p)/∂p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    m = local_array((3, 3))
    none: Any = np.int64(0)
    count, _gap, _looks, _short = split_atoms(
        x, y, z, continuity, none, UNLIMITED, p, atoms, pull, texture
    )
    split_response(p, continuity, atoms, count, pull, m, texture)
    return (
        pull[0], pull[1], pull[2], m[0, 0], 0.5 * (m[0, 1] + m[1, 0]), 0.5 * (m[0, 2] + m[2, 0]),
        m[1, 1], 0.5 * (m[1, 2] + m[2, 1]), m[2, 2],
    )  # fmt: skip


def split_batch(points: FloatArray, out: FloatArray, continuity: float, texture: object) -> None:
    """Write potential/k [m²], number of atoms and gap [m²] (n, 3) at points (n, 3) [m]."""
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        value = 0.0
        count = 0
        gap = 0.0
        if height(x, y, texture) > z:
            value, count, gap = split_energy(x, y, z, continuity, texture)
        out[i, 0] = value
        out[i, 1] = count
        out[i, 2] = gap
