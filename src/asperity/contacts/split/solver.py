"""The split god-object: the point between several nearest points to which law H pulls.

With F the free set (outside of the body), c > 0 and μ = 1/(1 + c), law H's potential is

    U(p) = min over weights m on F of ½ [|p - z̄|² + (1 - μ) Σ λ_i |w_i - z̄|²],  z̄ = Σ λ_i w_i

and its force is k (z̄ - p) (MATH section 6, item 2). At the optimum every atom w_i is a nearest
point of y = p - (z̄ - p)/c, the maximiser of the dual
U(p) = (1 - μ) max_y [dist²(y)/2 - |p - y|²/(2μ)].

Fully-corrective Frank-Wolfe: ask for the nearest point of y, add it to the atoms, solve for the
weights exactly, drop what has no weight, and let Newton's method on the conditions of optimality
move the feet along with y. The last query certifies the gap between primal and dual.

With a budget of looks the queries may leave a gap of their own: of y at most ``d`` from an atom, no
point is nearer than d - g. The dual then is known to be at least what it is with d - g in the place
of d, which adds (1 - μ) (d² - (d - g)²)/2 to the gap between primal and dual; what follows from the
sum holds as it does without a budget. The bound of the force: by its weights, U is nowhere above a
parabola m with second derivatives 1 that has the value U(p) + gap and the gradient p - z̄ at p, and
above p it is nowhere below one with its own gradient f and second derivatives -c. So
gap + (p - z̄ - f)·t + (1 + c) |t|²/2 >= 0 for all t, that is |p - z̄ - f| <= √(2 (1 + c) gap).

Rows of ``atoms`` are x, y, z [m] and weight.
"""

import math
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import EPS, Kernels, local_array
from asperity.contacts.sampler import foot_within, height, look_cost
from asperity.contacts.split.conditions import (
    split_copy,
    split_farther,
    split_follow,
    split_moving,
    split_projection,
    split_solve,
    split_system,
    split_value,
)

KERNELS = Kernels(
    provides=("split_atoms",),
    requires=(
        "foot_within", "height", "look_cost", "split_copy", "split_farther", "split_follow",
        "split_moving", "split_projection", "split_solve", "split_system", "split_value",
    ),
    merged=("split_polish", "split_try_polish"),
    iterates=True,
)  # fmt: skip

# Of a foot by Newton's method before the atoms are solved for together; more do not pay.
STEPS = 2


def split_query(
    y: FloatArray, atoms: FloatArray, row: int, budget: float, texture: object
) -> tuple[float, float]:
    """Write the point of the free set nearest to y into a row of the atoms.

    Returns:
        How much nearer another one may be [m], and the looks that were taken.
    """
    fx = y[0]
    fy = y[1]
    fz = y[2]
    gap = 0.0
    looks = look_cost(texture)
    if height(fx, fy, texture) > fz:
        # An atom is a good start: at the optimum it is a nearest point itself.
        near_x = atoms[0, 0] if row > 0 else fx
        near_y = atoms[0, 1] if row > 0 else fy
        fx, fy, _h, _hx, _hy, gap, looks = foot_within(fx, fy, fz, near_x, near_y, budget, texture)
        fz = height(fx, fy, texture)
    atoms[row, 0] = fx
    atoms[row, 1] = fy
    atoms[row, 2] = fz
    atoms[row, 3] = 0.0
    return gap, looks


def split_subset(
    atoms: FloatArray, count: int, mask: int, p: FloatArray, mu: float, a: FloatArray,
    trial: FloatArray, y: FloatArray,
) -> int:  # fmt: skip
    """Write the best weights on the last atom and a subset of the others, and y.

    Returns:
        How many atoms; 0 if a weight is not positive.
    """
    # No literals: Numba compiles a function again for each literal that it is called with.
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
        return 0
    for i in range(n):
        trial[i, 3] = a[3 + i, 3 + n]
        if not trial[i, 3] > 0.0:
            return 0
    for d in range(3):
        y[d] += a[d, 3 + n]
    return int(n)


def split_weights(atoms: FloatArray, count: int, p: FloatArray, mu: float, a: FloatArray) -> int:
    """Write the optimal weights, drop the atoms without weight, return how many are left.

    The last atom is new and nearer to y than the others, so it has weight; every subset of the
    others is tried, the largest first, until one satisfies all conditions of optimality. If
    rounding lets none do so, the one that comes nearest is taken; 0 if there is none.
    """
    trial = local_array((4, 4))
    best = local_array((4, 4))
    y = local_array((3,))
    left: Any = np.int64(0)
    least = np.inf
    for mask in range((1 << (count - 1)) - 1, -1, -1):
        # In space at most four atoms are needed (Carathéodory).
        n = split_subset(atoms, count, mask, p, mu, a, trial, y) if mask != 15 else 0
        if n == 0:
            continue
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


def split_advance(atoms: FloatArray, count: int, y: FloatArray, a: FloatArray) -> tuple[int, float]:
    """Take the step that the solved system holds, and drop atoms without weight.

    Returns:
        How many atoms are left, and the square of the step of y [m²].
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


def split_polish(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray,
    budget: float, texture: object,
) -> tuple[int, float]:  # fmt: skip
    """Make atoms, weights and y satisfy the conditions of optimality, by Newton's method.

    Returns:
        How many atoms are left, 0 for failure, and the looks that were taken.
    """
    nothing: Any = np.int64(0)
    looks = 0.0
    scale = 0.0
    for d in range(3):
        scale += p[d] * p[d] + y[d] * y[d]
    last = np.inf
    stalled = 0
    most: Any = np.int64(STEPS)
    for _ in range(25):
        for i in range(count):
            found, taken = split_follow(y, atoms, i, most, texture)
            looks += taken
            if not found or looks > budget:
                return nothing, looks
        split_system(atoms, count, p, y, mu, a)
        moving = split_moving(atoms, count, y, mu, a, texture)
        looks += count * look_cost(texture)
        if not (moving and split_solve(a, 3 + count, 4 + count)):
            return nothing, looks
        left, size = split_advance(atoms, count, y, a)
        stalled += size >= 0.25 * last
        last = size
        if left == count and (stalled > 2 or size <= 2000.0 * EPS * EPS * scale):
            return count, looks
        count = left
    return nothing, looks


def split_try_polish(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, mu: float, a: FloatArray,
    budget: float, texture: object,
) -> tuple[int, float]:  # fmt: skip
    """Polish; take everything back and return 0 if that does not lower the energy.

    Returns:
        How many atoms are left, and the looks that were taken.
    """
    nothing: Any = np.int64(0)
    pull = local_array((3,))
    before = local_array((5, 4))
    split_copy(atoms, before, count)
    for d in range(3):
        before[4, d] = y[d]
    value = split_value(atoms, count, p, mu, pull)
    left, looks = split_polish(atoms, count, p, y, mu, a, budget, texture)
    # Equal energies are the rule where the atoms have almost settled.
    if left > 0 and split_value(atoms, left, p, mu, pull) <= value * (1.0 + 45.0 * EPS):
        return left, looks
    split_copy(before, atoms, count)
    for d in range(3):
        y[d] = before[4, d]
    return nothing, looks


def split_single(atoms: FloatArray, y: FloatArray, texture: object) -> bool:
    """Return whether the only atom is a local minimum of the distance, as seen from y.

    Where a god-object begins to split, its atoms are so close that their distances differ by less
    than rounding; but then the point between them is none.
    """
    projection = local_array((3, 3))
    first: Any = np.int64(0)
    return split_projection(y, atoms, first, projection, texture)


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
    rounding = 2.0 * EPS * (1.0 - mu) * distance * (distance + scale)
    return max((1.0 - mu) * gap, 0.0), rounding


def split_settle(
    atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, pull: FloatArray,
    continuity: float, a: FloatArray, budget: float, texture: object,
) -> tuple[int, float]:  # fmt: skip
    """Write y and z̄ - p, ``pull``, of atoms with weights; several are polished first if they can.

    Returns:
        How many atoms the polish left, 0 without one, and the looks that were taken.
    """
    solved: Any = np.int64(0)
    looks = 0.0
    mu = 1.0 / (1.0 + continuity)
    split_value(atoms, count, p, mu, pull)
    for d in range(3):
        y[d] = p[d] - pull[d] / continuity
    if count > 1:
        solved, looks = split_try_polish(atoms, count, p, y, mu, a, budget, texture)
    if solved > 0:
        # From y, not from the weights: they are ill-conditioned where atoms meet.
        for d in range(3):
            pull[d] = continuity * (p[d] - y[d])
    return solved, looks


def split_start(
    atoms: FloatArray, known: int, p: FloatArray, y: FloatArray, pull: FloatArray,
    continuity: float, a: FloatArray, budget: float, texture: object,
) -> tuple[int, int, float]:  # fmt: skip
    """Write the atoms to begin with, y and z̄ - p: those of a probe nearby, moved, or one foot.

    Their old weights would take y off the place to which all are equally near, and Newton's method
    with it: first come those that are best while the atoms stay.

    Returns:
        How many atoms, how many of them are polished, and the looks that were taken.
    """
    first: Any = np.int64(0)
    solved: Any = first
    looks = 0.0
    if known > 1:
        trial = local_array((4, 4))
        every: Any = (1 << known) - 1
        mu = 1.0 / (1.0 + continuity)
        if split_subset(atoms, known, every, p, mu, a, trial, y) == known:
            split_copy(trial, atoms, known)
        solved, looks = split_settle(
            atoms, known, p, y, pull, continuity, a, 0.25 * budget, texture
        )
        if solved > 0:
            return solved, solved, looks
    found = False
    to_end: Any = np.int64(25)
    if known == 1:
        found, looks = split_follow(p, atoms, first, to_end, texture)
    if not found:
        _gap, taken = split_query(p, atoms, first, budget, texture)
        looks += taken
    atoms[0, 3] = 1.0
    one: Any = np.int64(1)
    split_settle(atoms, one, p, y, pull, continuity, a, 0.0, texture)
    return one, first, looks


def split_atoms(
    x: float, y: float, z: float, continuity: float, known: int, budget: float,
    p: FloatArray, atoms: FloatArray, pull: FloatArray, texture: object,
) -> tuple[int, float, float, bool]:  # fmt: skip
    """Write p (3,), the atoms of law H (5, 4) and z̄ - p, ``pull`` (3,), at a probe inside.

    Args:
        x: of the probe [m].
        y: likewise.
        z: likewise.
        continuity: c.
        known: how many rows of ``atoms`` hold those of a probe nearby, with their weights.
        budget: looks that may be taken, a quarter of them by a query.
        p: result.
        atoms: result.
        pull: result.
        texture: record of the texture.

    Returns:
        How many atoms, the gap between primal and dual [m²], the looks that were taken, and whether
        the budget was not enough: the force is exact to k √(2 (1 + c) gap).
    """
    mu = 1.0 / (1.0 + continuity)
    a = local_array((7, 10))
    at = local_array((3,))
    p[0] = x
    p[1] = y
    p[2] = z
    scale = abs(p[0]) + abs(p[1]) + abs(p[2])
    each = 0.25 * budget
    doubts = 0
    count, solved, looks = split_start(atoms, known, p, at, pull, continuity, a, each, texture)
    for _ in range(60):
        unsure, taken = split_query(at, atoms, count, each, texture)
        looks += taken
        gap, rounding = split_gap(atoms, count, at, mu, scale)
        nearest = gap <= rounding
        gap += split_doubt(atoms, count, at, mu, unsure)
        if nearest:
            doubts += 1
            single = count == 1 and split_single(atoms, at, texture)
            if solved > 0 or doubts > 6 or single or unsure > 0.0:
                return count, gap, looks, unsure > 0.0
        # What a round may take is kept in reserve.
        if looks >= 0.5 * budget:
            return count, gap, looks, True
        left = split_weights(atoms, count + 1, p, mu, a)
        if left == 0:
            break  # rounding: no better weights are known than these
        count = left
        solved, taken = split_settle(atoms, count, p, at, pull, continuity, a, 0.25 * each, texture)
        looks += taken
        count = solved if solved > 0 else count
    return count, gap, looks, False


def split_doubt(atoms: FloatArray, count: int, y: FloatArray, mu: float, gap: float) -> float:
    """Return what the gap of a query [m] adds to that between primal and dual [m²]."""
    square = 0.0
    for d in range(3):
        square += (atoms[count, d] - y[d]) ** 2
    return (1.0 - mu) * gap * (math.sqrt(square) - 0.5 * gap)
