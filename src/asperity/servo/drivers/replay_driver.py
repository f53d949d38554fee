"""A recording as a device: the handle follows the recorded positions."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import ClassVar

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.loop import replayed_device
from asperity.loop.replayed_device import ReplayedDevice
from asperity.recording.recording import open_recording
from asperity.servo.drivers.driver import Driver


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


def replay_driver(path: str, period: float) -> ReplayDriver:
    """Return a driver that follows the positions of a recording.

    Args:
        path: path of the recording.
        period: period of the loop [s].

    Raises:
        ParameterError: for a recording that cannot be read, without rows or positions, or with
        another
            period.
    """
    recording = open_recording(path)
    if recording.rows < 2:
        raise ParameterError("driver", f"{path} has {recording.rows} rows: nothing to replay")
    steps = np.diff(recording["time"])
    if np.abs(steps - period).max() > 1e-3 * period:
        recorded, wanted = (format_quantity(1.0 / one, "Hz") for one in (np.median(steps), period))
        words = f"{path} is not sampled evenly at {wanted}: most of it is at {recorded}"
        raise ParameterError("driver", f"{words} (--set update_rate={recorded.replace(' ', '')})")
    points = np.column_stack([recording[name] for name in "xyz"])
    return ReplayDriver(np.ascontiguousarray(points))
