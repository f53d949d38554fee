"""A loop that follows another one: the same motion of the hand, sample by sample."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from tests.servo.python_device import SURFACE

from asperity.core.checks import FloatArray
from asperity.core.platform.clocks import no_clock
from asperity.loop.shared_trace import COLUMNS
from asperity.servo.driver_loop import DriverLoop, build_program
from asperity.servo.drivers import pointer as pointer_driver_module
from asperity.servo.drivers.pointer import (
    FOLLOWER_ROW,
    MAX_LAG,
    MAX_POLLS,
    NEXT_SAMPLE,
    POLL_TIME,
    SAMPLE_COUNT,
    STATE_ROW,
    PointerDriver,
    PointerHand,
    anchor_segment,
    pointer_driver,
)
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand
from asperity.surface import Surface

SERVO = Servo(1e-3, max_force=3.0)
HAND = SpringHand(stiffness=800.0, damping=5.0, mass=0.05)
ROWS = 1500
NAMES = [name for name, _unit in COLUMNS]
MEASURED = [NAMES.index("late"), NAMES.index("took")]
"""Columns that depend on the machine."""


@pytest.fixture
def pointer() -> Iterator[PointerHand]:
    with PointerHand((0.0, 0.0, 1e-3)) as hand:
        yield hand


def driver(pointer: PointerHand, *, follows: bool = False) -> PointerDriver:
    return replace(pointer_driver(Cartesian(0.05, 0.5), HAND, SERVO, pointer), follows=follows)


def run(surface: Surface, device: PointerDriver, opened: tuple[object, ...]) -> FloatArray:
    """Return the first rows of a loop without a clock."""
    memory, safety = LoopMemory(), Safety(ramp=0.0, max_slew=1e9, beyond_depth="warn", silence=1e4)
    loop = DriverLoop(device, SERVO, safety, 1.0, memory.block(), no_clock())
    loop.run(build_program(surface, device), opened, ROWS)
    rows = memory.rows(0)[0][:ROWS]
    rows[:, MEASURED] = 0.0
    return rows


def test_one_law_gives_the_same_samples_bit_for_bit_and_another_does_not(
    pointer: PointerHand,
) -> None:
    first, second, third = driver(pointer), *(driver(pointer, follows=True) for _ in range(2))
    pointer.request_motion((0.3e-3, 0.1e-3, -2e-4), (4e-3, 0.0, 0.0), (0.0, 1e-3, 3e-4), 9.0)
    leading = first.open()
    following, other = second.open(), third.open()  # before the first sample
    law = SURFACE.to_law("C")
    rows = run(law, first, leading)
    assert rows[:, NAMES.index("inside")].mean() > 0.3
    assert (run(law, second, following) == rows).all()
    assert pointer.follower_lag[1] == 0
    force = NAMES.index("applied z")
    assert np.abs(run(SURFACE.to_law("H"), third, other) - rows)[:, force].max() > 1e-2


def test_a_following_anchor_repeats_waits_and_leaves_out(
    pointer: PointerHand, monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[int] = []
    monkeypatch.setattr(pointer_driver_module, "clock_now", lambda due, _clock: due)
    monkeypatch.setattr(
        pointer_driver_module, "clock_wait_until", lambda due, _clock: waits.append(due)
    )
    leading, following = driver(pointer).open(), driver(pointer, follows=True).open()
    pointer.request_motion((2e-3, -1e-3, 0.0))

    def lead(count: int) -> list[tuple[float, ...]]:
        points = []
        for _ in range(count):
            points.append(anchor_segment(leading))
            leading.counters[1] += 1
        return points

    def follow() -> tuple[float, ...]:
        point = anchor_segment(following)
        following.counters[1] += 1
        return point

    points = lead(20)
    # A row is complete once the next call says so; the last segment needs the row after it.
    assert [follow() for _ in range(18)] == points[:18]
    assert not waits
    # Without a further sample the hand rests, and no sample is lost.
    assert follow() == points[18][:3] * 2
    assert waits == [POLL_TIME] * MAX_POLLS
    points += lead(MAX_LAG)
    assert [follow() for _ in range(3)] == points[18:21]
    assert pointer.follower_lag == (len(points) - 1 - 21, 0)
    points += lead(40)
    assert follow() == points[-3]
    assert pointer.follower_lag == (1, len(points) - 3 - 21)
    assert pointer.table[STATE_ROW, SAMPLE_COUNT] == len(points) - 1
    assert pointer.table[FOLLOWER_ROW, NEXT_SAMPLE] == len(points) - 2


def test_a_following_loop_starts_at_the_newest_sample(pointer: PointerHand) -> None:
    leading = driver(pointer).open()
    for _ in range(50):
        anchor_segment(leading)
        leading.counters[1] += 1
    following = driver(pointer, follows=True).open()
    assert following.counters[2] == 48
    # Opening it leaves the leading loop alone.
    assert pointer.table[STATE_ROW, SAMPLE_COUNT] == 49
