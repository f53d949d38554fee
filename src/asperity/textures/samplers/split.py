"""The split god-object: the point between several nearest points to which law H pulls.

With F the free set (outside of the body), c > 0 and μ = 1/(1 + c), law H's potential is

    U(p) = min over weights m on F of ½ [(1 - μ) Σ λ_i |w_i - p|² + μ |z̄ - p|²],  z̄ = Σ λ_i w_i

and its force is k (z̄ - p) (MATH section 6, item 2). At the optimum every w_i is a nearest point of
y = p - (z̄ - p)/c, the maximiser of the dual U(p) = (1 - μ) max_y [dist²(y)/2 - |p - y|²/(2μ)].

Fully-corrective Frank-Wolfe: ask for the nearest point of y, add it to the atoms, solve for the
weights exactly, drop what has no weight. Once the atoms have settled, Newton's method on the
conditions of optimality makes them exact; a last global query certifies the gap between primal and
dual. ``nearest``, ``height`` and ``curvature`` are the sampler's own; the fused module binds them.
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


# fused from here

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def free_point(y: FloatArray, out: FloatArray, texture: Any) -> None:
    """Write the point of the free set nearest to y."""
    if height(y[0], y[1], *texture) <= y[2]:
        out[0] = y[0]
        out[1] = y[1]
        out[2] = y[2]
        return
    fx, fy = nearest(y[0], y[1], y[2], *texture)
    out[0] = fx
    out[1] = fy
    out[2] = height(fx, fy, *texture)


def solve_linear(a: FloatArray, b: FloatArray, n: int, columns: int) -> bool:
    """Solve a x = b in place by elimination with pivoting; return whether a is regular."""
    for i in range(n):
        pivot = i
        for r in range(i + 1, n):
            if abs(a[r, i]) > abs(a[pivot, i]):
                pivot = r
        if abs(a[pivot, i]) < 1e-300:
            return False
        if pivot != i:
            for j in range(n):
                a[i, j], a[pivot, j] = a[pivot, j], a[i, j]
            for j in range(columns):
                b[i, j], b[pivot, j] = b[pivot, j], b[i, j]
        for r in range(i + 1, n):
            factor = a[r, i] / a[i, i]
            if factor != 0.0:
                for j in range(i, n):
                    a[r, j] -= factor * a[i, j]
                for j in range(columns):
                    b[r, j] -= factor * b[i, j]
    for i in range(n - 1, -1, -1):
        for j in range(columns):
            total = b[i, j]
            for r in range(i + 1, n):
                total -= a[i, r] * b[r, j]
            b[i, j] = total / a[i, i]
    return True


def subset_weights(
    atoms: FloatArray, p: FloatArray, mu: float, mask: int, count: int, weights: FloatArray
) -> float:
    """Write the best weights on a subset of the atoms; return the value, infinite if outside."""
    index = np.empty(5, dtype=np.int64)
    n = 0
    for i in range(count):
        weights[i] = 0.0
        if mask >> i & 1:
            index[n] = i
            n += 1
    first = index[0]
    if n > 1:
        a = np.zeros((4, 4))
        b = np.zeros((4, 1))
        square0 = 0.0
        for d in range(3):
            square0 += (atoms[first, d] - p[d]) ** 2
        for i in range(n - 1):
            square = 0.0
            along = 0.0
            for d in range(3):
                square += (atoms[index[i + 1], d] - p[d]) ** 2
                edge = atoms[index[i + 1], d] - atoms[first, d]
                along += edge * (atoms[first, d] - p[d])
                for j in range(n - 1):
                    a[i, j] += mu * edge * (atoms[index[j + 1], d] - atoms[first, d])
            b[i, 0] = -0.5 * (1.0 - mu) * (square - square0) - mu * along
        if not solve_linear(a, b, n - 1, 1):
            return np.inf
        rest = 1.0
        for i in range(n - 1):
            if not b[i, 0] >= 0.0:
                return np.inf
            weights[index[i + 1]] = b[i, 0]
            rest -= b[i, 0]
        if not rest >= 0.0:
            return np.inf
        weights[first] = rest
    else:
        weights[first] = 1.0
    return primal_value(atoms, p, mu, count, weights)


def primal_value(
    atoms: FloatArray, p: FloatArray, mu: float, count: int, weights: FloatArray
) -> float:
    """Return ½ [(1 - μ) Σ λ_i |w_i - p|² + μ |z̄ - p|²]."""
    mean = 0.0
    squares = 0.0
    for d in range(3):
        pull = 0.0
        for i in range(count):
            away = atoms[i, d] - p[d]
            pull += weights[i] * away
            squares += weights[i] * away * away
        mean += pull * pull
    return 0.5 * ((1.0 - mu) * squares + mu * mean)


def best_weights(
    atoms: FloatArray, p: FloatArray, mu: float, count: int, weights: FloatArray
) -> int:
    """Write the optimal weights; drop the atoms without weight; return how many are left."""
    trial = np.empty(5)
    best = np.inf
    chosen = np.zeros(5)
    for mask in range(1, 1 << count):
        if mask == 31:
            continue  # in space at most four atoms are needed (Carathéodory)
        value = subset_weights(atoms, p, mu, mask, count, trial)
        if value < best:
            best = value
            for i in range(count):
                chosen[i] = trial[i]
    left = 0
    for i in range(count):
        if chosen[i] > 0.0:
            for d in range(3):
                atoms[left, d] = atoms[i, d]
            weights[left] = chosen[i]
            left += 1
    return left


def foot_projection(y: FloatArray, foot: FloatArray, out: FloatArray, texture: Any) -> bool:
    """Write ∂(foot)/∂y, (3, 3), of a foot on the surface; return whether it is a minimum."""
    _h, hx, hy, hxx, hxy, hyy = curvature(foot[0], foot[1], *texture)
    gap = foot[2] - y[2]
    q11 = 1.0 + hx * hx + gap * hxx
    q12 = hx * hy + gap * hxy
    q22 = 1.0 + hy * hy + gap * hyy
    det = q11 * q22 - q12 * q12
    if det <= 0.0 or q11 + q22 <= 0.0:
        return False
    r11 = q22 / det
    r12 = -q12 / det
    r22 = q11 / det
    out[0, 0] = r11
    out[0, 1] = r12
    out[1, 1] = r22
    out[0, 2] = r11 * hx + r12 * hy
    out[1, 2] = r12 * hx + r22 * hy
    out[2, 2] = out[0, 2] * hx + out[1, 2] * hy
    out[1, 0] = out[0, 1]
    out[2, 0] = out[0, 2]
    out[2, 1] = out[1, 2]
    return True


def follow_foot(y: FloatArray, foot: FloatArray, texture: Any) -> bool:
    """Move a foot to the stationary point near it that belongs to y; return success."""
    fx = foot[0]
    fy = foot[1]
    last = np.inf
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
        size = sx * sx + sy * sy
        if size >= 0.25 * last:
            break
        fx += sx
        fy += sy
        last = size
    foot[0] = fx
    foot[1] = fy
    foot[2] = height(fx, fy, *texture)
    return True


def optimality_system(
    atoms: FloatArray, weights: FloatArray, p: FloatArray, y: FloatArray, mu: float, count: int,
    a: FloatArray, texture: Any,
) -> bool:  # fmt: skip
    """Write the Jacobian of the conditions of optimality in (y, λ).

    (1 - μ) (y - p) + μ Σ λ_i (w_i(y) - p) = 0; |y - w_i| equal; Σ λ_i = 1.
    """
    projection = np.empty((3, 3))
    for i in range(3 + count):
        for j in range(3 + count):
            a[i, j] = 0.0
    for d in range(3):
        a[d, d] = 1.0 - mu
    for i in range(count):
        if not foot_projection(y, atoms[i], projection, texture):
            return False
        for r in range(3):
            for s in range(3):
                a[r, s] += mu * weights[i] * projection[r, s]
            a[r, 3 + i] = mu * (atoms[i, r] - p[r])
        a[3, 3 + i] = 1.0
        if i > 0:
            for s in range(3):
                a[3 + i, s] = atoms[0, s] - atoms[i, s]
    return True


def newton_polish(
    atoms: FloatArray, weights: FloatArray, p: FloatArray, mu: float, count: int, texture: Any
) -> bool:
    """Make atoms and weights satisfy the conditions of optimality; return success."""
    c = (1.0 - mu) / mu
    y = np.empty(3)
    a = np.empty((7, 7))
    b = np.empty((7, 1))
    for d in range(3):
        pull = 0.0
        for i in range(count):
            pull += weights[i] * (atoms[i, d] - p[d])
        y[d] = p[d] - pull / c
    last = np.inf
    for _ in range(20):
        for i in range(count):
            if not follow_foot(y, atoms[i], texture):
                return False
        if not optimality_system(atoms, weights, p, y, mu, count, a, texture):
            return False
        for d in range(3):
            total = (1.0 - mu) * (p[d] - y[d])
            for i in range(count):
                total -= mu * weights[i] * (atoms[i, d] - p[d])
            b[d, 0] = total
        b[3, 0] = 0.0
        for i in range(1, count):
            difference = 0.0
            for d in range(3):
                # |y - w_i|² - |y - w_0|² as a product: no cancellation of squares.
                difference += (atoms[0, d] - atoms[i, d]) * (2.0 * y[d] - atoms[i, d] - atoms[0, d])
            b[3 + i, 0] = -0.5 * difference
        if not solve_linear(a, b, 3 + count, 1):
            return False
        size = 0.0
        for d in range(3):
            size += b[d, 0] * b[d, 0]
        if size >= 0.25 * last:
            break
        last = size
        for d in range(3):
            y[d] += b[d, 0]
        for i in range(count):
            weights[i] += b[3 + i, 0]
    for i in range(count):
        if not weights[i] > 0.0:
            return False
        if not follow_foot(y, atoms[i], texture):
            return False
    return True


def split_atoms(
    x: float, y: float, z: float, continuity: float, atoms: FloatArray, weights: FloatArray,
    texture: Any,
) -> tuple[int, float]:  # fmt: skip
    """Write the atoms (w_i, λ_i) of law H at a probe inside the body.

    Args:
        x: probe.
        y: probe.
        z: probe [m].
        continuity: c.
        atoms: out, (5, 3) [m].
        weights: out, (5,).
        texture: the arguments of the sampler.

    Returns:
        How many atoms, and the gap between primal and dual potential [m²]: the force is exact to
        k √(2 (1 + c) gap).
    """
    mu = 1.0 / (1.0 + continuity)
    p = np.array([x, y, z])
    far = np.empty(3)
    free_point(p, atoms[0], texture)
    weights[0] = 1.0
    count = 1
    gap = np.inf
    polished = False
    for _ in range(60):
        value = primal_value(atoms, p, mu, count, weights)
        pulled = 0.0
        for d in range(3):
            pull = 0.0
            for i in range(count):
                pull += weights[i] * (atoms[i, d] - p[d])
            far[d] = p[d] - pull / continuity
            pulled += pull * pull
        free_point(far, atoms[count], texture)
        square = 0.0
        for d in range(3):
            square += (atoms[count, d] - far[d]) ** 2
        bound = 0.5 * (1.0 - mu) * square
        penalty = 0.5 * (1.0 - mu) * pulled / (mu * continuity * continuity)
        gap = max(value - (bound - penalty), 0.0)
        rounding = 2e-15 * (value + bound + penalty)
        # A single atom is exact as soon as it is also the nearest point of y; several are only
        # accurate to the root of the gap, so they are polished before they are believed.
        if gap <= rounding and (count == 1 or polished):
            break
        if count > 1 and not polished and gap <= max(0.02 * value, rounding):
            before = atoms.copy()
            weight_before = weights.copy()
            if newton_polish(atoms, weights, p, mu, count, texture):
                polished = True
                continue
            for i in range(count):
                for d in range(3):
                    atoms[i, d] = before[i, d]
                weights[i] = weight_before[i]
        polished = False
        count = best_weights(atoms, p, mu, count + 1, weights)
    return count, gap


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: Any
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    atoms = np.empty((5, 3))
    weights = np.empty(5)
    count, _gap = split_atoms(x, y, z, continuity, atoms, weights, texture)
    tx = ty = tz = 0.0
    for i in range(count):
        tx += weights[i] * (atoms[i, 0] - x)
        ty += weights[i] * (atoms[i, 1] - y)
        tz += weights[i] * (atoms[i, 2] - z)
    return tx, ty, tz


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: Any
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and M = ∂(z̄ - p)/∂p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz.

    One atom: P - I with P the derivative of the foot. Several: z̄ = (p - (1 - μ) y)/μ with
    ∂y/∂p from the conditions of optimality, so M = c (I - ∂y/∂p).
    """
    atoms = np.empty((5, 3))
    weights = np.empty(5)
    count, _gap = split_atoms(x, y, z, continuity, atoms, weights, texture)
    tx = ty = tz = 0.0
    for i in range(count):
        tx += weights[i] * (atoms[i, 0] - x)
        ty += weights[i] * (atoms[i, 1] - y)
        tz += weights[i] * (atoms[i, 2] - z)
    m = np.zeros((3, 3))
    if count == 1:
        p = np.array([x, y, z])
        if foot_projection(p, atoms[0], m, texture):
            for d in range(3):
                m[d, d] -= 1.0
    else:
        mu = 1.0 / (1.0 + continuity)
        p = np.array([x, y, z])
        far = np.array([x - tx / continuity, y - ty / continuity, z - tz / continuity])
        a = np.empty((7, 7))
        b = np.zeros((7, 3))
        for d in range(3):
            b[d, d] = 1.0
        if optimality_system(atoms, weights, p, far, mu, count, a, texture) and solve_linear(
            a, b, 3 + count, 3
        ):
            for r in range(3):
                for s in range(3):
                    m[r, s] = -continuity * b[r, s]
                m[r, r] += continuity
    return (
        tx, ty, tz, m[0, 0], 0.5 * (m[0, 1] + m[1, 0]), 0.5 * (m[0, 2] + m[2, 0]),
        m[1, 1], 0.5 * (m[1, 2] + m[2, 1]), m[2, 2],
    )  # fmt: skip
