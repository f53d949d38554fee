"""A hand that is steered: its anchor follows smoothly, and never faster than a hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.servo.drivers.steered import Wheel, steered_driver
from asperity.servo.kernels.steered import (
    ANCHOR,
    EAGERNESS,
    FASTEST,
    HEARD,
    KEPT,
    PARTS,
    ROWS,
    TURN,
    anchor_step,
)
from asperity.simulation import Cartesian, MovedHand, Servo, SpringHand

RATE = 2000.0
HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)


@pytest.fixture
def wheel() -> Iterator[Wheel]:
    with Wheel((1e-3, -2e-3, 3e-3)) as one:
        yield one


def device(wheel: Wheel) -> Any:
    """Return what the compiled loop holds, on the same memory."""
    driver = steered_driver(Cartesian(0.05, 1.0), HAND, Servo(1.0 / RATE), wheel)
    return driver.open()


def way(held: Any, samples: int) -> np.ndarray:
    return np.array([anchor_step(held)[3:] for _ in range(samples)])


def test_the_anchor_goes_where_it_is_wanted_without_a_swing(wheel: Wheel) -> None:
    target = np.array([2e-3, -1e-3, 2.5e-3])
    held, start = device(wheel), wheel.anchor
    number = wheel.steer(target)
    way_there = way(held, round(20.0 / EAGERNESS * RATE))
    assert wheel.heard == number == wheel.wishes == 1
    assert np.abs(way_there[-1] - target).max() < 1e-7
    # Critically damped: each axis goes on without turning back, and has done half at 1.68/w.
    for axis in range(3):
        assert (np.diff(way_there[:, axis]) * np.sign(target - start)[axis] >= 0.0).all()
    half = np.argmax(way_there[:, 0] > 1.5e-3) / RATE
    assert half == pytest.approx(1.678 / EAGERNESS, abs=1.5 / RATE)


def test_it_is_never_faster_than_a_hand(wheel: Wheel) -> None:
    held = device(wheel)
    wheel.steer((0.08, -0.05, 0.02))
    steps = np.linalg.norm(np.diff(way(held, 400), axis=0), axis=1)
    assert steps.max() == pytest.approx(FASTEST / RATE, rel=1e-9)
    assert (steps <= FASTEST / RATE * (1.0 + 1e-12)).all()


def test_an_ellipse_is_gone_round_by_the_loop_itself(wheel: Wheel) -> None:
    held, speed = device(wheel), 20.0
    middle, cosine, sine = (0.0, 0.0, -1e-4), (2e-3, 0.0, 0.0), (0.0, 0.0, 5e-4)
    wheel.steer(middle, cosine, sine, speed)
    way(held, 400)
    points = way(held, 3000)
    # A filter of second order lags by 2 atan(speed/w) and takes 1 + (speed/w)^2 off the radius.
    shrunk = 1.0 / (1.0 + (speed / EAGERNESS) ** 2)
    angle = wheel.table[HEARD, TURN] - 2.0 * np.arctan(speed / EAGERNESS)
    expected = np.array(middle) + shrunk * (
        np.array(cosine) * np.cos(angle) + np.array(sine) * np.sin(angle)
    )
    assert np.abs(points[-1] - expected).max() < 0.02 * 2e-3
    assert np.ptp(points[:, 0]) == pytest.approx(4e-3 * shrunk, rel=0.01)


@pytest.mark.parametrize("wrong", [{"target": (np.nan, 0, 0)}, {"target": (0, 0)},
                                   {"target": (0, 0, 0), "speed": np.inf}])  # fmt: skip
def test_what_is_no_place_is_refused_and_changes_nothing(wheel: Wheel, wrong: Any) -> None:
    before = wheel.table.copy()
    with pytest.raises(ParameterError):
        wheel.steer(**wrong)
    assert (wheel.table == before).all()


def test_a_wheel_that_is_gone_is_said(wheel: Wheel) -> None:
    driver = steered_driver(Cartesian(0.05, 1.0), HAND, Servo(1e-3), wheel)
    assert driver.device.anchor.shape == (ROWS + KEPT * PARTS, 3)
    wheel.close()
    with pytest.raises(ParameterError, match="nobody steers"):
        driver.open()
    with pytest.raises(ParameterError, match="is closed"):
        wheel.steer((0.0, 0.0, 0.0))


def test_a_hand_that_is_moved_cannot_be_steered(wheel: Wheel) -> None:
    with pytest.raises(ParameterError, match="hand must be a spring"):
        steered_driver(Cartesian(0.05, 1.0), MovedHand(), Servo(1e-3), wheel)


def test_the_memory_is_shared(wheel: Wheel) -> None:
    held = device(wheel)
    held.anchor[ANCHOR] = (7.0, 8.0, 9.0)
    assert wheel.anchor.tolist() == [7.0, 8.0, 9.0]
