"""The split god-object: the point between several nearest points to which law H pulls.

With F the free set (outside of the body), c > 0 and μ = 1/(1 + c), law H's potential is

    U(p) = min over weights m on F of ½ [|p - z̄|² + (1 - μ) Σ λ_i |w_i - z̄|²],  z̄ = Σ λ_i w_i

and its force is k (z̄ - p) (MATH section 6, item 2). At the optimum every atom w_i is a nearest
point of y = p - (z̄ - p)/c, the maximiser of the dual
U(p) = (1 - μ) max_y [dist²(y)/2 - |p - y|²/(2μ)].

Fully-corrective Frank-Wolfe: ask for the nearest point of y, add it to the atoms, solve for the
weights exactly, drop what has no weight, and let Newton's method on the conditions of optimality
move the feet along with y. The last query certifies the gap between primal and dual.

Rows of ``atoms`` are x, y, z [m] and weight. Differences of squared distances are products of
sums and differences: near a crest the atoms are so close together that squares would cancel.
``nearest``, ``height`` and ``curvature`` are the sampler's own; the fused module binds them.
"""

from typing import Any

import numpy as np


def nearest(x: float, y: float, z: float, *texture: Any) -> tuple[float, float]:
    """Stand in for the sampler's own function, which replaces this one."""
    raise AssertionError


def height(x: float, y: float, *texture: Any) -> float:
    """Stand in for the sampler's own function, which replaces this one."""
    raise AssertionError


def curvature(x: float, y: float, *texture: Any) -> tuple[float, ...]:
    """Stand in for the sampler's own function, which replaces this one."""
    raise AssertionError


# Compiled, these are arrays on the stack: see stack_memory.
local_array = np.empty

# fused from here

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def split_query(y: FloatArray, atoms: FloatArray, row: int, texture: Any) -> None:
    """Write the point of the free set nearest to y into a row of the atoms."""
    fx = y[0]
    fy = y[1]
    fz = y[2]
    if height(fx, fy, *texture) > fz:
        fx, fy = nearest(fx, fy, fz, *texture)
        fz = height(fx, fy, *texture)
    atoms[row, 0] = fx
    atoms[row, 1] = fy
    atoms[row, 2] = fz
    atoms[row, 3] = 0.0


def split_farther(atoms: FloatArray, i: int, j: int, y: FloatArray) -> float:
    """Return half of |w_i - y|² - |w_j - y|²."""
    total = 0.0
    for d in range(3):
        total += (atoms[i, d] - atoms[j, d]) * (atoms[i, d] + atoms[j, d] - 2.0 * y[d])
    return 0.5 * total


def split_value(atoms: FloatArray, count: int, p: FloatArray, mu: float, pull: FloatArray) -> float:
    """Write z̄ - p and return ½ [|z̄ - p|² + (1 - μ) Σ λ_i |w_i - z̄|²]."""
    total = 0.0
    for d in range(3):
        pull[d] = 0.0
        for i in range(count):
            pull[d] += atoms[i, 3] * (atoms[i, d] - p[d])
        total += pull[d] * pull[d]
        for i in range(count):
            total += (1.0 - mu) * atoms[i, 3] * (atoms[i, d] - p[d] - pull[d]) ** 2
    return 0.5 * total


def split_solve(a: FloatArray, n: int, width: int) -> bool:
    """Solve n equations in place, right-hand sides in columns n to width; are they regular?"""
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


def split_projection(
    y: FloatArray, atoms: FloatArray, row: int, out: FloatArray, texture: Any
) -> bool:
    """Write ∂w/∂y, (3, 3), of a foot w on the surface; return whether it is a minimum."""
    _h, hx, hy, hxx, hxy, hyy = curvature(atoms[row, 0], atoms[row, 1], *texture)
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


def split_follow(y: FloatArray, atoms: FloatArray, row: int, texture: Any) -> bool:
    """Move a foot to the stationary point near it that belongs to y; return success."""
    fx = atoms[row, 0]
    fy = atoms[row, 1]
    last = np.inf
    stalled = 0
    for _ in range(25):
        h, hx, hy, hxx, hxy, hyy = curvature(fx, fy, *texture)
        gap = h - y[2]
        px = fx - y[0] + gap * hx
        py = fy - y[1] + gap * hy
        q11 = 1.0 + hx * hx + gap * hxx
        q12 = hx * hy + gap * hxy
        q22 = 1.0 + hy * hy + gap * hyy
        det = q11 * q22 - q12 * q12
        if det <= 0.0 or q11 + q22 <= 0.0:
            return False
        sx = (q12 * py - q22 * px) / det
        sy = (q12 * px - q11 * py) / det
        fx += sx
        fy += sy
        size = sx * sx + sy * sy
        stalled += size >= 0.25 * last
        last = size
        # Near a centre of curvature the first steps need not shrink.
        if stalled > 2 or size <= 1e-32 * (gap * gap + fx * fx + fy * fy):
            break
    atoms[row, 0] = fx
    atoms[row, 1] = fy
    atoms[row, 2] = height(fx, fy, *texture)
    return True


def split_system(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray
) -> None:
    """Write the linearised conditions of optimality for y and the weights, the atoms fixed.

    (1 - μ) (y - p) + μ Σ λ_i (w_i - p) = 0; |y - w_i| equal; Σ λ_i = 1. The right-hand side,
    column 3 + count, is minus their residual; the conditions are linear, one step solves them.
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
        if i > 0:
            for d in range(3):
                difference = atoms[0, d] - atoms[i, d]
                a[3 + i, d] = difference
                a[3 + i, n] += 0.5 * difference * (atoms[0, d] + atoms[i, d] - 2.0 * y[d])


def split_moving(
    atoms: FloatArray, count: int, y: FloatArray, mu: float, a: FloatArray, texture: Any
) -> bool:
    """Let the atoms of the system move with y, as feet do; return whether all are minima."""
    projection = local_array((3, 3))
    for i in range(count):
        if not split_projection(y, atoms, i, projection, texture):
            return False
        for r in range(3):
            for s in range(3):
                a[r, s] += mu * atoms[i, 3] * projection[r, s]
    return True


def split_copy(source: FloatArray, target: FloatArray, count: int) -> None:
    """Copy the first rows."""
    for i in range(count):
        for d in range(4):
            target[i, d] = source[i, d]


def split_weights(atoms: FloatArray, count: int, p: FloatArray, mu: float, a: FloatArray) -> int:
    """Write the optimal weights, drop the atoms without weight, return how many are left.

    The last atom is new and nearer to y than the others, so it has weight; every subset of the
    others is tried, the largest first, until one satisfies all conditions of optimality. If
    rounding lets none do so, the one that comes nearest is taken; -1 if there is none.
    """
    trial = local_array((4, 4))
    best = local_array((4, 4))
    y = local_array((3,))
    left: Any = np.int64(-1)
    least = np.inf
    for mask in range((1 << (count - 1)) - 1, -1, -1):
        if mask == 15:
            continue  # in space at most four atoms are needed (Carathéodory)
        n: Any = np.int64(0)
        for i in range(count):
            if i == count - 1 or mask >> i & 1:
                for d in range(3):
                    trial[n, d] = atoms[i, d]
                trial[n, 3] = 0.0
                n += 1
        for d in range(3):
            y[d] = p[d]
        split_system(trial, n, p, y, mu, a)
        if not split_solve(a, 3 + n, 4 + n):
            continue
        inside = True
        for i in range(n):
            trial[i, 3] = a[3 + i, 3 + n]
            inside = inside and trial[i, 3] > 0.0
        if not inside:
            continue
        for d in range(3):
            y[d] += a[d, 3 + n]
        violation = 0.0
        for i in range(count):
            violation = max(violation, split_farther(atoms, count - 1, i, y))
        if violation < least:
            least = violation
            left = n
            split_copy(trial, best, n)
        if violation == 0.0:
            break
    split_copy(best, atoms, left)
    return int(left)


def split_polish(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray,
    texture: Any,
) -> int:  # fmt: skip
    """Make atoms, weights and y satisfy the conditions of optimality.

    Atoms whose weight would be negative are dropped.

    Returns:
        How many atoms are left; 0 for failure.
    """
    scale = 0.0
    for d in range(3):
        scale += p[d] * p[d] + y[d] * y[d]
    last = np.inf
    stalled = 0
    for _ in range(20):
        for i in range(count):
            if not split_follow(y, atoms, i, texture):
                return 0
        n = 3 + count
        split_system(atoms, count, p, y, mu, a)
        if not (split_moving(atoms, count, y, mu, a, texture) and split_solve(a, n, n + 1)):
            return 0
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
        stalled += size >= 0.25 * last
        last = size
        if left == count and (stalled > 2 or size <= 1e-28 * scale):
            return count
        count = left
    return 0


def split_try_polish(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray,
    texture: Any,
) -> int:  # fmt: skip
    """Polish; take everything back and return 0 if that does not lower the energy."""
    pull = local_array((3,))
    before = local_array((5, 4))
    split_copy(atoms, before, count)
    for d in range(3):
        before[4, d] = y[d]
    value = split_value(atoms, count, p, mu, pull)
    left = split_polish(atoms, count, p, y, mu, a, texture)
    # Equal energies are the rule where the atoms have almost settled.
    if left > 0 and split_value(atoms, left, p, mu, pull) <= value * (1.0 + 1e-14):
        return left
    split_copy(before, atoms, count)
    for d in range(3):
        y[d] = before[4, d]
    return 0


def split_gap(
    atoms: FloatArray, count: int, y: FloatArray, mu: float, scale: float
) -> tuple[float, float]:
    """Return the gap between primal and dual [m²], and how large rounding can make it.

    The atom in row ``count`` is the nearest to y.
    """
    gap = 0.0
    distance = 0.0
    for i in range(count):
        gap += atoms[i, 3] * split_farther(atoms, i, count, y)
    for d in range(3):
        distance += abs(atoms[count, d] - y[d])
    rounding = 4e-16 * (1.0 - mu) * distance * (distance + scale)
    return max((1.0 - mu) * gap, 0.0), rounding


def split_atoms(
    p: FloatArray, continuity: float, atoms: FloatArray, pull: FloatArray, texture: Any
) -> tuple[int, float]:
    """Write the atoms of law H and z̄ - p at a probe inside the body.

    Args:
        p: probe [m], shape (3,).
        continuity: c.
        atoms: out, (5, 4).
        pull: out, (3,) [m].
        texture: the arguments of the sampler.

    Returns:
        How many atoms, and the gap between primal and dual [m²]: the force is exact to
        k √(2 (1 + c) gap).
    """
    mu = 1.0 / (1.0 + continuity)
    a = local_array((7, 10))
    y = local_array((3,))
    projection = local_array((3, 3))
    scale = abs(p[0]) + abs(p[1]) + abs(p[2])
    # No literals: Numba compiles a function again for each literal that it is called with.
    first: Any = np.int64(0)
    count: Any = np.int64(1)
    split_query(p, atoms, first, texture)
    atoms[0, 3] = 1.0
    gap = np.inf
    doubts = 0
    for _ in range(60):
        split_value(atoms, count, p, mu, pull)
        for d in range(3):
            y[d] = p[d] - pull[d] / continuity
        polished = split_try_polish(atoms, count, p, y, mu, a, texture) if count > 1 else 0
        if polished > 0:
            count = polished
            # From y, not from the weights: they are ill-conditioned where atoms meet.
            for d in range(3):
                pull[d] = continuity * (p[d] - y[d])
        split_query(y, atoms, count, texture)
        gap, rounding = split_gap(atoms, count, y, mu, scale)
        if gap <= rounding:
            # Where a god-object begins to split, its atoms are so close that distances differ by
            # less than rounding; but then its only atom is no local minimum as seen from y.
            doubts += 1
            if count == 1 and split_projection(y, atoms, first, projection, texture):
                break
            if polished > 0 or doubts > 6:
                break
        left = split_weights(atoms, count + 1, p, mu, a)
        if left < 0:
            break  # rounding: no better weights are known than these
        count = left
    return count, gap


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: Any
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    p[0] = x
    p[1] = y
    p[2] = z
    split_atoms(p, continuity, atoms, pull, texture)
    return pull[0], pull[1], pull[2]


def split_energy(
    x: float, y: float, z: float, continuity: float, texture: Any
) -> tuple[float, int, float]:
    """Return U [m²], the number of atoms, and the gap between primal and dual [m²]."""
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    p[0] = x
    p[1] = y
    p[2] = z
    count, gap = split_atoms(p, continuity, atoms, pull, texture)
    return split_value(atoms, count, p, 1.0 / (1.0 + continuity), pull), count, gap


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: Any
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and M = ∂(z̄ - p)/∂p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz.

    One atom: P - I with P the derivative of the foot. Several: z̄ = (p - (1 - μ) y)/μ with
    ∂y/∂p from the conditions of optimality, so M = c (I - ∂y/∂p).
    """
    atoms = local_array((5, 4))
    p = local_array((3,))
    pull = local_array((3,))
    far = local_array((3,))
    m = local_array((3, 3))
    a = local_array((7, 10))
    p[0] = x
    p[1] = y
    p[2] = z
    count, _gap = split_atoms(p, continuity, atoms, pull, texture)
    n = 3 + count
    for r in range(3):
        far[r] = p[r] - pull[r] / continuity
        for s in range(3):
            m[r, s] = 0.0
    if count == 1:
        if split_projection(p, atoms, count - 1, m, texture):
            for d in range(3):
                m[d, d] -= 1.0
    else:
        mu = 1.0 / (1.0 + continuity)
        split_system(atoms, count, p, far, mu, a)
        for r in range(n):
            for s in range(3):
                a[r, n + s] = 1.0 if r == s else 0.0
        if split_moving(atoms, count, far, mu, a, texture) and split_solve(a, n, n + 3):
            for r in range(3):
                for s in range(3):
                    m[r, s] = -continuity * a[r, n + s]
                m[r, r] += continuity
    return (
        pull[0], pull[1], pull[2], m[0, 0], 0.5 * (m[0, 1] + m[1, 0]), 0.5 * (m[0, 2] + m[2, 0]),
        m[1, 1], 0.5 * (m[1, 2] + m[2, 1]), m[2, 2],
    )  # fmt: skip
