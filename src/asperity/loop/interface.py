"""The interface between a servo loop and its parts: device and trace; states and end causes.

The functions are declarations: the module of a driver or a trace defines them, and the linker binds
the calls of the loop to it. ``device`` and ``trace`` are records (NamedTuple) of that module.
"""

from typing import NamedTuple

from asperity.core.checks import FloatArray
from asperity.kernels.tick import ServoSettings, ServoState

# What the functions of a device return if there is no error.
OK = 0
# What ends the loop.
RUNNING, STOPPED, SWAP, FINISHED, NOT_FINITE, DEVICE, WORKSPACE, DEPTH = range(8)
LATE_SAMPLE, NO_HEARTBEAT = range(8, 10)
# Requests to stop: with a ramp, or with the next sample.
STOP_RAMPED = 1
STOP_NOW = 2
# End sample of a loop that does not end by itself.
NO_END = 2**62


class Reading(NamedTuple):
    """A reading of the position.

    Attributes:
        x: position in the surface's frame [m].
        y: likewise.
        z: likewise.
        cause: the fault of the reading, or ``RUNNING``.
        code: error code of the driver.
    """

    x: float
    y: float
    z: float
    cause: int
    code: int


class GuardedForce(NamedTuple):
    """The force that is held, and the state of the guards.

    Attributes:
        fx: held force, in the surface's frame [N].
        fy: likewise.
        fz: likewise.
        ramp: rendered share of the law's force [1].
        energy: energy given to the hand [J].
        damping: damping of the passivity controller in the last sample [N s/m].
    """

    fx: float = 0.0
    fy: float = 0.0
    fz: float = 0.0
    ramp: float = 0.0
    energy: float = 0.0
    damping: float = 0.0


class LoopTiming(NamedTuple):
    """The timing of the next sample.

    Attributes:
        sample: number of the sample.
        due: time at which it is due [ns].
        late_since: time at which the first of consecutive late samples was due [ns]; 0 for none.
        heartbeat: newest heartbeat.
        heartbeat_time: time of that heartbeat [ns].
    """

    sample: int = 0
    due: int = 0
    late_since: int = 0
    heartbeat: int = 0
    heartbeat_time: int = 0


class LoopState(NamedTuple):
    """The state of a loop from sample to sample, and from surface to surface.

    Attributes:
        servo: state of the tick.
        force: held force and state of the guards.
        timing: timing of the next sample.
    """

    servo: ServoState = ServoState()
    force: GuardedForce = GuardedForce()
    timing: LoopTiming = LoopTiming()


def device_read(position: FloatArray, device: object) -> int:
    """Write the position of the handle (3,), in the device's own frame and unit.

    Returns:
        ``OK``, or an error code of the driver.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: object) -> int:
    """Command a force [N] in the device's own frame; a device with brakes switches them.

    Returns:
        ``OK``, or an error code of the driver.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def trace_sample(
    trace: object,
    sample: int,
    reading: Reading,
    before: ServoState,
    servo: ServoState,
    force: GuardedForce,
    in_contact: bool,
    settings: ServoSettings,
    device: object,
) -> None:
    """Write the row of a sample, after its tick and before its force is commanded.

    Args:
        trace: record of the trace.
        sample: number of the sample.
        reading: position that was read.
        before: state of the servo before the tick.
        servo: state of the servo after the tick.
        force: force that is commanded.
        in_contact: whether the probe is in contact.
        settings: settings of the servo.
        device: record of the device.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def trace_timing(trace: object, reading: Reading, lateness: int, duration: int) -> None:
    """Complete the row of a sample with its lateness and duration [ns]."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it
