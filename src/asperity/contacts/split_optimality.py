"""Energy, weights and optimality conditions of law H for given atoms (``split_solver``).

Rows of ``atoms`` are x, y, z [m] and weight. Differences of squared distances are products of
sums and differences: near a crest the atoms are so close together that the squares would cancel.
"""

from typing import Any

import numpy as np

from asperity.contacts.sampler_interface import evaluation_cost, sample_height, sample_hessian
from asperity.core.compiled import EPS, EVERY_FUNCTION, FloatArray, Kernels, local_array

KERNELS = Kernels(provides=EVERY_FUNCTION, iterates=True)


def split_distance_difference(atoms: FloatArray, i: int, j: int, y: FloatArray) -> float:
    """Return half of |w_i - y|² - |w_j - y|²."""
    total = 0.0
    for d in range(3):
        total += (atoms[i, d] - atoms[j, d]) * (atoms[i, d] + atoms[j, d] - 2.0 * y[d])
    return 0.5 * total


def split_evaluate_energy(
    atoms: FloatArray, count: int, p: FloatArray, mu: float, offset: FloatArray
) -> float:
    """Write z̄ - p and return ½ [|z̄ - p|² + (1 - μ) Σ λ_i |w_i - z̄|²]."""
    total = 0.0
    for d in range(3):
        offset[d] = 0.0
        for i in range(count):
            offset[d] += atoms[i, 3] * (atoms[i, d] - p[d])
        total += offset[d] * offset[d]
        for i in range(count):
            total += (1.0 - mu) * atoms[i, 3] * (atoms[i, d] - p[d] - offset[d]) ** 2
    return 0.5 * total


def split_copy_atoms(source: FloatArray, target: FloatArray, count: int) -> None:
    """Copy the first rows."""
    for i in range(count):
        for d in range(4):
            target[i, d] = source[i, d]


def split_solve_linear(a: FloatArray, n: int, width: int) -> bool:
    """Solve n equations in place; right-hand sides in columns n to width. Is it regular?"""
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(a[r, i]) > abs(a[pivot, i]):
                pivot = r
        size = a[pivot, i]
        if abs(size) < 1e-300:
            return False
        for j in range(i, width):
            upper = a[pivot, j] / size
            a[pivot, j] = a[i, j]
            a[i, j] = upper
        for r in range(n):
            factor = a[r, i]
            if r != i and factor != 0.0:
                for j in range(i, width):
                    a[r, j] -= factor * a[i, j]
    return True


def split_assemble_system(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray
) -> None:
    """Write the linearised optimality conditions for y and the weights at fixed atoms.

    (1 - μ) (y - p) + μ Σ λ_i (w_i - p) = 0; |y - w_i| equal; Σ λ_i = 1. The right-hand side,
    column 3 + count, is minus their residual; the conditions are linear, so one step solves them.
    """
    n = 3 + count
    for i in range(n):
        for j in range(n + 1):
            a[i, j] = 0.0
    for d in range(3):
        a[d, d] = 1.0 - mu
        a[d, n] = (1.0 - mu) * (p[d] - y[d])
    a[3, n] = 1.0
    for i in range(count):
        for d in range(3):
            a[d, 3 + i] = mu * (atoms[i, d] - p[d])
            a[d, n] -= atoms[i, 3] * a[d, 3 + i]
        a[3, 3 + i] = 1.0
        a[3, n] -= atoms[i, 3]
        # The difference of the first atom to itself is zero: its row is that of the sum.
        for d in range(3):
            difference = atoms[0, d] - atoms[i, d]
            a[3 + i, d] = difference
            a[3 + i, n] += 0.5 * difference * (atoms[0, d] + atoms[i, d] - 2.0 * y[d])


def split_closest_derivative(
    y: FloatArray, atoms: FloatArray, row: int, out: FloatArray, texture: object
) -> bool:
    """Write ∂w/∂y, (3, 3), of a closest point w; return whether it is a minimum."""
    _h, hx, hy, hxx, hxy, hyy = sample_hessian(atoms[row, 0], atoms[row, 1], texture)
    gap = atoms[row, 2] - y[2]
    q11 = 1.0 + hx * hx + gap * hxx
    q12 = hx * hy + gap * hxy
    q22 = 1.0 + hy * hy + gap * hyy
    det = q11 * q22 - q12 * q12
    if det <= 0.0 or q11 + q22 <= 0.0:
        return False
    out[0, 0] = q22 / det
    out[0, 1] = -q12 / det
    out[1, 1] = q11 / det
    out[0, 2] = out[0, 0] * hx + out[0, 1] * hy
    out[1, 2] = out[0, 1] * hx + out[1, 1] * hy
    out[2, 2] = out[0, 2] * hx + out[1, 2] * hy
    out[1, 0] = out[0, 1]
    out[2, 0] = out[0, 2]
    out[2, 1] = out[1, 2]
    return True


def split_add_atom_motion(
    atoms: FloatArray, count: int, y: FloatArray, mu: float, a: FloatArray, texture: object
) -> bool:
    """Add the motion of the atoms with y to the system; return whether all are minima."""
    projection = local_array((3, 3))
    for i in range(count):
        if not split_closest_derivative(y, atoms, i, projection, texture):
            return False
        for r in range(3):
            for s in range(3):
                a[r, s] += mu * atoms[i, 3] * projection[r, s]
    return True


def split_track_point(
    y: FloatArray, atoms: FloatArray, row: int, max_steps: int, texture: object
) -> tuple[bool, float]:
    """Move an atom to the stationary point of the distance from y near it, by Newton's method.

    Returns:
        Whether it is near a minimum, and the evaluations, one per step.
    """
    fx = atoms[row, 0]
    fy = atoms[row, 1]
    last = np.inf
    stalled = 0
    evaluations = 0.0
    cost = evaluation_cost(texture)
    for _ in range(max_steps):
        evaluations += cost
        h, hx, hy, hxx, hxy, hyy = sample_hessian(fx, fy, texture)
        gap = h - y[2]
        px = fx - y[0] + gap * hx
        py = fy - y[1] + gap * hy
        q11 = 1.0 + hx * hx + gap * hxx
        q12 = hx * hy + gap * hxy
        q22 = 1.0 + hy * hy + gap * hyy
        det = q11 * q22 - q12 * q12
        if det <= 0.0 or q11 + q22 <= 0.0:
            return False, evaluations
        sx = (q12 * py - q22 * px) / det
        sy = (q12 * px - q11 * py) / det
        fx += sx
        fy += sy
        size = sx * sx + sy * sy
        stalled += size >= 0.25 * last
        last = size
        rounding = 0.2 * EPS * EPS * (fx * fx + fy * fy)
        # Near a centre of curvature the first steps need not shrink; else convergence is quadratic.
        if stalled > 2 or size <= 0.5 * EPS * gap * gap + rounding:
            break
    atoms[row, 0] = fx
    atoms[row, 1] = fy
    atoms[row, 2] = sample_height(fx, fy, texture)
    return True, evaluations


def split_solve_subset(
    atoms: FloatArray,
    count: int,
    mask: int,
    p: FloatArray,
    mu: float,
    a: FloatArray,
    trial: FloatArray,
    y: FloatArray,
) -> int:
    """Write the best weights on the last atom and a subset of the others, and y.

    Returns:
        The number of atoms; 0 if a weight is not positive.
    """
    # Not a literal: Numba compiles a function again for each literal argument.
    n: Any = np.int64(0)
    for i in range(count):
        if i == count - 1 or mask >> i & 1:
            for d in range(3):
                trial[n, d] = atoms[i, d]
            trial[n, 3] = 0.0
            n += 1
    for d in range(3):
        y[d] = p[d]
    split_assemble_system(trial, n, p, y, mu, a)
    if not split_solve_linear(a, 3 + n, 4 + n):
        return 0
    for i in range(n):
        trial[i, 3] = a[3 + i, 3 + n]
        if not trial[i, 3] > 0.0:
            return 0
    for d in range(3):
        y[d] += a[d, 3 + n]
    return int(n)


def split_solve_weights(
    atoms: FloatArray, count: int, p: FloatArray, mu: float, a: FloatArray
) -> int:
    """Write the optimal weights, drop atoms without weight, and return the number of atoms.

    The last atom is new and closer to y than the others, so it has weight; every subset of the
    others is tried, the largest first, until one satisfies all optimality conditions. If none does
    because of rounding, the one with the least violation is taken; 0 if there is none.
    """
    trial = local_array((4, 4))
    best = local_array((4, 4))
    y = local_array((3,))
    left: Any = np.int64(0)
    least = np.inf
    for mask in range((1 << (count - 1)) - 1, -1, -1):
        # In space at most four atoms are needed (Carathéodory).
        n = split_solve_subset(atoms, count, mask, p, mu, a, trial, y) if mask != 15 else 0
        if n == 0:
            continue
        violation = 0.0
        for i in range(count):
            violation = max(violation, split_distance_difference(atoms, count - 1, i, y))
        if violation < least:
            least = violation
            left = n
            split_copy_atoms(trial, best, n)
        if violation == 0.0:
            break
    split_copy_atoms(best, atoms, left)
    return int(left)


def split_apply_step(
    atoms: FloatArray, count: int, y: FloatArray, a: FloatArray
) -> tuple[int, float]:
    """Apply the step of the solved system, and drop atoms without weight.

    Returns:
        The number of atoms left, and the squared step of y [m²].
    """
    n = 3 + count
    size = 0.0
    for d in range(3):
        y[d] += a[d, n]
        size += a[d, n] * a[d, n]
    left = 0
    for i in range(count):
        weight = atoms[i, 3] + a[3 + i, n]
        if weight > 0.0:
            for d in range(3):
                atoms[left, d] = atoms[i, d]
            atoms[left, 3] = weight
            left += 1
    return left, size


def split_duality_gap(
    atoms: FloatArray, count: int, y: FloatArray, mu: float, scale: float
) -> tuple[float, float]:
    """Return the duality gap [m²] and its possible rounding error.

    The atom in row ``count`` is the closest to y.
    """
    gap = 0.0
    distance = 0.0
    for i in range(count):
        gap += atoms[i, 3] * split_distance_difference(atoms, i, count, y)
    for d in range(3):
        distance += abs(atoms[count, d] - y[d])
    rounding = 2.0 * EPS * (1.0 - mu) * distance * (distance + scale)
    return max((1.0 - mu) * gap, 0.0), rounding
