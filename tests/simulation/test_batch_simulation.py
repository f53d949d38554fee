"""Runs that go on side by side are the runs that were asked for one by one, at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.simulation.onset import limit_cycle_definition as definition

from asperity.core.errors import ParameterError
from asperity.simulation import (
    BandHand,
    Cartesian,
    Pantograph,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    simulate,
)
from asperity.simulation.batch import BatchSimulation, SegmentStatistics, StopRule, Trajectory
from asperity.simulation.kernels.body_interface import LANES
from asperity.simulation.limit_cycles.onset_search import limit_cycle_rule
from asperity.simulation.trace import Run, StopReason
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "F", stiffness=900.0, max_depth=1e-3)
PLANT, HAND = Cartesian(0.05, 1.5), SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))
SERVO = Servo(1e-3, delay=2, position_resolution=5e-6)
WAY = Strokes((0.0, 0.0, -0.5e-3), (4e-3, 1e-3, -0.5e-3), 0.05, count=2)
LOOP = SURFACE, PLANT, HAND, SERVO


class Watcher:
    """Sees a run after so many samples each, and writes down what it sees.

    Args:
        goals: in rising order.
    """

    def __init__(self, *goals: int) -> None:
        self.goals = goals
        self.seen: list[SegmentStatistics] = []

    def judge(self) -> StopRule:
        for goal in self.goals:
            self.seen.append((yield goal))
            if self.seen[-1].stop:
                break
        return True


def run_all(loop: BatchSimulation, starts: Sequence[Trajectory]) -> None:
    while some := [start for start in starts if start.verdict is None]:
        loop.run(some)


def alone(
    parts: Any, start: Trajectory, begin: Any, velocity: Any, samples: int, motion: Any = WAY
) -> Run:
    """Return the same run by itself, with its whole trace."""
    surface, plant, hand, servo = parts
    own = replace(servo, delay=start.delay)
    way = definition.Shifted(motion, start.offset)
    return simulate(
        surface.to_stiffness(start.stiffness), plant, hand, own, way, samples * servo.period,
        start=np.array(begin) + start.offset, velocity=velocity,
    )  # fmt: skip


def same(start: Trajectory, watcher: Watcher, run: Run) -> None:
    """Compare a run that was seen with its trace: states bit for bit, spreads to rounding."""
    np.testing.assert_array_equal(start.state, run.state)
    np.testing.assert_array_equal(
        start.position_bounds, [run.position.min(axis=0), run.position.max(axis=0)]
    )
    assert (start.samples, watcher.seen[-1].stop) == (run.samples, run.stop)
    assert start.memory[4] == run.truncated_ticks
    supplied = run.energies["supplied"].sum(axis=1)
    taken = run.energies["lost"] - run.energies["friction"]
    first = 0
    for seen in watcher.seen:
        last = len(run.table) if seen.stop else seen.samples
        part = run.velocity[first:last]
        rounding = 1e-7 * np.abs(part - part[0]).max()
        assert seen.velocity_spread == pytest.approx(part.std(axis=0).sum(), rel=1e-9, abs=rounding)
        assert seen.previous_energies == pytest.approx(
            (supplied[last - 1], taken[last - 1]), rel=1e-12
        )
        if last < len(run.table):
            assert seen.energies == pytest.approx((supplied[last], taken[last]), rel=1e-12)
        first = last


def test_runs_of_other_stiffness_and_delay_go_on_bit_for_bit() -> None:
    """Over parts that end within the 256 samples between flushes, wherever the others are."""
    begin, velocity = (1e-4, 0.0, 1e-3), (0.0, 0.05, 0.0)
    loop = BatchSimulation(*LOOP, WAY, begin, velocity)
    plans = [(300, 1100, 17_000), (7, 8, 900), (40_000,), (1, 2, 3, 20_011)]
    watchers = [Watcher(*goals) for goals in plans]
    starts = [
        loop.new_trajectory(
            500.0 * (i + 1), i, np.array([3e-4 * i, 1e-4 * i, 0.0]), watcher.judge()
        )
        for i, watcher in enumerate(watchers)
    ]
    loop.run(starts[1:3])  # the others begin later
    run_all(loop, starts)
    for start, watcher, goals in zip(starts, watchers, plans, strict=True):
        same(start, watcher, alone(LOOP, start, begin, velocity, goals[-1]))
        assert [seen.samples for seen in watcher.seen] == list(goals)
    # Whoever takes another stiffness or delay for its own gets another state.
    wrong = alone(LOOP, starts[2], begin, velocity, 40_000)
    for start in starts[0], starts[3]:
        assert not np.array_equal(start.state, wrong.state)


def test_next_to_nothing_is_made_nothing_at_the_same_samples() -> None:
    """A handle that fades away freely: which sample makes it nothing does not depend on parts."""
    parts = SURFACE, Cartesian(0.05, 40.0), SpringHand(), Servo(1e-3)
    still, begin, velocity = Stationary((0.0, 0.0, 1.0)), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    loop = BatchSimulation(*parts, still, begin, velocity)
    watcher = Watcher(100, 171, 600)
    start = loop.new_trajectory(900.0, 0, np.zeros(3), watcher.judge())
    run_all(loop, [start])
    run = alone(parts, start, begin, velocity, 600, still)
    same(start, watcher, run)
    assert run.table[-1, 4] == 0.0 < run.table[170, 4] < 1e-50


def test_a_run_that_has_ended_does_not_go_on() -> None:
    servo = Servo(1e-3, virtual_damping=-400.0)
    loop = BatchSimulation(SURFACE, PLANT, HAND, servo, WAY, None, (0.0, 0.0, -1.0))
    watchers = Watcher(1000, 4000), Watcher(1000)
    starts = [loop.new_trajectory(900.0, 0, np.array([0.0, 0.0, z]), w.judge())
              for z, w in zip((0.0, 1.0), watchers, strict=True)]  # fmt: skip
    run_all(loop, starts)
    (seen,) = watchers[0].seen
    assert seen.stop is StopReason.DIVERGED
    assert starts[0].samples < 1000
    run = alone(
        (SURFACE, PLANT, HAND, servo), starts[0], WAY.at(np.zeros(1))[0], (0.0, 0.0, -1.0), 1000
    )
    same(starts[0], watchers[0], run)


def test_a_goal_that_is_behind_begins_anew() -> None:
    loop = BatchSimulation(*LOOP, WAY)
    back, ahead = Watcher(700, 350, 900), Watcher(350, 900)
    starts = [loop.new_trajectory(900.0, 1, np.zeros(3), one.judge()) for one in (back, ahead)]
    run_all(loop, starts)
    assert back.seen[1:] == ahead.seen
    np.testing.assert_array_equal(starts[0].state, starts[1].state)
    np.testing.assert_array_equal(starts[0].position_bounds, starts[1].position_bounds)


def test_what_fits_not_together_is_refused() -> None:
    with pytest.raises(ParameterError, match="plant must be"):
        BatchSimulation(SURFACE, HAND, HAND, SERVO, WAY)  # type: ignore[arg-type]  # the point
    bars = BatchSimulation(SURFACE, Pantograph(), HAND, SERVO, STILL)
    with pytest.raises(ParameterError, match="workspace"):
        bars.new_trajectory(900.0, 0, np.array([0.0, 0.0, 9.0]), Watcher(1).judge())
    loop = BatchSimulation(*LOOP, WAY)
    with pytest.raises(ParameterError, match="delay must be at most"):
        loop.new_trajectory(900.0, 1_000_001, np.zeros(3), Watcher(1).judge())
    starts = [
        loop.new_trajectory(900.0, 0, np.zeros(3), Watcher(1).judge()) for _ in range(LANES + 1)
    ]
    with pytest.raises(ParameterError, match=f"at most {LANES}"):
        loop.run(starts)


# --- a pantograph, whose handles move on together -------------------------------------------------


BAND = BandHand(200.0, 3.0, 0.08, 0.02)
STILL = Stationary((0.0, 0.0, 0.0))
OFFSETS = np.array([(1e-4 * i, 0.0, 4e-3 - 1e-3 * i) for i in range(LANES)])
AT_THE_END = SpringHand(0.0, 0.1, 0.0, (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("plant", "hand", "velocity", "above", "period"),
    [
        (Pantograph(), BAND, None, 0.0, 1e-4),
        (Pantograph(friction=0.05), BAND, None, 0.0, 1e-4),  # parts of a sample
        (Pantograph(), BandHand(200.0, 0.5, 0.08, 0.02), (0.0, 0.0, -0.5), 0.0, 1e-4),
        (Pantograph(), SpringHand(300.0, 1.0, 0.01), (6.0, 0.0, 0.0), 0.0, 1e-4),  # shorter steps
        (Pantograph(), AT_THE_END, None, 0.03, 1e-4),
        (Pantograph(inside_only=False), BAND, None, 0.0, 1e-4),
        (Pantograph(), BAND, None, 0.0, 1e-3),
    ],
    ids=["plain", "friction", "slack", "fast", "leaves", "brakes always on", "slow servo"],
)
def test_handles_that_move_together_move_as_alone(
    plant: Pantograph, hand: Any, velocity: Any, above: float, period: float
) -> None:
    surface = Surface(Sinusoid(0.8e-3, 1e-3), "W", stiffness=900.0)
    parts = surface, plant, hand, Servo(period, position_resolution=15e-6)
    begin = (0.0, 0.0, above)
    loop = BatchSimulation(*parts, STILL, begin, velocity)
    goals = [(round(0.05 / period), round((0.12 if i in {1, 2, 7} else 0.06) / period))
             for i in range(LANES)]  # fmt: skip
    watchers = [Watcher(*each) for each in goals]
    starts = [
        loop.new_trajectory(900.0 + 10.0 * i, i % 3, OFFSETS[i], watcher.judge())
        for i, watcher in enumerate(watchers)
    ]
    loop.run([starts[i] for i in (0, 2, 5)])
    run_all(loop, starts)
    for start, watcher, (_, last) in zip(starts, watchers, goals, strict=True):
        run = alone(parts, start, begin, velocity, last, STILL)
        same(start, watcher, run)
        assert (run.stop is StopReason.LEFT_WORKSPACE) == (hand is AT_THE_END)


@pytest.mark.parametrize("law", ["W", "C", "D"])
def test_verdicts_are_those_of_whole_traces(law: str) -> None:
    """Stiffnesses about the onset, where runs are made longer, and beyond, where they leave."""
    surface = Surface(Sinusoid(0.8e-3, 1e-3), law, max_depth=1e-3)
    parts = surface, Pantograph(centre=(0.0375, 0.1)), BAND, Servo(1e-4, position_resolution=15e-6)
    begin, span = (0.0, 0.0, 4e-3), 0.25
    loop = BatchSimulation(*parts, STILL, begin)
    middle = {"W": 5600.0, "C": 11.5, "D": 4000.0}[law]
    lengths, stops = set(), set()
    for factor in (0.9, 0.98, 1.04, 8.0):
        starts = [
            loop.new_trajectory(
                middle * factor, 2, np.array([shift, 0.0, 0.0]),
                limit_cycle_rule(lambda times: round(times * span / 1e-4)),
            )
            for shift in (0.0, 0.3e-3, 0.6e-3)
        ]  # fmt: skip
        run_all(loop, starts)
        for start in starts:

            def run_for(duration: float, start: Trajectory = start) -> Run:
                return alone(parts, start, begin, None, round(duration / 1e-4), STILL)

            ends, run = definition.ends_in_cycle(run_for, span)
            assert (start.verdict, start.samples) == (ends, run.samples)
            box = [run.position.min(axis=0), run.position.max(axis=0)]
            np.testing.assert_array_equal(start.position_bounds, box)
            lengths.add(start.samples)
            stops.add(run.stop)
    assert len(lengths) > 1
    assert (StopReason.LEFT_WORKSPACE in stops) == (law != "C")
