"""No device: the plant and the hand of a simulation, sample by sample as the clock goes."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.errors import ParameterError
from asperity.servo.drivers.driver import Driver
from asperity.servo.kernels import simulated
from asperity.servo.kernels.simulated import SimulatedDevice
from asperity.simulation.hands import Hand
from asperity.simulation.kernels import servo_loop
from asperity.simulation.kernels.body_functions import DIVERGED, LEFT
from asperity.simulation.kernels.booking import SUMS
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Plant
from asperity.simulation.sampled_plant import sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import anchor_points, begin

MOST_SAMPLES = 40_000_000
"""Of the hand's motion, which is laid out before the start: about a gigabyte."""
_WORDS = {DIVERGED: "the simulated handle flew away", LEFT: "the handle left the workspace"}


@dataclass(frozen=True, eq=False)
class SimulatedDriver(Driver):
    """A simulated device that a simulated hand holds.

    Attributes:
        modules: names of the compiled modules of the body.
        device: what it is made of, at the start.
    """

    name: ClassVar[str] = "simulated"
    moving: ClassVar[bool] = False
    when_lost: ClassVar[str] = "There is no device: nothing moves."

    modules: tuple[str, ...]
    device: SimulatedDevice

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the device, its delay and its body."""
        return simulated, servo_loop, *map(importlib.import_module, self.modules)

    def blank(self) -> tuple[Any, ...]:
        """Return the device itself: compiling moves nothing."""
        return self.device

    def open(self) -> tuple[Any, ...]:
        """Return a copy, so that every start is the same."""
        device = self.device
        return device._replace(
            x=device.x.copy(), queue=np.zeros_like(device.queue), done=np.zeros(2, np.int64),
            ledger=np.zeros(SUMS),
        )  # fmt: skip

    def explain(self, code: int) -> str:
        """Return what has happened to the body."""
        return _WORDS.get(code, f"error {code}")


def simulated_driver(
    plant: Plant, hand: Hand, servo: Servo, motion: Motion, duration: float,
    start: tuple[float, ...] | None = None, velocity: tuple[float, ...] | None = None, *,
    steps: bool = False,
) -> SimulatedDriver:  # fmt: skip
    """Return a simulated device.

    Args:
        plant: the device.
        hand: what holds it.
        servo: whose period and delay count; with ``steps`` its steps, too.
        motion: of the hand's anchor, which stays where it is after the end.
        duration: for which the motion is laid out [s].
        start: of the handle [m]; default: where the motion begins.
        velocity: of the handle at the start [m/s]; default: at rest.
        steps: whether the steps of position and force are the device's own, as those of a real one;
            else they are the loop's, as in a simulation.

    Raises:
        ParameterError: see :func:`~asperity.simulation.simulate`; for a duration of more than
            ``MOST_SAMPLES``.
    """
    samples = round(duration / servo.period)
    if not 0 < samples <= MOST_SAMPLES:
        limit = f"must be 1 to {MOST_SAMPLES} samples of {servo.period:g} s"
        raise ParameterError("duration", limit, duration)
    place, speed = begin(plant, hand, servo, motion, start, velocity)
    anchor = anchor_points(motion, servo.period, plant, 0, samples)
    made = sampled_plant(plant, hand, servo)
    device = SimulatedDevice(
        made.state(place, speed), np.zeros((servo.delay + 1, 3)), np.zeros(2, np.int64),
        np.ascontiguousarray(anchor), np.zeros(SUMS), 1.0 / servo.period, made.record,
        float(servo.position_resolution) if steps else 0.0,
        float(servo.force_resolution) if steps else 0.0,
    )  # fmt: skip
    return SimulatedDriver(tuple(module.__name__ for module in made.modules), device)
