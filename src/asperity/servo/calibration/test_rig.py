"""Rigs that apply excitations to a device, in the loop that renders surfaces."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from asperity.core.checks import FloatArray
from asperity.devices.device import Axis
from asperity.kernels.fuse import module_source
from asperity.loop import servo_loop
from asperity.loop.shared_trace import COLUMNS
from asperity.servo.driver_loop import DriverLoop, LoopProgram, loop_parts, no_clock
from asperity.servo.drivers.driver import Driver, Frame
from asperity.servo.fault import FAULT_DESCRIPTIONS, FAULT_SAMPLES, DeviceFault, EndReason
from asperity.servo.kernels import excitation as exciter
from asperity.servo.kernels.excitation import Excitation
from asperity.servo.loop_memory import LoopMemory
from asperity.servo.process import ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo

EXCITATION_COLUMN = [name for name, _unit in COLUMNS].index("law anchor x")
"""Column of the number of an excitation; then follow its sample and whether it tripped."""
_POLL_INTERVAL = 0.02  # [s] between two polls of a loop
_NO_SUPERVISION = 1e9  # [s]
_TIMEOUT = 10.0  # [s] for the rows of an excitation, beyond its duration


class CalibrationRig(Protocol):
    """A device to which excitations are applied.

    Attributes:
        servo: period and maximum force of the loop.
        axes: names of the device's axes along the loop's x, y and z.
    """

    servo: Servo
    axes: tuple[Axis, ...]

    def apply(self, excitation: Excitation) -> FloatArray:
        """Apply an excitation, and return the rows of its samples."""


def frame_axes(frame: Frame) -> tuple[Axis, ...]:
    """Return the names of the device's axes along x, y and z of a frame.

    Example:
        >>> frame_axes(Frame(rotation=((0, -1, 0), (1, 0, 0), (0, 0, 1))))
        ('y', 'x', 'z')
    """
    names: tuple[Axis, ...] = ("x", "y", "z")
    return tuple(names[int(np.argmax(np.abs(column)))] for column in np.array(frame.rotation).T)


def excitation_renderer(driver: Driver) -> Callable[[Excitation], LoopProgram]:
    """Return a function that turns an excitation into a program for a driver's loop."""
    source = module_source(servo_loop, *loop_parts(), exciter, *driver.kernel_modules())
    return lambda excitation: LoopProgram(
        source, (0.0,), Excitation(*map(float, excitation)), -math.inf, math.inf, 1.0
    )


def excitation_rows(rows: FloatArray, excitation: Excitation) -> FloatArray:
    """Return the rows of an excitation."""
    own = (rows[:, EXCITATION_COLUMN] == excitation.number) & (
        rows[:, EXCITATION_COLUMN + 1] < excitation.samples
    )
    return np.asarray(rows[own])


class UnclockedRig:
    """A simulated device without a clock.

    Args:
        driver: the device; no real handle moves.
        servo: period and maximum force.
        safety: limits.
        check: called before each excitation; its exceptions are passed on.

    Raises:
        DeviceFault: if the simulation diverges.
    """

    def __init__(
        self, driver: Driver, servo: Servo, safety: Safety, check: Callable[[], None] = lambda: None
    ) -> None:
        self.servo = servo
        self.axes = frame_axes(driver.frame)
        self._check = check
        self._driver = driver
        self._loop_memory = LoopMemory()
        unsupervised = replace(safety, silence=_NO_SUPERVISION)
        block = self._loop_memory.block()
        self._loop = DriverLoop(driver, servo, unsupervised, math.inf, block, no_clock())
        self._device = driver.open()
        self._to_program = excitation_renderer(driver)

    def apply(self, excitation: Excitation) -> FloatArray:
        """See :class:`CalibrationRig`."""
        self._check()
        first = self._loop_memory.row_count
        last = self._loop.state.timing.sample + int(excitation.samples)
        cause, code = self._loop.run(self._to_program(excitation), self._device, last)
        self._loop.reset_contact()
        rows, _first = self._loop_memory.rows(first)
        if cause.is_fault:
            by_driver = cause is EndReason.DEVICE
            words = self._driver.describe_error(code) if by_driver else FAULT_DESCRIPTIONS[cause]
            raise DeviceFault(cause, f"{words}; the force was made zero", rows[-FAULT_SAMPLES:])
        return excitation_rows(rows, excitation)


class ClockedRig:
    """A device in a loop with a process of its own, as in ``asperity run``; use it in a ``with``.

    Args:
        driver: the device.
        servo: period and maximum force.
        safety: limits.
        reach: reach of the handle [m].
        check: called while an excitation runs; an exception ends the loop, without force.
    """

    def __init__(
        self, driver: Driver, servo: Servo, safety: Safety, reach: float,
        check: Callable[[], None] = lambda: None,
    ) -> None:  # fmt: skip
        self.servo = servo
        self.axes = frame_axes(driver.frame)
        self._check = check
        self._to_program = excitation_renderer(driver)
        rest = Excitation(*[0.0] * len(Excitation._fields))
        self.loop = ServoProcess(self._to_program(rest), driver, servo, safety, reach)

    def __enter__(self) -> ClockedRig:
        self.loop.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.loop.stop()

    def apply(self, excitation: Excitation) -> FloatArray:
        """See :class:`CalibrationRig`."""
        first = self.loop.memory.row_count
        parts = []
        self.loop.change_program(self._to_program(excitation))
        end = time.monotonic() + self.servo.period * excitation.samples + _TIMEOUT
        while time.monotonic() < end:
            self._check()
            self.loop.poll()
            rows, at = self.loop.rows(first)
            first = at + len(rows)
            parts.append(excitation_rows(rows, excitation))
            if len(rows) and rows[-1, EXCITATION_COLUMN] == excitation.number and (
                rows[-1, EXCITATION_COLUMN + 1] >= excitation.samples
            ):  # fmt: skip
                return np.concatenate(parts)
            time.sleep(_POLL_INTERVAL)
        raise DeviceFault(EndReason.UNRESPONSIVE, "the loop did not run the excitation")
