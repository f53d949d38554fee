"""The closed loop, sample by sample: tick, delay, ledger, trace, and the body that moves on."""

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.law_functions import probe_inside
from asperity.kernels.tick import (
    ServoSettings,
    ServoState,
    first_state,
    flushed,
    flushed_state,
    servo_tick,
)
from asperity.simulation.kernels.body_functions import (
    DIVERGED,
    RAN,
    Held,
    advance_body,
    stored_energy,
)
from asperity.simulation.kernels.booking import SAME_SAMPLE, SAMPLING

KERNELS = Kernels(
    provides=("book_command", "flush", "wait_in_queue"),
    requires=(
        "advance_body", "first_state", "flushed", "flushed_state", "probe_inside", "servo_tick",
        "stored_energy",
    ),
    loops=("servo_batch", "stored_batch"),
)  # fmt: skip


class LoopState(NamedTuple):
    """What the loop carries from call to call, besides body and waiting forces.

    Attributes:
        servo: state of the servo.
        head: where in the queue the newest force waits.
        samples: that were done.
    """

    servo: ServoState = ServoState()
    head: int = 0
    samples: int = 0


def wait_in_queue(
    queue: FloatArray, head: int, fx: float, fy: float, fz: float
) -> tuple[int, float, float, float]:
    """Put a force into a queue (d + 1, 3); return the new head and the force that is due [N]."""
    queue[head, 0] = fx
    queue[head, 1] = fy
    queue[head, 2] = fz
    head += 1
    if head == queue.shape[0]:
        head = 0
    return head, queue[head, 0], queue[head, 1], queue[head, 2]


def book_command(ledger: FloatArray, before: ServoState, after: ServoState) -> None:
    """Add to the ledger what follows from the readings and commands of two samples."""
    dx = after.x - before.x
    dy = after.y - before.y
    dz = after.z - before.z
    ledger[SAME_SAMPLE] += after.fx * dx
    ledger[SAME_SAMPLE + 1] += after.fy * dy
    ledger[SAME_SAMPLE + 2] += after.fz * dz
    ledger[SAMPLING] += 0.5 * (
        (before.fx - after.fx) * dx + (before.fy - after.fy) * dy + (before.fz - after.fz) * dz
    )


def trace_row(
    trace: FloatArray, row: int, time: float, x: FloatArray, servo: ServoState, held: Held,
    ledger: FloatArray, plant: object,
) -> None:  # fmt: skip
    """Write a row of the trace, see ``COLUMNS``."""
    trace[row, 0] = time
    for i in range(6):
        trace[row, 1 + i] = x[i]
    trace[row, 7] = servo.fx
    trace[row, 8] = servo.fy
    trace[row, 9] = servo.fz
    trace[row, 10] = held.fx
    trace[row, 11] = held.fy
    trace[row, 12] = held.fz
    trace[row, 13] = held.ax
    trace[row, 14] = held.ay
    trace[row, 15] = held.az
    for i in range(10):
        trace[row, 16 + i] = ledger[i]
    trace[row, 26] = stored_energy(x, held.ax, held.ay, held.az, plant)
    trace[row, 27] = servo.anchor_x
    trace[row, 28] = servo.anchor_y
    trace[row, 29] = 1.0 if servo.held else 0.0


def flush(values: FloatArray) -> None:
    """Make nothing of what is next to nothing."""
    for i in range(values.shape[0]):
        values[i] = flushed(values[i])


def servo_batch(
    x: FloatArray, queue: FloatArray, state: LoopState, ledger: FloatArray, anchor: FloatArray,
    plant: object, settings: ServoSettings, memory: FloatArray, texture: object, law: object,
    trace: FloatArray, every: int,
) -> tuple[int, int, LoopState]:  # fmt: skip
    """Run one sample for each row of the hand's anchor but the last.

    Args:
        x: state of the body, position [m], velocity [m/s], more; changed.
        queue: forces that wait (d + 1, 3) [N]; changed.
        state: of the loop.
        ledger: sums, see ``booking``; added to.
        anchor: positions of the hand's anchor at the samples (k + 1, 3) [m].
        plant: record of the body.
        settings: of the servo.
        memory: of the contact; changed.
        texture: record of the texture.
        law: parameters of the law.
        trace: rows of ``COLUMNS``, for the samples that are multiples of ``every``; none are
            written if it has none.
        every: samples per row.

    Returns:
        What stopped it, the rows written and the state after the last sample.
    """
    servo, head, done = state
    if done == 0:
        servo = first_state(x[0], x[1], x[2], settings)
    samples = anchor.shape[0] - 1
    rate = 1.0 / settings.period
    rows = 0
    wait = (every - done % every) % every
    tracing = trace.shape[0] > 0
    stop = RAN
    for sample in range(samples):
        if (done + sample) & 255 == 0:
            flush(x)
            servo = flushed_state(servo)
        before = servo
        servo = servo_tick(before, settings, x[0], x[1], x[2], memory, texture, law)
        book_command(ledger, before, servo)
        head, fx, fy, fz = wait_in_queue(queue, head, servo.fx, servo.fy, servo.fz)
        ax = anchor[sample, 0]
        ay = anchor[sample, 1]
        az = anchor[sample, 2]
        held = Held(
            fx, fy, fz, ax, ay, az,
            (anchor[sample + 1, 0] - ax) * rate,
            (anchor[sample + 1, 1] - ay) * rate,
            (anchor[sample + 1, 2] - az) * rate,
            probe_inside(servo.x, servo.y, servo.z, texture),
        )  # fmt: skip
        if tracing:
            if wait == 0:
                time = (done + sample) * settings.period
                trace_row(trace, rows, time, x, servo, held, ledger, plant)
                rows += 1
                wait = every
            wait -= 1
        stop = advance_body(x, ledger, held, plant)
        if stop != RAN:
            samples = sample
            break
        size = abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) + abs(x[4]) + abs(x[5])
        if not size < 1e6:
            stop = DIVERGED
            samples = sample + 1
            break
    return stop, rows, LoopState(servo, head, done + samples)


def stored_batch(x: FloatArray, anchor: FloatArray, plant: object) -> float:
    """Return the stored energy [J] with the hand's anchor at a place (3,) [m]."""
    return stored_energy(x, anchor[0], anchor[1], anchor[2], plant)
