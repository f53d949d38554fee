"""The parts of law H's solver as plain functions, each against independent linear algebra."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from asperity.contacts import split_evaluation as answers
from asperity.contacts import split_optimality as conditions
from asperity.contacts import split_solver
from asperity.contacts.warm_start import (
    BUDGET,
    ERROR_BOUND,
    EVALUATIONS,
    FIRST_POINT,
    POINT_COUNT,
    TRUNCATED_TICKS,
    UNLIMITED,
    WARM_START_SIZE,
)
from asperity.core.checks import FloatArray

RNG = np.random.default_rng(31)
MU = 0.4
# Coefficients of a quadratic surface h = ax²/2 + bxy + cy²/2 + dx + ey.
QUADRIC = (-0.3, 0.2, 0.15, 0.4, -0.25)


def curvature(x: float, y: float, _texture: object) -> tuple[float, ...]:
    a, b, c, d, e = QUADRIC
    h = 0.5 * a * x * x + b * x * y + 0.5 * c * y * y + d * x + e * y
    return h, a * x + b * y + d, b * x + c * y + e, a, b, c


def height(x: float, y: float, texture: object) -> float:
    return curvature(x, y, texture)[0]


@pytest.fixture(autouse=True)
def surface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conditions, "sample_hessian", curvature)
    monkeypatch.setattr(conditions, "sample_height", height)
    monkeypatch.setattr(conditions, "evaluation_cost", lambda _texture: 1.0)
    monkeypatch.setattr(split_solver, "evaluation_cost", lambda _texture: 1.0)


def random_atoms(count: int) -> FloatArray:
    atoms = np.zeros((5, 4))
    atoms[:count, :3] = RNG.normal(size=(count, 3))
    weights = RNG.uniform(0.1, 1.0, count)
    atoms[:count, 3] = weights / weights.sum()
    return atoms


def closest_point(y: FloatArray) -> FloatArray:
    """Return the surface point whose normal passes through y, by Newton's method."""

    def slope(xy: FloatArray) -> FloatArray:
        h, hx, hy = curvature(*xy, None)[:3]
        return np.array([xy[0] - y[0] + (h - y[2]) * hx, xy[1] - y[1] + (h - y[2]) * hy])

    xy, step = y[:2].copy(), 1e-6
    for _ in range(60):
        columns = [(slope(xy + d) - slope(xy - d)) / (2.0 * step) for d in step * np.eye(2)]
        xy = xy - np.linalg.solve(np.column_stack(columns), slope(xy))
    return np.array([*xy, height(*xy, None)])


# --- conditions of optimality ---------------------------------------------------------------------


def test_distances_and_energy_of_atoms() -> None:
    for count in (1, 2, 4):
        atoms, y, p = random_atoms(count), RNG.normal(size=3), RNG.normal(size=3)
        w, weights = atoms[:count, :3], atoms[:count, 3]
        squares = ((w - y) ** 2).sum(axis=1)
        for i, j in combinations(range(count), 2):
            result = conditions.split_distance_difference(atoms, i, j, y)
            assert result == pytest.approx(0.5 * (squares[i] - squares[j]), rel=1e-12)
        pull, mean = np.full(3, np.nan), weights @ w
        value = conditions.split_evaluate_energy(atoms, count, p, MU, pull)
        np.testing.assert_allclose(pull, mean - p, rtol=1e-12)
        spread = float((weights * ((w - mean) ** 2).sum(axis=1)).sum())
        expected = 0.5 * (float(((mean - p) ** 2).sum()) + (1.0 - MU) * spread)
        assert value == pytest.approx(expected, rel=1e-12)
        copy = np.full((5, 4), -1.0)
        conditions.split_copy_atoms(atoms, copy, count)
        np.testing.assert_array_equal(copy[:count], atoms[:count])
        assert (copy[count:] == -1.0).all()


@pytest.mark.parametrize("columns", [1, 3])
def test_linear_equations_are_solved_in_place(columns: int) -> None:
    for n in (1, 3, 7):
        matrix, right = RNG.normal(size=(n, n)), RNG.normal(size=(n, columns))
        if n > 1:
            matrix[0, 0] = 0.0  # requires a row exchange
        a = np.hstack([matrix, right, np.full((n, 1), 9.0)])
        assert conditions.split_solve_linear(a, n, n + columns)
        np.testing.assert_allclose(a[:, n:-1], np.linalg.solve(matrix, right), rtol=1e-9)
        assert (a[:, -1] == 9.0).all()
    assert not conditions.split_solve_linear(np.array([[1.0, 2.0, 1.0], [0.5, 1.0, 1.0]]), 2, 3)
    assert conditions.split_solve_linear(np.array([[1e-299, 1.0]]), 1, 2)
    assert not conditions.split_solve_linear(np.array([[1e-301, 1.0]]), 1, 2)


def residual(y: FloatArray, weights: FloatArray, w: FloatArray, p: FloatArray) -> FloatArray:
    """Return the residual of the conditions of optimality, as in the module's docstring."""
    pull = (1.0 - MU) * (y - p) + MU * weights @ (w - p)
    squares = 0.5 * ((w - y) ** 2).sum(axis=1)
    return np.array([*pull, weights.sum() - 1.0, *(squares[1:] - squares[0])])


@pytest.mark.parametrize("count", [1, 2, 4])
def test_system_is_the_linearised_optimality_conditions(count: int) -> None:
    """Its columns are differences of the residual, its right-hand side minus the residual."""
    n, a = 3 + count, np.full((7, 10), 9.0)
    atoms, y, p = random_atoms(count), RNG.normal(size=3), RNG.normal(size=3)
    atoms[:count, 3] *= 1.3  # not normalised yet
    conditions.split_assemble_system(atoms, count, p, y, MU, a)
    w, weights = atoms[:count, :3], atoms[:count, 3]
    residual_at_point = residual(y, weights, w, p)
    np.testing.assert_allclose(a[:n, n], -residual_at_point, rtol=1e-12, atol=1e-14)
    for column in range(n):
        moved = np.zeros(n)
        moved[column] = 1.0
        moved_residual = residual(y + moved[:3], weights + moved[3:], w, p)
        # Affine: the |y|² of both squared distances cancel.
        np.testing.assert_allclose(
            a[:n, column], moved_residual - residual_at_point, rtol=1e-9, atol=1e-12
        )


def test_closest_derivative_agrees_with_differences() -> None:
    atoms, y = np.zeros((5, 4)), np.array([0.2, -0.1, -0.5])
    atoms[0, :3], atoms[1, :3], atoms[:2, 3] = closest_point(y), closest_point(y), (0.3, 0.7)
    derivative = np.full((3, 3), np.nan)
    assert conditions.split_closest_derivative(y, atoms, 0, derivative, None)
    step = 1e-5
    columns = [
        (closest_point(y + d) - closest_point(y - d)) / (2.0 * step) for d in step * np.eye(3)
    ]
    np.testing.assert_allclose(derivative, np.column_stack(columns), rtol=1e-6, atol=1e-9)
    a = np.full((7, 10), 2.0)
    assert conditions.split_add_atom_motion(atoms, 2, y, MU, a, None)
    np.testing.assert_allclose(a[:3, :3], 2.0 + MU * derivative, rtol=1e-12)
    assert (a[3:] == 2.0).all()
    assert (a[:, 3:] == 2.0).all()
    # Below the centre of curvature a stationary point is not a minimum.
    for depth, is_minimum in ((0.5, True), (30.0, False)):
        h, hx, hy = curvature(0.1, 0.1, None)[:3]
        deep_point = np.array([0.1 + depth * hx, 0.1 + depth * hy, h - depth])
        atoms[0, :3] = 0.1, 0.1, h
        assert (
            conditions.split_closest_derivative(deep_point, atoms, 0, derivative, None)
            is is_minimum
        )
        assert split_solver.split_is_local_minimum(atoms, deep_point, None) is is_minimum


def test_tracked_point_follows_its_probe() -> None:
    for shift in (0.0, 0.01, 0.2):
        y = np.array([0.2, -0.1, -0.5])
        atoms = np.zeros((5, 4))
        atoms[1, :3] = closest_point(y)
        y = y + shift * np.array([1.0, -1.0, 0.5])
        is_found, evaluations = conditions.split_track_point(y, atoms, 1, 25, None)
        assert is_found
        assert 1.0 <= evaluations <= (2.0 if shift == 0.0 else 8.0)
        np.testing.assert_allclose(atoms[1, :3], closest_point(y), rtol=1e-10)
        assert not atoms[0].any()
    errors = []
    for max_steps in (1, 2, 3):
        atoms[1, :3] = closest_point(np.array([0.2, -0.1, -0.5]))
        assert conditions.split_track_point(y, atoms, 1, max_steps, None) == (
            True,
            float(max_steps),
        )
        errors.append(float(np.linalg.norm(atoms[1, :3] - closest_point(y))))
    assert 0.03 > errors[0] > 3.0 * errors[1] > 9.0 * errors[2] > 0.0
    atoms[0, :2] = 0.1, 0.1
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    deep_point = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    assert conditions.split_track_point(deep_point, atoms, 0, 25, None) == (False, 1.0)
    # Convex just above the first focal point, a saddle just below it.
    a, b, c = QUADRIC[:3]
    for depth in np.linspace(2.0, 4.0, 41):
        q = np.eye(2) + np.outer((hx, hy), (hx, hy)) + depth * np.array([[a, b], [b, c]])
        deep_point = np.array([0.1 + depth * hx, 0.1 + depth * hy, h - depth])
        atoms[0, :2] = 0.1, 0.1
        is_minimum = bool(np.linalg.det(q) > 0.0)
        assert conditions.split_track_point(deep_point, atoms, 0, 25, None)[0] is is_minimum


def test_closest_minimum_near_the_atoms_is_tracked_from_them(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Atoms beside it, of which the first is far off; the row after them is written."""
    monkeypatch.setattr(split_solver, "local_array", np.zeros)
    y = np.array([0.1, -0.2, -0.4])
    expected = closest_point(y)
    atoms = np.zeros((5, 4))
    for row, shift in enumerate(([0.2, 0.1], [0.03, -0.02], [-0.05, 0.04])):
        xy = expected[:2] + shift
        atoms[row, :3] = *xy, height(*xy, None)
    before = atoms.copy()
    evaluations = split_solver.split_query_nearby(y, atoms, 3, None)
    np.testing.assert_allclose(atoms[3], [*expected, 0.0], atol=1e-9)
    np.testing.assert_array_equal(atoms[[0, 1, 2, 4]], before[[0, 1, 2, 4]])
    assert 3.0 <= evaluations <= 30.0


# --- weights --------------------------------------------------------------------------------------


def primal_energy(weights: FloatArray, w: FloatArray, p: FloatArray) -> float:
    mean = weights @ w
    spread = (weights * ((w - mean) ** 2).sum(axis=1)).sum()
    return 0.5 * float(((mean - p) ** 2).sum() + (1.0 - MU) * spread)


def optimal_weights(w: FloatArray, p: FloatArray) -> FloatArray:
    """Return the best weights: over all subsets, those where the energy is stationary."""
    best, lowest_energy = np.zeros(len(w)), math.inf
    subsets = [c for n in range(1, 5) for c in combinations(range(len(w)), n)]
    for rows in map(list, subsets):
        offsets = w[rows] - p
        n = len(rows)
        equations = np.ones((n + 1, n + 1))
        equations[:n, :n], equations[n, n] = MU * offsets @ offsets.T, 0.0
        right = np.append(-0.5 * (1.0 - MU) * (offsets**2).sum(axis=1), 1.0)
        weights = np.zeros(len(w))
        weights[rows] = np.linalg.lstsq(equations, right, rcond=None)[0][:n]
        if weights.min() >= 0.0 and primal_energy(weights, w, p) < lowest_energy:
            best, lowest_energy = weights, primal_energy(weights, w, p)
    return best


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_weights_are_optimal(count: int) -> None:
    """For cases in which the last atom has weight, as one nearer to y than the others does."""
    case_count = 0
    for _ in range(40):
        atoms, p, a = random_atoms(count), 0.7 * RNG.normal(size=3), np.zeros((7, 10))
        w = atoms[:count, :3].copy()
        expected = optimal_weights(w, p)
        if expected[-1] < 1e-3:
            continue
        case_count += 1
        remaining = conditions.split_solve_weights(atoms, count, p, MU, a)
        rows = np.flatnonzero(expected > 1e-9)
        np.testing.assert_array_equal(atoms[:remaining, :3], w[rows])
        np.testing.assert_allclose(atoms[:remaining, 3], expected[rows], rtol=1e-6)
    assert case_count >= 4


def test_subset_mask_selects_atoms() -> None:
    """One bit per atom, the last one always; no result where a weight is not positive."""
    atoms, a = np.zeros((5, 4)), np.zeros((7, 10))
    atoms[:3, :3] = [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]]
    p, trial, y = np.array([0.0, 0.0, -1.0]), np.zeros((4, 4)), np.zeros(3)
    for mask, rows in ((0b11, [0, 1, 2]), (0b01, [0, 2]), (0b10, [1, 2]), (0b00, [2])):
        assert conditions.split_solve_subset(atoms, 3, mask, p, MU, a, trial, y) == len(rows)
        np.testing.assert_array_equal(trial[: len(rows), :3], atoms[rows, :3])
        weights = trial[: len(rows), 3]
        assert np.abs(residual(y, weights, atoms[rows, :3], p)).max() < 1e-12
    outside = np.array([9.0, 0.0, -1.0])
    assert conditions.split_solve_subset(atoms, 3, 0b11, outside, MU, a, trial, y) == 0


def test_subset_with_a_singular_system_has_no_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conditions, "split_solve_linear", lambda *_arguments: False)
    atoms, trial, y = random_atoms(3), np.zeros((4, 4)), np.zeros(3)
    p, a = RNG.normal(size=3), np.zeros((7, 10))
    assert conditions.split_solve_subset(atoms, 3, 0b11, p, MU, a, trial, y) == 0


def test_step_drops_atoms_without_weight() -> None:
    atoms, a, y = random_atoms(3), np.zeros((7, 10)), np.array([1.0, 2.0, 3.0])
    atoms[:3, 3] = 0.2, 0.3, 0.5
    before = atoms.copy()
    a[:6, 6] = 0.1, -0.2, 0.3, 0.05, -0.3, 0.1
    remaining, size = conditions.split_apply_step(atoms, 3, y, a)
    assert (remaining, size) == (2, pytest.approx(0.14, rel=1e-12))
    np.testing.assert_allclose(y, [1.1, 1.8, 3.3], rtol=1e-12)
    np.testing.assert_array_equal(atoms[:2, :3], before[[0, 2], :3])
    np.testing.assert_allclose(atoms[:2, 3], [0.25, 0.6], rtol=1e-12)


def test_duality_gap_and_query_error() -> None:
    """(1 - μ) Σ λ_i (|w_i - y|² - |w - y|²)/2, and (1 - μ) (d² - (d - g)²)/2 for an error g."""
    atoms, y = random_atoms(3), RNG.normal(size=3)
    for scale in (1.0, -1.0):
        atoms[3, :3] = y + scale * np.array([0.01, 0.02, -0.02])
        squares = ((atoms[:4, :3] - y) ** 2).sum(axis=1)
        gap, rounding = conditions.split_duality_gap(atoms, 3, y, MU, 7.0)
        expected = 0.5 * (1.0 - MU) * float(atoms[:3, 3] @ (squares[:3] - squares[3]))
        assert gap == pytest.approx(expected, rel=1e-12)
        assert rounding == pytest.approx(4e-16 * (1.0 - MU) * 0.05 * 7.05, rel=1e-12)
    atoms[3, :3] = y + 100.0
    assert conditions.split_duality_gap(atoms, 3, y, MU, 0.0)[0] == 0.0
    distance = 100.0 * math.sqrt(3.0)
    error = split_solver.split_query_error(atoms, 3, y, MU, 5.0)
    assert error == pytest.approx(0.5 * (1.0 - MU) * (distance**2 - (distance - 5.0) ** 2))


# --- calls of the solver --------------------------------------------------------------------------


def stand_in_solver(count: int, gap: float, *, truncated: bool) -> Any:
    """Return a solver that finds random atoms, and the list of its calls."""
    atoms_found, pull, calls = random_atoms(max(count, 1)), RNG.normal(size=3), []

    def split_atoms(x: float, y: float, z: float, *arguments: Any) -> Any:
        continuity, known_count, budget, p, atoms, out, texture = arguments
        calls.append(
            (x, y, z, continuity, int(known_count), budget, atoms[:known_count].copy(), texture)
        )
        p[:], atoms[:], out[:] = (x, y, z), atoms_found, pull
        return count, gap, 17.0, truncated

    return split_atoms, atoms_found, pull, calls


@pytest.mark.parametrize(
    ("known_count", "count", "truncated"), [(0, 1, False), (2, 4, True), (4, 3, True)]
)
def test_warm_start_uses_and_stores_atoms(
    known_count: int, count: int, truncated: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    split_atoms, atoms_found, pull, calls = stand_in_solver(count, 0.02, truncated=truncated)
    monkeypatch.setattr(answers, "split_compute_atoms", split_atoms)
    memory = np.arange(100.0, 100.0 + WARM_START_SIZE)
    memory[[BUDGET, POINT_COUNT, TRUNCATED_TICKS]] = 55.0, known_count, 3.0
    before = memory.copy()
    assert answers.split_contact_warm(0.1, 0.2, 0.3, 1.5, memory, "texture") == tuple(pull)
    ((*numbers, atoms, texture),) = calls
    assert (numbers, texture) == ([0.1, 0.2, 0.3, 1.5, known_count, 55.0], "texture")
    np.testing.assert_array_equal(
        atoms, before[FIRST_POINT : FIRST_POINT + 4 * known_count].reshape(known_count, 4)
    )
    assert (memory[POINT_COUNT], memory[EVALUATIONS], memory[TRUNCATED_TICKS]) == (
        count,
        17.0,
        4.0 if truncated else 3.0,
    )
    stored = memory[FIRST_POINT : FIRST_POINT + 4 * count].reshape(count, 4)
    np.testing.assert_array_equal(stored, atoms_found[:count])
    np.testing.assert_array_equal(
        memory[FIRST_POINT + 4 * count :], before[FIRST_POINT + 4 * count :]
    )
    expected = math.sqrt(2.0 * 2.5 * 0.02) if truncated else 0.0
    assert memory[ERROR_BOUND] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("count", [1, 3])
def test_contact_and_energy_follow_from_the_atoms(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without warm start and budget; U is zero for points outside."""
    split_atoms, atoms_found, pull, calls = stand_in_solver(count, 0.02, truncated=False)
    monkeypatch.setattr(answers, "split_compute_atoms", split_atoms)
    monkeypatch.setattr(answers, "sample_height", height)
    assert answers.split_contact(0.1, 0.2, -0.3, 1.5, None) == tuple(pull)
    value, atoms, gap = answers.split_energy(0.1, 0.2, -0.3, 1.5, None)
    weights = atoms_found[:count, 3]
    offsets = atoms_found[:count, :3] - [0.1, 0.2, -0.3]
    mean = weights @ offsets
    spread = float((weights * ((offsets - mean) ** 2).sum(axis=1)).sum())
    assert value == pytest.approx(0.5 * (float(mean @ mean) + 0.6 * spread), rel=1e-12)
    assert (atoms, gap) == (count, 0.02)
    assert all(call[:6] == (0.1, 0.2, -0.3, 1.5, 0, UNLIMITED) for call in calls)
    points = np.array([[0.1, 0.2, -0.3], [0.1, 0.2, 0.9], [0.1, 0.2, height(0.1, 0.2, None)]])
    out = np.full((3, 3), np.nan)
    answers.split_batch(points, out, 1.5, None)
    np.testing.assert_allclose(out, [[value, count, gap], [0.0] * 3, [0.0] * 3], rtol=1e-12)


def test_derivative_with_one_atom_is_that_of_the_closest_point() -> None:
    """∂(z̄ - p)/∂p is the closest point's derivative minus identity; zero at a non-minimum."""
    y = np.array([0.2, -0.1, -0.5])
    atoms, derivative = np.zeros((5, 4)), np.full((3, 3), np.nan)
    atoms[0] = [*closest_point(y), 1.0]
    pull = atoms[0, :3] - y
    step = 1e-5
    columns = [
        (closest_point(y + d) - closest_point(y - d)) / (2.0 * step) for d in step * np.eye(3)
    ]
    answers.split_contact_derivative(y, 1.5, atoms, 1, pull, derivative, None)
    np.testing.assert_allclose(
        derivative, np.column_stack(columns) - np.eye(3), rtol=1e-6, atol=1e-9
    )
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    deep_point = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    atoms[0] = [0.1, 0.1, h, 1.0]
    answers.split_contact_derivative(deep_point, 1.5, atoms, 1, pull, derivative, None)
    assert not derivative.any()


def test_newton_ends_with_its_budget_or_a_lost_point() -> None:
    """Two atoms far from their closest points take several evaluations each."""
    y, p, a = np.array([0.2, -0.1, -0.5]), np.array([0.2, -0.1, -0.9]), np.zeros((7, 10))
    for budget in (0.0, 3.0, 5.0):
        atoms = random_atoms(2)
        atoms[:2, :2] = [[0.6, 0.3], [-0.4, -0.3]]
        count, evaluations = split_solver.split_newton(atoms, 2, p, y.copy(), MU, a, budget, None)
        assert count == 0
        assert budget < evaluations <= budget + 8.0
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    deep_point = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    atoms = random_atoms(2)
    atoms[0, :2] = 0.1, 0.1
    assert split_solver.split_newton(atoms, 2, p, deep_point, MU, a, UNLIMITED, None) == (0, 1.0)
