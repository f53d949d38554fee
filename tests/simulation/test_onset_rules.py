"""The rules of the onset search, on stand-ins for runs with prescribed verdicts."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.perception.grip import load_grip
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary, Strokes, find_onset, onset
from asperity.simulation.lanes import MAX_LANES
from asperity.simulation.onset import Onset, find_onsets, is_at_rest, start_offsets
from asperity.simulation.onset_search import (
    MotionState,
    bracket_onset,
    felt_speed,
    limit_cycle_rule,
    motion_state,
)
from asperity.simulation.trace import SegmentStatistics, StopReason
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "A", max_depth=1e-3)


PERIOD = 1e-3  # [s]


def apply_rule(
    *segments: SegmentStatistics, first: int = 16, threshold: float | None = 1.0
) -> tuple[bool, list[int]]:
    """Return the verdict of the rule on these segments, and the sample counts it requested.

    Args:
        segments: statistics of the segments, in order.
        first: samples of the first run, before it is extended.
        threshold: spread of the velocity of a limit cycle [m/s].
    """
    rule = limit_cycle_rule(lambda times: round(times * first), PERIOD, threshold)
    goals = [next(rule)]
    for number, segment in enumerate(segments):
        try:
            goals.append(rule.send(segment))
        except StopIteration as end:
            assert number == len(segments) - 1
            return end.value, goals
    raise AssertionError("it wants to see more")


def make_segment(
    spread: float = 0.0, supplied: float = 0.0, taken: float = 0.0, stop: str = "", samples: int = 0
) -> SegmentStatistics:
    return SegmentStatistics(samples, StopReason(stop), spread, (supplied, taken))


def quarters(before: float, last: float, fed: bool = True) -> tuple[SegmentStatistics, ...]:
    """Return the three segments of a run: its first half and its last two quarters."""
    return (
        make_segment(99.0),
        make_segment(before, 5.0, 5.0),
        make_segment(last, 6.0 if fed else 5.0, 6.0),
    )


CYCLING = quarters(2.0, 2.0)


@pytest.mark.parametrize(
    ("segments", "ends"),
    [
        ((*CYCLING, *quarters(1.5, 1.5)), True),
        ((*CYCLING, *2 * quarters(1.5, 1.5, fed=False)), False),  # moving, not fed by the texture
        ((*CYCLING, *quarters(1.5, 0.5)), False),  # fed, but at rest
        ((make_segment(stop="diverged"),), True),
        ((make_segment(), make_segment(), make_segment(stop="diverged")), True),
    ],
)
def test_cycle_moves_and_gains_energy_or_diverges(
    segments: tuple[SegmentStatistics, ...], ends: bool
) -> None:
    assert apply_rule(*segments)[0] is ends


@pytest.mark.parametrize(
    ("segments", "ends"),
    [
        (CYCLING, True),
        (quarters(2.0, 2.0, fed=False), False),
        (quarters(9.0, 1.0), False),  # at the threshold
    ],
)
def test_run_that_leaves_the_workspace_is_judged_by_its_last_quarter(
    segments: tuple[SegmentStatistics, ...], ends: bool
) -> None:
    """Up to and including the sample at which it left."""
    verdict, goals = apply_rule(make_segment(stop="left the workspace", samples=10), *segments)
    assert (verdict, goals) == (ends, [8, 11 - 5, 11 - 2, 11])


def test_run_that_leaves_at_once_is_not_a_cycle() -> None:
    assert apply_rule(make_segment(stop="left the workspace", samples=6)) == (False, [8])
    with pytest.raises(AssertionError, match="see more"):
        apply_rule(make_segment(stop="left the workspace", samples=7))


def test_velocity_spread_of_a_cycle_exceeds_the_threshold() -> None:
    assert apply_rule(*quarters(2.0, 1.0)) == (False, [8, 12, 16])
    assert apply_rule(*CYCLING, *quarters(1.0, math.nextafter(1.0, 2.0)))[0]


@pytest.mark.parametrize("frequency", [40.0, 100.0, 300.0])
def test_default_threshold_is_what_a_hand_feels_at_the_frequency(frequency: float) -> None:
    """An amplitude of the threshold curve."""
    amplitude = float(load_grip().threshold(frequency)[1])
    for factor, ends in ((0.99, False), (1.01, True)):
        extent = factor * amplitude / math.sqrt(2.0)
        speed = 2.0 * math.pi * frequency * extent
        segments = [replace(one, position_spread=extent) for one in quarters(speed, speed)]
        segments += segments if ends else []
        assert apply_rule(*segments, first=1024, threshold=None)[0] is ends


def test_felt_speed_beyond_the_curve_is_that_of_its_ends() -> None:
    grip = load_grip()
    ends = [math.sqrt(2.0) * math.pi * f * float(grip.threshold(f)[1]) for f in (40.0, 500.0)]
    assert felt_speed(1e-9, 1.0) == pytest.approx(ends[0])
    assert felt_speed(1.0, 1e-9) == pytest.approx(ends[1])
    assert felt_speed(1.0, 0.0) == pytest.approx(ends[1])
    slow = 13e-3  # 13 mm/s at 24 Hz is no rest
    assert felt_speed(slow, slow / (2.0 * math.pi * 24.0)) == pytest.approx(ends[0])
    assert ends[0] < slow


@pytest.mark.parametrize(("supplied", "spans"), [(0.91, 1), (0.9, 4), (0.21, 4), (0.19, 2)])
def test_cycle_that_lasts_gains_nine_tenths_of_the_loss(supplied: float, spans: int) -> None:
    """Counted from quarter to quarter; less than a fifth is no cycle, the rest is run again."""
    last = make_segment(2.0, 3.0 + supplied, 4.0)
    run = (make_segment(9.0), make_segment(2.0, 3.0, 3.0), last)
    verdict, goals = apply_rule(*CYCLING, *(spans * run))
    assert verdict is (spans == 1)
    assert goals[-1] == 16 * 4**spans


@pytest.mark.parametrize(("count", "spans"), [(3.9, 2), (4.1, 1)])
def test_quarters_of_few_oscillations_tell_nothing(count: float, spans: int) -> None:
    """But for the longest run: an elastic surface takes and returns energy in each oscillation."""
    duration = 16 * PERIOD  # of a quarter of the second run; four times as long in the third
    extent = duration * 2.0 / (2.0 * math.pi * count)
    run = [replace(one, position_spread=extent) for one in quarters(2.0, 2.0)]
    verdict, goals = apply_rule(*run, *(spans * run))
    assert (verdict, goals[-1]) == (True, 16 * 4**spans)


@pytest.mark.parametrize(("spread", "spans"), [(0.02, 1), (0.5, 2)])
def test_what_a_quarter_holds_besides_whole_oscillations_is_an_error(
    spread: float, spans: int
) -> None:
    """With the error the supply must still exceed nine tenths of the loss."""
    extent = 16 * PERIOD * 2.0 / (2.0 * math.pi * 4.1)
    segments = [
        replace(one, position_spread=extent, net_spread=spread) for one in quarters(2.0, 2.0)
    ]
    error = math.sqrt(2.0) * 2.0 * spread / (math.pi * 4.1)
    assert (1.0 - error > 0.9) == (spans == 1)
    calm = [replace(one, net_spread=0.0) for one in segments]
    verdict, goals = apply_rule(*segments, *segments, *(calm if spans == 2 else []))
    assert (verdict, goals[-1]) == (True, 16 * 4**spans)


@pytest.mark.parametrize(
    ("segments", "count", "state"),
    [
        (quarters(2.0, 1e-9), 9.0, MotionState.AT_REST),
        (CYCLING, 9.0, MotionState.CYCLE),
        (CYCLING, 3.0, MotionState.UNDECIDED),
        (quarters(2.0, 1.9), 9.0, MotionState.UNDECIDED),
        (quarters(2.0, 2.0, fed=False), 9.0, MotionState.NOT_FED),
        ((make_segment(2.0, 5.0, 5.0), make_segment(2.0, 5.8, 6.0)), 9.0, MotionState.UNDECIDED),
    ],
)
def test_state_of_a_single_run(
    segments: tuple[SegmentStatistics, ...], count: float, state: MotionState
) -> None:
    """At the end of one run, which is not extended."""
    before, last = segments[-2:]
    extent = last.velocity_spread / (2.0 * math.pi * count)
    assert motion_state(before, replace(last, position_spread=extent), 1.0) is state


@pytest.mark.parametrize("rows", range(16, 24))
def test_quarters_are_split_as_by_numpy(rows: int) -> None:
    sizes = [len(part) for part in np.array_split(np.zeros(rows), 4)]
    _verdict, goals = apply_rule(*quarters(0.0, 0.0), first=rows)
    assert goals == [sum(sizes[:2]), sum(sizes[:3]), rows]


@pytest.mark.parametrize(
    ("speeds", "spans", "ends"),
    [
        (((1.0, 1.0),), (16,), False),  # at the threshold: at rest
        (((1.0, 1.1), (1.1, 1.0)), (16, 64), False),
        (((1.0, 1.1), (1.1, 1.1)), (16, 64), True),  # steady: no longer run needed
        (
            ((9.0, 9.0), *4 * [(9.0, 8.0)]),
            (16, 64, 256, 1024, 4096),
            False,
        ),  # settling up to the longest run: it does not last
        # So it is where it would not be felt in the next run.
        (((9.0, 2.0), (2.0, 1.79), (2.0, 1.79)), (16, 64, 256), False),
        # A decrease of exactly a tenth does not count, nor one that would be it in a longer run.
        (((9.0, 2.0), (2.0, 1.9), (2.0, 1.8)), (16, 64, 256), True),
        (((9.0, 2.0), (2.0, 0.9**0.25 * 2.0)), (16, 64), True),
        (((9.0, 2.0), (2.0, 0.973 * 2.0), (2.0, 1.8)), (16, 64, 256), True),
        (((9.0, 2.0), (2.0, 1.5), (1.2, 0.9)), (16, 64, 256), False),
        (((9.0, 9.0), (9.0, 7.0), (9.0, 8.0), (4.0, 4.0)), (16, 64, 256, 1024), True),
    ],
)
def test_run_is_extended_while_it_settles(
    speeds: tuple[tuple[float, float], ...], spans: tuple[int, ...], ends: bool
) -> None:
    verdict, goals = apply_rule(*(segments for pair in speeds for segments in quarters(*pair)))
    assert (verdict, tuple(goals[2::3])) == (ends, spans)


def test_onset_value_is_the_geometric_mean_of_its_bracket() -> None:
    def value(quiet: float, cycling: float) -> float:
        return Onset("A", 0, quiet, cycling, 1, 1, (0.0,) * 3, (0.0,) * 3).value

    assert value(4.0, 9.0) == 6.0
    assert value(0.0, 9.0) == 9.0
    assert value(4.0, math.inf) == math.inf


def run_search(path: Any, cycling_at: Callable[[float], bool]) -> tuple[float, float]:
    """Return the bracket of a search, given where the loop cycles."""
    stiffness = next(path)
    while True:
        try:
            stiffness = path.send(cycling_at(stiffness))
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]  # that of a generator


def search_bracket(
    onset_at: float, low: float, high: float, width: float
) -> tuple[Any, list[float]]:
    tested: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tested.append(stiffness)
        return stiffness >= onset_at

    return run_search(bracket_onset(low, high, width), cycling_at), tested


def test_search_doubles_upwards_and_then_bisects_geometrically() -> None:
    bracket, tested = search_bracket(9.0, 1.0, 1000.0, 0.5)
    assert tested == pytest.approx([1.0, 2.0, 4.0, 8.0, 16.0, math.sqrt(128.0)])
    assert bracket == (8.0, pytest.approx(math.sqrt(128.0)))
    quiet, cycling = search_bracket(9.0, 1.0, 1000.0, 1e-6)[0]
    assert quiet < 9.0 <= cycling <= quiet * (1.0 + 1e-6)


def test_bracket_of_exactly_the_tolerance_is_accepted() -> None:
    bracket, tested = search_bracket(9.0, 1.0, 1000.0, 1.0)
    assert (bracket, len(tested)) == ((8.0, 16.0), 5)


def test_highest_stiffness_is_tested_and_none_above() -> None:
    assert search_bracket(1e9, 1.0, 10.0, 0.1) == ((10.0, math.inf), [1.0, 2.0, 4.0, 8.0, 10.0])
    assert search_bracket(1e9, 1.0, 8.0, 0.1) == ((8.0, math.inf), [1.0, 2.0, 4.0, 8.0])
    bracket, tested = search_bracket(9.5, 1.0, 10.0, 2.0)
    assert (bracket, tested[-1]) == ((8.0, 10.0), 10.0)


def test_cycle_at_the_lowest_stiffness_has_no_quiet_end() -> None:
    assert search_bracket(0.5, 1.0, 10.0, 0.1) == ((0.0, 1.0), [1.0])


@pytest.mark.parametrize("seed", range(60))
def test_search_from_a_guess_finds_the_same_bracket(seed: int) -> None:
    rng = random.Random(seed)
    onset_at = 10.0 ** rng.uniform(-1.0, 5.5)
    near = onset_at * 2.0 ** rng.uniform(-3.0, 3.0)
    ends = (10.0 ** rng.uniform(0.0, 1.0), 10.0 ** rng.uniform(4.5, 5.0))
    width = 10.0 ** rng.uniform(-3.0, 0.0)
    expected, tested_from_below = search_bracket(onset_at, *ends, width)
    tested: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tested.append(stiffness)
        return stiffness >= onset_at

    assert run_search(bracket_onset(*ends, width, near), cycling_at) == expected
    assert len(tested) == len(set(tested)) <= len(tested_from_below) + 3
    assert set(tested) - set(tested_from_below) <= {
        k for k in tested if k >= onset_at or k == ends[1]
    }


def test_search_from_a_guess_skips_a_window_far_below() -> None:
    def cycling_at(stiffness: float) -> bool:
        return 3.0 <= stiffness < 9.0 or stiffness >= 700.0

    assert run_search(bracket_onset(1.0, 1e6, 1.0), cycling_at) == (2.0, 4.0)
    assert run_search(bracket_onset(1.0, 1e6, 1.0, 300.0), cycling_at) == (512.0, 1024.0)
    assert run_search(bracket_onset(1.0, 1e6, 1.0, 8.5), cycling_at) == (2.0, 4.0)


@pytest.mark.parametrize("near", [0.0, -1.0, 1e-9, 1e9])
def test_search_from_any_guess_finds_the_onset(near: float) -> None:
    assert run_search(bracket_onset(1.0, 1000.0, 1.0, near), lambda k: k >= 9.0) == (8.0, 16.0)


# --- the whole search, on prescribed runs ---------------------------------------------------------


PLANT, SERVO = Cartesian(0.05, 3.0), Servo(1e-3)
HAND = SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))


class StandInTrajectory:
    """A trajectory whose verdict is available after a number of runs."""

    def __init__(self, stiffness: float, delay: int, shift: float, times: int) -> None:
        self.stiffness, self.delay, self.shift, self.times = stiffness, delay, shift, times
        self.verdict: bool | None = None
        self.position_bounds = np.array([[-shift, 0.0, -stiffness], [shift, 0.0, stiffness]])


class StandInLoop:
    """The last start cycles from 100 N/m, all from 200 N/m; bounds grow with the stiffness."""

    def __init__(self, times: int = 1) -> None:
        self.times = times
        self.seen: list[tuple[float, float]] = []
        self.together: list[list[StandInTrajectory]] = []

    def new_trajectory(
        self, stiffness: float, delay: int, shift: FloatArray, _rule: Any
    ) -> StandInTrajectory:
        return StandInTrajectory(stiffness, delay, float(shift[0]), self.times)

    def run(self, starts: list[StandInTrajectory]) -> None:
        assert 1 <= len(starts) <= MAX_LANES
        assert len(set(map(id, starts))) == len(starts)
        self.together.append(starts)
        for start in starts:
            assert start.verdict is None
            start.times -= 1
            if start.times == 0:
                self.seen.append((start.stiffness, start.shift))
                start.verdict = self.cycles(start)

    def cycles(self, start: StandInTrajectory) -> bool:
        limit = 100.0 if start.shift > 1.4e-3 else 200.0
        return start.stiffness * (1 + start.delay) >= limit


@pytest.fixture
def stand_in_runs(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """The stiffnesses and shifts that were run."""
    loop = StandInLoop()
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: loop)
    return loop.seen


def search(starts: int = 4, **more: Any) -> Onset:
    still = Stationary((0.0, 0.0, 0.0))
    return find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=starts, **more)


def test_one_cycling_start_is_enough(stand_in_runs: list[tuple[float, float]]) -> None:
    result = search(lowest=90.0, tolerance=0.05)
    assert result.quiet < 100.0 <= result.cycling <= 1.05 * result.quiet
    assert (result.starts, result.cycles) == (4, 1)
    # The final stiffness is run once from every start, and the bounds reached are recorded.
    assert sorted(shift for k, shift in stand_in_runs if k == result.cycling) == pytest.approx(
        [0.0, 0.5e-3, 1e-3, 1.5e-3]
    )
    assert result.low == pytest.approx((-1.5e-3, 0.0, -result.cycling))
    assert result.high == pytest.approx((1.5e-3, 0.0, result.cycling))


def test_first_cycling_start_ends_the_runs_of_a_stiffness(
    stand_in_runs: list[tuple[float, float]],
) -> None:
    result = search(lowest=300.0)
    assert (result.quiet, result.cycling, result.cycles) == (0.0, 300.0, 4)
    # No start is run twice, not even to record the bounds.
    assert stand_in_runs == [(300.0, pytest.approx(i * 0.5e-3)) for i in range(4)]
    stand_in_runs.clear()
    search(lowest=50.0, near=800.0)
    assert [shift for k, shift in stand_in_runs if k == 800.0] == [0.0]


def test_last_cycling_start_is_run_first(stand_in_runs: list[tuple[float, float]]) -> None:
    """By itself; the others in groups as large as a batch."""
    search(starts=24, lowest=75.0, near=75.0, tolerance=0.1)
    tested = {
        k: [round(shift * 12e3) for j, shift in stand_in_runs if j == k]
        for k, _shift in stand_in_runs
    }
    assert tested[75.0] == list(range(24))
    assert tested[150.0] == list(range(24))  # starts from 17 on, the third group, cycle
    middle = math.sqrt(75.0 * 150.0)
    first = stand_in_runs.index((middle, pytest.approx(17 / 12e3)))
    assert stand_in_runs[first + 1][0] != middle


class WindowedLoop(StandInLoop):
    """One start also cycles near 566 N/m; all cycle from 700 N/m."""

    def cycles(self, start: StandInTrajectory) -> bool:
        in_window = start.shift > 1.4e-3 and 560.0 <= start.stiffness < 570.0
        return in_window or start.stiffness >= 700.0


def test_bisection_finds_a_window_of_one_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every stiffness that directs the search is run from all starts."""
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: WindowedLoop())
    result = search(lowest=100.0, near=400.0, tolerance=0.05)  # 400, 800, and 566 between them
    assert result.quiet < 560.0 <= result.cycling < 570.0
    assert result.cycles == 1


def test_joint_search_over_delays_equals_separate_searches(monkeypatch: pytest.MonkeyPatch) -> None:
    """An onset does not depend on what else runs in the batch."""
    still, delays, guesses = Stationary((0.0, 0.0, 0.0)), (0, 1, 4), (None, 300.0, 20.0)
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: StandInLoop())
    expected = [
        find_onset(SURFACE, PLANT, HAND, Servo(1e-3, d), still, starts=24, near=guess)
        for d, guess in zip(delays, guesses, strict=True)
    ]
    loop = StandInLoop(times=3)
    monkeypatch.setattr(onset, "BatchSimulation", lambda *_parts: loop)
    finished: list[int] = []
    onsets = find_onsets(
        SURFACE,
        PLANT,
        HAND,
        SERVO,
        still,
        delays,
        guesses,
        starts=24,
        onset_callback=lambda: finished.append(1),
    )
    assert onsets == expected
    assert len(finished) == 3
    assert len({result.cycling for result in onsets}) == 3
    first, *_ = loop.together
    # First one start of each delay.
    assert sorted(start.delay for start in first if start.shift == 0.0) == list(delays)
    assert len(first) == 3


@pytest.mark.usefixtures("stand_in_runs")
def test_search_without_cycles_ends_at_the_highest_stiffness() -> None:
    calls: list[int] = []
    result = search(lowest=10.0, highest=50.0, progress=lambda: calls.append(1))
    assert (result.quiet, result.cycling, result.cycles) == (50.0, math.inf, 0)
    assert result.high[2] == 50.0
    assert len(calls) == 5  # 10, 20, 40, 50, and 50 from every start


@pytest.mark.usefixtures("stand_in_runs")
@pytest.mark.parametrize(
    ("options", "argument"),
    [
        ({"lowest": 10.0, "highest": 10.0}, "lowest"),
        ({"tolerance": 0.99e-9}, "tolerance"),
        ({"duration": 15.9e-3}, "duration"),
    ],
)
def test_options_just_out_of_range_are_errors(options: dict[str, float], argument: str) -> None:
    with pytest.raises(ParameterError, match=argument):
        search(**options)


@pytest.mark.usefixtures("stand_in_runs")
def test_options_at_their_limits_are_accepted() -> None:
    search(tolerance=1e-9, lowest=90.0, duration=16e-3)
    still = Stationary((0.0, 0.0, 0.0))
    assert find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=1).starts == 1
    with pytest.raises(ParameterError, match="starts"):
        find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=10_001)


def test_motion_must_rest_in_the_second_half() -> None:
    motion = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1, count=1)  # 1 s
    assert is_at_rest(motion, 2.0)
    assert not is_at_rest(motion, 1.9)


def test_start_offsets_exclude_the_full_period() -> None:
    shifts: FloatArray = start_offsets(SURFACE, 5)
    np.testing.assert_allclose(shifts[:, 0], np.arange(5) * 0.4e-3, atol=1e-18)
    assert not shifts[:, 1:].any()
