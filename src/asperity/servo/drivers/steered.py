"""A simulated device whose hand is moved by somebody while the loop runs: a pointer on a page."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array, real
from asperity.errors import ParameterError
from asperity.servo.drivers.simulated import SimulatedDriver, simulated_driver
from asperity.servo.kernels import steered
from asperity.servo.kernels.simulated import SimulatedDevice
from asperity.servo.kernels.steered import (
    ANCHOR,
    ASKED,
    COSINE,
    HEARD,
    KEPT,
    PARTS,
    ROWS,
    SINE,
    TARGET,
    TURN,
    WISH,
)
from asperity.simulation.hands import Hand, MovedHand
from asperity.simulation.motions import Still
from asperity.simulation.plants import Plant
from asperity.simulation.servo import Servo

_LENGTH = ROWS + PARTS * KEPT
_PLACE = "/dev/shm" if Path("/dev/shm").is_dir() else None


class Wheel:
    """The memory through which a hand is steered; use it in a ``with``.

    One process steers and one loop follows, and neither waits for the other: each number is
    written whole, and what is asked for in between two of them is followed for one sample.

    Args:
        start: where the anchor is at first [m].

    Attributes:
        name: of the file by which the loop's process finds the memory.
    """

    def __init__(self, start: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        place = array("start", start, (3,), "m")
        # A file that lies in memory where the system has a place for that.
        descriptor, self.name = tempfile.mkstemp(prefix="asperity-", dir=_PLACE)
        with open(descriptor, "wb") as file:
            file.write(bytes(8 * 3 * _LENGTH))
        self._table: FloatArray | None = table_of(self.name)
        self._table[TARGET] = self._table[ANCHOR] = place

    @property
    def table(self) -> FloatArray:
        """The memory, see ``kernels.steered``."""
        if self._table is None:
            raise ParameterError("wheel", "is closed")
        return self._table

    def steer(
        self, target: ArrayLike, cosine: ArrayLike = (0.0, 0.0, 0.0),
        sine: ArrayLike = (0.0, 0.0, 0.0), speed: float = 0.0,
    ) -> int:  # fmt: skip
        """Ask for the points target + cosine cos(angle) + sine sin(angle) [m].

        Args:
            target: a point, or the middle of an ellipse.
            cosine: from the middle to where the ellipse begins.
            sine: from the middle to where it is a quarter later.
            speed: of the angle [rad/s].

        Returns:
            The number of the wish, which :attr:`heard` reaches when the anchor follows it.

        Raises:
            ParameterError: for a number that is not finite.
        """
        parts = [
            array(name, value, (3,), "m")
            for name, value in (("target", target), ("cosine", cosine), ("sine", sine))
        ]
        turn = real("speed", speed, "rad/s")
        table = self.table
        for row, part in zip((TARGET, COSINE, SINE), parts, strict=True):
            table[row] = part
        table[ASKED, TURN] = turn
        number = self.wishes + 1
        table[ASKED, WISH] = number
        return number

    @property
    def wishes(self) -> int:
        """Number of the newest wish."""
        return int(self.table[ASKED, WISH])

    @property
    def heard(self) -> int:
        """Number of the newest wish that the anchor follows."""
        return int(self.table[HEARD, WISH])

    @property
    def anchor(self) -> FloatArray:
        """Where the anchor is (3,) [m]."""
        return np.array(self.table[ANCHOR])

    @property
    def track(self) -> FloatArray:
        """Anchor [m], velocity [m/s] and position [m] of the newest samples (KEPT, 3, 3).

        The k-th sample is at k modulo KEPT; the loop counts none twice and leaves none out.
        """
        return np.array(self.table[ROWS:]).reshape(KEPT, PARTS, 3)

    def close(self) -> None:
        """Let go of the memory; a loop that runs keeps its own hold on it."""
        if self._table is not None:
            self._table = None
            with suppress(OSError):  # some systems keep a file that is still in use
                os.remove(self.name)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def table_of(name: str) -> FloatArray:
    """Return what is shared as a table, which keeps the memory.

    Raises:
        FileNotFoundError: if nobody steers any more.
    """
    return np.asarray(np.memmap(name, np.float64, "r+", shape=(_LENGTH, 3)))


@dataclass(frozen=True, eq=False)
class SteeredDriver(SimulatedDriver):
    """A simulated device whose hand follows a :class:`Wheel`.

    Attributes:
        wheel: name of its memory.
    """

    name: ClassVar[str] = "simulated"
    wheel: str = ""

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the hand that is steered before what a simulated device takes for it."""
        return steered, *super().kernels()

    def open(self) -> tuple[Any, ...]:
        """Return the device, held by the hand.

        Raises:
            ParameterError: if nobody steers any more.
        """
        try:
            table = table_of(self.wheel)
        except FileNotFoundError:
            raise ParameterError("wheel", "is closed: nobody steers the hand") from None
        table[HEARD] = 0.0
        device = super().open()
        return SimulatedDevice(*device)._replace(anchor=table)


def steered_driver(plant: Plant, hand: Hand, servo: Servo, wheel: Wheel) -> SteeredDriver:
    """Return a simulated device whose hand follows a wheel.

    Args:
        plant: the device.
        hand: what holds it; not one that is moved whatever the force.
        servo: whose period and delay count.
        wheel: what moves the hand's anchor, from where the handle begins.

    Raises:
        ParameterError: for a plant that cannot be simulated with this hand; for a moved hand.
    """
    if isinstance(hand, MovedHand):
        raise ParameterError("hand", "must be a spring or a band: a pointer is no prescribed way")
    start = Still(tuple(wheel.anchor))
    made = simulated_driver(plant, hand, servo, start, servo.period)
    blank = made.device._replace(anchor=np.zeros((_LENGTH, 3)))
    return SteeredDriver(made.modules, replace(made, device=blank).device, wheel.name)
