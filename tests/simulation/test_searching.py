"""Searches that sound most stiffnesses, on tables that say what every start comes to."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from asperity.simulation import searching
from asperity.simulation.searching import Found, Search, bracket, run_searches

STARTS = 12
Table = Callable[[float, int], bool]


class ToldStart:
    """A start whose verdict comes after so many runs."""

    def __init__(self, verdict: bool, times: int) -> None:
        self.comes, self.times = verdict, times
        self.verdict: bool | None = None
        self.box = np.zeros((2, 3))


class Lanes:
    """Runs starts as a loop does, each as often as drawn."""

    def __init__(self, seed: int) -> None:
        self.draw, self.runs = random.Random(seed), 0

    def run(self, starts: list[ToldStart]) -> None:
        for start in starts:
            start.times -= 1
            if start.times == 0:
                start.verdict = start.comes


def find(
    tables: list[Table], near: float | None, seed: int = 0, ahead: bool = True, path: Any = bracket
) -> tuple[list[Found], int, set[float]]:
    """Return what searches find side by side, the runs they took, and what was sounded only."""
    lanes = Lanes(seed)

    def search(table: Table) -> Search:
        begun: set[tuple[float, int]] = set()

        def start(stiffness: float, i: int) -> Any:
            assert (stiffness, i) not in begun  # none is run twice
            begun.add((stiffness, i))
            lanes.runs += 1
            return ToldStart(table(stiffness, i), lanes.draw.randrange(1, 9))

        return Search(start, STARTS, lambda: path(1.0, 1000.0, 0.05, near), ahead, None)

    searches = {number: search(table) for number, table in enumerate(tables)}
    assert set(run_searches(lanes, searches)) == set(searches)  # type: ignore[arg-type]
    believed = set().union(*(one._sounded for one in searches.values()))
    return [one.found() for one in searches.values()], lanes.runs, believed


def monotone(seed: int) -> Table:
    """Every start cycles from a stiffness of its own on."""
    draw = random.Random(seed)
    spread = draw.choice([1.01, 1.2, 3.0, 50.0])
    middle = 10.0 ** draw.uniform(0.0, 3.0)
    onsets = [middle * spread ** draw.uniform(-1.0, 1.0) for _ in range(STARTS)]
    return lambda stiffness, i: stiffness >= onsets[i]


def anyhow(seed: int) -> Table:
    """Windows in which one start cycles and others do not, as narrow as a bracket."""
    rate = random.Random(seed).choice([0.02, 0.1, 0.4])
    return lambda k, i: random.Random(f"{seed} {k!r} {i}").random() < rate * k / 500.0


@pytest.mark.parametrize("seed", range(60))
def test_where_starts_go_on_cycling_the_bracket_is_that_of_all_starts(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    near = 10.0 ** random.Random(-seed).uniform(0.0, 3.0) if seed % 3 else None
    (found,), *_ = find([monotone(seed)], near)
    monkeypatch.setattr(searching, "SOUNDED", STARTS)
    (whole,), *_ = find([monotone(seed)], near)
    assert found[:3] == whole[:3]


def test_soundings_save_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    tables = [monotone(seed) for seed in range(60)]
    runs = sum(find([table], 100.0, ahead=False)[1] for table in tables)
    monkeypatch.setattr(searching, "SOUNDED", STARTS)
    assert runs < 0.85 * sum(find([table], 100.0, ahead=False)[1] for table in tables)


def test_both_ends_of_a_bracket_are_facts_whatever_cycles_where() -> None:
    """A sounding is wrong now and then, and never the end of a bracket."""
    wrong = 0
    for seed in range(300):
        table, near = anyhow(seed), (None, 30.0, 300.0)[seed % 3]

        def cycling(stiffness: float, table: Table = table) -> int:
            return sum(table(stiffness, i) for i in range(STARTS))

        (found,), _runs, believed = find([table], near, seed)
        assert found.quiet == 0.0 or cycling(found.quiet) == 0
        assert found.quiet < found.cycling <= max(1.0, 1.05 * found.quiet) or found.cycling > 1000.0
        if math.isfinite(found.cycling):
            assert found.cycles == cycling(found.cycling) > 0
        wrong += sum(cycling(stiffness) > 0 for stiffness in believed)
    assert wrong > 100


def test_what_runs_beside_a_search_changes_nothing() -> None:
    """Nor how long each run takes, or whether some run ahead."""
    tables = [anyhow(seed) for seed in range(6)]
    alone = [find([table], 300.0, seed=number)[0][0] for number, table in enumerate(tables)]
    for seed in range(20):
        found, _runs, _believed = find(tables, 300.0, seed, ahead=seed % 2 == 0)
        assert [one[:3] for one in found] == [one[:3] for one in alone]
    assert len({one.cycling for one in alone}) > 1


def test_nothing_is_climbed_over_on_a_sounding() -> None:
    """A window of one start, between stiffnesses that are quiet: the path asks for all of them."""

    def table(stiffness: float, i: int) -> bool:
        return i == 7 and 100.0 <= stiffness < 400.0

    def careless(*numbers: Any) -> Any:
        path = bracket(*numbers)
        stiffness, _whole = next(path)
        while True:
            try:
                stiffness, _whole = path.send((yield stiffness, False))
            except StopIteration as end:
                return end.value

    for near in (None, 50.0):
        (found,), _runs, _believed = find([table], near)
        assert found.quiet < 100.0 <= found.cycling < 105.0
    assert math.isinf(find([table], 50.0, path=careless)[0][0].cycling)  # so it would be missed
