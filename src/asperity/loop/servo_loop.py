"""The servo loop: wait, read, tick, guard, trace, write; no allocation, no interpreter.

Clock, guards, device and trace are functions that the linker binds, see
:mod:`asperity.loop.interface`. On any fault the force is zero before the loop returns,
within the same sample.
"""

from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.core.platform.clock_interface import Clock, clock_now, clock_wait_until
from asperity.kernels.probe_functions import probe_in_contact
from asperity.kernels.tick import ServoSettings, servo_tick, state_before_tick
from asperity.loop.guards import (
    Guards,
    check_sample,
    finish_timing,
    guard_force,
    read_position,
    requested_end,
    write_force,
)
from asperity.loop.interface import (
    DEVICE,
    OK,
    RUNNING,
    GuardedForce,
    LoopState,
    LoopTiming,
    trace_sample,
    trace_timing,
)

KERNELS = Kernels(provides=("run_sample",), loops=("servo_loop",))


def servo_loop(
    state: LoopState,
    end_sample: int,
    settings: ServoSettings,
    clock: Clock,
    guards: Guards,
    device: object,
    trace: object,
    memory: FloatArray,
    texture: object,
    law: object,
) -> tuple[int, int, LoopState]:
    """Run samples until ``end_sample``, a request to stop, or a fault.

    Args:
        state: state of the loop.
        end_sample: number of the first sample that is not run; negative to run nothing, which
            compiles the loop and leaves the device alone.
        settings: settings of the tick.
        clock: record of the clock.
        guards: record of the guards.
        device: record of the device.
        trace: record of the trace.
        memory: warm start of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.

    Returns:
        End cause, error code of the driver, and the state, whose force is zero.
    """
    cause = RUNNING
    code = OK
    if end_sample < 0:
        return cause, code, state
    state = LoopState(state.servo, state.force, start_timing(state.timing, clock))
    while cause == RUNNING:
        cause, code, state = run_sample(
            state, end_sample, settings, clock, guards, device, trace, memory, texture, law
        )
    # Release the force once more, even after a failed write.
    write_force(0.0, 0.0, 0.0, False, guards, device)
    return cause, code, LoopState(state.servo, release_force(state.force), state.timing)


def start_timing(timing: LoopTiming, clock: Clock) -> LoopTiming:
    """Return the timing with the first sample due now, if none is due yet."""
    if timing.due != 0:
        return timing
    now = clock_now(0, clock)
    return LoopTiming(timing.sample, now, 0, timing.heartbeat, now)


def release_force(force: GuardedForce) -> GuardedForce:
    """Return the state without force."""
    return GuardedForce(0.0, 0.0, 0.0, 0.0, force.energy, 0.0)


def run_sample(
    state: LoopState,
    end_sample: int,
    settings: ServoSettings,
    clock: Clock,
    guards: Guards,
    device: object,
    trace: object,
    memory: FloatArray,
    texture: object,
    law: object,
) -> tuple[int, int, LoopState]:
    """Run a sample, unless the loop ends before it; see :func:`servo_loop`.

    Returns:
        End cause, or ``RUNNING``; error code of the driver; state, whose force is zero after a
        fault.
    """
    position = local_array((3,))
    servo, force, timing = state
    end, is_released = requested_end(timing.sample, end_sample, force, guards)
    if is_released:
        return end, OK, state
    start = clock_wait_until(timing.due, clock)
    reading = read_position(position, guards, device)
    cause = reading.cause
    code = reading.code
    in_contact = False
    before = servo
    if cause == RUNNING:
        x = reading.x
        y = reading.y
        z = reading.z
        before = state_before_tick(servo, timing.sample, x, y, z, settings)
        servo = servo_tick(before, settings, x, y, z, memory, texture, law)
        force = guard_force(force, before, servo, end != RUNNING, settings, guards)
        in_contact = probe_in_contact(servo.x, servo.y, servo.z, texture)
        cause = check_sample(servo, force, start - timing.due, guards, texture)
    if cause != RUNNING:
        force = release_force(force)
    trace_sample(trace, timing.sample, reading, before, servo, force, in_contact, settings, device)
    answer = write_force(force.fx, force.fy, force.fz, in_contact, guards, device)
    if cause == RUNNING and answer != OK:
        cause = DEVICE
        code = answer
    now = clock_now(timing.due, clock)
    trace_timing(trace, reading, start - timing.due, now - start)
    timing_fault, timing = finish_timing(timing, start, now, guards)
    if cause == RUNNING:
        cause = timing_fault
    return cause, code, LoopState(servo, force, timing)
