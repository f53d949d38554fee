"""Onsets are cached between runs under a key of everything that they depend on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any
from uuid import uuid4

import numpy as np
import pytest

from asperity.core import cache
from asperity.laws import Law
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, find_onset
from asperity.simulation.lanes import BatchSimulation
from asperity.simulation.onset import Onset
from asperity.surface import Surface
from asperity.textures import Sinusoid

pytestmark = pytest.mark.caches_results
LOOP: dict[str, Any] = {
    "surface": Surface(Sinusoid(0.2e-3, 2e-3), "W", max_depth=1e-2),
    "plant": Cartesian(0.05, 3.0),
    "hand": SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0)),
    "servo": Servo(1e-3),
    "motion": Stationary((0.0, 0.0, 0.0)),
    "duration": 0.1,
    "starts": 1,
    "lowest": 900.0,
    "highest": 1000.0,
}


@pytest.fixture(autouse=True)
def empty_cache(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An empty namespace of results; compiled code is shared with other tests."""
    monkeypatch.setattr(cache, "RESULTS_NAMESPACE", f"results-{uuid4().hex}")
    yield
    for entry in cache.list_entries():
        if entry.namespace == cache.RESULTS_NAMESPACE:
            entry.path.unlink()


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The list of simulated stiffnesses, filled as they are run."""
    stiffnesses: list[float] = []
    new_trajectory = BatchSimulation.new_trajectory

    def record(loop: BatchSimulation, stiffness: float, *rest: Any) -> Any:
        stiffnesses.append(stiffness)
        return new_trajectory(loop, stiffness, *rest)

    monkeypatch.setattr(BatchSimulation, "new_trajectory", record)
    return stiffnesses


def cached_onset(**changes: Any) -> Onset:
    return find_onset(**LOOP | changes)


def test_onset_is_computed_once_and_then_cached(runs: list[float]) -> None:
    onset = cached_onset()
    assert runs
    runs.clear()
    assert cached_onset() == onset
    # The surface's stiffness is not part of the key; an explicit default start equals the default.
    assert cached_onset(surface=LOOP["surface"].to_stiffness(3.0), start=np.zeros(3)) == onset
    assert not runs


CHANGES: dict[str, Callable[[], Any]] = {
    "surface": lambda: Surface(Sinusoid(0.21e-3, 2e-3), "W", max_depth=1e-2),
    "plant": lambda: Cartesian(0.05, np.nextafter(3.0, 4.0)),
    "hand": lambda: replace(LOOP["hand"], damping=1.1),
    "servo": lambda: Servo(1e-3, delay=1),
    "motion": lambda: Stationary((0.0, 0.0, 1e-9)),
    "start": lambda: (0.0, 0.0, 1e-3),
    "velocity": lambda: (0.0, 0.0, 1e-3),
    "duration": lambda: 0.11,
    "starts": lambda: 2,
    "tolerance": lambda: 0.03,
    "threshold": lambda: 14e-3,
    "lowest": lambda: 901.0,
    "highest": lambda: 1001.0,
    "near": lambda: 950.0,
}


@pytest.mark.parametrize("name", CHANGES)
def test_changed_argument_is_computed_again(name: str, runs: list[float]) -> None:
    cached_onset()
    runs.clear()
    cached_onset(**{name: CHANGES[name]()})
    assert runs


class UserMotion(Stationary):
    """A user-defined motion, whose behaviour the cache key cannot capture."""


def test_onset_of_a_user_defined_motion_is_not_cached(runs: list[float]) -> None:
    for _ in range(2):
        runs.clear()
        cached_onset(motion=UserMotion((0.0, 0.0, 0.0)))
        assert runs


def test_onset_of_a_user_defined_law_is_cached_by_its_formula(runs: list[float]) -> None:
    for power in (1, 2):
        law = Law("U", "own", "vertical", lambda c, n=power: c.k * c.depth**n * c.e_z)
        runs.clear()
        cached_onset(surface=Surface(Sinusoid(1e-4, 1e-3), law))
        assert runs
