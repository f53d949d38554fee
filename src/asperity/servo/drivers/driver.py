"""What a driver is: where the handle is, a force to hold, and what becomes of it when all ends."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """Where the surface lies in the frame of a device.

    p = unit Rᵀ (p_device - origin) and f_device = R f, as :doc:`/howto/own-loop` has it.

    Attributes:
        rotation: R, rows; column j is where the surface's j-th axis points in the device's frame.
        origin: of the surface, in the device's frame and unit.
        unit: one unit of the device's positions [m].

    Raises:
        ParameterError: for a matrix that is no rotation, or a unit that is not positive.

    Example:
        >>> Frame(origin=(0.0, 0.0, 20.0), unit=1e-3).table[2].tolist()
        [0.0, 0.0, 0.001, -0.02]
    """

    rotation: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    origin: Vector = (0.0, 0.0, 0.0)
    unit: float = 1.0

    def __post_init__(self) -> None:
        turn = array("rotation", self.rotation, (3, 3), "1")
        array("origin", self.origin, (3,), "m")
        positive("unit", self.unit, "m")
        if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-9 or np.linalg.det(turn) < 0.0:
            raise ParameterError("rotation", "must be a rotation without mirroring", self.rotation)

    @property
    def table(self) -> FloatArray:
        """What the compiled loop receives: to the surface, then to the device (6, 4)."""
        turn, origin = np.array(self.rotation), np.array(self.origin)
        table = np.zeros((6, 4))
        table[:3, :3] = self.unit * turn.T
        table[:3, 3] = 0.0 - self.unit * turn.T @ origin
        table[3:, :3] = turn
        return table


UNTURNED = Frame()
"""The surface's own frame."""

RIGHT, AWAY, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
TOWARDS = (0.0, -1.0, 0.0)
WALLS = {"lying": (RIGHT, AWAY, UP), "standing": (RIGHT, UP, TOWARDS)}
"""Where x, y and z of a surface point, seen by the user: on a table, or facing him."""


def frame_of(axes: Sequence[Vector], wall: str, origin: Vector, unit: float) -> Frame:
    """Return where a surface lies in the frame of a device.

    Args:
        axes: where the device's x, y and z point, seen by the user: right, away, up.
        wall: one of ``WALLS``.
        origin: of the surface, in the device's axes [m].
        unit: one unit of the device's positions [m].
    """
    turn = np.array(axes) @ np.array(WALLS[wall]).T
    x, y, z = (value / unit for value in origin)
    rows = tuple((float(a), float(b), float(c)) for a, b, c in turn)
    return Frame(rows, (x, y, z), unit)  # type: ignore[arg-type]  # three rows


class Driver(ABC):
    """A kind of device; what is made of it goes to the loop's process, so it must be picklable.

    Attributes:
        name: as on the command line.
        moving: whether a real handle moves.
        when_lost: what the device does if the process of the loop dies, in a sentence.
    """

    name: ClassVar[str]
    moving: ClassVar[bool] = True
    when_lost: ClassVar[str]

    @property
    def frame(self) -> Frame:
        """Where the surface lies in the device's frame."""
        return UNTURNED

    @property
    def readings(self) -> int | None:
        """How many readings there are; ``None`` for as many as are wanted."""
        return None

    @abstractmethod
    def kernels(self) -> tuple[ModuleType, ...]:
        """Return the compiled modules: ``device_read`` and ``device_write``, and what they need."""

    @abstractmethod
    def blank(self) -> tuple[Any, ...]:
        """Return a record of the right type, for compiling before the device is open."""

    @abstractmethod
    def open(self) -> tuple[Any, ...]:
        """Open the device, in the loop's process; return its record.

        Raises:
            ParameterError: if it cannot be opened, with what to do.
        """

    def close(self) -> None:
        """Let go of the device, without force; called however the loop ended."""
        return

    def explain(self, code: int) -> str:
        """Return what a number means that the driver returned, in words."""
        return f"error {code}"


@dataclass(frozen=True)
class DriverKind:
    """A driver of real devices that a word chooses, declared in the driver's file.

    Attributes:
        name: the word, which a colon may follow with more.
        axes: where the device's x, y and z point, seen by the user: right, away, up.
        unit: one unit of the device's positions [m].
        make: returns a driver from what stands after the colon, and where the surface lies.
        example: of the word with what may follow it.
    """

    name: str
    axes: tuple[Vector, Vector, Vector]
    unit: float
    make: Callable[[str, Frame], Driver]
    example: str
