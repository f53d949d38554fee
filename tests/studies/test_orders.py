"""Orders of conditions are balanced, and runs are the same when they are replayed."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import pytest
from tests.studies.study_cases import answers, design_of

from asperity.core.errors import ParameterError
from asperity.studies.design import balanced_order
from asperity.studies.methods import METHODS


def counts(orders: list[list[int]]) -> tuple[set[int], set[int]]:
    """Return how often conditions stand in places, and follow each other."""
    size = len(orders[0])
    places = Counter((i, one) for order in orders for i, one in enumerate(order))
    follow = Counter(pair for order in orders for pair in pairwise(order))
    followed = {follow[a, b] for a in range(size) for b in range(size) if a != b}
    return {places[i, one] for i in range(size) for one in range(size)}, followed


@pytest.mark.parametrize("size", range(2, 12))
def test_orders_are_balanced_to_first_order(size: int) -> None:
    rows = size if size % 2 == 0 else 2 * size
    places, followed = counts([balanced_order(size, one) for one in range(rows)])
    assert places == {rows // size}
    assert followed == {rows // size}


def test_a_rotated_order_is_not_balanced() -> None:
    rotated = [[(place + row) % 6 for place in range(6)] for row in range(6)]
    places, followed = counts(rotated)
    assert places == {1}
    assert len(followed) > 1


def test_one_condition_has_one_order() -> None:
    assert balanced_order(1, 7) == [0]


@pytest.mark.parametrize("kind", METHODS)
def test_runs_replay_from_seed_and_answers(kind: str) -> None:
    design = design_of(kind)
    first = answers(design, 2)
    replayed = METHODS[kind].make(design, 2, 5)
    for one in first:
        assert replayed.next() == one.presentation
        assert replayed.next() is replayed.next()
        replayed.answer(one.answer)
    assert replayed.next() is None
    with pytest.raises(ParameterError, match="after the end"):
        replayed.answer("1")
    presentations = [one.presentation for one in first]
    assert presentations != [one.presentation for one in answers(design, 3)]


def test_bayesian_runs_replay() -> None:
    pytest.importorskip("SweetSpot", reason="not run: no SweetSpot here")
    design = design_of("detection", procedure="bayesian", trials=5)
    assert answers(design) == answers(design) != answers(design, seed=6)


@pytest.mark.parametrize("kind", METHODS)
def test_answers_that_are_not_allowed_are_refused(kind: str) -> None:
    method = METHODS[kind].make(design_of(kind), 0, 1)
    for answer in ("yes", "", "-1", "nan", "inf"):
        with pytest.raises(ParameterError, match="answer"):
            method.answer(answer)


def test_pairs_come_as_often_in_either_place() -> None:
    shown = [one.presentation for one in answers(design_of("comparison", repeats=4))]
    letters = Counter(tuple(one["surface.law"] for one in each.intervals) for each in shown)
    assert set(letters.values()) == {2}
    assert len(letters) == 12


def test_x_equals_either_end_equally_often() -> None:
    shown = [one.presentation for one in answers(design_of("axb", repeats=4))]
    assert Counter(one.correct for one in shown) == {"1": 12, "3": 12}
    for one in shown:
        first, middle, last = one.intervals
        assert first != last
        assert middle == (first if one.correct == "1" else last)


def test_series_ascend_and_descend() -> None:
    shown = [one.presentation for one in answers(design_of("onset"))]
    starts = [one.intervals[0]["surface.stiffness"] for one in shown]
    assert sum(start < 316.0 for start in starts) == len(starts) / 2
    assert min(starts) >= 100.0
    assert max(starts) <= 1000.0
    assert len(set(starts)) == len(starts)


@pytest.mark.parametrize(
    ("kind", "options", "words"),
    [
        ("detection", {"range": [1e-4, 1e-6]}, "two ascending"),
        ("detection", {"target": 0.5}, "above 0.5"),
        ("detection", {"intervals": 4}, "2 or 3"),
        ("discrimination", {"reference": 2e-5}, "below the range"),
        ("onset", {"range": [1.0]}, "two ascending"),
    ],
)
def test_options_that_cannot_be_used_are_refused(kind: str, options: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        METHODS[kind].make(design_of(kind, **options), 0, 1)


def test_too_few_conditions_are_refused() -> None:
    from asperity.studies.design import StudyDesign

    with pytest.raises(ParameterError, match="at least 2 conditions"):
        METHODS["comparison"].make(StudyDesign("comparison", {"surface.law": ("A",)}), 0, 1)
