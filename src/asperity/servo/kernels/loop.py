"""The loop of a device: wait, read, tick, guard, write, publish; no allocation, no interpreter.

Whatever is found wrong, the force is zero before the loop returns, within the same sample.
"""

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.law_functions import probe_depth, probe_inside
from asperity.kernels.native import load_acquire, store_release
from asperity.kernels.tick import (
    ServoSettings,
    ServoState,
    first_state,
    flushed_state,
    servo_tick,
)
from asperity.servo.kernels.clock import Clock, clock_now, clock_wait
from asperity.servo.kernels.device_functions import FINE, device_read, device_write
from asperity.servo.kernels.guard import controlled, is_finite, limited_length, limited_slew
from asperity.servo.kernels.published import (
    BEGUN,
    BINS,
    DEEP,
    DEPTH,
    DEVICE,
    FINISHED,
    GOING,
    HEAD,
    HEARTBEAT,
    LATE,
    LATENESS,
    LATENESS_LIMIT,
    LENGTHS,
    MISSES,
    NUMBER,
    PARENT,
    PERIODS,
    SKIPPED,
    SLEWS,
    STOP,
    STOPPED,
    SWAP,
    WORKSPACE,
    WORST_LATE,
    Board,
)

KERNELS = Kernels(
    requires=(
        "clock_now", "clock_wait", "controlled", "device_read", "device_write", "first_state",
        "flushed_state", "is_finite", "limited_length", "limited_slew", "probe_depth",
        "probe_inside", "servo_tick",
    ),
    loops=("device_loop",),
    native=("load_acquire", "store_release"),
)  # fmt: skip


class Limits(NamedTuple):
    """When the loop holds the force back, and when it gives up.

    Attributes:
        period: T [ns].
        slew: most that the force moves in a sample [N].
        share: of the force that is added in a sample after the start, taken off after a stop [1].
        damping: greatest of the controller [N s/m]; 0 for none.
        misses: samples in a row that may be late.
        late: longest lateness [ns].
        silence: longest time without a heartbeat [ns]; 0 for no heartbeat.
        reach: of the handle from the middle of its workspace [m].
        middle_x: of the workspace, in the surface's frame [m].
        middle_y: likewise.
        middle_z: likewise.
        shallow: height [m] above which the depth is within its limit wherever the probe is.
        depth: limit of the depth [m].
        deep_ends: whether a greater depth is a fault; else it is counted.
    """

    period: int
    slew: float
    share: float
    damping: float
    misses: int
    late: int
    silence: int
    reach: float
    middle_x: float
    middle_y: float
    middle_z: float
    shallow: float
    depth: float
    deep_ends: bool


class Carried(NamedTuple):
    """What the loop carries from sample to sample, and from surface to surface.

    Attributes:
        servo: state of the tick.
        fx: force that is held, in the surface's frame [N].
        fy: likewise.
        fz: likewise.
        share: of the law's force that is rendered [1].
        energy: that the hand was given [J].
        damping: of the controller, in the last sample [N s/m].
        sample: that is due, by number.
        due: when [ns].
        misses: samples in a row that were late.
        beat: newest heartbeat.
        heard: when it was heard [ns].
    """

    servo: ServoState = ServoState()
    fx: float = 0.0
    fy: float = 0.0
    fz: float = 0.0
    share: float = 0.0
    energy: float = 0.0
    damping: float = 0.0
    sample: int = 0
    due: int = 0
    misses: int = 0
    beat: int = 0
    heard: int = 0


class Sensed(NamedTuple):
    """A reading.

    Attributes:
        x: position in the surface's frame [m].
        y: likewise.
        z: likewise.
        cause: what is wrong with it, or ``GOING``.
        code: what the driver said.
    """

    x: float
    y: float
    z: float
    cause: int
    code: int


def sense(place: FloatArray, frame: FloatArray, limits: Limits, device: object) -> Sensed:
    """Read the position of the handle, and judge it."""
    code = device_read(place, device)
    if code != FINE:
        return Sensed(0.0, 0.0, 0.0, DEVICE, code)
    x = frame[0, 0] * place[0] + frame[0, 1] * place[1] + frame[0, 2] * place[2] + frame[0, 3]
    y = frame[1, 0] * place[0] + frame[1, 1] * place[1] + frame[1, 2] * place[2] + frame[1, 3]
    z = frame[2, 0] * place[0] + frame[2, 1] * place[1] + frame[2, 2] * place[2] + frame[2, 3]
    if not is_finite(x, y, z):
        return Sensed(x, y, z, NUMBER, FINE)
    ax = x - limits.middle_x
    ay = y - limits.middle_y
    az = z - limits.middle_z
    far = ax * ax + ay * ay + az * az > limits.reach * limits.reach
    return Sensed(x, y, z, WORKSPACE if far else GOING, FINE)


def command(
    fx: float, fy: float, fz: float, inside: bool, frame: FloatArray, device: object
) -> int:
    """Command a force of the surface's frame [N]; what the driver says."""
    return device_write(
        frame[3, 0] * fx + frame[3, 1] * fy + frame[3, 2] * fz,
        frame[4, 0] * fx + frame[4, 1] * fy + frame[4, 2] * fz,
        frame[5, 0] * fx + frame[5, 1] * fy + frame[5, 2] * fz,
        inside,
        device,
    )


def too_deep(at: ServoState, limits: Limits, board: Board, texture: object) -> int:
    """Judge the depth of the probe, or count it."""
    if at.z >= limits.shallow or probe_depth(at.x, at.y, at.z, texture) <= limits.depth:
        return GOING
    board.status[DEEP] += 1
    return DEPTH if limits.deep_ends else GOING


def guarded(
    at: Carried, before: ServoState, servo: ServoState, share: float, settings: ServoSettings,
    limits: Limits, board: Board,
) -> Carried:  # fmt: skip
    """Return what is carried on, with the force to be held for a share of the law's force."""
    dx = servo.x - before.x
    dy = servo.y - before.y
    dz = servo.z - before.z
    energy = at.energy + at.fx * dx + at.fy * dy + at.fz * dz
    most = limits.damping if share > 0.0 else 0.0
    damping = controlled(energy, dx, dy, dz, settings.period, most)
    drag = damping / settings.period
    wanted = limited_length(
        share * servo.fx - drag * dx, share * servo.fy - drag * dy, share * servo.fz - drag * dz,
        settings.max_force,
    )  # fmt: skip
    force = limited_slew(wanted, at.fx, at.fy, at.fz, limits.slew)
    board.status[LENGTHS] += wanted.changed
    board.status[SLEWS] += force.changed
    return Carried(
        servo, force.x, force.y, force.z, share, energy, damping, at.sample, at.due, at.misses,
        at.beat, at.heard,
    )  # fmt: skip


def rendered(
    at: Carried, sensed: Sensed, leaving: bool, settings: ServoSettings, limits: Limits,
    board: Board, memory: FloatArray, texture: object, law: object,
) -> Carried:  # fmt: skip
    """Return what is carried on after the tick of a reading."""
    before = at.servo
    if at.sample == 0:
        before = first_state(sensed.x, sensed.y, sensed.z, settings)
    if at.sample & 255 == 0:
        before = flushed_state(before)
    servo = servo_tick(before, settings, sensed.x, sensed.y, sensed.z, memory, texture, law)
    share = next_share(at.share, leaving, limits.share)
    return guarded(at, before, servo, share, settings, limits, board)


def wanted_end(sample: int, last: int, board: Board) -> int:
    """Return why the loop shall end, or ``GOING``."""
    if load_acquire(board.control, STOP) != 0:
        return STOPPED
    if sample >= last:
        return FINISHED
    return SWAP if load_acquire(board.swap, 0) != 0 else GOING


def next_share(share: float, leaving: bool, step: float) -> float:
    """Return the share of the force in the next sample, up to all of it or down to none."""
    return max(share - step, 0.0) if leaving else min(share + step, 1.0)


def counted(nanoseconds: int) -> int:
    """Return the place of a time in a histogram: n for less than 2ⁿ ns, but not less than 2ⁿ⁻¹."""
    _part, exponent = math.frexp(float(max(nanoseconds, 0)))
    return min(exponent, BINS - 1)


def judged_time(late: int, done: int, at: Carried, limits: Limits, board: Board) -> int:
    """Book how late a sample began and whether it ended after the next one was due; judge it.

    What counts as too late is its end: a device that takes long to answer is late, too.
    """
    status = board.status
    begun = at.due + late
    status[LATENESS + counted(late)] += 1
    if status[HEAD] > 1:
        status[PERIODS + counted(abs(begun - status[BEGUN] - limits.period))] += 1
    status[BEGUN] = begun
    status[WORST_LATE] = max(status[WORST_LATE], late)
    if done > at.due + limits.period:
        status[LATE] += 1
        status[SKIPPED] += (done - at.due) // limits.period - 1
    if done - at.due > limits.late:
        return LATENESS_LIMIT
    if at.misses > limits.misses:
        return MISSES
    return PARENT if 0 < limits.silence < done - at.heard else GOING


def booked(at: Carried, now: int, done: int, limits: Limits, board: Board) -> Carried:
    """Return what is carried on to the next sample that is not over yet."""
    over = max((done - at.due) // limits.period - 1, 0)
    missed = done > at.due + limits.period
    beat = load_acquire(board.control, HEARTBEAT)
    return Carried(
        at.servo, at.fx, at.fy, at.fz, at.share, at.energy, at.damping,
        at.sample + 1 + over, at.due + (1 + over) * limits.period,
        at.misses + 1 if missed else 0, beat, now if beat != at.beat else at.heard,
    )  # fmt: skip


def publish(at: Carried, sensed: Sensed, late: int, took: int, inside: bool, board: Board,
            period: float) -> None:  # fmt: skip
    """Write a row, and then that it is there."""
    head = board.status[HEAD]
    row = head % board.rows.shape[0]
    rows = board.rows
    rows[row, 0] = at.sample * period
    rows[row, 1] = sensed.x
    rows[row, 2] = sensed.y
    rows[row, 3] = sensed.z
    rows[row, 4] = at.servo.fx
    rows[row, 5] = at.servo.fy
    rows[row, 6] = at.servo.fz
    rows[row, 7] = at.fx
    rows[row, 8] = at.fy
    rows[row, 9] = at.fz
    rows[row, 10] = at.share
    rows[row, 11] = at.energy
    rows[row, 12] = at.damping
    rows[row, 13] = 1e-9 * late
    rows[row, 14] = 1e-9 * took
    rows[row, 15] = 1.0 if inside else 0.0
    rows[row, 16] = at.servo.anchor_x
    rows[row, 17] = at.servo.anchor_y
    rows[row, 18] = 1.0 if at.servo.held else 0.0
    store_release(board.status, HEAD, head + 1)


def let_go(at: Carried) -> Carried:
    """Return the same without force."""
    return Carried(
        at.servo, 0.0, 0.0, 0.0, 0.0, at.energy, 0.0, at.sample, at.due, at.misses, at.beat,
        at.heard,
    )  # fmt: skip


def restarted(at: Carried, now: int) -> Carried:
    """Return the same, with the next sample due now [ns]."""
    return Carried(
        at.servo, at.fx, at.fy, at.fz, at.share, at.energy, at.damping, at.sample, now, 0,
        at.beat, now,
    )  # fmt: skip


def device_loop(
    at: Carried, last: int, settings: ServoSettings, limits: Limits, frame: FloatArray,
    clock: Clock, device: object, board: Board, memory: FloatArray, texture: object, law: object,
) -> tuple[int, int, Carried]:  # fmt: skip
    """Run samples until one is due that is not wanted, or something ends the loop.

    Args:
        at: what is carried on.
        last: number of the first sample that is not wanted any more; before 0 for nothing at all,
            which compiles the loop and leaves the device alone.
        settings: of the tick.
        limits: see there.
        frame: rows of the matrix from the device's position to the surface's, with what is added
            [m], then of the one from the surface's force to the device's (6, 4).
        clock: when samples are due.
        device: record of the driver.
        board: what is shared.
        memory: of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.

    Returns:
        What ended the loop, what the driver said, and what is carried on. The force is zero.
    """
    place = local_array((3,))
    cause, code = GOING, FINE
    if last < 0:
        return cause, code, at
    if at.due == 0:
        now = clock_now(0, clock)
        at = restarted(at, now)
    while cause == GOING:
        ends = wanted_end(at.sample, last, board)
        if ends != GOING and at.share == 0.0 and at.fx == 0.0 and at.fy == 0.0 and at.fz == 0.0:
            cause = ends
            break
        now = clock_wait(at.due, clock)
        sensed = sense(place, frame, limits, device)
        cause, code, inside = sensed.cause, sensed.code, False
        if cause == GOING:
            at = rendered(at, sensed, ends != GOING, settings, limits, board, memory, texture, law)
            inside = probe_inside(at.servo.x, at.servo.y, at.servo.z, texture)
            cause = too_deep(at.servo, limits, board, texture)
            if not is_finite(at.fx, at.fy, at.fz):
                cause = NUMBER
        if cause != GOING:
            at = let_go(at)
        answer = command(at.fx, at.fy, at.fz, inside, frame, device)
        if cause == GOING and answer != FINE:
            cause, code = DEVICE, answer
        done = clock_now(at.due, clock)
        publish(at, sensed, now - at.due, done - now, inside, board, settings.period)
        judged = judged_time(now - at.due, done, at, limits, board)
        at = booked(at, now, done, limits, board)
        if cause == GOING:
            cause = judged
    # Whatever ended it, and if writing failed a moment ago: once more, nothing.
    command(0.0, 0.0, 0.0, False, frame, device)
    return cause, code, let_go(at)
