"""What the parts of law H's solver ask of each other, and what they make of the answers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.contacts.split import solver
from asperity.core.checks import FloatArray
from asperity.core.compiled import EPS

RNG = np.random.default_rng(33)
P, Y = np.array([0.1, 0.2, -0.9]), np.array([0.3, -0.2, -0.5])
C = 1.5


def some_atoms(count: int) -> FloatArray:
    atoms = np.zeros((5, 4))
    atoms[:count, :3] = RNG.normal(size=(count, 3))
    atoms[:count, 3] = RNG.dirichlet(np.ones(count))
    return atoms


def value_of(atoms: FloatArray, count: int) -> tuple[float, FloatArray]:
    """Return the energy of atoms at P, and the vector to their mean."""
    mu, weights, away = 1.0 / (1.0 + C), atoms[:count, 3], atoms[:count, :3] - P
    mean = weights @ away
    spread = float((weights * ((away - mean) ** 2).sum(axis=1)).sum())
    return 0.5 * (float(mean @ mean) + (1.0 - mu) * spread), mean


@pytest.mark.parametrize("row", [0, 2])
def test_a_query_writes_the_nearest_free_point(row: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The point itself where it is free; else a foot, searched from the first atom or above it."""
    told: list[Any] = []

    def foot_within(*given: Any) -> Any:
        told.append(given)
        return 0.7, 0.8, 9.0, 9.0, 9.0, 0.05, 21.0

    monkeypatch.setattr(solver, "closest_point_within_budget", foot_within)
    monkeypatch.setattr(solver, "evaluation_cost", lambda _texture: 1.0)
    for height, free in ((-0.5, True), (-0.4, False)):
        monkeypatch.setattr(
            solver, "sample_height", lambda x, y, _t, h=height: h + (x - 0.3) - (y + 0.2)
        )
        atoms = some_atoms(4)
        before = atoms.copy()
        gap, looks = solver.split_query(Y, atoms, row, 40.0, "texture")
        if free:
            assert (gap, looks, told) == (0.0, 1.0, [])
            np.testing.assert_array_equal(atoms[row], [*Y, 0.0])
        else:
            start = tuple(before[0, :2]) if row else tuple(Y[:2])
            assert (gap, looks) == (0.05, 21.0)
            assert told == [(*Y, *start, 40.0, "texture")]
            np.testing.assert_allclose(atoms[row], [0.7, 0.8, -0.4 + 0.4 - 1.0, 0.0], rtol=1e-15)
        others = [i for i in range(5) if i != row]
        np.testing.assert_array_equal(atoms[others], before[others])


@pytest.mark.parametrize(
    ("left", "nearer", "kept"),
    [(2, 0.1, True), (2, 0.0, True), (2, -0.1, False), (1, 0.1, True), (0, 0.1, False)],
)
def test_a_polish_that_does_not_help_is_taken_back(
    left: int, nearer: float, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Equal energies are kept; where it is not kept atoms and y are as they were."""

    def split_polish(
        atoms: FloatArray, count: int, p: FloatArray, y: FloatArray, *rest: Any
    ) -> Any:
        assert (count, rest[2:]) == (2, (40.0, "texture"))
        np.testing.assert_array_equal(p, P)
        atoms[:2, :3] += nearer * (P - atoms[:2, :3])
        atoms[0, 3] += 1.0 if left == 1 else 0.0
        y += 1.0
        return left, 13.0

    monkeypatch.setattr(solver, "split_newton", split_polish)
    atoms, y = some_atoms(2), Y.copy()
    if left == 1:
        atoms[:2] = [[*(P + 0.2), 0.0], [*(P + 0.9), 1.0]]
    before = atoms.copy()
    mu, a = 1.0 / (1.0 + C), np.zeros((7, 10))
    found = solver.split_try_newton(atoms, 2, P, y, mu, a, 40.0, "texture")
    assert found == (left if kept else 0, 13.0)
    np.testing.assert_array_equal(y, Y + 1.0 if kept else Y)
    if not kept:
        np.testing.assert_array_equal(atoms, before)


def test_a_polish_may_raise_the_energy_by_rounding(monkeypatch: pytest.MonkeyPatch) -> None:
    for units, kept in ((40.0, 3), (45.0, 3), (50.0, 0)):
        values = iter([2.0, 2.0 * (1.0 + units * EPS)])
        monkeypatch.setattr(
            solver, "split_evaluate_energy", lambda *_given, values=values: next(values)
        )
        monkeypatch.setattr(solver, "split_newton", lambda *_given: (3, 5.0))
        args: Any = (some_atoms(3), 3, P, Y.copy(), 0.4, np.zeros((7, 10)), 40.0, None)
        assert solver.split_try_newton(*args)[0] == kept


@pytest.mark.parametrize(("count", "solved"), [(1, 0), (3, 0), (3, 2)])
def test_y_follows_from_the_mean_or_the_mean_from_y(
    count: int, solved: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []

    def split_try_polish(*given: Any) -> Any:
        told.append(given[1:2] + given[4:5] + given[6:])
        if solved:
            given[3][:] = Y
        return solved, 7.0

    monkeypatch.setattr(solver, "split_try_newton", split_try_polish)
    atoms, y, pull = some_atoms(count), np.full(3, np.nan), np.full(3, np.nan)
    mean = value_of(atoms, count)[1]
    found = solver.split_update_dual(
        atoms, count, P, y, pull, C, np.zeros((7, 10)), 40.0, "texture"
    )
    assert found == (solved, 7.0 if count > 1 else 0.0)
    assert told == ([(count, pytest.approx(0.4), 40.0, "texture")] if count > 1 else [])
    if solved:
        np.testing.assert_array_equal(y, Y)
        np.testing.assert_allclose(pull, C * (P - Y), rtol=1e-15)
    else:
        np.testing.assert_allclose(pull, mean, rtol=1e-12)
        np.testing.assert_allclose(y, P - mean / C, rtol=1e-12)


@pytest.mark.parametrize(
    ("known", "works", "asked", "answer"),
    [
        (0, True, ["query", "settle 1"], (1, 0, 9.0)),
        (1, True, ["follow", "settle 1"], (1, 0, 4.0)),
        (1, False, ["follow", "query", "settle 1"], (1, 0, 13.0)),
        (3, True, ["weights 3", "settle 3"], (2, 2, 6.0)),
        (3, False, ["weights 3", "settle 3", "query", "settle 1"], (1, 0, 15.0)),
        (2, True, ["weights 2", "settle 2"], (2, 2, 6.0)),
    ],
)
def test_a_search_begins_with_what_is_known(
    known: int, works: bool, asked: list[str], answer: tuple[float, ...],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Atoms of a probe nearby, moved; one foot that follows; else the nearest point.

    Several have the weights that are best where they are, if all are positive: here, those of two.
    """
    told: list[str] = []

    def subset(given: Any, count: int, mask: int, p: Any, mu: float, *rest: Any) -> int:
        told.append(f"weights {count}")
        assert (mask, mu, tuple(p)) == (2**count - 1, 1.0 / (1.0 + C), tuple(P))
        rest[1][:] = given[:4]
        rest[1][:count, 3] = 0.5
        return count if count == 2 else 0

    def settle(_atoms: Any, count: int, p: Any, _y: Any, _pull: Any, c: float, *rest: Any) -> Any:
        told.append(f"settle {int(count)}")
        assert (tuple(p), c) == (tuple(P), C)
        assert rest[1:] == (10.0 if count > 1 else 0.0, "texture")
        return (2 if works else 0, 6.0) if count > 1 else (0, 50.0)

    def follow(p: Any, _atoms: Any, row: int, most: int, _texture: Any) -> Any:
        told.append("follow")
        assert (tuple(p), row, most) == (tuple(P), 0, 25)
        return works, 4.0

    def query(p: Any, _atoms: Any, row: int, budget: float, _texture: Any) -> Any:
        told.append("query")
        assert (tuple(p), row, budget) == (tuple(P), 0, 40.0)
        return 0.0, 9.0

    asking = (
        ("update_dual", settle), ("track_point", follow), ("query", query),
        ("solve_subset", subset),
    )  # fmt: skip
    for name, function in asking:
        monkeypatch.setattr(solver, f"split_{name}", function)
    atoms, y, pull = some_atoms(4), np.zeros(3), np.zeros(3)
    weight = 0.5 if known == 2 else atoms[0, 3]
    a = np.zeros((7, 10))
    found = solver.split_initialize(atoms, known, P, y, pull, C, a, 40.0, "texture")
    assert found == answer
    assert told == asked
    assert atoms[0, 3] == (1.0 if asked[-1] == "settle 1" else weight)
