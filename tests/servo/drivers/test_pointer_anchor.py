"""The pointer hand: its anchor follows the target smoothly, no faster than a real hand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.servo.drivers.pointer import (
    ANCHOR,
    ANGLE,
    HEADER_ROWS,
    HISTORY_SAMPLES,
    MAX_SPEED,
    STATE_ROW,
    TRACKING_BANDWIDTH,
    PointerHand,
    anchor_segment,
    pointer_driver,
)
from asperity.simulation import Cartesian, PrescribedHand, Servo, SpringHand

RATE = 2000.0
HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)


@pytest.fixture
def pointer() -> Iterator[PointerHand]:
    with PointerHand((1e-3, -2e-3, 3e-3)) as hand:
        yield hand


def device(pointer: PointerHand) -> Any:
    """Return the record of the compiled loop, which shares the pointer's memory."""
    driver = pointer_driver(Cartesian(0.05, 1.0), HAND, Servo(1.0 / RATE), pointer)
    return driver.open()


def anchor_path(held: Any, samples: int) -> np.ndarray:
    return np.array([anchor_segment(held)[3:] for _ in range(samples)])


def test_anchor_reaches_the_target_without_overshoot(pointer: PointerHand) -> None:
    target = np.array([2e-3, -1e-3, 2.5e-3])
    record, start = device(pointer), pointer.anchor
    request_count = pointer.request_motion(target)
    anchors = anchor_path(record, round(20.0 / TRACKING_BANDWIDTH * RATE))
    assert pointer.acknowledged_count == request_count == pointer.request_count == 1
    assert np.abs(anchors[-1] - target).max() < 1e-7
    # Critically damped: each axis is monotonic and reaches one half at 1.678/w.
    for axis in range(3):
        assert (np.diff(anchors[:, axis]) * np.sign(target - start)[axis] >= 0.0).all()
    half_time = np.argmax(anchors[:, 0] > 1.5e-3) / RATE
    assert half_time == pytest.approx(1.678 / TRACKING_BANDWIDTH, abs=1.5 / RATE)


def test_anchor_speed_is_limited_to_that_of_a_hand(pointer: PointerHand) -> None:
    record = device(pointer)
    pointer.request_motion((0.08, -0.05, 0.02))
    steps = np.linalg.norm(np.diff(anchor_path(record, 400), axis=0), axis=1)
    assert steps.max() == pytest.approx(MAX_SPEED / RATE, rel=1e-9)
    assert (steps <= MAX_SPEED / RATE * (1.0 + 1e-12)).all()


def test_loop_follows_an_ellipse_on_its_own(pointer: PointerHand) -> None:
    record, speed = device(pointer), 20.0
    middle, cosine, sine = (0.0, 0.0, -1e-4), (2e-3, 0.0, 0.0), (0.0, 0.0, 5e-4)
    pointer.request_motion(middle, cosine, sine, speed)
    anchor_path(record, 400)
    points = anchor_path(record, 3000)
    # A second-order filter lags by 2 atan(speed/w) and divides the radius by 1 + (speed/w)^2.
    gain = 1.0 / (1.0 + (speed / TRACKING_BANDWIDTH) ** 2)
    angle = pointer.table[STATE_ROW, ANGLE] - 2.0 * np.arctan(speed / TRACKING_BANDWIDTH)
    expected = np.array(middle) + gain * (
        np.array(cosine) * np.cos(angle) + np.array(sine) * np.sin(angle)
    )
    assert np.abs(points[-1] - expected).max() < 0.02 * 2e-3
    assert np.ptp(points[:, 0]) == pytest.approx(4e-3 * gain, rel=0.01)


@pytest.mark.parametrize(
    "arguments",
    [
        {"target": (np.nan, 0, 0)},
        {"target": (0, 0)},
        {"target": (0, 0, 0), "angular_velocity": np.inf},
    ],
)
def test_invalid_request_is_rejected_and_changes_nothing(
    pointer: PointerHand, arguments: Any
) -> None:
    before = pointer.table.copy()
    with pytest.raises(ParameterError):
        pointer.request_motion(**arguments)
    assert (pointer.table == before).all()


def test_closed_pointer_is_an_error(pointer: PointerHand) -> None:
    driver = pointer_driver(Cartesian(0.05, 1.0), HAND, Servo(1e-3), pointer)
    assert driver.device.anchor.shape == (HEADER_ROWS + HISTORY_SAMPLES, 3)
    pointer.close()
    with pytest.raises(ParameterError, match="nothing moves"):
        driver.open()
    with pytest.raises(ParameterError, match="is closed"):
        pointer.request_motion((0.0, 0.0, 0.0))


def test_prescribed_hand_cannot_be_steered(pointer: PointerHand) -> None:
    with pytest.raises(ParameterError, match="hand must be a spring"):
        pointer_driver(Cartesian(0.05, 1.0), PrescribedHand(), Servo(1e-3), pointer)


def test_loop_and_pointer_share_memory(pointer: PointerHand) -> None:
    record = device(pointer)
    record.anchor[ANCHOR] = (7.0, 8.0, 9.0)
    assert pointer.anchor.tolist() == [7.0, 8.0, 9.0]
