"""The guards of a loop between law and motor: reach, depth, ramp, force, timing.

The passivity observer sums the energy given to the hand, E += f·Δp, with the force that acts over
the sample, commanded the device's delay ago, and the measured displacement. For a force held from
sample to sample this is the exact work, and needs no velocity. The controller dissipates it by
damping: α = E/(T v²) dissipates α v² T = E over the next sample, after the delay.

Reference:
    Hannaford and Ryu, "Time-domain passivity control of haptic interfaces", IEEE Transactions on
    Robotics and Automation 18(1), 2002, section II: observer (4), controller (9) for a device that
    measures motion and displays force. Sum over displacement instead of velocity: Stramigioli,
    Secchi, van der Schaft and Fantuzzi, "Sampled data systems passivity and discrete
    port-Hamiltonian systems", IEEE Transactions on Robotics 21(4), 2005.
"""

import math
from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels, load_acquire
from asperity.kernels.probe_functions import probe_depth
from asperity.kernels.tick import ServoSettings, ServoState, least_limited_square
from asperity.loop.interface import (
    DEPTH,
    DEVICE,
    FINISHED,
    LATE_SAMPLE,
    NO_HEARTBEAT,
    NOT_FINITE,
    OK,
    RUNNING,
    STOP_NOW,
    STOPPED,
    SWAP,
    WORKSPACE,
    GuardedForce,
    LoopTiming,
    Reading,
    device_read,
    device_write,
)
from asperity.loop.shared_trace import (
    APPLIED,
    DEEP_COUNT,
    DEEPEST,
    FORCE_LIMIT_COUNT,
    HEARTBEAT_WORD,
    ROW_COUNT,
    SLEW_LIMIT_COUNT,
    STOP_WORD,
    SharedBlock,
    count_timing,
)

KERNELS = Kernels(
    provides=(
        "check_sample",
        "finish_timing",
        "guard_force",
        "read_position",
        "requested_end",
        "write_force",
    ),
    native=("load_acquire",),
)


class LoopLimits(NamedTuple):
    """The limits of a loop.

    Attributes:
        period: T [ns].
        max_change: largest change of the force in a sample [N].
        ramp_step: share of the force added in a sample after the start, removed after a stop [1].
        max_damping: largest damping of the passivity controller [N s/m]; 0 for none.
        max_lateness: time for which all samples may be late, or a single one [ns].
        max_silence: longest time without a heartbeat [ns]; 0 for no heartbeat.
        max_reach: distance of the handle from the middle of its workspace [m].
        centre_x: middle of the workspace, in the surface's frame [m].
        centre_y: likewise.
        centre_z: likewise.
        safe_height: height [m] above which the depth is within its limit at every position.
        max_depth: limit of the depth [m].
        depth_is_fault: whether a larger depth is a fault; otherwise it is counted.
    """

    period: int
    max_change: float
    ramp_step: float
    max_damping: float
    max_lateness: int
    max_silence: int
    max_reach: float
    centre_x: float
    centre_y: float
    centre_z: float
    safe_height: float
    max_depth: float
    depth_is_fault: bool


class Guards(NamedTuple):
    """The guards of a loop.

    Attributes:
        limits: limits of the loop.
        frame: rows of the map from the device's position to the surface's, with the offset [m],
            then of the map from the surface's force to the device's (6, 4).
        block: counts and requests, shared with the supervising process.
    """

    limits: LoopLimits
    frame: FloatArray
    block: SharedBlock


class LimitedForce(NamedTuple):
    """A force after a limit.

    Attributes:
        x: [N].
        y: likewise.
        z: likewise.
        is_limited: whether the limit acted.
    """

    x: float
    y: float
    z: float
    is_limited: bool


def is_finite_vector(x: float, y: float, z: float) -> bool:
    """Return whether three numbers are finite."""
    return abs(x) + abs(y) + abs(z) < math.inf


def limit_change(
    x: float, y: float, z: float, hx: float, hy: float, hz: float, max_change: float
) -> LimitedForce:
    """Return a force at most a distance [N] from the force (hx, hy, hz)."""
    dx = x - hx
    dy = y - hy
    dz = z - hz
    square = dx * dx + dy * dy + dz * dz
    if square <= max_change * max_change:
        return LimitedForce(x, y, z, False)
    # Shorter by a few units in the last place: rounding must not make it longer.
    share = (1.0 - 1e-15) * max_change / math.sqrt(square)
    return LimitedForce(hx + share * dx, hy + share * dy, hz + share * dz, True)


def passivity_damping(
    energy: float, dx: float, dy: float, dz: float, period: float, max_damping: float
) -> float:
    """Return the damping [N s/m] that dissipates an energy over the next sample, if it can.

    Args:
        energy: energy given to the hand [J].
        dx: displacement in the last sample [m].
        dy: likewise.
        dz: likewise.
        period: T [s].
        max_damping: largest damping [N s/m].
    """
    square = dx * dx + dy * dy + dz * dz
    if energy <= 0.0 or max_damping <= 0.0 or square == 0.0:
        return 0.0
    return min(max_damping, energy * period / square)


def next_ramp(ramp: float, is_ending: bool, step: float) -> float:
    """Return the share of the force in the next sample, up to 1 or down to 0."""
    return max(ramp - step, 0.0) if is_ending else min(ramp + step, 1.0)


def requested_end(
    sample: int, end_sample: int, force: GuardedForce, guards: Guards
) -> tuple[int, bool]:
    """Return the requested end cause, or ``RUNNING``, and whether the force is released for it."""
    block = guards.block
    end = RUNNING
    stop = load_acquire(block.control, STOP_WORD)
    if stop == STOP_NOW:
        return STOPPED, True
    if stop != 0:
        end = STOPPED
    elif sample >= end_sample:
        end = FINISHED
    elif load_acquire(block.swap, 0) != 0:
        end = SWAP
    is_zero = force.fx == 0.0 and force.fy == 0.0 and force.fz == 0.0
    return end, end != RUNNING and force.ramp == 0.0 and is_zero


def to_surface(position: FloatArray, row: int, frame: FloatArray) -> float:
    """Return a coordinate of a position in the surface's frame [m]."""
    value: float = (
        frame[row, 0] * position[0]
        + frame[row, 1] * position[1]
        + frame[row, 2] * position[2]
        + frame[row, 3]
    )
    return value


def read_position(position: FloatArray, guards: Guards, device: object) -> Reading:
    """Read the position of the handle; report an error of the device or one that is not finite."""
    frame = guards.frame
    code = device_read(position, device)
    if code != OK:
        return Reading(0.0, 0.0, 0.0, DEVICE, code)
    x = to_surface(position, 0, frame)
    y = to_surface(position, 1, frame)
    z = to_surface(position, 2, frame)
    cause = RUNNING if is_finite_vector(x, y, z) else NOT_FINITE
    return Reading(x, y, z, cause, OK)


def write_force(
    fx: float, fy: float, fz: float, in_contact: bool, guards: Guards, device: object
) -> int:
    """Command a force of the surface's frame [N]; return the error code of the driver."""
    frame = guards.frame
    return device_write(
        frame[3, 0] * fx + frame[3, 1] * fy + frame[3, 2] * fz,
        frame[4, 0] * fx + frame[4, 1] * fy + frame[4, 2] * fz,
        frame[5, 0] * fx + frame[5, 1] * fy + frame[5, 2] * fz,
        in_contact,
        device,
    )


def guard_force(
    force: GuardedForce,
    before: ServoState,
    servo: ServoState,
    is_ending: bool,
    settings: ServoSettings,
    guards: Guards,
) -> GuardedForce:
    """Return the force to hold: the law's, ramped, damped and limited."""
    limits = guards.limits
    status = guards.block.status
    ramp = next_ramp(force.ramp, is_ending, limits.ramp_step)
    dx = servo.x - before.x
    dy = servo.y - before.y
    dz = servo.z - before.z
    rows = guards.block.rows
    last = (status[ROW_COUNT] - 1) % rows.shape[0]
    energy = force.energy + rows[last, APPLIED] * dx
    energy += rows[last, APPLIED + 1] * dy + rows[last, APPLIED + 2] * dz
    max_damping = limits.max_damping if ramp > 0.0 else 0.0
    damping = passivity_damping(energy, dx, dy, dz, settings.period, max_damping)
    drag = damping / settings.period
    bounded = limit_change(
        ramp * servo.fx - drag * dx,
        ramp * servo.fy - drag * dy,
        ramp * servo.fz - drag * dz,
        0.0,
        0.0,
        0.0,
        settings.max_force,
    )
    limited = limit_change(
        bounded.x, bounded.y, bounded.z, force.fx, force.fy, force.fz, limits.max_change
    )
    square = servo.fx * servo.fx + servo.fy * servo.fy + servo.fz * servo.fz
    least = least_limited_square(settings.max_force, settings.force_step)
    status[FORCE_LIMIT_COUNT] += bounded.is_limited or square >= least
    status[SLEW_LIMIT_COUNT] += limited.is_limited
    return GuardedForce(limited.x, limited.y, limited.z, ramp, energy, damping)


def check_sample(
    servo: ServoState, force: GuardedForce, late: int, guards: Guards, texture: object
) -> int:
    """Return the fault of a sample, or ``RUNNING``; count a depth beyond the limit.

    A late start [ns] is a fault at once: the loop may have been suspended.
    """
    limits = guards.limits
    is_deep = count_depth(servo, guards, texture)
    ax = servo.x - limits.centre_x
    ay = servo.y - limits.centre_y
    az = servo.z - limits.centre_z
    if ax * ax + ay * ay + az * az > limits.max_reach * limits.max_reach:
        return WORKSPACE
    if late > limits.max_lateness:
        return LATE_SAMPLE
    if not is_finite_vector(force.fx, force.fy, force.fz):
        return NOT_FINITE
    return DEPTH if is_deep and limits.depth_is_fault else RUNNING


def count_depth(servo: ServoState, guards: Guards, texture: object) -> bool:
    """Return whether a probe is deeper than the limit; count it."""
    limits = guards.limits
    status = guards.block.status
    depth = 0.0
    if servo.z < limits.safe_height:
        depth = probe_depth(servo.x, servo.y, servo.z, texture)
    if depth <= limits.max_depth:
        return False
    status[DEEP_COUNT] += 1
    status[DEEPEST] = max(status[DEEPEST], int(1e12 * depth))
    return True


def finish_timing(
    timing: LoopTiming, start_time: int, end_time: int, guards: Guards
) -> tuple[int, LoopTiming]:
    """Count the lateness of a sample; return a timing fault, or ``RUNNING``, and the next timing.

    The end of the sample counts: a device that answers slowly is late as well. The next sample is
    the first one that is not over yet.
    """
    limits = guards.limits
    late = end_time - timing.due
    late_since = 0
    if late > limits.period:
        late_since = timing.late_since if timing.late_since != 0 else timing.due
    count_timing(guards.block, timing.due, start_time, end_time, limits.period)
    fault = RUNNING
    if max(late, end_time - late_since if late_since != 0 else 0) > limits.max_lateness:
        fault = LATE_SAMPLE
    elif 0 < limits.max_silence < end_time - timing.heartbeat_time:
        fault = NO_HEARTBEAT
    over = max(late // limits.period - 1, 0)
    beat = load_acquire(guards.block.control, HEARTBEAT_WORD)
    return fault, LoopTiming(
        timing.sample + 1 + over,
        timing.due + (1 + over) * limits.period,
        late_since,
        beat,
        start_time if beat != timing.heartbeat else timing.heartbeat_time,
    )
