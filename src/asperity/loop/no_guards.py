"""The parts of a loop without clock and guards: the law's force is sent to the device unchanged."""

# ruff: noqa: ARG001 - one signature for all guards

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.loop.interface import (
    DEVICE,
    FINISHED,
    OK,
    RUNNING,
    GuardedForce,
    LoopTiming,
    Reading,
    device_read,
    device_write,
)

KERNELS = Kernels(
    provides=(
        "check_sample",
        "clock_now",
        "clock_wait_until",
        "finish_timing",
        "guard_force",
        "read_position",
        "requested_end",
        "write_force",
    )
)


def clock_now(due: int, clock: object) -> int:
    """Return the time at which the sample is due."""
    return due


def clock_wait_until(due: int, clock: object) -> int:
    """Return at once."""
    return due


def requested_end(
    sample: int, end_sample: int, force: GuardedForce, guards: object
) -> tuple[int, bool]:
    """Return the end cause, and whether the loop ends before this sample."""
    return (FINISHED, True) if sample >= end_sample else (RUNNING, False)


def read_position(position: FloatArray, guards: object, device: object) -> Reading:
    """Return the position of the handle."""
    code = device_read(position, device)
    cause = RUNNING if code == OK else DEVICE
    return Reading(position[0], position[1], position[2], cause, code)


def guard_force(
    force: GuardedForce,
    before: ServoState,
    servo: ServoState,
    is_ending: bool,
    settings: ServoSettings,
    guards: object,
) -> GuardedForce:
    """Return the force of the law."""
    return GuardedForce(servo.fx, servo.fy, servo.fz, 1.0, 0.0, 0.0)


def check_sample(
    servo: ServoState, force: GuardedForce, late: int, guards: object, texture: object
) -> int:
    """Return that no fault is detected."""
    return RUNNING


def write_force(
    fx: float, fy: float, fz: float, in_contact: bool, guards: object, device: object
) -> int:
    """Command a force [N]."""
    return device_write(fx, fy, fz, in_contact, device)


def finish_timing(
    timing: LoopTiming, start_time: int, end_time: int, guards: object
) -> tuple[int, LoopTiming]:
    """Return that no sample is late, and the timing of the next sample."""
    return RUNNING, LoopTiming(timing.sample + 1, timing.due, 0, 0, 0)
