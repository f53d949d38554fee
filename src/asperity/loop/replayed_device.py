"""A device whose handle follows recorded positions, whatever the force."""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.loop.interface import OK

KERNELS = Kernels(provides=("device_read", "device_write"))


class ReplayedDevice(NamedTuple):
    """Recorded positions, one per sample; after the last one the handle rests.

    Attributes:
        points: positions in the surface's frame (n, 3) [m].
        samples_done: samples that were run (1,).
    """

    points: FloatArray
    samples_done: IntArray


def device_read(position: FloatArray, device: ReplayedDevice) -> int:
    """Write the next position [m]; see ``interface``."""
    row = min(device.samples_done[0], device.points.shape[0] - 1)
    for i in range(3):
        position[i] = device.points[row, i]
    return OK


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: ReplayedDevice) -> int:
    """Advance by a sample; see ``interface``."""
    device.samples_done[0] += 1
    return OK
