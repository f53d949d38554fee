"""Batched runs equal the same runs simulated one by one, bit for bit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.simulation import limit_cycle_definition as definition

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
from asperity.simulation.lanes import MAX_LANES, BatchSimulation, StopRule, Trajectory
from asperity.simulation.onset_search import limit_cycle_rule
from asperity.simulation.trace import Run, SegmentStatistics, StopReason
from asperity.surface import Surface
from asperity.textures import Sinusoid

SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "F", stiffness=900.0, max_depth=1e-3)
PLANT, HAND = Cartesian(0.05, 1.5), SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))
SERVO = Servo(1e-3, delay=2, position_resolution=5e-6)
MOTION = Strokes((0.0, 0.0, -0.5e-3), (4e-3, 1e-3, -0.5e-3), 0.05, count=2)
LOOP = SURFACE, PLANT, HAND, SERVO


class SegmentRecorder:
    """Records the statistics of a trajectory after given numbers of samples.

    Args:
        goals: sample counts at which the statistics are recorded.
    """

    def __init__(self, *goals: int) -> None:
        self.goals = goals
        self.segments: list[SegmentStatistics] = []

    def judge(self) -> StopRule:
        for goal in self.goals:
            self.segments.append((yield goal))
            if self.segments[-1].stop:
                break
        return True


def run_all(loop: BatchSimulation, starts: Sequence[Trajectory]) -> None:
    while unfinished := [start for start in starts if start.verdict is None]:
        loop.run(unfinished)


def simulate_alone(
    parts: Any,
    start: Trajectory,
    start_position: Any,
    velocity: Any,
    samples: int,
    motion: Any = MOTION,
) -> Run:
    """Return the same run simulated by itself, with its whole trace."""
    surface, plant, hand, servo = parts
    delayed = replace(servo, delay=start.delay)
    shifted = definition.ShiftedMotion(motion, start.offset)
    return simulate(
        surface.to_stiffness(start.stiffness),
        plant,
        hand,
        delayed,
        shifted,
        samples * servo.period,
        start=np.array(start_position) + start.offset,
        velocity=velocity,
    )


def assert_same(start: Trajectory, watcher: SegmentRecorder, run: Run) -> None:
    """Compare a trajectory with its trace: states bit for bit, spreads to rounding."""
    np.testing.assert_array_equal(start.state, run.state)
    np.testing.assert_array_equal(
        start.position_bounds, [run.position.min(axis=0), run.position.max(axis=0)]
    )
    assert (start.samples, watcher.segments[-1].stop) == (run.samples, run.stop)
    assert start.memory[4] == run.truncated_ticks
    supplied = run.energies["supplied"].sum(axis=1)
    taken = run.energies["lost"] - run.energies["friction"]
    first = 0
    for segment in watcher.segments:
        last = len(run.table) if segment.stop else segment.samples
        part = run.velocity[first:last]
        rounding = 1e-7 * np.abs(part - part[0]).max()
        assert segment.velocity_spread == pytest.approx(
            part.std(axis=0).sum(), rel=1e-9, abs=rounding
        )
        energies = supplied[first:last], taken[first:last]
        means = [part.mean() for part in energies]
        scale = max(np.abs(part).max() for part in energies)
        assert segment.mean_energies == pytest.approx(means, rel=1e-10, abs=1e-12 * scale)
        net = energies[0] - energies[1]
        assert segment.net_spread == pytest.approx(net.std(), rel=1e-6, abs=1e-7 * scale)
        first = last


def test_batch_of_stiffnesses_and_delays_equals_single_runs() -> None:
    """In segments that end between the flushes every 256 samples, independently of each other."""
    start_position, velocity = (1e-4, 0.0, 1e-3), (0.0, 0.05, 0.0)
    loop = BatchSimulation(*LOOP, MOTION, start_position, velocity)
    goal_lists = [(300, 1100, 17_000), (7, 8, 900), (40_000,), (1, 2, 3, 20_011)]
    watchers = [SegmentRecorder(*goals) for goals in goal_lists]
    starts = [
        loop.new_trajectory(
            500.0 * (i + 1), i, np.array([3e-4 * i, 1e-4 * i, 0.0]), watcher.judge()
        )
        for i, watcher in enumerate(watchers)
    ]
    loop.run(starts[1:3])  # the others start later
    run_all(loop, starts)
    for start, watcher, goals in zip(starts, watchers, goal_lists, strict=True):
        assert_same(
            start, watcher, simulate_alone(LOOP, start, start_position, velocity, goals[-1])
        )
        assert [segment.samples for segment in watcher.segments] == list(goals)
    # Negative control: another stiffness or delay gives another state.
    wrong = simulate_alone(LOOP, starts[2], start_position, velocity, 40_000)
    for start in starts[0], starts[3]:
        assert not np.array_equal(start.state, wrong.state)


def test_subnormal_numbers_are_flushed_at_the_same_samples() -> None:
    """The sample at which a freely decaying motion becomes zero does not depend on segments."""
    parts = SURFACE, Cartesian(0.05, 40.0), SpringHand(), Servo(1e-3)
    still, start_position, velocity = Stationary((0.0, 0.0, 1.0)), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)
    loop = BatchSimulation(*parts, still, start_position, velocity)
    watcher = SegmentRecorder(100, 171, 600)
    start = loop.new_trajectory(900.0, 0, np.zeros(3), watcher.judge())
    run_all(loop, [start])
    run = simulate_alone(parts, start, start_position, velocity, 600, still)
    assert_same(start, watcher, run)
    assert run.table[-1, 4] == 0.0 < run.table[170, 4] < 1e-50


def test_ended_run_is_not_continued() -> None:
    servo = Servo(1e-3, virtual_damping=-400.0)
    loop = BatchSimulation(SURFACE, PLANT, HAND, servo, MOTION, None, (0.0, 0.0, -1.0))
    watchers = SegmentRecorder(1000, 4000), SegmentRecorder(1000)
    starts = [
        loop.new_trajectory(900.0, 0, np.array([0.0, 0.0, z]), w.judge())
        for z, w in zip((0.0, 1.0), watchers, strict=True)
    ]
    run_all(loop, starts)
    (segment,) = watchers[0].segments
    assert segment.stop is StopReason.DIVERGED
    assert starts[0].samples < 1000
    run = simulate_alone(
        (SURFACE, PLANT, HAND, servo), starts[0], MOTION.at(np.zeros(1))[0], (0.0, 0.0, -1.0), 1000
    )
    assert_same(starts[0], watchers[0], run)


def test_earlier_goal_restarts_the_run() -> None:
    loop = BatchSimulation(*LOOP, MOTION)
    restarted, continued = SegmentRecorder(700, 350, 900), SegmentRecorder(350, 900)
    starts = [
        loop.new_trajectory(900.0, 1, np.zeros(3), recorder.judge())
        for recorder in (restarted, continued)
    ]
    run_all(loop, starts)
    assert restarted.segments[1:] == continued.segments
    np.testing.assert_array_equal(starts[0].state, starts[1].state)
    np.testing.assert_array_equal(starts[0].position_bounds, starts[1].position_bounds)


def test_incompatible_parts_and_excess_sizes_are_errors() -> None:
    with pytest.raises(ParameterError, match="plant must be"):
        BatchSimulation(SURFACE, HAND, HAND, SERVO, MOTION)  # type: ignore[arg-type]  # the point
    pantograph_loop = BatchSimulation(SURFACE, Pantograph(), HAND, SERVO, STILL)
    with pytest.raises(ParameterError, match="workspace"):
        pantograph_loop.new_trajectory(
            900.0, 0, np.array([0.0, 0.0, 9.0]), SegmentRecorder(1).judge()
        )
    loop = BatchSimulation(*LOOP, MOTION)
    with pytest.raises(ParameterError, match="delay must be at most"):
        loop.new_trajectory(900.0, 1_000_001, np.zeros(3), SegmentRecorder(1).judge())
    starts = [
        loop.new_trajectory(900.0, 0, np.zeros(3), SegmentRecorder(1).judge())
        for _ in range(MAX_LANES + 1)
    ]
    with pytest.raises(ParameterError, match=f"at most {MAX_LANES}"):
        loop.run(starts)


# --- pantographs ----------------------------------------------------------------------------------


BAND = BandHand(200.0, 3.0, 0.08, 0.02)
STILL = Stationary((0.0, 0.0, 0.0))
OFFSETS = np.array([(1e-4 * i, 0.0, 4e-3 - 1e-3 * i) for i in range(MAX_LANES)])
PUSHED_OUT = SpringHand(0.0, 0.1, 0.0, (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("plant", "hand", "velocity", "above", "period"),
    [
        (Pantograph(), BAND, None, 0.0, 1e-4),
        (Pantograph(friction=0.05), BAND, None, 0.0, 1e-4),  # substeps
        (Pantograph(), BandHand(200.0, 0.5, 0.08, 0.02), (0.0, 0.0, -0.5), 0.0, 1e-4),
        (
            Pantograph(),
            SpringHand(300.0, 1.0, 0.01),
            (6.0, 0.0, 0.0),
            0.0,
            1e-4,
        ),  # shorter substeps
        (Pantograph(), PUSHED_OUT, None, 0.03, 1e-4),
        (Pantograph(inside_only=False), BAND, None, 0.0, 1e-4),
        (Pantograph(), BAND, None, 0.0, 1e-3),
    ],
    ids=["plain", "friction", "slack", "fast", "leaves", "brakes always on", "slow servo"],
)
def test_pantographs_equal_single_runs(
    plant: Pantograph, hand: Any, velocity: Any, above: float, period: float
) -> None:
    surface = Surface(Sinusoid(0.8e-3, 1e-3), "W", stiffness=900.0)
    parts = surface, plant, hand, Servo(period, position_resolution=15e-6)
    start_position = (0.0, 0.0, above)
    loop = BatchSimulation(*parts, STILL, start_position, velocity)
    goals = [
        (round(0.05 / period), round((0.12 if i in {1, 2, 7} else 0.06) / period))
        for i in range(MAX_LANES)
    ]
    watchers = [SegmentRecorder(*goal) for goal in goals]
    starts = [
        loop.new_trajectory(900.0 + 10.0 * i, i % 3, OFFSETS[i], watcher.judge())
        for i, watcher in enumerate(watchers)
    ]
    loop.run([starts[i] for i in (0, 2, 5)])
    run_all(loop, starts)
    for start, watcher, (_, last) in zip(starts, watchers, goals, strict=True):
        run = simulate_alone(parts, start, start_position, velocity, last, STILL)
        assert_same(start, watcher, run)
        assert (run.stop is StopReason.LEFT_WORKSPACE) == (hand is PUSHED_OUT)


@pytest.mark.parametrize("law", ["W", "C", "D"])
def test_batch_verdicts_equal_those_of_whole_traces(law: str) -> None:
    """At stiffnesses near the onset, where runs are extended, and far above it."""
    surface = Surface(Sinusoid(0.8e-3, 1e-3), law, max_depth=1e-3)
    parts = surface, Pantograph(centre=(0.0375, 0.1)), BAND, Servo(1e-4, position_resolution=15e-6)
    start_position, span = (0.0, 0.0, 4e-3), 0.25
    loop = BatchSimulation(*parts, STILL, start_position)
    middle = {"W": 5600.0, "C": 11.5, "D": 4000.0}[law]
    lengths, stops = set(), set()
    for factor in (0.9, 0.98, 1.04, 8.0):
        starts = [
            loop.new_trajectory(
                middle * factor,
                2,
                np.array([shift, 0.0, 0.0]),
                limit_cycle_rule(lambda times: round(times * span / 1e-4), 1e-4),
            )
            for shift in (0.0, 0.3e-3, 0.6e-3)
        ]
        run_all(loop, starts)
        for start in starts:

            def run_for(duration: float, start: Trajectory = start) -> Run:
                return simulate_alone(
                    parts, start, start_position, None, round(duration / 1e-4), STILL
                )

            cycles, run = definition.ends_in_cycle(run_for, span)
            assert (start.verdict, start.samples) == (cycles, run.samples)
            box = [run.position.min(axis=0), run.position.max(axis=0)]
            np.testing.assert_array_equal(start.position_bounds, box)
            lengths.add(start.samples)
            stops.add(run.stop)
    assert len(lengths) > 1
    assert (StopReason.LEFT_WORKSPACE in stops) == (law != "C")
