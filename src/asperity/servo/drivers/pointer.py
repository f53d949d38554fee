"""A simulated device whose hand follows a pointer while the loop runs."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_real
from asperity.core.errors import ParameterError
from asperity.servo.driver_loop import no_clock, system_clock
from asperity.servo.drivers.simulated import SimulatedDriver, simulated_driver
from asperity.servo.kernels import pointer_anchor
from asperity.simulation.hands import Hand
from asperity.simulation.kernels.simulated_device import SimulatedDevice
from asperity.simulation.motions import Stationary
from asperity.simulation.plants import Plant
from asperity.simulation.servo import Servo

_ROW_COUNT = pointer_anchor.HEADER_ROWS + pointer_anchor.HISTORY_SAMPLES
_MEMORY_FOLDER = "/dev/shm" if Path("/dev/shm").is_dir() else None


class PointerHand:
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
        descriptor, self.name = tempfile.mkstemp(prefix="asperity-", dir=_MEMORY_FOLDER)
        with open(descriptor, "wb") as file:
            file.write(bytes(8 * 3 * _ROW_COUNT))
        self._table: FloatArray | None = open_pointer_table(self.name)
        self._table[pointer_anchor.TARGET] = self._table[pointer_anchor.ANCHOR] = position

    @property
    def table(self) -> FloatArray:
        """The memory, see ``kernels/pointer_anchor.py``."""
        if self._table is None:
            raise ParameterError("pointer", "is closed")
        return self._table

    def request_motion(
        self, target: ArrayLike, cosine: ArrayLike = (0.0, 0.0, 0.0),
        sine: ArrayLike = (0.0, 0.0, 0.0), angular_velocity: float = 0.0,
    ) -> int:  # fmt: skip
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
        points = {
            pointer_anchor.TARGET: ("target", target),
            pointer_anchor.COSINE: ("cosine", cosine),
            pointer_anchor.SINE: ("sine", sine),
        }
        rows = {row: check_array(*point, (3,), "m") for row, point in points.items()}
        velocity = check_real("angular_velocity", angular_velocity, "rad/s")
        table = self.table
        for row, values in rows.items():
            table[row] = values
        table[pointer_anchor.REQUEST_ROW, pointer_anchor.ANGLE] = velocity
        number = self.request_count + 1
        table[pointer_anchor.REQUEST_ROW, pointer_anchor.REQUEST_NUMBER] = number
        return number

    @property
    def request_count(self) -> int:
        """Number of the newest request."""
        return int(self.table[pointer_anchor.REQUEST_ROW, pointer_anchor.REQUEST_NUMBER])

    @property
    def acknowledged_count(self) -> int:
        """Number of the newest acknowledged request."""
        return int(self.table[pointer_anchor.STATE_ROW, pointer_anchor.REQUEST_NUMBER])

    @property
    def follower_lag(self) -> tuple[int, int]:
        """Samples by which a following loop is behind, and samples that it has left out."""
        sample, left_out, _ = self.table[pointer_anchor.FOLLOWER_ROW]
        count = self.table[pointer_anchor.STATE_ROW, pointer_anchor.SAMPLE_COUNT]
        return max(int(count - sample), 0), int(left_out)

    @property
    def anchor(self) -> FloatArray:
        """Position of the anchor (3,) [m]."""
        return np.array(self.table[pointer_anchor.ANCHOR])

    def close(self) -> None:
        """Release the memory; a running loop keeps its own mapping."""
        if self._table is not None:
            self._table = None
            with suppress(OSError):  # some systems do not remove files in use
                os.remove(self.name)

    def __enter__(self) -> Self:
        return self

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
    """

    name: ClassVar[str] = "simulated"
    pointer_file: str = ""
    follows: bool = False

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the modules of a simulated device, with the anchor of the pointer first."""
        return pointer_anchor, *super().kernel_modules()

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
            table[pointer_anchor.STATE_ROW] = 0.0
            return device
        count = table[pointer_anchor.STATE_ROW, pointer_anchor.SAMPLE_COUNT]
        device.counters[2] = max(count - 1.0, 0.0)
        table[pointer_anchor.FOLLOWER_ROW] = device.counters[2], 0.0, 0.0
        wait = np.array([0, pointer_anchor.POLL_TIME])
        return device._replace(clock=system_clock()._replace(timespec=wait))


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
