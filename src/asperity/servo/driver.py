"""The interface of drivers: reading the position, holding a force, describing failures."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.core.checks import FloatArray, check_array, check_positive
from asperity.core.errors import ParameterError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Frame:
    """Pose of the surface in the frame of a device.

    p = unit Rᵀ (p_device - origin) and f_device = R f, see :doc:`/howto/own-loop`.

    Attributes:
        rotation: R, rows; column j is the surface's j-th axis in the device's frame.
        origin: origin of the surface, in the device's frame and unit.
        unit: one unit of the device's positions [m].

    Raises:
        ParameterError: for a matrix that is not a rotation, or a unit that is not positive.

    Example:
        >>> Frame(origin=(0.0, 0.0, 20.0), unit=1e-3).matrix[2].tolist()
        [0.0, 0.0, 0.001, -0.02]
    """

    rotation: tuple[Vector, Vector, Vector] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    origin: Vector = (0.0, 0.0, 0.0)
    unit: float = 1.0

    def __post_init__(self) -> None:
        turn = check_array("rotation", self.rotation, (3, 3), "1")
        check_array("origin", self.origin, (3,), "m")
        check_positive("unit", self.unit, "m")
        if np.abs(turn @ turn.T - np.eye(3)).max() > 1e-9 or np.linalg.det(turn) < 0.0:
            raise ParameterError("rotation", "must be a rotation without mirroring", self.rotation)

    @property
    def matrix(self) -> FloatArray:
        """Matrix for the compiled loop: to the surface, then to the device (6, 4)."""
        turn = np.array(self.rotation)
        origin = np.array(self.origin)
        table = np.zeros((6, 4))
        table[:3, :3] = self.unit * turn.T
        table[:3, 3] = 0.0 - self.unit * turn.T @ origin
        table[3:, :3] = turn
        return table


IDENTITY_FRAME = Frame()
"""The surface's own frame."""

RIGHT = (1.0, 0.0, 0.0)
AWAY = (0.0, 1.0, 0.0)
UP = (0.0, 0.0, 1.0)
TOWARDS = (0.0, -1.0, 0.0)
WALL_AXES = {"lying": (RIGHT, AWAY, UP), "standing": (RIGHT, UP, TOWARDS)}
"""Directions of the surface's x, y and z, seen by the user: on a table, or facing the user."""


def surface_frame(axes: Sequence[Vector], wall: str, origin: Vector, unit: float) -> Frame:
    """Return the pose of a surface in the frame of a device.

    Args:
        axes: directions of the device's x, y and z, seen by the user: right, away, up.
        wall: one of ``WALL_AXES``.
        origin: origin of the surface, in the device's axes [m].
        unit: one unit of the device's positions [m].
    """
    turn = np.array(axes) @ np.array(WALL_AXES[wall]).T
    x, y, z = (value / unit for value in origin)
    rows = tuple((float(a), float(b), float(c)) for a, b, c in turn)
    return Frame(rows, (x, y, z), unit)  # type: ignore[arg-type]  # three rows


class Driver(ABC):
    """A kind of device; instances go to the loop's process, so they must be picklable.

    Attributes:
        name: name on the command line.
        has_moving_handle: whether a real handle moves.
        can_reopen: whether opening the device moves nothing and closing it leaves no force, so that
            both release a force that a dead process has left.
        loss_notice: what the device does if the process of the loop dies, in a sentence.
        follows: whether the device itself waits for the next sample, so that the loop needs no
            clock.
        clock_speed: seconds of the loop in one of the system; above 1 for tests alone.
    """

    name: ClassVar[str]
    has_moving_handle: ClassVar[bool] = True
    can_reopen: ClassVar[bool] = False
    loss_notice: ClassVar[str]
    follows = False
    clock_speed = 1

    @property
    def frame(self) -> Frame:
        """Pose of the surface in the device's frame: the field ``surface_frame``, if any."""
        frame: Frame = getattr(self, "surface_frame", IDENTITY_FRAME)
        return frame

    @property
    def device_name(self) -> str:
        """Name of the device among those of its kind, for its lock; empty for any."""
        return ""

    @property
    def max_readings(self) -> int | None:
        """Number of readings; ``None`` for any number."""
        return None

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the compiled modules of ``device_read`` and ``device_write``; default: its own."""
        return (sys.modules[type(self).__module__],)

    @abstractmethod
    def placeholder_record(self) -> tuple[Any, ...]:
        """Return a record of the same type, to compile before the device is open."""

    def check_library(self) -> None:
        """Check that the library of the device can be loaded, whether or not there is a device.

        Raises:
            ParameterError: if it cannot, with a hint.
        """
        return

    @abstractmethod
    def open(self) -> tuple[Any, ...]:
        """Open the device, in the loop's process; return its record.

        Raises:
            ParameterError: if it cannot be opened, with a hint.
        """

    def close(self) -> None:
        """Close the device, without force; called however the loop ended."""
        return

    def release_lost_device(self) -> None:
        """Release the force after the loop's process has died, in the supervising process.

        Raises:
            ParameterError: if the device cannot be opened.
        """
        if self.can_reopen:
            self.open()
            self.close()

    def describe_error(self, code: int) -> str:
        """Return the meaning of an error code of the driver, in words."""
        return f"error {code}"


@dataclass(frozen=True)
class DriverKind:
    """A driver of real devices with its name, declared in the driver's file.

    Attributes:
        name: name on the command line; a colon and an argument may follow.
        axes: directions of the device's x, y and z, seen by the user: right, away, up.
        unit: one unit of the device's positions [m].
        create: returns a driver from the argument and the pose of the surface.
        example: example of a name with an argument.
    """

    name: str
    axes: tuple[Vector, Vector, Vector]
    unit: float
    create: Callable[[str, Frame], Driver]
    example: str
