"""Devices without hardware: a simulated one, and a recording."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.loop import replayed_device, simulated_device
from asperity.loop.body_interface import DIVERGED, LEFT_WORKSPACE
from asperity.loop.replayed_device import ReplayedDevice
from asperity.loop.simulated_device import COUNTERS_SIZE, DELAY, LEDGER_SIZE, SimulatedDevice
from asperity.recording.recording import Recording, open_recording
from asperity.servo.driver import Driver
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.lanes import anchor_points, initial_motion
from asperity.simulation.plants import Plant, sampled_plant
from asperity.simulation.servo import Servo

MAX_SAMPLES = 40_000_000
"""Samples of the hand's motion, which is computed before the start: about a gigabyte."""
_ERROR_TEXTS = {
    DIVERGED: "the simulated handle flew away",
    LEFT_WORKSPACE: "the handle left the workspace",
}


@dataclass(frozen=True, eq=False)
class SimulatedDriver(Driver):
    """A simulated device that a simulated hand holds.

    Attributes:
        body_modules: names of the compiled modules of the body.
        device: record of the device at the start.
    """

    name: ClassVar[str] = "simulated"
    has_moving_handle: ClassVar[bool] = False
    loss_notice: ClassVar[str] = "There is no device: nothing moves."

    body_modules: tuple[str, ...]
    device: SimulatedDevice

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the device, its delay and its body."""
        return simulated_device, *map(importlib.import_module, self.body_modules)

    def placeholder_record(self) -> tuple[Any, ...]:
        """Return the device itself: compiling moves nothing."""
        return self.device

    def open(self) -> tuple[Any, ...]:
        """Return a copy, so that every start is equal."""
        device = self.device
        return device._replace(
            x=device.x.copy(),
            queue=np.zeros_like(device.queue),
            counters=device.counters.copy(),
            ledger=np.zeros(LEDGER_SIZE),
        )

    def describe_error(self, code: int) -> str:
        """Return what happened to the body."""
        return _ERROR_TEXTS.get(code, f"error {code}")


def simulated_driver(
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    duration: float,
    start: tuple[float, ...] | None = None,
    velocity: tuple[float, ...] | None = None,
    *,
    device_resolution: bool = False,
) -> SimulatedDriver:
    """Return a simulated device.

    Args:
        plant: the device.
        hand: the hand that holds it.
        servo: period and delay; with ``device_resolution`` the steps as well.
        motion: motion of the hand's anchor, which rests after the end.
        duration: duration of the motion [s].
        start: initial position of the handle [m]; default: where the motion starts.
        velocity: initial velocity of the handle [m/s]; default: at rest.
        device_resolution: whether the steps of position and force are the device's own, as those of
            a real one; otherwise they are the loop's, as in a simulation.

    Raises:
        ParameterError: see :func:`~asperity.simulation.simulate`; for a duration of more than
            ``MAX_SAMPLES``.
    """
    samples = round(duration / servo.period)
    if not 0 < samples <= MAX_SAMPLES:
        raise ParameterError(
            "duration", f"must be 1 to {MAX_SAMPLES} samples of {servo.period:g} s", duration
        )
    position, speed = initial_motion(plant, hand, servo, motion, start, velocity)
    anchor = anchor_points(motion, servo.period, plant, 0, samples)
    body = sampled_plant(plant, hand, servo)
    counters = np.zeros(COUNTERS_SIZE, np.int64)
    counters[DELAY] = servo.delay
    device = SimulatedDevice(
        body.initial_state(position, speed),
        np.zeros((servo.delay + 1, 3)),
        counters,
        np.ascontiguousarray(anchor),
        np.zeros(3),
        np.zeros(LEDGER_SIZE),
        1.0 / servo.period,
        body.record,
        float(servo.position_resolution) if device_resolution else 0.0,
        float(servo.force_resolution) if device_resolution else 0.0,
    )
    return SimulatedDriver(tuple(module.__name__ for module in body.modules), device)


@dataclass(frozen=True, eq=False)
class ReplayDriver(Driver):
    """A handle that follows the positions of a recording.

    Attributes:
        points: positions in the surface's frame, sample by sample (n, 3) [m].
    """

    name: ClassVar[str] = "replay"
    has_moving_handle: ClassVar[bool] = False
    loss_notice: ClassVar[str] = "There is no device: nothing moves."

    points: FloatArray

    @property
    def max_readings(self) -> int:
        """Number of positions."""
        return len(self.points)

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the module that follows the positions."""
        return (replayed_device,)

    def placeholder_record(self) -> ReplayedDevice:
        """Return a device at its first position."""
        return self.open()

    def open(self) -> ReplayedDevice:
        """Return a device at its first position."""
        return ReplayedDevice(self.points, np.zeros(1, np.int64))


def open_replay(path: str) -> Recording:
    """Return a recording that has positions to follow.

    Raises:
        ParameterError: for a recording that cannot be read, or without rows.
    """
    recording = open_recording(path)
    if recording.rows < 2:
        raise ParameterError("driver", f"{path} has {recording.rows} rows: nothing to replay")
    return recording


def replay_driver(path: str, period: float) -> ReplayDriver:
    """Return a driver that follows the positions of a recording.

    Args:
        path: path of the recording.
        period: period of the loop [s].

    Raises:
        ParameterError: for a recording that cannot be read, without rows or positions, or with
            another period.
    """
    recording = open_replay(path)
    steps = np.diff(recording["time"])
    if np.abs(steps - period).max() > 1e-3 * period:
        recorded = format_quantity(1.0 / np.median(steps), "Hz")
        rate = format_quantity(1.0 / period, "Hz")
        raise ParameterError(
            "driver",
            f"{path} is not sampled evenly at {rate}: most of it is at {recorded}"
            f" ({{update_rate}})",
            update_rate=recorded,
        )
    points = np.column_stack([recording[name] for name in "xyz"])
    return ReplayDriver(np.ascontiguousarray(points))
