"""The excitations of a calibration, and the rigs that apply them to a device.

An excitation stands in the place of a law: rest, pushes, or a smooth wall, which is a spring from
both sides, as a pressed wall is felt, without anybody pressing. A soft spring holds the handle
across the tested axis. It runs in the loop that renders surfaces, so all its guards apply.
"""

# ruff: noqa: ARG001 - the signatures of a law on a texture

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from asperity.contacts.warm_start import FIRST_POINT, POINT_COUNT
from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.core.platform.clocks import no_clock
from asperity.devices.device import Axis
from asperity.kernels.fuse import module_source
from asperity.loop import servo_loop
from asperity.loop.shared_trace import COLUMNS
from asperity.servo.driver import Driver, Frame
from asperity.servo.driver_loop import DriverLoop, LoopProgram, loop_parts
from asperity.servo.loop_memory import (
    FAULT_DESCRIPTIONS,
    FAULT_SAMPLES,
    DeviceFault,
    EndReason,
    LoopMemory,
)
from asperity.servo.process import ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation.servo import Servo

KERNELS = Kernels(provides=("probe_depth", "probe_in_contact", "probe_tick"))

# Kinds of excitation.
REST = 0.0
PUSHING = 1.0
WALL = 2.0

# Places in the memory of a contact, which is unused here; POINT_COUNT is 0 at the start.
CENTRE = FIRST_POINT
SAMPLE_INDEX, RANDOM_STATE, PUSH_SIGN, PUSH_REMAINING, TRIPPED = range(
    FIRST_POINT + 3, FIRST_POINT + 8
)
LAST_POSITION = FIRST_POINT + 8
FILTERED_VELOCITY = FIRST_POINT + 11


class Excitation(NamedTuple):
    """The parameters of an excitation.

    Attributes:
        number: number that identifies its rows.
        kind: REST, PUSHING or WALL.
        axis: tested axis, 0 to 2.
        holding_stiffness: stiffness of the soft spring towards the centre [N/m].
        brake_damping: damping on the filtered velocity [N s/m].
        filter_fraction: weight of the newest difference in that velocity [1].
        rate: 1/T [1/s].
        x: centre [m]; NaN for the initial position of the handle.
        y: likewise.
        z: likewise.
        stiffness: stiffness of the wall [N/m].
        wall_step: step of the wall, once [m].
        wait_samples: samples before the step.
        push_force: force of the pushes [N].
        push_samples: mean duration of a push [samples].
        trip_distance: displacement along the axis that ends the force [m].
        samples: duration of the excitation.
    """

    number: float
    kind: float
    axis: float
    holding_stiffness: float
    brake_damping: float
    filter_fraction: float
    rate: float
    x: float
    y: float
    z: float
    stiffness: float
    wall_step: float
    wait_samples: float
    push_force: float
    push_samples: float
    trip_distance: float
    samples: float


def initialize_excitation(
    x: float, y: float, z: float, memory: FloatArray, law: Excitation
) -> None:
    """Initialize the memory with the position of the handle."""
    memory[CENTRE] = law.x
    memory[CENTRE + 1] = law.y
    memory[CENTRE + 2] = law.z
    if math.isnan(law.x):
        memory[CENTRE] = x
        memory[CENTRE + 1] = y
        memory[CENTRE + 2] = z
    memory[LAST_POSITION] = x
    memory[LAST_POSITION + 1] = y
    memory[LAST_POSITION + 2] = z
    for i in range(3):
        memory[FILTERED_VELOCITY + i] = 0.0
    memory[SAMPLE_INDEX] = 0.0
    memory[RANDOM_STATE] = 1.0 + law.number
    memory[PUSH_SIGN] = 1.0
    memory[PUSH_REMAINING] = 0.0
    memory[TRIPPED] = 0.0
    memory[POINT_COUNT] = 1.0


def push_force(memory: FloatArray, law: Excitation) -> float:
    """Return the push of this sample [N]; its sign alternates after 0.5 to 1.5 mean durations."""
    if memory[PUSH_REMAINING] <= 0.0:
        memory[PUSH_SIGN] = -memory[PUSH_SIGN]
        # Minimal standard generator of Park and Miller: exact in double precision.
        memory[RANDOM_STATE] = (16807.0 * memory[RANDOM_STATE]) % 2147483647.0
        memory[PUSH_REMAINING] = law.push_samples * (0.5 + memory[RANDOM_STATE] / 2147483647.0)
    memory[PUSH_REMAINING] -= 1.0
    force: float = law.push_force * memory[PUSH_SIGN]
    return force


def brake_force(x: float, i: int, memory: FloatArray, law: Excitation) -> float:
    """Return the force of the brake along an axis [N]."""
    speed = (x - memory[LAST_POSITION + i]) * law.rate
    memory[LAST_POSITION + i] = x
    memory[FILTERED_VELOCITY + i] += law.filter_fraction * (speed - memory[FILTERED_VELOCITY + i])
    force: float = -law.brake_damping * memory[FILTERED_VELOCITY + i]
    return force


def probe_tick(
    x: float,
    y: float,
    z: float,
    ax: float,
    ay: float,
    az: float,
    held: bool,
    memory: FloatArray,
    texture: object,
    law: Excitation,
) -> tuple[float, float, float, float, float, float, bool]:
    """Return the force [N], the number, the sample, zero, and whether the excitation tripped."""
    if memory[POINT_COUNT] == 0.0:
        initialize_excitation(x, y, z, memory, law)
    count = memory[SAMPLE_INDEX]
    memory[SAMPLE_INDEX] = count + 1.0
    axis = int(law.axis)
    offset = local_array((3,))
    offset[0] = x - memory[CENTRE]
    offset[1] = y - memory[CENTRE + 1]
    offset[2] = z - memory[CENTRE + 2]
    if law.kind == WALL and count >= law.wait_samples:
        offset[axis] -= law.wall_step
    along = offset[axis]
    # The trip is inactive before the step: the handle may be pulled from further away.
    if law.kind != REST and count >= law.wait_samples and abs(along) > law.trip_distance:
        memory[TRIPPED] = 1.0
    over = memory[TRIPPED] != 0.0
    if over or count >= law.samples:
        return 0.0, 0.0, 0.0, law.number, count, 0.0, over
    force = local_array((3,))
    for i in range(3):
        force[i] = -law.holding_stiffness * offset[i]
    if law.kind == WALL:
        force[axis] = -law.stiffness * along
    if law.kind == PUSHING:
        force[axis] += push_force(memory, law)
    fx = force[0] + brake_force(x, 0, memory, law)
    fy = force[1] + brake_force(y, 1, memory, law)
    fz = force[2] + brake_force(z, 2, memory, law)
    return fx, fy, fz, law.number, count, 0.0, over


def probe_in_contact(x: float, y: float, z: float, texture: object) -> bool:
    """Return that there is contact: brakes act as in a body."""
    return True


def probe_depth(x: float, y: float, z: float, texture: object) -> float:
    """Return zero: no depth limit applies."""
    return 0.0


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
    source = module_source(
        servo_loop, *loop_parts(), sys.modules[__name__], *driver.kernel_modules()
    )
    return lambda excitation: LoopProgram(
        source, (0.0,), Excitation(*map(float, excitation)), -math.inf, math.inf, False, 1.0
    )


def excitation_rows(rows: FloatArray, excitation: Excitation) -> FloatArray:
    """Return the rows of an excitation."""
    is_of_number = rows[:, EXCITATION_COLUMN] == excitation.number
    is_before_end = rows[:, EXCITATION_COLUMN + 1] < excitation.samples
    return np.asarray(rows[is_of_number & is_before_end])


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
            text = FAULT_DESCRIPTIONS.get(cause) or self._driver.describe_error(code)
            raise DeviceFault(cause, f"{text}; the force was made zero", rows[-FAULT_SAMPLES:])
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
        self,
        driver: Driver,
        servo: Servo,
        safety: Safety,
        reach: float,
        check: Callable[[], None] = lambda: None,
    ) -> None:
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
            newest = rows[-1:, EXCITATION_COLUMN : EXCITATION_COLUMN + 2]
            if (newest[:, 0] == excitation.number).any() and newest[0, 1] >= excitation.samples:
                return np.concatenate(parts)
            time.sleep(_POLL_INTERVAL)
        raise DeviceFault(EndReason.UNRESPONSIVE, "the loop did not run the excitation")
