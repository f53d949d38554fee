"""Base of the drivers whose device is served by another thread, beside the compiled loop."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from asperity.core.errors import ParameterError
from asperity.kernels.fuse import fuse_module
from asperity.servo.driver_loop import function_address, no_clock, system_clock
from asperity.servo.drivers.driver import IDENTITY_FRAME, Driver, Frame
from asperity.servo.kernels import ring_buffer, threaded_device
from asperity.servo.kernels.ring_buffer import RingBuffer
from asperity.servo.kernels.threaded_device import ThreadedDevice

OPEN_TIMEOUT = 2.0
"""Time for each answer of a device before the loop runs [s]."""


def new_ring_buffer(force_timeout: float = 0.0) -> RingBuffer:
    """Return an empty ring buffer.

    Args:
        force_timeout: time after which the thread releases a force that is not renewed [s].
    """
    words = np.zeros(ring_buffer.BUFFER_WORDS, np.int64)
    words[ring_buffer.FORCE_TIMEOUT] = round(1e9 * force_timeout)
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
        self._functions = fuse_module(ring_buffer)
        scratch = new_ring_buffer()  # compiled now: no message waits for it later
        self._functions.push_position(*scratch, 0.0, 0.0, 0.0, 0)
        self._functions.latest_force(*scratch)
        self._functions.report_failure(scratch.words, ring_buffer.LOOP_SILENT)

    def push_position(self, x: float, y: float, z: float, time: int) -> None:
        """Hand a position, in the device's unit, and its time [ns] to the loop."""
        self._functions.push_position(*self.ring, x, y, z, time)

    def latest_force(self) -> tuple[float, float, float, int]:
        """Return the newest force [N], and the time of its command [ns]; 0 for none."""
        x, y, z, given = self._functions.latest_force(*self.ring)
        return x, y, z, given

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
        return threaded_device, ring_buffer

    def placeholder_record(self) -> ThreadedDevice:
        """Return a record of no device."""
        return ThreadedDevice(*new_ring_buffer(), 0, no_clock(), 0, -1)

    def device_record(self, buffer: RingBuffer, wakeup: int | None = None) -> ThreadedDevice:
        """Return the record of an open device.

        Args:
            buffer: ring buffer of the thread.
            wakeup: file that wakes the thread; ``None`` for a thread that polls.
        """
        max_age = round(1e9 * self.max_reading_age)
        clock = system_clock()
        if wakeup is None:
            return ThreadedDevice(*buffer, max_age, clock, 0, -1)
        write = function_address(ctypes.CDLL(None).write)
        return ThreadedDevice(*buffer, max_age, clock, write, wakeup)

    def describe_error(self, code: int) -> str:
        """Return what went wrong between loop and thread."""
        age = 1e3 * self.max_reading_age
        held = 1e3 * self.force_timeout
        words = {
            ring_buffer.STALE: f"the newest reading of the device is older than {age:g} ms",
            ring_buffer.LOOP_SILENT: f"the loop held a force for {held:g} ms without renewing it",
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
    while not buffer.words[ring_buffer.POSITIONS]:
        if failure := reason():
            raise ParameterError("driver", f"cannot use the device: {failure}")
        if time.monotonic() > end:
            raise ParameterError("driver", f"has no reading of the device for {OPEN_TIMEOUT:g} s")
        time.sleep(1e-3)
