"""A handle that goes where it went before, whatever the force."""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.servo.kernels.device_functions import FINE

KERNELS = Kernels(provides=("device_read", "device_write"))


class ReplayedDevice(NamedTuple):
    """Positions, one for each sample; at the end the handle stays.

    Attributes:
        points: in the surface's frame (n, 3) [m].
        done: samples that were done (1,).
    """

    points: FloatArray
    done: NDArray[np.int64]


def device_read(place: FloatArray, device: ReplayedDevice) -> int:
    """Write the next position [m]; see ``device_functions``."""
    row = min(device.done[0], device.points.shape[0] - 1)
    for i in range(3):
        place[i] = device.points[row, i]
    return FINE


def device_write(fx: float, fy: float, fz: float, inside: bool, device: ReplayedDevice) -> int:
    """Go on by a sample; see ``device_functions``."""
    device.done[0] += 1
    return FINE
