"""A hand that is steered: its anchor follows smoothly, and never faster than a hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.servo.drivers.pointer import PointerHand, pointer_driver
from asperity.servo.kernels.pointer_anchor import (
    ANCHOR,
    ANGLE,
    HEADER_ROWS,
    HISTORY_SAMPLES,
    MAX_SPEED,
    ROWS_PER_SAMPLE,
    STATE_ROW,
    TRACKING_BANDWIDTH,
    anchor_segment,
)
from asperity.simulation import Cartesian, PrescribedHand, Servo, SpringHand

RATE = 2000.0
HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)


@pytest.fixture
def wheel() -> Iterator[PointerHand]:
    with PointerHand((1e-3, -2e-3, 3e-3)) as one:
        yield one


def device(wheel: PointerHand) -> Any:
    """Return what the compiled loop holds, on the same memory."""
    driver = pointer_driver(Cartesian(0.05, 1.0), HAND, Servo(1.0 / RATE), wheel)
    return driver.open()


def way(held: Any, samples: int) -> np.ndarray:
    return np.array([anchor_segment(held)[3:] for _ in range(samples)])


def test_the_anchor_goes_where_it_is_wanted_without_a_swing(wheel: PointerHand) -> None:
    target = np.array([2e-3, -1e-3, 2.5e-3])
    held, start = device(wheel), wheel.anchor
    number = wheel.request_motion(target)
    way_there = way(held, round(20.0 / TRACKING_BANDWIDTH * RATE))
    assert wheel.acknowledged_count == number == wheel.request_count == 1
    assert np.abs(way_there[-1] - target).max() < 1e-7
    # Critically damped: each axis goes on without turning back, and has done half at 1.68/w.
    for axis in range(3):
        assert (np.diff(way_there[:, axis]) * np.sign(target - start)[axis] >= 0.0).all()
    half = np.argmax(way_there[:, 0] > 1.5e-3) / RATE
    assert half == pytest.approx(1.678 / TRACKING_BANDWIDTH, abs=1.5 / RATE)


def test_it_is_never_faster_than_a_hand(wheel: PointerHand) -> None:
    held = device(wheel)
    wheel.request_motion((0.08, -0.05, 0.02))
    steps = np.linalg.norm(np.diff(way(held, 400), axis=0), axis=1)
    assert steps.max() == pytest.approx(MAX_SPEED / RATE, rel=1e-9)
    assert (steps <= MAX_SPEED / RATE * (1.0 + 1e-12)).all()


def test_an_ellipse_is_gone_round_by_the_loop_itself(wheel: PointerHand) -> None:
    held, speed = device(wheel), 20.0
    middle, cosine, sine = (0.0, 0.0, -1e-4), (2e-3, 0.0, 0.0), (0.0, 0.0, 5e-4)
    wheel.request_motion(middle, cosine, sine, speed)
    way(held, 400)
    points = way(held, 3000)
    # A filter of second order lags by 2 atan(speed/w) and takes 1 + (speed/w)^2 off the radius.
    shrunk = 1.0 / (1.0 + (speed / TRACKING_BANDWIDTH) ** 2)
    angle = wheel.table[STATE_ROW, ANGLE] - 2.0 * np.arctan(speed / TRACKING_BANDWIDTH)
    expected = np.array(middle) + shrunk * (
        np.array(cosine) * np.cos(angle) + np.array(sine) * np.sin(angle)
    )
    assert np.abs(points[-1] - expected).max() < 0.02 * 2e-3
    assert np.ptp(points[:, 0]) == pytest.approx(4e-3 * shrunk, rel=0.01)


@pytest.mark.parametrize("wrong", [{"target": (np.nan, 0, 0)}, {"target": (0, 0)},
                                   {"target": (0, 0, 0), "angular_velocity": np.inf}])  # fmt: skip
def test_what_is_no_place_is_refused_and_changes_nothing(wheel: PointerHand, wrong: Any) -> None:
    before = wheel.table.copy()
    with pytest.raises(ParameterError):
        wheel.request_motion(**wrong)
    assert (wheel.table == before).all()


def test_a_wheel_that_is_gone_is_said(wheel: PointerHand) -> None:
    driver = pointer_driver(Cartesian(0.05, 1.0), HAND, Servo(1e-3), wheel)
    assert driver.device.anchor.shape == (HEADER_ROWS + HISTORY_SAMPLES * ROWS_PER_SAMPLE, 3)
    wheel.close()
    with pytest.raises(ParameterError, match="nothing moves"):
        driver.open()
    with pytest.raises(ParameterError, match="is closed"):
        wheel.request_motion((0.0, 0.0, 0.0))


def test_a_hand_that_is_moved_cannot_be_steered(wheel: PointerHand) -> None:
    with pytest.raises(ParameterError, match="hand must be a spring"):
        pointer_driver(Cartesian(0.05, 1.0), PrescribedHand(), Servo(1e-3), wheel)


def test_the_memory_is_shared(wheel: PointerHand) -> None:
    held = device(wheel)
    held.anchor[ANCHOR] = (7.0, 8.0, 9.0)
    assert wheel.anchor.tolist() == [7.0, 8.0, 9.0]
