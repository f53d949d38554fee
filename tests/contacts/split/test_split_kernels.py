"""The parts of law H's solver as plain functions, each against linear algebra of its own."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from asperity.contacts.split import optimality as conditions
from asperity.contacts.split import potential_hull as hull
from asperity.contacts.split import potential_spline as table
from asperity.contacts.split import solver
from asperity.contacts.split import split_evaluation as answers
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
# A quadratic surface h = ax²/2 + bxy + cy²/2 + dx + ey, and where its height is asked.
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
    monkeypatch.setattr(solver, "evaluation_cost", lambda _texture: 1.0)


def some_atoms(count: int) -> FloatArray:
    atoms = np.zeros((5, 4))
    atoms[:count, :3] = RNG.normal(size=(count, 3))
    weights = RNG.uniform(0.1, 1.0, count)
    atoms[:count, 3] = weights / weights.sum()
    return atoms


def foot_of(y: FloatArray) -> FloatArray:
    """Return the point with (w - y) along the normal, by Newton's method with differences."""

    def slope(at: FloatArray) -> FloatArray:
        h, hx, hy = curvature(*at, None)[:3]
        return np.array([at[0] - y[0] + (h - y[2]) * hx, at[1] - y[1] + (h - y[2]) * hy])

    at, step = y[:2].copy(), 1e-6
    for _ in range(60):
        columns = [(slope(at + d) - slope(at - d)) / (2.0 * step) for d in step * np.eye(2)]
        at = at - np.linalg.solve(np.column_stack(columns), slope(at))
    return np.array([*at, height(*at, None)])


# --- conditions of optimality ---------------------------------------------------------------------


def test_distances_and_energy_are_those_of_the_atoms() -> None:
    for count in (1, 2, 4):
        atoms, y, p = some_atoms(count), RNG.normal(size=3), RNG.normal(size=3)
        w, weights = atoms[:count, :3], atoms[:count, 3]
        squares = ((w - y) ** 2).sum(axis=1)
        for i, j in combinations(range(count), 2):
            found = conditions.split_distance_difference(atoms, i, j, y)
            assert found == pytest.approx(0.5 * (squares[i] - squares[j]), rel=1e-12)
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
def test_equations_are_solved_in_place(columns: int) -> None:
    for n in (1, 3, 7):
        matrix, right = RNG.normal(size=(n, n)), RNG.normal(size=(n, columns))
        if n > 1:
            matrix[0, 0] = 0.0  # a row has to be exchanged
        a = np.hstack([matrix, right, np.full((n, 1), 9.0)])
        assert conditions.split_solve_linear(a, n, n + columns)
        np.testing.assert_allclose(a[:, n:-1], np.linalg.solve(matrix, right), rtol=1e-9)
        assert (a[:, -1] == 9.0).all()
    assert not conditions.split_solve_linear(np.array([[1.0, 2.0, 1.0], [0.5, 1.0, 1.0]]), 2, 3)
    assert conditions.split_solve_linear(np.array([[1e-299, 1.0]]), 1, 2)
    assert not conditions.split_solve_linear(np.array([[1e-301, 1.0]]), 1, 2)


def residual(y: FloatArray, weights: FloatArray, w: FloatArray, p: FloatArray) -> FloatArray:
    """The conditions of optimality, from the module's first lines."""
    pull = (1.0 - MU) * (y - p) + MU * weights @ (w - p)
    squares = 0.5 * ((w - y) ** 2).sum(axis=1)
    return np.array([*pull, weights.sum() - 1.0, *(squares[1:] - squares[0])])


@pytest.mark.parametrize("count", [1, 2, 4])
def test_the_system_is_the_conditions_linearised(count: int) -> None:
    """Its columns are their differences, its right-hand side minus their residual."""
    n, a = 3 + count, np.full((7, 10), 9.0)
    atoms, y, p = some_atoms(count), RNG.normal(size=3), RNG.normal(size=3)
    atoms[:count, 3] *= 1.3  # not a mean yet
    conditions.split_assemble_system(atoms, count, p, y, MU, a)
    w, weights = atoms[:count, :3], atoms[:count, 3]
    here = residual(y, weights, w, p)
    np.testing.assert_allclose(a[:n, n], -here, rtol=1e-12, atol=1e-14)
    for column in range(n):
        moved = np.zeros(n)
        moved[column] = 1.0
        there = residual(y + moved[:3], weights + moved[3:], w, p)
        # Affine but for |y|², which both squares of a difference have.
        np.testing.assert_allclose(a[:n, column], there - here, rtol=1e-9, atol=1e-12)


def test_feet_move_as_differences_say() -> None:
    atoms, y = np.zeros((5, 4)), np.array([0.2, -0.1, -0.5])
    atoms[0, :3], atoms[1, :3], atoms[:2, 3] = foot_of(y), foot_of(y), (0.3, 0.7)
    out = np.full((3, 3), np.nan)
    assert conditions.split_closest_derivative(y, atoms, 0, out, None)
    step = 1e-5
    columns = [(foot_of(y + d) - foot_of(y - d)) / (2.0 * step) for d in step * np.eye(3)]
    np.testing.assert_allclose(out, np.column_stack(columns), rtol=1e-6, atol=1e-9)
    a = np.full((7, 10), 2.0)
    assert conditions.split_add_atom_motion(atoms, 2, y, MU, a, None)
    np.testing.assert_allclose(a[:3, :3], 2.0 + MU * out, rtol=1e-12)
    assert (a[3:] == 2.0).all()
    assert (a[:, 3:] == 2.0).all()
    # Below the centre of curvature a stationary point is no minimum.
    for depth, minimum in ((0.5, True), (30.0, False)):
        h, hx, hy = curvature(0.1, 0.1, None)[:3]
        below = np.array([0.1 + depth * hx, 0.1 + depth * hy, h - depth])
        atoms[0, :3] = 0.1, 0.1, h
        assert conditions.split_closest_derivative(below, atoms, 0, out, None) is minimum
        assert solver.split_is_local_minimum(atoms, below, None) is minimum


def test_a_foot_follows_its_point() -> None:
    for shift in (0.0, 0.01, 0.2):
        y = np.array([0.2, -0.1, -0.5])
        atoms = np.zeros((5, 4))
        atoms[1, :3] = foot_of(y)
        y = y + shift * np.array([1.0, -1.0, 0.5])
        found, looks = conditions.split_track_point(y, atoms, 1, 25, None)
        assert found
        assert 1.0 <= looks <= (2.0 if shift == 0.0 else 8.0)
        np.testing.assert_allclose(atoms[1, :3], foot_of(y), rtol=1e-10)
        assert not atoms[0].any()
    away = []
    for most in (1, 2, 3):
        atoms[1, :3] = foot_of(np.array([0.2, -0.1, -0.5]))
        assert conditions.split_track_point(y, atoms, 1, most, None) == (True, float(most))
        away.append(float(np.linalg.norm(atoms[1, :3] - foot_of(y))))
    assert 0.03 > away[0] > 3.0 * away[1] > 9.0 * away[2] > 0.0
    atoms[0, :2] = 0.1, 0.1
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    below = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    assert conditions.split_track_point(below, atoms, 0, 25, None) == (False, 1.0)
    # Convex just above the first focal point, a saddle just below it.
    a, b, c = QUADRIC[:3]
    for depth in np.linspace(2.0, 4.0, 41):
        q = np.eye(2) + np.outer((hx, hy), (hx, hy)) + depth * np.array([[a, b], [b, c]])
        below = np.array([0.1 + depth * hx, 0.1 + depth * hy, h - depth])
        atoms[0, :2] = 0.1, 0.1
        minimum = bool(np.linalg.det(q) > 0.0)
        assert conditions.split_track_point(below, atoms, 0, 25, None)[0] is minimum


# --- weights --------------------------------------------------------------------------------------


def primal(weights: FloatArray, w: FloatArray, p: FloatArray) -> float:
    mean = weights @ w
    spread = (weights * ((w - mean) ** 2).sum(axis=1)).sum()
    return 0.5 * float(((mean - p) ** 2).sum() + (1.0 - MU) * spread)


def optimum(w: FloatArray, p: FloatArray) -> FloatArray:
    """Return the best weights: of every subset those where the energy does not change."""
    best, least = np.zeros(len(w)), math.inf
    subsets = [c for n in range(1, 5) for c in combinations(range(len(w)), n)]
    for rows in map(list, subsets):
        away = w[rows] - p
        n = len(rows)
        equations = np.ones((n + 1, n + 1))
        equations[:n, :n], equations[n, n] = MU * away @ away.T, 0.0
        right = np.append(-0.5 * (1.0 - MU) * (away**2).sum(axis=1), 1.0)
        weights = np.zeros(len(w))
        weights[rows] = np.linalg.lstsq(equations, right, rcond=None)[0][:n]
        if weights.min() >= 0.0 and primal(weights, w, p) < least:
            best, least = weights, primal(weights, w, p)
    return best


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_the_weights_are_the_best_there_are(count: int) -> None:
    """Where the last atom has weight, as one that is nearer to y than the others has."""
    tried = 0
    for _ in range(40):
        atoms, p, a = some_atoms(count), 0.7 * RNG.normal(size=3), np.zeros((7, 10))
        w = atoms[:count, :3].copy()
        expected = optimum(w, p)
        if expected[-1] < 1e-3:
            continue
        tried += 1
        left = solver.split_solve_weights(atoms, count, p, MU, a)
        rows = np.flatnonzero(expected > 1e-9)
        np.testing.assert_array_equal(atoms[:left, :3], w[rows])
        np.testing.assert_allclose(atoms[:left, 3], expected[rows], rtol=1e-6)
    assert tried >= 4


def test_a_subset_names_the_atoms_of_its_mask() -> None:
    """Bit by bit, and always the last; nothing where a weight is not positive."""
    atoms, a = np.zeros((5, 4)), np.zeros((7, 10))
    atoms[:3, :3] = [[1.0, 0.0, 0.0], [-0.5, 0.8, 0.0], [-0.5, -0.8, 0.0]]
    p, trial, y = np.array([0.0, 0.0, -1.0]), np.zeros((4, 4)), np.zeros(3)
    for mask, rows in ((0b11, [0, 1, 2]), (0b01, [0, 2]), (0b10, [1, 2]), (0b00, [2])):
        assert solver.split_solve_subset(atoms, 3, mask, p, MU, a, trial, y) == len(rows)
        np.testing.assert_array_equal(trial[: len(rows), :3], atoms[rows, :3])
        weights = trial[: len(rows), 3]
        assert np.abs(residual(y, weights, atoms[rows, :3], p)).max() < 1e-12
    outside = np.array([9.0, 0.0, -1.0])
    assert solver.split_solve_subset(atoms, 3, 0b11, outside, MU, a, trial, y) == 0


def test_a_step_drops_what_has_no_weight() -> None:
    atoms, a, y = some_atoms(3), np.zeros((7, 10)), np.array([1.0, 2.0, 3.0])
    atoms[:3, 3] = 0.2, 0.3, 0.5
    before = atoms.copy()
    a[:6, 6] = 0.1, -0.2, 0.3, 0.05, -0.3, 0.1
    left, size = solver.split_apply_step(atoms, 3, y, a)
    assert (left, size) == (2, pytest.approx(0.14, rel=1e-12))
    np.testing.assert_allclose(y, [1.1, 1.8, 3.3], rtol=1e-12)
    np.testing.assert_array_equal(atoms[:2, :3], before[[0, 2], :3])
    np.testing.assert_allclose(atoms[:2, 3], [0.25, 0.6], rtol=1e-12)


def test_gaps_between_primal_and_dual() -> None:
    """(1 - μ) Σ λ_i (|w_i - y|² - |w - y|²)/2, and (1 - μ) (d² - (d - g)²)/2 for a doubt."""
    atoms, y = some_atoms(3), RNG.normal(size=3)
    for scale in (1.0, -1.0):
        atoms[3, :3] = y + scale * np.array([0.01, 0.02, -0.02])
        squares = ((atoms[:4, :3] - y) ** 2).sum(axis=1)
        gap, rounding = solver.split_duality_gap(atoms, 3, y, MU, 7.0)
        expected = 0.5 * (1.0 - MU) * float(atoms[:3, 3] @ (squares[:3] - squares[3]))
        assert gap == pytest.approx(expected, rel=1e-12)
        assert rounding == pytest.approx(4e-16 * (1.0 - MU) * 0.05 * 7.05, rel=1e-12)
    atoms[3, :3] = y + 100.0
    assert solver.split_duality_gap(atoms, 3, y, MU, 0.0)[0] == 0.0
    distance = 100.0 * math.sqrt(3.0)
    doubt = solver.split_query_error(atoms, 3, y, MU, 5.0)
    assert doubt == pytest.approx(0.5 * (1.0 - MU) * (distance**2 - (distance - 5.0) ** 2))


# --- hulls of tables ------------------------------------------------------------------------------


def test_bernstein_coefficients_are_those_of_the_spline() -> None:
    """Of c0 (½ - t)²/2·… on the middle cell: Σ b_i B_i(u) is the spline and its derivatives."""
    c0, c1, c2 = RNG.normal(size=3)
    u = np.linspace(0.0, 1.0, 7)
    basis = np.stack([(1 - u) ** 2, 2 * u * (1 - u), u * u])
    spline = 0.5 * (c0 * (1 - u) ** 2 + c1 * (1 + 2 * u - 2 * u * u) + c2 * u * u)
    slope = c0 * (u - 1) + c1 * (1 - 2 * u) + c2 * u
    for order, expected in enumerate((spline, slope, np.full(7, c0 - 2 * c1 + c2))):
        found = (
            np.array([hull.bernstein_coefficient(c0, c1, c2, order, i) for i in range(3)]) @ basis
        )
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_the_weights_of_a_table_are_those_of_the_spline() -> None:
    """Of the middle node and its neighbours, and their derivatives; a straight line below."""
    for t in (-0.5, -0.2, 0.0, 0.37, 0.5):
        weights, slopes = (
            np.array(table.quadratic_weights(t)),
            np.array(table.quadratic_weight_slopes(t)),
        )
        assert weights.sum() == pytest.approx(1.0, rel=1e-15)
        assert weights @ [-1.0, 0.0, 1.0] == pytest.approx(t, abs=1e-15)
        assert weights @ [1.0, 0.0, 1.0] == pytest.approx(t * t + 0.25, rel=1e-15)
        assert slopes.sum() == pytest.approx(0.0, abs=1e-15)
        assert slopes @ [-1.0, 0.0, 1.0] == pytest.approx(1.0, rel=1e-15)
        assert slopes @ [1.0, 0.0, 1.0] == pytest.approx(2.0 * t, abs=1e-15)
    for w, node in ((0.5, 1), (1.49, 1), (1.51, 2), (7.2, 7)):
        m, below, weights, slopes = table.potential_z_weights(w)
        assert (m, below) == (node, 0.0)
        assert (weights, slopes) == (
            table.quadratic_weights(w - node),
            table.quadratic_weight_slopes(w - node),
        )
    for w in (0.4, -3.0):
        m, below, weights, slopes = table.potential_z_weights(w)
        assert (m, below) == (1, w - 0.5)
        assert np.array(weights) @ [0.0, 1.0, 2.0] == pytest.approx(w, rel=1e-14)
        assert slopes == (-1.0, 1.0, 0.0)


def test_eigenvalues_and_pivots_agree_with_lapack() -> None:
    for _ in range(200):
        m = RNG.normal(size=(3, 3))
        m = m + m.T
        entries = m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]
        top = float(np.linalg.eigvalsh(m)[-1])
        assert hull.largest_eigenvalue_3x3(*entries) == pytest.approx(top, rel=1e-7)
        for part, below in ((1e-6, True), (-1e-6, False), (-2.0, False), (5.0, True)):
            assert hull.eigenvalues_below(top + part * (1.0 + abs(top)), *entries) == below
    assert hull.largest_eigenvalue_3x3(2.0, 0.0, 0.0, 2.0, 0.0, 2.0) == 2.0
    diagonal: Any = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    assert not hull.eigenvalues_below(1.0, *diagonal)
    assert not hull.eigenvalues_below(1.5, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0)


# --- what is asked of the solver ------------------------------------------------------------------


def solved(count: int, gap: float, *, short: bool) -> Any:
    """Return a solver that finds random atoms, and notes what it was told."""
    found, pull, told = some_atoms(max(count, 1)), RNG.normal(size=3), []

    def split_atoms(x: float, y: float, z: float, *given: Any) -> Any:
        continuity, known, budget, p, atoms, out, texture = given
        told.append((x, y, z, continuity, int(known), budget, atoms[:known].copy(), texture))
        p[:], atoms[:], out[:] = (x, y, z), found, pull
        return count, gap, 17.0, short

    return split_atoms, found, pull, told


@pytest.mark.parametrize(("known", "count", "short"), [(0, 1, False), (2, 4, True), (4, 3, True)])
def test_a_tick_goes_on_from_the_atoms_of_the_last(
    known: int, count: int, short: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    split_atoms, found, pull, told = solved(count, 0.02, short=short)
    monkeypatch.setattr(answers, "split_compute_atoms", split_atoms)
    memory = np.arange(100.0, 100.0 + WARM_START_SIZE)
    memory[[BUDGET, POINT_COUNT, TRUNCATED_TICKS]] = 55.0, known, 3.0
    before = memory.copy()
    assert answers.split_contact_warm(0.1, 0.2, 0.3, 1.5, memory, "texture") == tuple(pull)
    ((*numbers, atoms, texture),) = told
    assert (numbers, texture) == ([0.1, 0.2, 0.3, 1.5, known, 55.0], "texture")
    np.testing.assert_array_equal(
        atoms, before[FIRST_POINT : FIRST_POINT + 4 * known].reshape(known, 4)
    )
    assert (memory[POINT_COUNT], memory[EVALUATIONS], memory[TRUNCATED_TICKS]) == (
        count,
        17.0,
        4.0 if short else 3.0,
    )
    kept = memory[FIRST_POINT : FIRST_POINT + 4 * count].reshape(count, 4)
    np.testing.assert_array_equal(kept, found[:count])
    np.testing.assert_array_equal(
        memory[FIRST_POINT + 4 * count :], before[FIRST_POINT + 4 * count :]
    )
    expected = math.sqrt(2.0 * 2.5 * 0.02) if short else 0.0
    assert memory[ERROR_BOUND] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("count", [1, 3])
def test_answers_are_those_of_the_atoms(count: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """From nothing and without a budget; U of the atoms, and points outside have none."""
    split_atoms, found, pull, told = solved(count, 0.02, short=False)
    monkeypatch.setattr(answers, "split_compute_atoms", split_atoms)
    monkeypatch.setattr(answers, "sample_height", height)
    assert answers.split_contact(0.1, 0.2, -0.3, 1.5, None) == tuple(pull)
    value, atoms, gap = answers.split_energy(0.1, 0.2, -0.3, 1.5, None)
    weights = found[:count, 3]
    away = found[:count, :3] - [0.1, 0.2, -0.3]
    mean = weights @ away
    spread = float((weights * ((away - mean) ** 2).sum(axis=1)).sum())
    assert value == pytest.approx(0.5 * (float(mean @ mean) + 0.6 * spread), rel=1e-12)
    assert (atoms, gap) == (count, 0.02)
    assert all(one[:6] == (0.1, 0.2, -0.3, 1.5, 0, UNLIMITED) for one in told)
    points = np.array([[0.1, 0.2, -0.3], [0.1, 0.2, 0.9], [0.1, 0.2, height(0.1, 0.2, None)]])
    out = np.full((3, 3), np.nan)
    answers.split_batch(points, out, 1.5, None)
    np.testing.assert_allclose(out, [[value, count, gap], [0.0] * 3, [0.0] * 3], rtol=1e-12)


def test_one_atom_moves_as_a_foot_does() -> None:
    """∂(z̄ - p)/∂p is that of the foot less the probe's own; nothing where it is no minimum."""
    y = np.array([0.2, -0.1, -0.5])
    atoms, m = np.zeros((5, 4)), np.full((3, 3), np.nan)
    atoms[0] = [*foot_of(y), 1.0]
    pull = atoms[0, :3] - y
    step = 1e-5
    moved = [(foot_of(y + d) - foot_of(y - d)) / (2.0 * step) for d in step * np.eye(3)]
    answers.split_contact_derivative(y, 1.5, atoms, 1, pull, m, None)
    np.testing.assert_allclose(m, np.column_stack(moved) - np.eye(3), rtol=1e-6, atol=1e-9)
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    below = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    atoms[0] = [0.1, 0.1, h, 1.0]
    answers.split_contact_derivative(below, 1.5, atoms, 1, pull, m, None)
    assert not m.any()


def test_polishing_ends_with_its_looks_or_with_a_foot_that_is_lost() -> None:
    """Two feet that are far from theirs: each follows in several looks, then both are moved."""
    y, p, a = np.array([0.2, -0.1, -0.5]), np.array([0.2, -0.1, -0.9]), np.zeros((7, 10))
    for budget in (0.0, 3.0, 5.0):
        atoms = some_atoms(2)
        atoms[:2, :2] = [[0.6, 0.3], [-0.4, -0.3]]
        left, looks = solver.split_newton(atoms, 2, p, y.copy(), MU, a, budget, None)
        assert left == 0
        assert budget < looks <= budget + 8.0
    h, hx, hy = curvature(0.1, 0.1, None)[:3]
    below = np.array([0.1 + 30.0 * hx, 0.1 + 30.0 * hy, h - 30.0])
    atoms = some_atoms(2)
    atoms[0, :2] = 0.1, 0.1
    assert solver.split_newton(atoms, 2, p, below, MU, a, UNLIMITED, None) == (0, 1.0)
