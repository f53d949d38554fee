"""Solver of the split god-object: the mean of several closest points to which law H pulls.

With F the free set (outside of the body), c > 0 and μ = 1/(1 + c), law H's potential is

    U(p) = min over weights m on F of ½ [|p - z̄|² + (1 - μ) Σ λ_i |w_i - z̄|²],  z̄ = Σ λ_i w_i

and its force is k (z̄ - p) (docs/theory/split.md). At the optimum every atom w_i is a closest
point of y = p - (z̄ - p)/c, the maximiser of the dual
U(p) = (1 - μ) max_y [dist²(y)/2 - |p - y|²/(2μ)].

The method is fully-corrective Frank-Wolfe. Each iteration queries the closest point of y, adds it
to the atoms, solves for the weights exactly, drops atoms without weight, and moves the atoms along
with y by Newton's method on the optimality conditions. The last query certifies the duality gap;
before it, any point closer than the atoms improves y, and one near an atom is found at little cost.

With an evaluation budget the queries may have an error bound g: y is at most d from an atom, and no
point is closer than d - g. The dual is then at least its value with d - g in place of d, which adds
(1 - μ) (d² - (d - g)²)/2 to the duality gap; the consequences hold as without a budget. Bound of
the force: by its weights, U is nowhere above a parabola with second derivatives 1, the value
U(p) + gap and the gradient p - z̄ at p, and nowhere below one with its own gradient f at p and
second derivatives -c. So gap + (p - z̄ - f)·t + (1 + c) |t|²/2 >= 0 for all t, that is
|p - z̄ - f| <= √(2 (1 + c) gap).

Rows of ``atoms`` are x, y, z [m] and weight.
"""

import math
from typing import Any

import numpy as np

from asperity.contacts.sampler_interface import (
    closest_point_within_budget,
    evaluation_cost,
    sample_height,
)
from asperity.contacts.split_optimality import (
    split_add_atom_motion,
    split_apply_step,
    split_assemble_system,
    split_closest_derivative,
    split_copy_atoms,
    split_duality_gap,
    split_evaluate_energy,
    split_solve_linear,
    split_solve_subset,
    split_solve_weights,
    split_track_point,
)
from asperity.core.compiled import EPS, FloatArray, Kernels, local_array

KERNELS = Kernels(provides=("split_compute_atoms",), shared=("split_compute_atoms",), iterates=True)

# Newton steps of each atom before the joint solution; more do not pay.
NEWTON_STEPS = 2
# Evaluations of a short search for a point closer than the atoms, and of one near an atom.
SHORT_SEARCH = 150.0
NEARBY_SEARCH = 24.0
# Iterations after which every search is for the closest point.
NEARBY_ITERATIONS = 20


def split_query(
    y: FloatArray, atoms: FloatArray, row: int, budget: float, texture: object
) -> tuple[float, float]:
    """Write the point of the free set closest to y into a row of the atoms.

    Returns:
        The error bound of its distance [m] and the evaluations.
    """
    fx = y[0]
    fy = y[1]
    fz = y[2]
    gap = 0.0
    evaluations = evaluation_cost(texture)
    if sample_height(fx, fy, texture) > fz:
        # An atom is a good start: at the optimum it is a closest point itself.
        near_x = atoms[0, 0] if row > 0 else fx
        near_y = atoms[0, 1] if row > 0 else fy
        fx, fy, _h, _hx, _hy, gap, evaluations = closest_point_within_budget(
            fx, fy, fz, near_x, near_y, budget, texture
        )
        fz = sample_height(fx, fy, texture)
    atoms[row, 0] = fx
    atoms[row, 1] = fy
    atoms[row, 2] = fz
    atoms[row, 3] = 0.0
    return gap, evaluations


def split_newton(
    atoms: FloatArray,
    count: int,
    p: FloatArray,
    y: FloatArray,
    mu: float,
    a: FloatArray,
    budget: float,
    texture: object,
) -> tuple[int, float]:
    """Solve the optimality conditions for atoms, weights and y by Newton's method.

    Returns:
        The number of atoms left, 0 for failure, and the evaluations.
    """
    zero: Any = np.int64(0)
    evaluations = 0.0
    scale = 0.0
    for d in range(3):
        scale += p[d] * p[d] + y[d] * y[d]
    last = np.inf
    stalled = 0
    max_steps: Any = np.int64(NEWTON_STEPS)
    for _ in range(25):
        for i in range(count):
            found, taken = split_track_point(y, atoms, i, max_steps, texture)
            evaluations += taken
            if not found or evaluations > budget:
                return zero, evaluations
        split_assemble_system(atoms, count, p, y, mu, a)
        moving = split_add_atom_motion(atoms, count, y, mu, a, texture)
        evaluations += count * evaluation_cost(texture)
        if not (moving and split_solve_linear(a, 3 + count, 4 + count)):
            return zero, evaluations
        left, size = split_apply_step(atoms, count, y, a)
        stalled += size >= 0.25 * last
        last = size
        # Rounding may end convergence early; large steps repeat, and y is not that of the weights.
        tolerance = 5000.0 * EPS if stalled > 2 else 2000.0 * EPS * EPS
        if left == count and size <= tolerance * scale:
            return count, evaluations
        count = left
    return zero, evaluations


def split_try_newton(
    atoms: FloatArray,
    count: int,
    p: FloatArray,
    y: FloatArray,
    mu: float,
    a: FloatArray,
    budget: float,
    texture: object,
) -> tuple[int, float]:
    """Apply Newton's method; undo it and return 0 if it does not lower the energy.

    Returns:
        The number of atoms left and the evaluations.
    """
    zero: Any = np.int64(0)
    pull = local_array((3,))
    before = local_array((5, 4))
    split_copy_atoms(atoms, before, count)
    for d in range(3):
        before[4, d] = y[d]
    value = split_evaluate_energy(atoms, count, p, mu, pull)
    left, evaluations = split_newton(atoms, count, p, y, mu, a, budget, texture)
    # Equal energies are usual where the atoms have almost converged.
    if left > 0 and split_evaluate_energy(atoms, left, p, mu, pull) <= value * (1.0 + 45.0 * EPS):
        return left, evaluations
    split_copy_atoms(before, atoms, count)
    for d in range(3):
        y[d] = before[4, d]
    return zero, evaluations


def split_is_local_minimum(atoms: FloatArray, y: FloatArray, texture: object) -> bool:
    """Return whether the only atom is a local minimum of the distance from y.

    Where a god-object begins to split, its atoms are so close that their distances differ by less
    than rounding; the point between them is then not a minimum.
    """
    projection = local_array((3, 3))
    first: Any = np.int64(0)
    return split_closest_derivative(y, atoms, first, projection, texture)


def split_update_dual(
    atoms: FloatArray,
    count: int,
    p: FloatArray,
    y: FloatArray,
    offset: FloatArray,
    continuity: float,
    a: FloatArray,
    budget: float,
    texture: object,
) -> tuple[int, float]:
    """Write y and z̄ - p, ``offset``, of atoms with weights; several are refined by Newton's method.

    Returns:
        The number of atoms after a successful refinement, else 0, and the evaluations.
    """
    solved: Any = np.int64(0)
    evaluations = 0.0
    mu = 1.0 / (1.0 + continuity)
    split_evaluate_energy(atoms, count, p, mu, offset)
    for d in range(3):
        y[d] = p[d] - offset[d] / continuity
    if count > 1:
        solved, evaluations = split_try_newton(atoms, count, p, y, mu, a, budget, texture)
    if solved > 0:
        # From y, not from the weights: they are ill-conditioned where atoms meet.
        for d in range(3):
            offset[d] = continuity * (p[d] - y[d])
    return solved, evaluations


def split_initialize(
    atoms: FloatArray,
    warm_count: int,
    p: FloatArray,
    y: FloatArray,
    offset: FloatArray,
    continuity: float,
    a: FloatArray,
    budget: float,
    texture: object,
) -> tuple[int, int, float]:
    """Write the initial atoms, y and z̄ - p: moved atoms of a nearby probe, or one surface point.

    The old weights would move y away from the point that is equally far from all atoms, where
    Newton's method converges; the optimal weights of the fixed atoms come first.

    Returns:
        The number of atoms, of refined atoms, and of evaluations.
    """
    first: Any = np.int64(0)
    one: Any = np.int64(1)
    mu = 1.0 / (1.0 + continuity)
    straight = sample_height(p[0], p[1], texture) - p[2]
    if warm_count > 1 and split_evaluate_energy(atoms, warm_count, p, mu, offset) < (
        0.5 * straight * straight
    ):
        trial = local_array((4, 4))
        every: Any = (1 << warm_count) - 1
        if split_solve_subset(atoms, warm_count, every, p, mu, a, trial, y) == warm_count:
            split_copy_atoms(trial, atoms, warm_count)
        solved, evaluations = split_update_dual(
            atoms, warm_count, p, y, offset, continuity, a, 0.25 * budget, texture
        )
        return (solved if solved > 0 else warm_count), solved, evaluations
    found = False
    evaluations = 0.0
    max_steps: Any = np.int64(25)
    if warm_count == 1:
        found, evaluations = split_track_point(p, atoms, first, max_steps, texture)
    if not found:
        short = min(SHORT_SEARCH * evaluation_cost(texture), 0.25 * budget)
        _gap, taken = split_query(p, atoms, first, short, texture)
        evaluations += taken
    atoms[0, 3] = 1.0
    split_update_dual(atoms, one, p, y, offset, continuity, a, 0.0, texture)
    return one, first, evaluations


def split_query_nearby(y: FloatArray, atoms: FloatArray, count: int, texture: object) -> float:
    """Write the closest of the local minima near the atoms into the row after them.

    Returns:
        The evaluations.
    """
    trial = local_array((2, 4))
    one: Any = np.int64(1)
    max_steps: Any = np.int64(25)
    best = np.inf
    evaluations = 0.0
    for i in range(count):
        for d in range(4):
            trial[0, d] = trial[1, d] = atoms[i, d]
        found, taken = split_track_point(y, trial, one, max_steps, texture)
        evaluations += taken
        if not found:
            _gap, taken = split_query(
                y, trial, one, NEARBY_SEARCH * evaluation_cost(texture), texture
            )
            evaluations += taken
        square = 0.0
        for d in range(3):
            square += (trial[1, d] - y[d]) ** 2
        if square < best:
            best = square
            for d in range(3):
                atoms[count, d] = trial[1, d]
    atoms[count, 3] = 0.0
    return evaluations


def split_query_closer(
    y: FloatArray,
    atoms: FloatArray,
    count: int,
    is_final: bool,
    mu: float,
    scale: float,
    budget: float,
    texture: object,
) -> tuple[float, float, float, float]:
    """Write a point closer to y than the atoms into the row after them, or the closest one.

    The closest one is needed to show that y is final. Otherwise any closer one improves y: it is
    searched near the atoms, then by a short search.

    Returns:
        The duality gap [m²], its possible rounding error, the error bound of the distance [m] of
        the closest point, infinite if it is unknown, and the evaluations.
    """
    error_bound = np.inf
    evaluations = 0.0
    gap = rounding = 0.0
    for stage in range(2 if is_final else 0, 3):
        if stage == 0:
            evaluations += split_query_nearby(y, atoms, count, texture)
        else:
            left = budget - evaluations
            if stage == 1:
                left = min(SHORT_SEARCH * evaluation_cost(texture), 0.5 * left)
            error_bound, taken = split_query(y, atoms, count, left, texture)
            evaluations += taken
        gap, rounding = split_duality_gap(atoms, count, y, mu, scale)
        if error_bound == 0.0 or gap > 1e3 * rounding:
            break
    return gap, rounding, error_bound, evaluations


def split_compute_atoms(
    x: float,
    y: float,
    z: float,
    continuity: float,
    warm_count: int,
    budget: float,
    p: FloatArray,
    atoms: FloatArray,
    offset: FloatArray,
    texture: object,
) -> tuple[int, float, float, bool]:
    """Write p (3,), the atoms of law H (5, 4) and z̄ - p, ``offset`` (3,), at a probe inside.

    Args:
        x: of the probe [m].
        y: likewise.
        z: likewise.
        continuity: c.
        warm_count: number of rows of ``atoms`` that hold the atoms of a nearby probe with weights.
        budget: evaluations allowed.
        p: result.
        atoms: result.
        offset: result.
        texture: record of the texture.

    Returns:
        The number of atoms, the duality gap [m²], the evaluations, and whether the search was
        truncated: the force is exact to k √(2 (1 + c) gap).
    """
    p[0] = x
    p[1] = y
    p[2] = z
    count, gap, evaluations, truncated, failed = split_iterate(
        p, atoms, offset, continuity, warm_count, budget, True, texture
    )
    if failed and evaluations < budget:
        # Newton's method moved the atoms to where no weights are better: again without it.
        none: Any = np.int64(0)
        count, gap, taken, truncated, failed = split_iterate(
            p, atoms, offset, continuity, none, budget - evaluations, False, texture
        )
        evaluations += taken
    return count, gap, evaluations, truncated or failed


def split_iterate(
    p: FloatArray,
    atoms: FloatArray,
    offset: FloatArray,
    continuity: float,
    warm_count: int,
    budget: float,
    newton: bool,
    texture: object,
) -> tuple[int, float, float, bool, bool]:
    """Write atoms and z̄ - p at p, with or without Newton's method; see ``split_compute_atoms``.

    Returns:
        The number of atoms, the duality gap [m²], the evaluations, whether the search was
        truncated, and whether it ended without convergence.
    """
    mu = 1.0 / (1.0 + continuity)
    a = local_array((7, 10))
    at = local_array((3,))
    scale = abs(p[0]) + abs(p[1]) + abs(p[2])
    reserve = 2.0 * SHORT_SEARCH * evaluation_cost(texture)
    share = 0.1 * budget if newton else 0.0
    doubts = 0
    stuck = False
    count, solved, evaluations = split_initialize(
        atoms, warm_count, p, at, offset, continuity, a, budget, texture
    )
    for iteration in range(60):
        is_last = evaluations >= 0.75 * budget
        single = count == 1 and split_is_local_minimum(atoms, at, texture)
        unlikely = iteration >= NEARBY_ITERATIONS or budget - evaluations < reserve
        is_final = is_last or stuck or solved > 0 or single or unlikely
        gap, rounding, error_bound, taken = split_query_closer(
            at, atoms, count, is_final, mu, scale, budget - evaluations, texture
        )
        evaluations += taken
        converged = gap <= rounding
        gap += split_query_error(atoms, count, at, mu, error_bound)
        if converged:
            doubts += 1
            if solved > 0 or doubts > 6 or single or error_bound > 0.0:
                return count, gap, evaluations, error_bound > 0.0, False
        if is_last:
            return count, gap, evaluations, True, False
        left = split_solve_weights(atoms, count + 1, p, mu, a)
        if left == 0 and is_final:
            break  # by rounding: there are no better weights
        stuck = left == 0
        if not stuck:
            count = left
            share = min(share, budget - evaluations)
            solved, taken = split_update_dual(
                atoms, count, p, at, offset, continuity, a, share, texture
            )
            evaluations += taken
            count = solved if solved > 0 else count
    return count, gap, evaluations, False, gap > 1e3 * rounding


def split_query_error(
    atoms: FloatArray, count: int, y: FloatArray, mu: float, error_bound: float
) -> float:
    """Return the contribution of a query's error bound [m] to the duality gap [m²]."""
    square = 0.0
    for d in range(3):
        square += (atoms[count, d] - y[d]) ** 2
    distance = math.sqrt(square)
    error_bound = min(error_bound, distance)
    return (1.0 - mu) * error_bound * (distance - 0.5 * error_bound)
