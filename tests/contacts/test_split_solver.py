"""The solver of law H: what its parts request from each other and do with the results."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.contacts import split_solver
from asperity.core.checks import FloatArray
from asperity.core.compiled import EPS
from asperity.kernels.fuse import fuse_surface
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures.kinds.named_surfaces import named_surface

RNG = np.random.default_rng(33)
P, Y = np.array([0.1, 0.2, -0.9]), np.array([0.3, -0.2, -0.5])
C = 1.5


def random_atoms(count: int) -> FloatArray:
    atoms = np.zeros((5, 4))
    atoms[:count, :3] = RNG.normal(size=(count, 3))
    atoms[:count, 3] = RNG.dirichlet(np.ones(count))
    return atoms


def energy_and_pull(atoms: FloatArray, count: int) -> tuple[float, FloatArray]:
    """Return the energy of atoms at P, and the vector from P to their mean."""
    mu, weights, offsets = 1.0 / (1.0 + C), atoms[:count, 3], atoms[:count, :3] - P
    mean = weights @ offsets
    spread = float((weights * ((offsets - mean) ** 2).sum(axis=1)).sum())
    return 0.5 * (float(mean @ mean) + (1.0 - mu) * spread), mean


@pytest.mark.parametrize("row", [0, 2])
def test_query_writes_the_closest_free_point(row: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A free point itself; otherwise the closest point, searched from the first atom or above."""
    calls: list[Any] = []

    def search(*arguments: Any) -> Any:
        calls.append(arguments)
        return 0.7, 0.8, 9.0, 9.0, 9.0, 0.05, 21.0

    monkeypatch.setattr(split_solver, "closest_point_within_budget", search)
    monkeypatch.setattr(split_solver, "evaluation_cost", lambda _texture: 1.0)
    for height, is_free in ((-0.5, True), (-0.4, False)):
        monkeypatch.setattr(
            split_solver, "sample_height", lambda x, y, _t, h=height: h + (x - 0.3) - (y + 0.2)
        )
        atoms = random_atoms(4)
        before = atoms.copy()
        error, evaluations = split_solver.split_query(Y, atoms, row, 40.0, "texture")
        if is_free:
            assert (error, evaluations, calls) == (0.0, 1.0, [])
            np.testing.assert_array_equal(atoms[row], [*Y, 0.0])
        else:
            start = tuple(before[0, :2]) if row else tuple(Y[:2])
            assert (error, evaluations) == (0.05, 21.0)
            assert calls == [(*Y, *start, 40.0, "texture")]
            np.testing.assert_allclose(atoms[row], [0.7, 0.8, -0.4 + 0.4 - 1.0, 0.0], rtol=1e-15)
        others = [i for i in range(5) if i != row]
        np.testing.assert_array_equal(atoms[others], before[others])


@pytest.mark.parametrize(
    ("count_left", "progress", "accepted"),
    [(2, 0.1, True), (2, 0.0, True), (2, -0.1, False), (1, 0.1, True), (0, 0.1, False)],
)
def test_newton_step_is_accepted_unless_the_energy_rises(
    count_left: int, progress: float, accepted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Equal energies are accepted; a rejected step restores the atoms and y."""

    def split_newton(
        atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, *rest: Any
    ) -> Any:
        assert (count, rest[2:]) == (2, (40.0, "texture"))
        np.testing.assert_array_equal(p, P)
        atoms[:2, :3] += progress * (P - atoms[:2, :3])
        atoms[0, 3] += 1.0 if count_left == 1 else 0.0
        y += 1.0
        return count_left, 13.0

    monkeypatch.setattr(split_solver, "split_newton", split_newton)
    atoms, y = random_atoms(2), Y.copy()
    if count_left == 1:
        atoms[:2] = [[*(P + 0.2), 0.0], [*(P + 0.9), 1.0]]
    before = atoms.copy()
    mu, a = 1.0 / (1.0 + C), np.zeros((7, 10))
    result = split_solver.split_try_newton(atoms, 2, P, y, mu, a, 40.0, "texture")
    assert result == (count_left if accepted else 0, 13.0)
    np.testing.assert_array_equal(y, Y + 1.0 if accepted else Y)
    if not accepted:
        np.testing.assert_array_equal(atoms, before)


def test_newton_step_may_raise_the_energy_by_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    for units, count in ((40.0, 3), (45.0, 3), (50.0, 0)):
        values = iter([2.0, 2.0 * (1.0 + units * EPS)])
        monkeypatch.setattr(
            split_solver, "split_evaluate_energy", lambda *_arguments, values=values: next(values)
        )
        monkeypatch.setattr(split_solver, "split_newton", lambda *_arguments: (3, 5.0))
        args: Any = (random_atoms(3), 3, P, Y.copy(), 0.4, np.zeros((7, 10)), 40.0, None)
        assert split_solver.split_try_newton(*args)[0] == count


@pytest.mark.parametrize(("count", "solved"), [(1, 0), (3, 0), (3, 2)])
def test_dual_point_and_mean_follow_from_each_other(
    count: int, solved: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []

    def split_try_newton(*arguments: Any) -> Any:
        calls.append(arguments[1:2] + arguments[4:5] + arguments[6:])
        if solved:
            arguments[3][:] = Y
        return solved, 7.0

    monkeypatch.setattr(split_solver, "split_try_newton", split_try_newton)
    atoms, y, pull = random_atoms(count), np.full(3, np.nan), np.full(3, np.nan)
    mean = energy_and_pull(atoms, count)[1]
    result = split_solver.split_update_dual(
        atoms, count, P, y, pull, C, np.zeros((7, 10)), 40.0, "texture"
    )
    assert result == (solved, 7.0 if count > 1 else 0.0)
    assert calls == ([(count, pytest.approx(0.4), 40.0, "texture")] if count > 1 else [])
    if solved:
        np.testing.assert_array_equal(y, Y)
        np.testing.assert_allclose(pull, C * (P - Y), rtol=1e-15)
    else:
        np.testing.assert_allclose(pull, mean, rtol=1e-12)
        np.testing.assert_allclose(y, P - mean / C, rtol=1e-12)


@pytest.mark.parametrize(
    ("known_count", "succeeds", "expected_calls", "expected"),
    [
        (0, True, ["query", "settle 1"], (1, 0, 9.0)),
        (1, True, ["follow", "settle 1"], (1, 0, 4.0)),
        (1, False, ["follow", "query", "settle 1"], (1, 0, 13.0)),
        (3, True, ["weights 3", "settle 3"], (2, 2, 6.0)),
        (3, False, ["weights 3", "settle 3"], (3, 0, 6.0)),
        (2, True, ["weights 2", "settle 2"], (2, 2, 6.0)),
    ],
)
def test_initialization_from_known_atoms(
    known_count: int,
    succeeds: bool,
    expected_calls: list[str],
    expected: tuple[float, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Atoms of a nearby probe, with optimal weights if all are positive: here two have them."""
    calls = replace_parts(monkeypatch, succeeds)
    atoms, y, pull = random_atoms(4), np.zeros(3), np.zeros(3)
    weight = 0.5 if known_count == 2 else atoms[0, 3]
    a = np.zeros((7, 10))
    result = split_solver.split_initialize(atoms, known_count, P, y, pull, C, a, 160.0, "texture")
    assert result == expected
    assert calls == expected_calls
    assert atoms[0, 3] == (1.0 if expected_calls[-1] == "settle 1" else weight)


def test_atoms_of_a_distant_probe_are_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    """A mean with more energy than the point straight above the probe is no good start."""
    calls = replace_parts(monkeypatch, succeeds=True, height=-0.7)
    atoms, y, pull = random_atoms(4), np.zeros(3), np.zeros(3)
    a = np.zeros((7, 10))
    split_solver.split_initialize(atoms, 3, P, y, pull, C, a, 160.0, "texture")
    assert calls == ["query", "settle 1"]


def replace_parts(
    monkeypatch: pytest.MonkeyPatch, succeeds: bool, height: float = 99.0
) -> list[str]:
    """Replace the functions that an initialization calls, and return the list of their calls."""
    calls: list[str] = []

    def solve_subset(candidates: Any, count: int, mask: int, p: Any, mu: float, *rest: Any) -> int:
        calls.append(f"weights {count}")
        assert (mask, mu, tuple(p)) == (2**count - 1, 1.0 / (1.0 + C), tuple(P))
        rest[1][:] = candidates[:4]
        rest[1][:count, 3] = 0.5
        return count if count == 2 else 0

    def update_dual(
        _atoms: Any, count: int, p: Any, _y: Any, _pull: Any, c: float, *rest: Any
    ) -> Any:
        calls.append(f"settle {int(count)}")
        assert (tuple(p), c) == (tuple(P), C)
        assert rest[1:] == (40.0 if count > 1 else 0.0, "texture")
        return (2 if succeeds else 0, 6.0) if count > 1 else (0, 50.0)

    def track_point(p: Any, _atoms: Any, row: int, most: int, _texture: Any) -> Any:
        calls.append("follow")
        assert (tuple(p), row, most) == (tuple(P), 0, 25)
        return succeeds, 4.0

    def query(p: Any, _atoms: Any, row: int, budget: float, _texture: Any) -> Any:
        calls.append("query")
        assert (tuple(p), row, budget) == (tuple(P), 0, 40.0)
        return 0.0, 9.0

    stand_ins = (
        ("update_dual", update_dual),
        ("track_point", track_point),
        ("query", query),
        ("solve_subset", solve_subset),
    )
    for name, function in stand_ins:
        monkeypatch.setattr(split_solver, f"split_{name}", function)
    monkeypatch.setattr(split_solver, "sample_height", lambda *_: height)
    monkeypatch.setattr(split_solver, "evaluation_cost", lambda _texture: 1.0)
    return calls


@pytest.mark.parametrize("is_final", [True, False])
def test_search_for_a_closer_point_ends_with_the_first(
    is_final: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Near the atoms, then briefly, then all: only a complete search shows that none is closer."""
    for stage_with_progress in (0, 1, 2):
        calls: list[Any] = []

        def query(_y: Any, _atoms: Any, _row: int, budget: float, _t: Any, c: Any = calls) -> Any:
            c.append(budget)
            return (0.0 if budget == 900.0 else 0.5), 10.0

        def nearby(*_arguments: Any, c: Any = calls) -> float:
            c.append("nearby")
            return 0.0

        def gap(*_arguments: Any, c: Any = calls, stage: int = stage_with_progress) -> Any:
            return (1.0 if len(c) == stage + 1 else 0.0), 1e-6

        monkeypatch.setattr(split_solver, "split_query", query)
        monkeypatch.setattr(split_solver, "split_query_nearby", nearby)
        monkeypatch.setattr(split_solver, "split_duality_gap", gap)
        monkeypatch.setattr(split_solver, "evaluation_cost", lambda _texture: 1.0)
        args = (Y, random_atoms(2), 2, is_final, 0.4, 1.0, 900.0 if is_final else 910.0, None)
        _gap, _rounding, error_bound, _evaluations = split_solver.split_query_closer(*args)
        expected = [900.0] if is_final else ["nearby", split_solver.SHORT_SEARCH, 900.0]
        count = 1 if is_final else stage_with_progress + 1
        assert calls == expected[:count]
        assert error_bound == (0.0 if is_final else (np.inf, 0.5, 0.0)[stage_with_progress])


def test_steps_of_newtons_method_that_do_not_shrink_are_not_a_solution() -> None:
    """At this probe on cloth Newton's method stalls far from the solution.

    Accepted, its y led to atoms without weight, and the search ended with 4 % too much potential.
    """
    texture = named_surface("cloth")
    z = -7.171628434352647e-05
    points, out = np.array([[1.2e-3, 8.8e-4, z], [1.2e-3, 8.8e-4, z - 1e-7]]), np.empty((2, 3))
    loops = fuse_surface(LAWS["H"], texture.sampler, NONE)
    loops.split_batch(points, out, 1.0, texture.arguments)
    assert (out[:, 1] == 3).all()
    assert (out[:, 2] < 1e-12 * out[:, 0]).all()
    assert out[0, 0] == pytest.approx(7.63001e-9, rel=1e-5)
