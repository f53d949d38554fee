"""A device served by another thread, with which the loop exchanges through a ring buffer.

A position that is too old is a fault in the sample that would have used it.
"""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels, call_address
from asperity.loop.clock import Clock, clock_now
from asperity.loop.interface import OK
from asperity.servo.kernels.ring_buffer import (
    FORCES,
    POSITIONS,
    STALE,
    failure_code,
    latest_row,
    push_row,
)

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))


class ThreadedDevice(NamedTuple):
    """A device behind a ring buffer.

    Attributes:
        words: words of the ring buffer.
        numbers: numbers of the ring buffer.
        max_age: largest age of a position [ns].
        clock: clock of the rows.
        write_function: address of ``write`` of the C library; 0 if the thread is not to be woken.
        wakeup: file that wakes the thread when a byte is written to it.
    """

    words: IntArray
    numbers: FloatArray
    max_age: int
    clock: Clock
    write_function: int
    wakeup: int


def device_read(position: FloatArray, device: ThreadedDevice) -> int:
    """Read the newest position; see ``interface``."""
    wrong = failure_code(device.words)
    if wrong != OK:
        return wrong
    newest = latest_row(device.words, device.numbers, POSITIONS)
    position[0] = newest.x
    position[1] = newest.y
    position[2] = newest.z
    return STALE if clock_now(0, device.clock) - newest.time > device.max_age else OK


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: ThreadedDevice) -> int:
    """Push a force to the thread, and wake it; the next reading reports a failure."""
    push_row(device.words, device.numbers, FORCES, fx, fy, fz, clock_now(0, device.clock))
    if device.write_function != 0:
        # A full pipe wakes the thread as well.
        call_address(device.write_function, device.wakeup, device.words, 1)
    return OK
