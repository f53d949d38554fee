"""Where a device is tried: one excitation after the other, in the loop that renders surfaces."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

import numpy as np

from asperity.checks import FloatArray
from asperity.devices.device import Axis
from asperity.kernels.fuse import source_of_module
from asperity.servo.drivers.driver import Driver, Frame
from asperity.servo.fault import KEPT, Cause, DeviceFault, words_of
from asperity.servo.kernels import clock, exciter, guard, loop
from asperity.servo.kernels.exciter import Excitation
from asperity.servo.kernels.published import COLUMNS
from asperity.servo.loop import Loop, Rendered, no_clock
from asperity.servo.process import ServoProcess
from asperity.servo.safety import Safety
from asperity.servo.shared import Shared
from asperity.simulation.servo import Servo

NUMBER = [name for name, _unit in COLUMNS].index("law anchor x")
"""Column of the rows in which an excitation writes its number; then the sample, and the trip."""
_LOOK = 0.02  # [s] between two looks at a loop
_ALONE = 1e9  # [s]
_PATIENCE = 10.0  # [s] for the rows of an excitation, beyond its own time


class Bench(Protocol):
    """A device that can be tried.

    Attributes:
        servo: period and greatest force of the loop.
        axes: names of the device's axes along which the loop's x, y and z lie.
    """

    servo: Servo
    axes: tuple[Axis, ...]

    def do(self, excitation: Excitation) -> FloatArray:
        """Do something, and return the rows of its samples; see ``servo.kernels.published``."""
        ...


def axes_of(frame: Frame) -> tuple[Axis, ...]:
    """Return the names of the device's axes along which x, y and z of a frame lie.

    Example:
        >>> axes_of(Frame(rotation=((0, -1, 0), (1, 0, 0), (0, 0, 1))))
        ('y', 'x', 'z')
    """
    names: tuple[Axis, ...] = ("x", "y", "z")
    return tuple(names[int(np.argmax(np.abs(column)))] for column in np.array(frame.rotation).T)


def prepared(driver: Driver) -> Callable[[Excitation], Rendered]:
    """Return what makes an excitation what the loop of a driver takes."""
    from asperity.kernels import tick

    source = source_of_module(loop, tick, clock, guard, exciter, *driver.kernels())
    return lambda excitation: Rendered(
        source, (0.0,), Excitation(*map(float, excitation)), -math.inf, math.inf, 1.0
    )


def rows_of(rows: FloatArray, excitation: Excitation) -> FloatArray:
    """Return those rows that an excitation has made."""
    own = (rows[:, NUMBER] == excitation.number) & (rows[:, NUMBER + 1] < excitation.samples)
    return np.asarray(rows[own])


class InstantBench:
    """A simulated device, tried without a clock: no longer than computing takes.

    Args:
        driver: the device; nothing moves.
        servo: period and greatest force.
        safety: limits.

    Raises:
        DeviceFault: if it flies away.
    """

    def __init__(self, driver: Driver, servo: Servo, safety: Safety) -> None:
        self.servo, self.axes = servo, axes_of(driver.frame)
        self._driver, self._shared = driver, Shared()
        alone = replace(safety, silence=_ALONE)  # nobody watches, and time is the loop's own
        self._loop = Loop(driver, servo, alone, math.inf, self._shared.board(), no_clock())
        self._device, self._render = driver.open(), prepared(driver)

    def do(self, excitation: Excitation) -> FloatArray:
        """See :class:`Bench`."""
        first = self._shared.head
        last = self._loop.carried.sample + int(excitation.samples)
        cause, code = self._loop.run(self._render(excitation), self._device, last)
        self._loop.forget()
        rows, _first = self._shared.rows(first)
        if cause.is_fault:
            said = self._driver.explain(code) if cause is Cause.DEVICE else words_of(cause)
            raise DeviceFault(cause, f"{said}; the force was made zero", rows[-KEPT:])
        return rows_of(rows, excitation)


class ClockedBench:
    """A device in a loop with a process of its own, as ``asperity run`` has it; use it in a with.

    Args:
        driver: the device.
        servo: period and greatest force.
        safety: limits.
        reach: of the handle [m].
        look: called while it goes on; what it raises ends the loop, without force.
    """

    def __init__(
        self, driver: Driver, servo: Servo, safety: Safety, reach: float,
        look: Callable[[], None] = lambda: None,
    ) -> None:  # fmt: skip
        self.servo, self.axes, self._look = servo, axes_of(driver.frame), look
        self._render = prepared(driver)
        nothing = Excitation(*[0.0] * len(Excitation._fields))
        self.loop = ServoProcess(self._render(nothing), driver, servo, safety, reach)

    def __enter__(self) -> ClockedBench:
        self.loop.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.loop.stop()

    def do(self, excitation: Excitation) -> FloatArray:
        """See :class:`Bench`."""
        first, kept = self.loop.shared.head, []
        self.loop.exchange(self._render(excitation))
        end = time.monotonic() + self.servo.period * excitation.samples + _PATIENCE
        while time.monotonic() < end:
            self._look()
            self.loop.poll()
            rows, at = self.loop.rows(first)
            first = at + len(rows)
            kept.append(rows_of(rows, excitation))
            if len(rows) and rows[-1, NUMBER] == excitation.number and (
                rows[-1, NUMBER + 1] >= excitation.samples
            ):  # fmt: skip
                return np.concatenate(kept)
            time.sleep(_LOOK)
        raise DeviceFault(Cause.SILENT, "the loop did not do what it was asked to")
