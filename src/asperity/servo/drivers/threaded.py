"""Base of the drivers whose device is served by another thread, beside the compiled loop.

The loop and the thread exchange through a ring buffer without locks: positions one way, forces the
other. A position that is too old is a fault in the sample that would have used it.

Each direction has a ring of rows with a single writer, which increments a count when a row is
complete; the reader takes the newest counted row. No side waits, and the writer returns to a row
only after all the others. The buffer is one block of memory, seen as words and as numbers, so that
a C function can take its address: first the words below, then the rows of a time [ns] and three
numbers.
"""

# ruff: noqa: ARG001 - one signature for every device

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType
from typing import NamedTuple

import numpy as np

from asperity.core.compiled import (
    FloatArray,
    IntArray,
    Kernels,
    call_address,
    load_acquire,
    store_release,
)
from asperity.core.errors import ParameterError
from asperity.core.platform.clock_interface import Clock, clock_now
from asperity.core.platform.clocks import no_clock, system_clock
from asperity.core.platform.wakeup import Wakeup
from asperity.kernels.fuse import fuse_module
from asperity.loop.interface import OK
from asperity.servo.driver import IDENTITY_FRAME, Driver, Frame

KERNELS = Kernels(
    provides=(
        "device_read",
        "device_write",
        "set_failure",
        "failure_code",
        "latest_row",
        "push_row",
    ),
    loops=("push_position", "latest_force", "report_failure"),
    native=("call_address", "load_acquire", "store_release"),
)

# Words: counts of positions and of forces, failure code or 0, and the time after which the thread
# releases a force that the loop does not renew [ns]. The rest is free for a driver.
POSITIONS = 0
FORCES = 1
FAILURE_CODE = 2
FORCE_TIMEOUT = 3
DRIVER_WORDS = 4
HEADER_WORDS = 24
# Failure codes: of the loop, a position that is too old; of the thread, a force not renewed.
STALE = 1
LOOP_SILENT = 2
RING_ROWS = 1024
"""Rows of each direction: a tenth of a second of the fastest loop."""
ROW_WORDS = 4
BUFFER_WORDS = HEADER_WORDS + 2 * RING_ROWS * ROW_WORDS
OPEN_TIMEOUT = 2.0
"""Time for each answer of a device before the loop runs [s]."""


class TimedRow(NamedTuple):
    """A row of a ring buffer.

    Attributes:
        x: component of a position [m, or the device's unit] or of a force [N].
        y: likewise.
        z: likewise.
        time: time of the row [ns]; 0 for no row, or one that was overwritten meanwhile.
    """

    x: float
    y: float
    z: float
    time: int


class RingBuffer(NamedTuple):
    """The memory of a ring buffer, in two views.

    Attributes:
        words: as integers (WORDS,).
        numbers: as numbers (WORDS,).
    """

    words: IntArray
    numbers: FloatArray


def push_row(
    words: IntArray, numbers: FloatArray, direction: int, x: float, y: float, z: float, time: int
) -> None:
    """Write the next row of a direction, ``POSITIONS`` or ``FORCES``; for a single writer."""
    count = words[direction]
    row = HEADER_WORDS + ROW_WORDS * (direction * RING_ROWS + count % RING_ROWS)
    words[row] = time
    numbers[row + 1] = x
    numbers[row + 2] = y
    numbers[row + 3] = z
    store_release(words, direction, count + 1)


def latest_row(words: IntArray, numbers: FloatArray, direction: int) -> TimedRow:
    """Return the newest row of a direction."""
    count = load_acquire(words, direction)
    if count == 0:
        return TimedRow(0.0, 0.0, 0.0, 0)
    row = HEADER_WORDS + ROW_WORDS * (direction * RING_ROWS + (count - 1) % RING_ROWS)
    time = words[row]
    x = numbers[row + 1]
    y = numbers[row + 2]
    z = numbers[row + 3]
    # A reader suspended for a whole ring between these lines has read a mixture.
    overtaken = load_acquire(words, direction) - count >= RING_ROWS - 1
    return TimedRow(x, y, z, 0 if overtaken else time)


def set_failure(words: IntArray, code: int) -> None:
    """Report a failure by a nonzero code; the first one is kept."""
    if words[FAILURE_CODE] == 0:
        store_release(words, FAILURE_CODE, code)


def failure_code(words: IntArray) -> int:
    """Return the failure code, or 0."""
    return load_acquire(words, FAILURE_CODE)


def push_position(
    words: IntArray, numbers: FloatArray, x: float, y: float, z: float, time: int
) -> None:
    """Push a position, from Python."""
    push_row(words, numbers, POSITIONS, x, y, z, time)


def latest_force(words: IntArray, numbers: FloatArray) -> tuple[float, float, float, int]:
    """Return the newest force and its time [ns], for Python."""
    force = latest_row(words, numbers, FORCES)
    return force.x, force.y, force.z, force.time


def report_failure(words: IntArray, code: int) -> None:
    """Report a failure, from Python."""
    set_failure(words, code)


class ThreadedDevice(NamedTuple):
    """A device behind a ring buffer.

    Attributes:
        words: words of the ring buffer.
        numbers: numbers of the ring buffer.
        max_age: largest age of a position [ns].
        clock: clock of the rows.
        send_function: address of ``send`` of the system; 0 if the thread is not to be woken.
        wakeup: socket that wakes the thread when a byte is sent to it.
    """

    words: IntArray
    numbers: FloatArray
    max_age: int
    clock: Clock
    send_function: int
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
    if device.send_function != 0:
        # A full socket wakes the thread as well.
        call_address(device.send_function, device.wakeup, device.words, 1, 0)
    return OK


def new_ring_buffer(force_timeout: float = 0.0) -> RingBuffer:
    """Return an empty ring buffer.

    Args:
        force_timeout: time after which the thread releases a force that is not renewed [s].
    """
    words = np.zeros(BUFFER_WORDS, np.int64)
    words[FORCE_TIMEOUT] = round(1e9 * force_timeout)
    return RingBuffer(words, words.view(np.float64))


class ThreadBuffer:
    """The buffer between a thread of Python and the compiled loop.

    Args:
        force_timeout: time after which the thread releases a force that is not renewed [s].

    Attributes:
        ring: memory that the loop shares.
    """

    def __init__(self, force_timeout: float = 0.0) -> None:
        self.ring = new_ring_buffer(force_timeout)
        self._functions = fuse_module(sys.modules[__name__])
        scratch = new_ring_buffer()  # compiled now: no message waits for it later
        self._functions.push_position(*scratch, 0.0, 0.0, 0.0, 0)
        self._functions.latest_force(*scratch)
        self._functions.report_failure(scratch.words, LOOP_SILENT)

    def push_position(self, x: float, y: float, z: float, time: int) -> None:
        """Hand a position, in the device's unit, and its time [ns] to the loop."""
        self._functions.push_position(*self.ring, x, y, z, time)

    def latest_force(self) -> tuple[float, float, float, int]:
        """Return the newest force [N], and the time of its command [ns]; 0 for none."""
        x, y, z, time = self._functions.latest_force(*self.ring)
        return x, y, z, time

    def report_failure(self, code: int) -> None:
        """Report a failure by a nonzero code; the first one is kept."""
        self._functions.report_failure(self.ring.words, code)


@dataclass
class ThreadedDriver(Driver):
    """A driver whose device is served by another thread.

    Attributes:
        surface_frame: pose of the surface in the device's frame.
        max_reading_age: largest age of a reading that the loop uses [s].
        force_timeout: time after which the thread releases a force that is not renewed [s].
    """

    surface_frame: Frame = IDENTITY_FRAME
    max_reading_age: float = 0.02
    force_timeout: float = 0.05

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        """Return the modules that exchange with the thread."""
        return (sys.modules[__name__],)

    def placeholder_record(self) -> ThreadedDevice:
        """Return a record of no device."""
        return ThreadedDevice(*new_ring_buffer(), 0, no_clock(), 0, -1)

    def device_record(self, buffer: RingBuffer, wakeup: Wakeup | None = None) -> ThreadedDevice:
        """Return the record of an open device.

        Args:
            buffer: ring buffer of the thread.
            wakeup: wakes the thread; ``None`` for a thread that polls.
        """
        max_age = round(1e9 * self.max_reading_age)
        clock = system_clock()
        if wakeup is None:
            return ThreadedDevice(*buffer, max_age, clock, 0, -1)
        return ThreadedDevice(*buffer, max_age, clock, wakeup.address, wakeup.number)

    def describe_error(self, code: int) -> str:
        """Return what went wrong between loop and thread."""
        age = 1e3 * self.max_reading_age
        held = 1e3 * self.force_timeout
        words = {
            STALE: f"the newest reading of the device is older than {age:g} ms",
            LOOP_SILENT: f"the loop held a force for {held:g} ms without renewing it",
        }
        return words.get(code, f"error {code}")


def wait_for_position(buffer: RingBuffer, reason: Callable[[], str]) -> None:
    """Wait until the thread has pushed a first position.

    Args:
        buffer: ring buffer of the thread.
        reason: returns the failure of the thread, or nothing.

    Raises:
        ParameterError: on a failure, or after ``OPEN_TIMEOUT``.
    """
    end = time.monotonic() + OPEN_TIMEOUT
    while not buffer.words[POSITIONS]:
        if failure := reason():
            raise ParameterError("driver", f"cannot use the device: {failure}")
        if time.monotonic() > end:
            raise ParameterError("driver", f"has no reading of the device for {OPEN_TIMEOUT:g} s")
        time.sleep(1e-3)
