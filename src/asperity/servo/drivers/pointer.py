"""A simulated device whose hand follows a pointer while the loop runs.

Requests come through shared memory, at any time and in any steps. The anchor follows them with
critical damping and a limited speed.

The anchor of a following loop repeats that of another loop, sample by sample. Such a loop has no
clock of its own: it waits for each sample of the other one, so both get the same motion at the same
samples, however late either is.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_real
from asperity.core.compiled import Kernels
from asperity.core.errors import ParameterError
from asperity.core.platform.clock_interface import clock_now, clock_wait_until
from asperity.core.platform.clocks import no_clock, system_clock
from asperity.core.platform.system import memory_folder
from asperity.loop.simulated_device import FIRST_SAMPLE, SAMPLES, SimulatedDevice
from asperity.servo.drivers.simulated import SimulatedDriver, simulated_driver
from asperity.simulation.hands import Hand, Stationary
from asperity.simulation.plants import Plant
from asperity.simulation.servo import Servo

KERNELS = Kernels(provides=("anchor_segment",))

# Rows of the memory: the pointer writes the first four, the loop the next three, a following loop
# the last. The request is the point TARGET + COSINE cos(angle) + SINE sin(angle) [m].
TARGET, COSINE, SINE, REQUEST_ROW, ANCHOR, VELOCITY, STATE_ROW, FOLLOWER_ROW = range(8)
HEADER_ROWS = 8
# Then follow the anchors at the newest samples [m], which a following loop repeats.
HISTORY_SAMPLES = 8_000
# REQUEST_ROW: angular velocity [rad/s] and number of the newest request; STATE_ROW: angle [rad],
# number of the newest acknowledged request, and number of samples whose rows are complete.
ANGLE = 0
REQUEST_NUMBER = 1
SAMPLE_COUNT = 2
# FOLLOWER_ROW: number of the next sample that is repeated, and number of samples left out.
NEXT_SAMPLE = 0
LEFT_OUT = 1

TRACKING_BANDWIDTH = 250.0
"""Bandwidth of the anchor [rad/s]; it lags by 2/ω, 8 ms."""
MAX_SPEED = 0.4
"""Largest speed of the anchor [m/s]."""
POLL_TIME = 2_000_000
"""Time for which a following loop waits before it looks for the next sample again [ns]."""
MAX_POLLS = 25
"""Waits after which its anchor rests for a sample, so that a request to stop is met."""
MAX_LAG = 2000
"""Samples behind the other loop, beyond which a following loop leaves samples out."""

_ROW_COUNT = HEADER_ROWS + HISTORY_SAMPLES


def history_row(sample: int) -> int:
    """Return the row of the anchor at a sample."""
    return HEADER_ROWS + sample % HISTORY_SAMPLES


def follow_anchor(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the anchor of the other loop at its sample and at the next [m], and wait for them.

    The sample is that of this loop plus ``counters[FIRST_SAMPLE]``. Without a further sample the
    anchor rests.
    """
    at = device.anchor
    sample = device.counters[SAMPLES] + device.counters[FIRST_SAMPLE]
    polls = 0
    while at[STATE_ROW, SAMPLE_COUNT] < sample + 2 and polls < MAX_POLLS:
        clock_wait_until(clock_now(0, device.clock) + POLL_TIME, device.clock)
        polls += 1
    lag = int(at[STATE_ROW, SAMPLE_COUNT]) - 2 - sample
    left_out = lag if lag > MAX_LAG else 0
    here = history_row(sample + left_out)
    following = sample + left_out + (1 if lag >= 0 else 0)
    there = history_row(following)
    device.counters[FIRST_SAMPLE] += following - sample - 1
    at[FOLLOWER_ROW, NEXT_SAMPLE] = following
    at[FOLLOWER_ROW, LEFT_OUT] += left_out
    return at[here, 0], at[here, 1], at[here, 2], at[there, 0], at[there, 1], at[there, 2]


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the hand's anchor at this sample and at the next [m].

    v' = ω² (target - a) - 2 ω v, with |v| limited to ``MAX_SPEED``. With a clock that can wait, the
    anchor is that of another loop.
    """
    if device.clock.wait != 0:
        return follow_anchor(device)
    at = device.anchor
    # Written in the call after that of the row.
    at[STATE_ROW, SAMPLE_COUNT] = device.counters[SAMPLES]
    step = 1.0 / device.update_rate
    number = at[REQUEST_ROW, REQUEST_NUMBER]
    angle = (at[STATE_ROW, ANGLE] + at[REQUEST_ROW, ANGLE] * step) % (2.0 * math.pi)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    speed = 0.0
    for i in range(3):
        target = at[TARGET, i] + at[COSINE, i] * cosine + at[SINE, i] * sine
        pull = TRACKING_BANDWIDTH * TRACKING_BANDWIDTH * (target - at[ANCHOR, i])
        at[VELOCITY, i] += step * (pull - 2.0 * TRACKING_BANDWIDTH * at[VELOCITY, i])
        speed += at[VELOCITY, i] * at[VELOCITY, i]
    speed = math.sqrt(speed)
    share = MAX_SPEED / speed if speed > MAX_SPEED else 1.0
    ax = at[ANCHOR, 0]
    ay = at[ANCHOR, 1]
    az = at[ANCHOR, 2]
    row = history_row(device.counters[SAMPLES])
    for i in range(3):
        at[row, i] = at[ANCHOR, i]
        at[VELOCITY, i] *= share
        at[ANCHOR, i] += step * at[VELOCITY, i]
    at[STATE_ROW, ANGLE] = angle
    at[STATE_ROW, REQUEST_NUMBER] = number
    return ax, ay, az, at[ANCHOR, 0], at[ANCHOR, 1], at[ANCHOR, 2]


class PointerHand(AbstractContextManager["PointerHand"]):
    """The memory through which a pointer moves a hand; use it in a ``with``.

    One process writes requests and one loop follows them, without locks: each number is written
    whole, and a request that is half written is followed for one sample.

    Args:
        start: initial position of the anchor [m].

    Attributes:
        name: name of the file by which the loop's process finds the memory.
    """

    def __init__(self, start: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        position = check_array("start", start, (3,), "m")
        # A file in memory, if the system provides it.
        descriptor, self.name = tempfile.mkstemp(prefix="asperity-", dir=memory_folder())
        with open(descriptor, "wb") as file:
            file.write(bytes(8 * 3 * _ROW_COUNT))
        self._table: FloatArray | None = open_pointer_table(self.name)
        self._table[TARGET] = self._table[ANCHOR] = position

    @property
    def table(self) -> FloatArray:
        """The memory, whose rows are named above."""
        if self._table is None:
            raise ParameterError("pointer", "is closed")
        return self._table

    def request_motion(
        self,
        target: ArrayLike,
        cosine: ArrayLike = (0.0, 0.0, 0.0),
        sine: ArrayLike = (0.0, 0.0, 0.0),
        angular_velocity: float = 0.0,
    ) -> int:
        """Request the points target + cosine cos(angle) + sine sin(angle) [m].

        Args:
            target: a point, or the centre of an ellipse.
            cosine: from the centre to the start of the ellipse.
            sine: from the centre to the point a quarter later.
            angular_velocity: angular velocity [rad/s].

        Returns:
            The number of the request, which :attr:`acknowledged_count` reaches when the anchor
            follows it.

        Raises:
            ParameterError: for a number that is not finite.
        """
        points = {TARGET: ("target", target), COSINE: ("cosine", cosine), SINE: ("sine", sine)}
        rows = {row: check_array(*point, (3,), "m") for row, point in points.items()}
        velocity = check_real("angular_velocity", angular_velocity, "rad/s")
        table = self.table
        for row, values in rows.items():
            table[row] = values
        table[REQUEST_ROW, ANGLE] = velocity
        number = self.request_count + 1
        table[REQUEST_ROW, REQUEST_NUMBER] = number
        return number

    @property
    def request_count(self) -> int:
        """Number of the newest request."""
        return int(self.table[REQUEST_ROW, REQUEST_NUMBER])

    @property
    def acknowledged_count(self) -> int:
        """Number of the newest acknowledged request."""
        return int(self.table[STATE_ROW, REQUEST_NUMBER])

    @property
    def follower_lag(self) -> tuple[int, int]:
        """Samples by which a following loop is behind, and samples that it has left out."""
        sample, left_out, _ = self.table[FOLLOWER_ROW]
        count = self.table[STATE_ROW, SAMPLE_COUNT]
        return max(int(count - sample), 0), int(left_out)

    @property
    def anchor(self) -> FloatArray:
        """Position of the anchor (3,) [m]."""
        return np.array(self.table[ANCHOR])

    def close(self) -> None:
        """Release the memory; a running loop keeps its own mapping."""
        if self._table is not None:
            self._table = None
            with suppress(OSError):  # some systems do not remove files in use
                os.remove(self.name)

    def __exit__(self, *_: object) -> None:
        self.close()


def open_pointer_table(name: str) -> FloatArray:
    """Return the shared memory as a table, which keeps it mapped.

    Raises:
        FileNotFoundError: if the pointer was closed.
    """
    return np.asarray(np.memmap(name, np.float64, "r+", shape=(_ROW_COUNT, 3)))


@dataclass(frozen=True, eq=False)
class PointerDriver(SimulatedDriver):
    """A simulated device whose hand follows a :class:`PointerHand`.

    Attributes:
        pointer_file: name of the file of its memory.
        follows: whether another loop moves the anchor, and this one repeats its motion.
        clock_speed: seconds of the loop in one of the system; above 1 for tests alone.
    """

    name: ClassVar[str] = "simulated"
    pointer_file: str = ""
    follows: bool = False
    clock_speed: int = 1

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the modules of a simulated device, with the anchor of the pointer first."""
        return sys.modules[__name__], *super().kernel_modules()

    def open(self) -> tuple[Any, ...]:
        """Return the device, held by the hand.

        Raises:
            ParameterError: if the pointer was closed.
        """
        try:
            table = open_pointer_table(self.pointer_file)
        except FileNotFoundError:
            raise ParameterError("pointer", "is closed: nothing moves the hand") from None
        device = SimulatedDevice(*super().open())._replace(anchor=table)
        if not self.follows:
            table[STATE_ROW] = 0.0
            return device
        count = table[STATE_ROW, SAMPLE_COUNT]
        device.counters[FIRST_SAMPLE] = max(count - 1.0, 0.0)
        table[FOLLOWER_ROW] = device.counters[FIRST_SAMPLE], 0.0, 0.0
        return device._replace(clock=system_clock())


def pointer_driver(plant: Plant, hand: Hand, servo: Servo, pointer: PointerHand) -> PointerDriver:
    """Return a simulated device whose hand follows a pointer.

    Args:
        plant: the device.
        hand: the hand that holds it, without a prescribed motion.
        servo: period and delay.
        pointer: moves the hand's anchor, from the initial position of the handle.

    Raises:
        ParameterError: for a plant that cannot be simulated with this hand; for a prescribed hand.
    """
    if hand.is_prescribed:
        raise ParameterError("hand", "must be a spring or a band: the pointer moves its anchor")
    start = Stationary(tuple(pointer.anchor))
    driver = simulated_driver(plant, hand, servo, start, servo.period)
    device = driver.device._replace(anchor=np.zeros((_ROW_COUNT, 3)), clock=no_clock())
    return PointerDriver(driver.body_modules, device, pointer.name)
