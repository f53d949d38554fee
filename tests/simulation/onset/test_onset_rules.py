"""The rules by which an onset is found, on stand-ins for runs: what cycles is told."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, Strokes, find_onset
from asperity.simulation.batch import SegmentStatistics
from asperity.simulation.kernels.body_interface import LANES
from asperity.simulation.limit_cycles import onset
from asperity.simulation.limit_cycles.onset import Onset, find_onsets, is_at_rest, start_offsets
from asperity.simulation.limit_cycles.onset_search import (
    CYCLE_SPEED,
    bracket_onset,
    limit_cycle_rule,
)
from asperity.simulation.trace import COLUMNS, StopReason, TailStatistics
from asperity.surface import Surface
from asperity.textures import Sinusoid

NAMES = [name for name, _unit in COLUMNS]
SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "A", max_depth=1e-3)


def judged(
    *seen: SegmentStatistics, first: int = 16, threshold: float = 1.0
) -> tuple[bool, list[int]]:
    """Return what is judged of a run that is seen so, and after how many samples it is looked at.

    Args:
        seen: one after the other.
        first: samples of the run before it is made longer.
        threshold: see ``ends_in_cycle``.
    """
    judge = limit_cycle_rule(lambda times: round(times * first), threshold)
    goals = [next(judge)]
    for number, one in enumerate(seen):
        try:
            goals.append(judge.send(one))
        except StopIteration as end:
            assert number == len(seen) - 1
            return end.value, goals
    raise AssertionError("it wants to see more")


def look(
    restlessness: float = 0.0, supplied: float = 0.0, taken: float = 0.0, stop: str = "",
    samples: int = 0,
) -> SegmentStatistics:  # fmt: skip
    """Return a look at a run, with energies that were the same one sample before."""
    energies = supplied, taken
    return SegmentStatistics(samples, StopReason(stop), restlessness, energies, energies)


def quarters(before: float, last: float, fed: bool = True) -> tuple[SegmentStatistics, ...]:
    """Return the three looks at a run: its first half, and its last two quarters."""
    return look(99.0), look(before, 5.0, 5.0), look(last, 6.0 if fed else 5.0, 6.0)


LIVELY = quarters(2.0, 2.0)


@pytest.mark.parametrize(
    ("seen", "ends"),
    [
        ((*LIVELY, *quarters(1.5, 1.5)), True),
        ((*LIVELY, *quarters(1.5, 1.5, fed=False)), False),  # restless, but on its own
        ((*LIVELY, *quarters(1.5, 0.5)), False),  # fed, but at rest
        ((look(stop="diverged"),), True),
        ((look(), look(), look(stop="diverged")), True),
    ],
)
def test_a_cycle_is_restless_and_fed_or_diverged(
    seen: tuple[SegmentStatistics, ...], ends: bool
) -> None:
    assert judged(*seen)[0] is ends


@pytest.mark.parametrize(
    ("seen", "ends"),
    [
        (LIVELY[1:], True),
        (quarters(2.0, 2.0, fed=False)[1:], False),
        ((look(9.0), look(1.0, 1.0, 1.0)), False),  # at the threshold
    ],
)
def test_what_leaves_is_run_again_for_its_last_quarter(
    seen: tuple[SegmentStatistics, ...], ends: bool
) -> None:
    """With the sample that the body could not follow."""
    found, goals = judged(look(stop="left the workspace", samples=10), *seen)
    assert (found, goals) == (ends, [8, 11 - 2, 11])


def test_what_leaves_at_once_has_no_quarter() -> None:
    assert judged(look(stop="left the workspace", samples=6)) == (False, [8])
    with pytest.raises(AssertionError, match="see more"):
        judged(look(stop="left the workspace", samples=7))


def test_a_cycle_is_above_the_threshold() -> None:
    assert judged(*quarters(2.0, 1.0)) == (False, [8, 12, 16])
    assert judged(*LIVELY, *quarters(1.0, math.nextafter(1.0, 2.0)))[0]
    assert CYCLE_SPEED == 15e-3


@pytest.mark.parametrize(("supplied", "ends"), [(0.2, False), (0.21, True), (-1.0, False)])
def test_what_is_fed_is_fed_a_fifth(supplied: float, ends: bool) -> None:
    """Of what is taken in the last quarter, up to the last sample; what was before counts not."""
    before = SegmentStatistics(0, StopReason.NONE, 2.0, (0.0, 3.0), (-7.0, -7.0))
    last = SegmentStatistics(0, StopReason.NONE, 2.0, (99.0, 99.0), (supplied, 4.0))
    assert judged(*LIVELY, look(), before, last)[0] is ends


@pytest.mark.parametrize("rows", range(16, 24))
def test_quarters_are_those_of_numpy(rows: int) -> None:
    sizes = [len(part) for part in np.array_split(np.zeros(rows), 4)]
    _found, goals = judged(*quarters(0.0, 0.0), first=rows)
    assert goals == [sum(sizes[:2]), sum(sizes[:3]), rows]


@pytest.mark.parametrize(
    ("speeds", "spans", "ends"),
    [
        (((1.0, 1.0),), (16,), False),  # at the threshold: at rest
        (((1.0, 1.1), (1.1, 1.0)), (16, 64), False),
        (((1.0, 1.1), (1.1, 1.1)), (16, 64), True),  # steady: it need not go on
        (((9.0, 2.0), (2.0, 1.79), (2.0, 1.79)), (16, 64, 256), True),  # calmer, to the last
        (((9.0, 2.0), (2.0, 1.8)), (16, 64), True),  # a tenth exactly is not less
        (((9.0, 2.0), (2.0, 1.5), (1.2, 0.9)), (16, 64, 256), False),
    ],
)
def test_a_restless_run_is_made_longer(
    speeds: tuple[tuple[float, float], ...], spans: tuple[int, ...], ends: bool
) -> None:
    found, goals = judged(*(seen for pair in speeds for seen in quarters(*pair)))
    assert (found, tuple(goals[2::3])) == (ends, spans)


def test_the_value_of_a_bracket() -> None:
    def value(quiet: float, cycling: float) -> float:
        return Onset("A", 0, quiet, cycling, 1, 1, (0.0,) * 3, (0.0,) * 3).value

    assert value(4.0, 9.0) == 6.0
    assert value(0.0, 9.0) == 9.0
    assert value(4.0, math.inf) == math.inf


def answered(path: Any, cycling_at: Callable[[float], bool]) -> tuple[float, float]:
    """Return the bracket of a search that is told where loops cycle."""
    stiffness = next(path)
    while True:
        try:
            stiffness = path.send(cycling_at(stiffness))
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]  # that of a generator


def found_bracket(
    onset_at: float, low: float, high: float, width: float
) -> tuple[Any, list[float]]:
    tried: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tried.append(stiffness)
        return stiffness >= onset_at

    return answered(bracket_onset(low, high, width), cycling_at), tried


def test_the_search_goes_up_in_doubles_and_halves_the_ratio() -> None:
    found, tried = found_bracket(9.0, 1.0, 1000.0, 0.5)
    assert tried == pytest.approx([1.0, 2.0, 4.0, 8.0, 16.0, math.sqrt(128.0)])
    assert found == (8.0, pytest.approx(math.sqrt(128.0)))
    quiet, cycling = found_bracket(9.0, 1.0, 1000.0, 1e-6)[0]
    assert quiet < 9.0 <= cycling <= quiet * (1.0 + 1e-6)


def test_a_bracket_as_wide_as_asked_is_narrow_enough() -> None:
    found, tried = found_bracket(9.0, 1.0, 1000.0, 1.0)
    assert (found, len(tried)) == ((8.0, 16.0), 5)


def test_the_highest_stiffness_is_tried_and_none_above() -> None:
    assert found_bracket(1e9, 1.0, 10.0, 0.1) == ((10.0, math.inf), [1.0, 2.0, 4.0, 8.0, 10.0])
    assert found_bracket(1e9, 1.0, 8.0, 0.1) == ((8.0, math.inf), [1.0, 2.0, 4.0, 8.0])
    found, tried = found_bracket(9.5, 1.0, 10.0, 2.0)
    assert (found, tried[-1]) == ((8.0, 10.0), 10.0)


def test_what_cycles_at_once_has_no_quiet_end() -> None:
    assert found_bracket(0.5, 1.0, 10.0, 0.1) == ((0.0, 1.0), [1.0])


@pytest.mark.parametrize("seed", range(60))
def test_from_near_the_same_bracket_is_found_with_fewer_questions(seed: int) -> None:
    draw = random.Random(seed)
    onset_at = 10.0 ** draw.uniform(-1.0, 5.5)
    near = onset_at * 2.0 ** draw.uniform(-3.0, 3.0)
    ends = (10.0 ** draw.uniform(0.0, 1.0), 10.0 ** draw.uniform(4.5, 5.0))
    width = 10.0 ** draw.uniform(-3.0, 0.0)
    climbed, all_tried = found_bracket(onset_at, *ends, width)
    tried: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tried.append(stiffness)
        return stiffness >= onset_at

    assert answered(bracket_onset(*ends, width, near), cycling_at) == climbed
    assert len(tried) == len(set(tried)) <= len(all_tried) + 3
    assert set(tried) - set(all_tried) <= {k for k in tried if k >= onset_at or k == ends[1]}


def test_from_near_a_window_farther_down_is_passed_over() -> None:
    def cycling_at(stiffness: float) -> bool:
        return 3.0 <= stiffness < 9.0 or stiffness >= 700.0

    assert answered(bracket_onset(1.0, 1e6, 1.0), cycling_at) == (2.0, 4.0)
    assert answered(bracket_onset(1.0, 1e6, 1.0, 300.0), cycling_at) == (512.0, 1024.0)
    assert answered(bracket_onset(1.0, 1e6, 1.0, 8.5), cycling_at) == (2.0, 4.0)


@pytest.mark.parametrize("near", [0.0, -1.0, 1e-9, 1e9])
def test_wherever_it_is_expected_the_onset_is_found(near: float) -> None:
    assert answered(bracket_onset(1.0, 1000.0, 1.0, near), lambda k: k >= 9.0) == (8.0, 16.0)


# --- the whole search, on runs that are told ------------------------------------------------------


PLANT, SERVO = Cartesian(0.05, 3.0), Servo(1e-3)
HAND = SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))


class ToldStart:
    """A start that is known when it has been run so many times."""

    def __init__(self, stiffness: float, delay: int, shift: float, times: int) -> None:
        self.stiffness, self.delay, self.shift, self.times = stiffness, delay, shift, times
        self.verdict: bool | None = None
        self.position_bounds = np.array([[-shift, 0.0, -stiffness], [shift, 0.0, stiffness]])


class ToldLoop:
    """Starts cycle from 100 N/m on, and from 200 N/m all; they reach as far as they are stiff."""

    def __init__(self, is_vectorized: bool = False, times: int = 1) -> None:
        self.is_vectorized, self.times = is_vectorized, times
        self.seen: list[tuple[float, float]] = []
        self.together: list[list[ToldStart]] = []

    def new_trajectory(
        self, stiffness: float, delay: int, shift: FloatArray, _rule: Any
    ) -> ToldStart:
        return ToldStart(stiffness, delay, float(shift[0]), self.times)

    def run(self, starts: list[ToldStart]) -> None:
        assert 1 <= len(starts) <= LANES
        assert len(set(map(id, starts))) == len(starts)
        self.together.append(starts)
        for start in starts:
            assert start.verdict is None
            start.times -= 1
            if start.times == 0:
                self.seen.append((start.stiffness, start.shift))
                start.verdict = self.cycles(start)

    def cycles(self, start: ToldStart) -> bool:
        known = 100.0 if start.shift > 1.4e-3 else 200.0
        return start.stiffness * (1 + start.delay) >= known


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """The stiffnesses and shifts that are run."""
    loop = ToldLoop()
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: loop)
    return loop.seen


def search(starts: int = 4, **more: Any) -> Onset:
    still = Stationary((0.0, 0.0, 0.0))
    return find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=starts, **more)


def test_one_start_that_cycles_is_enough(told: list[tuple[float, float]]) -> None:
    found = search(lowest=90.0, tolerance=0.05)
    assert found.quiet < 100.0 <= found.cycling <= 1.05 * found.quiet
    assert (found.starts, found.cycles) == (4, 1)
    # The last stiffness is looked at from every start, once, and where they got is kept.
    assert sorted(shift for k, shift in told if k == found.cycling) == pytest.approx(
        [0.0, 0.5e-3, 1e-3, 1.5e-3]
    )
    assert found.low == pytest.approx((-1.5e-3, 0.0, -found.cycling))
    assert found.high == pytest.approx((1.5e-3, 0.0, found.cycling))


def test_a_start_that_cycles_ends_its_stiffness(told: list[tuple[float, float]]) -> None:
    found = search(lowest=300.0)
    assert (found.quiet, found.cycling, found.cycles) == (0.0, 300.0, 4)
    # No start is run twice, not for where the others get to either.
    assert told == [(300.0, pytest.approx(i * 0.5e-3)) for i in range(4)]
    told.clear()
    search(lowest=50.0, near=800.0)
    assert [shift for k, shift in told if k == 800.0] == [0.0]


def test_the_start_that_cycled_last_is_tried_first(told: list[tuple[float, float]]) -> None:
    """Alone, and the others as many at a time as go side by side."""
    search(starts=24, lowest=75.0, near=75.0, tolerance=0.1)
    tried = {k: [round(shift * 12e3) for j, shift in told if j == k] for k, _shift in told}
    assert tried[75.0] == list(range(24))
    assert tried[150.0] == list(range(24))  # the third group cycles: from 17 on
    middle = math.sqrt(75.0 * 150.0)
    first = told.index((middle, pytest.approx(17 / 12e3)))
    assert told[first + 1][0] != middle


class Windowed(ToldLoop):
    """One start cycles about 566 N/m, too; the others, as it does, from 700 N/m on only."""

    def cycles(self, start: ToldStart) -> bool:
        alone = start.shift > 1.4e-3 and 560.0 <= start.stiffness < 570.0
        return alone or start.stiffness >= 700.0


@pytest.mark.parametrize("at_once", [False, True])
def test_a_window_of_one_start_is_found_where_a_bracket_is_halved(
    monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    """Every stiffness that says where the search goes on is tried from all starts."""
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: Windowed(at_once))
    found = search(lowest=100.0, near=400.0, tolerance=0.05)  # 400, 800, and between them 566
    assert found.quiet < 560.0 <= found.cycling < 570.0
    assert found.cycles == 1


@pytest.mark.parametrize("at_once", [False, True])
def test_delays_are_looked_for_together(monkeypatch: pytest.MonkeyPatch, at_once: bool) -> None:
    """Whatever else runs beside it, an onset is the one that is found alone."""
    still, delays, nears = Stationary((0.0, 0.0, 0.0)), (0, 1, 4), (None, 300.0, 20.0)
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: ToldLoop())
    alone = [
        find_onset(SURFACE, PLANT, HAND, Servo(1e-3, d), still, starts=24, near=near)
        for d, near in zip(delays, nears, strict=True)
    ]
    loop = ToldLoop(at_once, times=3)
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: loop)
    done: list[int] = []
    found = find_onsets(
        SURFACE,
        PLANT,
        HAND,
        SERVO,
        still,
        delays,
        nears,
        starts=24,
        onset_callback=lambda: done.append(1),
    )
    assert found == alone
    assert len(done) == 3
    assert len({one.cycling for one in found}) == 3
    first, *_ = loop.together
    # One start of each at first; where bodies move at once, others fill the lanes.
    assert sorted(start.delay for start in first if start.shift == 0.0) == list(delays)
    assert len(first) == (LANES if at_once else 3)


@pytest.mark.usefixtures("told")
def test_where_nothing_cycles_the_highest_stiffness_is_looked_at() -> None:
    calls: list[int] = []
    found = search(lowest=10.0, highest=50.0, progress=lambda: calls.append(1))
    assert (found.quiet, found.cycling, found.cycles) == (50.0, math.inf, 0)
    assert found.high[2] == 50.0
    assert len(calls) == 5  # 10, 20, 40, 50, and 50 from every start


@pytest.mark.usefixtures("told")
@pytest.mark.parametrize(
    ("more", "named"),
    [
        ({"lowest": 10.0, "highest": 10.0}, "lowest"),
        ({"tolerance": 0.99e-9}, "tolerance"),
        ({"duration": 15.9e-3}, "duration"),
    ],
)
def test_the_border_of_what_is_refused(more: dict[str, float], named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        search(**more)


@pytest.mark.usefixtures("told")
def test_the_border_of_what_is_taken() -> None:
    search(tolerance=1e-9, lowest=90.0, duration=16e-3)
    still = Stationary((0.0, 0.0, 0.0))
    assert find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=1).starts == 1
    with pytest.raises(ParameterError, match="starts"):
        find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=10_001)


def test_a_hand_must_be_at_rest_in_the_second_half() -> None:
    way = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1, count=1)  # 1 s
    assert is_at_rest(way, 2.0)
    assert not is_at_rest(way, 1.9)


def test_offsets_do_not_reach_the_period_again() -> None:
    shifts: FloatArray = start_offsets(SURFACE, 5)
    np.testing.assert_allclose(shifts[:, 0], np.arange(5) * 0.4e-3, atol=1e-18)
    assert not shifts[:, 1:].any()


def test_an_ending_is_told_from_rows_as_they_come() -> None:
    """Whatever the parts: as from the last quarter of the whole table, column by its name."""
    rng, answers = np.random.default_rng(48), set()
    for rows in range(4, 64):
        table = rng.normal(size=(rows, len(COLUMNS)))
        ending, seen = TailStatistics(rows), 0
        for part in np.split(table, np.sort(rng.integers(0, rows + 1, 3))):
            ending.update(part)
            seen += len(part)
            assert ending.is_complete == (seen == rows)
        moving = table[rows - rows // 4 :, [NAMES.index(f"v{axis}") for axis in "xyz"]]
        assert ending.velocity_spread == pytest.approx(np.std(moving, axis=0).sum(), abs=1e-15)
        change = dict(zip(NAMES, table[-1] - table[rows - max(rows // 4, 2)], strict=True))
        supplied = sum(change[f"supplied {axis}"] for axis in "xyz")
        assert ending.gains_energy == (supplied > 0.2 * (change["lost"] - change["friction"]))
        answers.add(ending.gains_energy)
    assert answers == {True, False}
