"""A recording as a device: the handle goes where it went, and the loop answers with its forces."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.recording.recording import open_recording
from asperity.servo.drivers.driver import Driver
from asperity.servo.kernels import replayed
from asperity.servo.kernels.replayed import ReplayedDevice
from asperity.units import engineering


@dataclass(frozen=True, eq=False)
class ReplayDriver(Driver):
    """A handle that goes where it went in a recording.

    Attributes:
        points: positions in the surface's frame, sample by sample (n, 3) [m].
    """

    name: ClassVar[str] = "replay"
    moving: ClassVar[bool] = False
    when_lost: ClassVar[str] = "There is no device: nothing moves."

    points: FloatArray

    @property
    def readings(self) -> int:
        """How many positions there are."""
        return len(self.points)

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return what goes from row to row."""
        return (replayed,)

    def blank(self) -> ReplayedDevice:
        """Return a device at its first position."""
        return self.open()

    def open(self) -> ReplayedDevice:
        """Return a device at its first position."""
        return ReplayedDevice(self.points, np.zeros(1, np.int64))


def replay_driver(path: str, period: float) -> ReplayDriver:
    """Return the handle of a recording.

    Args:
        path: of the recording.
        period: of the loop [s].

    Raises:
        ParameterError: for a recording that cannot be read, has no rows or no positions, or is not
            sampled by this period.
    """
    recording = open_recording(path)
    if recording.rows < 2:
        raise ParameterError("driver", f"{path} has {recording.rows} rows: nothing to replay")
    steps = np.diff(recording["time"])
    if np.abs(steps - period).max() > 1e-3 * period:
        recorded, wanted = (engineering(1.0 / one, "Hz") for one in (np.median(steps), period))
        words = f"{path} is not sampled evenly at {wanted}: most of it is at {recorded}"
        raise ParameterError("driver", f"{words} (--set update_rate={recorded.replace(' ', '')})")
    points = np.column_stack([recording[name] for name in "xyz"])
    return ReplayDriver(np.ascontiguousarray(points))
