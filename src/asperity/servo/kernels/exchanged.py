"""A device that another thread talks to: the loop exchanges with it through a slot.

A place that is too old is a fault in the very sample that would have used it.
"""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.native import call_address
from asperity.servo.kernels.clock import Clock, clock_now
from asperity.servo.kernels.device_functions import FINE
from asperity.servo.kernels.slot import FORCES, PLACES, STALE, failure, newest_row, put_row

KERNELS = Kernels(
    provides=("device_read", "device_write"),
    requires=("clock_now", "failure", "newest_row", "put_row"),
    native=("call_address",),
)


class ExchangedDevice(NamedTuple):
    """A device behind a slot.

    Attributes:
        words: of the slot.
        numbers: of the slot.
        stale: greatest age of a place [ns].
        clock: that stamps the rows.
        write: address of ``write``, of the system's library; 0 for a thread that needs no waking.
        bell: file that wakes the thread when a byte is written to it.
    """

    words: NDArray[np.int64]
    numbers: FloatArray
    stale: int
    clock: Clock
    write: int
    bell: int


def device_read(place: FloatArray, device: ExchangedDevice) -> int:
    """Take the newest place; see ``device_functions``."""
    wrong = failure(device.words)
    if wrong != FINE:
        return wrong
    newest = newest_row(device.words, device.numbers, PLACES)
    place[0] = newest.x
    place[1] = newest.y
    place[2] = newest.z
    return STALE if clock_now(0, device.clock) - newest.time > device.stale else FINE


def device_write(fx: float, fy: float, fz: float, inside: bool, device: ExchangedDevice) -> int:
    """Leave a force for the thread, and wake it; what goes wrong with it the next reading tells."""
    put_row(device.words, device.numbers, FORCES, fx, fy, fz, clock_now(0, device.clock))
    if device.write != 0:
        # A bell that is full wakes as well as one that rings.
        call_address(device.write, device.bell, device.words, 1)
    return FINE
