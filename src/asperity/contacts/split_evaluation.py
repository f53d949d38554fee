"""Split contact at a probe: vector to the mean, its derivative and energy; see ``split_solver``.

The warm-started search starts from the atoms of the last tick. Newton's method on the optimality
conditions moves them with the probe. One query at the new y then shows that no surface point is
closer, so that the result is that of a search without a start. If a point is closer, the search
continues from there.
"""

import math
from typing import Any

import numpy as np

from asperity.contacts.sampler_interface import sample_height
from asperity.contacts.split_optimality import (
    split_add_atom_motion,
    split_assemble_system,
    split_closest_derivative,
    split_evaluate_energy,
    split_solve_linear,
)
from asperity.contacts.split_solver import split_compute_atoms
from asperity.contacts.warm_search import record_error_bound
from asperity.contacts.warm_start import BUDGET, FIRST_POINT, POINT_COUNT, UNLIMITED
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels, local_array

KERNELS = Kernels(provides=EVERY_FUNCTION, loops=("split_batch",), iterates=True)


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    none: Any = np.int64(0)
    split_compute_atoms(x, y, z, continuity, none, UNLIMITED, p, atoms, offset, texture)
    return offset[0], offset[1], offset[2]


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


def split_contact_energy(
    x: float, y: float, z: float, continuity: float, warm_start: FloatArray, texture: object
) -> tuple[float, float, float, float]:
    """Return z̄ - p [m], and U [m²] of the atoms that the warm-started search left."""
    tx, ty, tz = split_contact_warm(x, y, z, continuity, warm_start, texture)
    count: Any = np.int64(warm_start[POINT_COUNT])
    spread = 0.0
    for i in range(count):
        first: Any = FIRST_POINT + 4 * i
        dx = warm_start[first] - x - tx
        dy = warm_start[first + 1] - y - ty
        dz = warm_start[first + 2] - z - tz
        spread += warm_start[first + 3] * (dx * dx + dy * dy + dz * dz)
    share = continuity / (1.0 + continuity)
    return tx, ty, tz, 0.5 * (tx * tx + ty * ty + tz * tz + share * spread)


def split_energy(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, int, float]:
    """Return U [m²], the number of atoms and the duality gap [m²]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    none: Any = np.int64(0)
    count, gap, _evaluations, _truncated = split_compute_atoms(
        x, y, z, continuity, none, UNLIMITED, p, atoms, offset, texture
    )
    return split_evaluate_energy(atoms, count, p, 1.0 / (1.0 + continuity), offset), count, gap


def split_contact_derivative(
    p: FloatArray,
    continuity: float,
    atoms: FloatArray,
    count: int,
    offset: FloatArray,
    derivative: FloatArray,
    texture: object,
) -> None:
    """Write M = ∂(z̄ - p)/∂p, (3, 3).

    One atom: P - I, P the derivative of the closest point. Several: z̄ = (p - (1 - μ) y)/μ with
    ∂y/∂p from the optimality conditions, so M = c (I - ∂y/∂p).
    """
    a = local_array((7, 10))
    y = local_array((3,))
    mu = 1.0 / (1.0 + continuity)
    n = 3 + count
    for r in range(3):
        y[r] = p[r] - offset[r] / continuity
        for s in range(3):
            derivative[r, s] = 0.0
    if count == 1:
        if split_closest_derivative(p, atoms, count - 1, derivative, texture):
            for d in range(3):
                derivative[d, d] -= 1.0
        return
    split_assemble_system(atoms, count, p, y, mu, a)
    for r in range(n):
        for s in range(3):
            a[r, n + s] = 1.0 if r == s else 0.0
    if split_add_atom_motion(atoms, count, y, mu, a, texture) and split_solve_linear(a, n, n + 3):
        for r in range(3):
            for s in range(3):
                derivative[r, s] = -continuity * a[r, n + s]
            derivative[r, r] += continuity


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: object
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and M = ∂(z̄ - p)/∂p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    offset = local_array((3,))
    m = local_array((3, 3))
    none: Any = np.int64(0)
    count, _gap, _evaluations, _truncated = split_compute_atoms(
        x, y, z, continuity, none, UNLIMITED, p, atoms, offset, texture
    )
    split_contact_derivative(p, continuity, atoms, count, offset, m, texture)
    mxy = 0.5 * (m[0, 1] + m[1, 0])
    mxz = 0.5 * (m[0, 2] + m[2, 0])
    myz = 0.5 * (m[1, 2] + m[2, 1])
    return offset[0], offset[1], offset[2], m[0, 0], mxy, mxz, m[1, 1], myz, m[2, 2]


def split_batch(points: FloatArray, out: FloatArray, continuity: float, texture: object) -> None:
    """Write potential/k [m²], number of atoms and gap [m²] (n, 3) at points (n, 3) [m]."""
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        value = 0.0
        count = 0
        gap = 0.0
        if sample_height(x, y, texture) > z:
            value, count, gap = split_energy(x, y, z, continuity, texture)
        out[i, 0] = value
        out[i, 1] = count
        out[i, 2] = gap
