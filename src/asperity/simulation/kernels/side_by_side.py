"""The closed loop of several runs at once: the same surface, body and servo from other starts.

Sample by sample every run ticks, and then all bodies move on together: see ``advance_lanes``. What
a run does is what it does alone, bit for bit.
"""

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.law_functions import probe_inside
from asperity.kernels.tick import (
    ServoSettings,
    ServoState,
    first_state,
    flushed_state,
    servo_tick,
)
from asperity.simulation.kernels.body_functions import (
    DIVERGED,
    LANES,
    RAN,
    SAMPLES,
    STOP,
    advance_lanes,
)
from asperity.simulation.kernels.booking import FRICTION, LOST, SUPPLIED
from asperity.simulation.kernels.servo_loop import book_command, flush, wait_in_queue

# Numbers of a servo's state.
CARRIED = 12

KERNELS = Kernels(
    requires=(
        "advance_lanes", "book_command", "first_state", "flush", "flushed_state", "probe_inside",
        "servo_tick", "wait_in_queue",
    ),
    loops=("servo_lanes",),
)  # fmt: skip


def carried_state(carried: FloatArray, lane: int) -> ServoState:
    """Return the state of a servo from its row."""
    return ServoState(
        carried[lane, 0], carried[lane, 1], carried[lane, 2],
        carried[lane, 3], carried[lane, 4], carried[lane, 5],
        carried[lane, 6], carried[lane, 7], carried[lane, 8] > 0.0,
        carried[lane, 9], carried[lane, 10], carried[lane, 11],
    )  # fmt: skip


def carry_state(carried: FloatArray, lane: int, servo: ServoState) -> None:
    """Write the state of a servo into its row."""
    carried[lane, 0] = servo.x
    carried[lane, 1] = servo.y
    carried[lane, 2] = servo.z
    carried[lane, 3] = servo.vx
    carried[lane, 4] = servo.vy
    carried[lane, 5] = servo.vz
    carried[lane, 6] = servo.anchor_x
    carried[lane, 7] = servo.anchor_y
    carried[lane, 8] = 1.0 if servo.held else 0.0
    carried[lane, 9] = servo.fx
    carried[lane, 10] = servo.fy
    carried[lane, 11] = servo.fz


def servo_lanes(
    x: FloatArray, queue: FloatArray, carried: FloatArray, done: int, ledger: FloatArray,
    anchor: FloatArray, plant: object, settings: ServoSettings, memory: FloatArray,
    texture: object, law: object, trace: FloatArray, told: NDArray[np.int64],
) -> None:  # fmt: skip
    """Run one sample of each of n runs for each row of the hands' anchors but the last.

    Args:
        x: states of the bodies, see ``servo_batch``, a row a run; changed, like all that follow.
        queue: forces that wait (n, d + 1, 3) [N].
        carried: states of the servos (n, 12).
        done: samples that those that run have behind them.
        ledger: sums (n, sums).
        anchor: positions of the hands' anchors at the samples (n, k + 1, 3) [m]; not changed.
        plant: record of the body.
        settings: of the servo.
        memory: of the contacts (n, 22).
        texture: record of the texture.
        law: parameters of the law.
        trace: rows of ``WATCHED`` of all samples, (n, at least done + k, 9).
        told: what stopped each run, and its samples, (n, 2); only those run that say ``RAN``.
    """
    held = local_array((LANES, 10))
    runs = x.shape[0]
    samples = anchor.shape[1] - 1
    rate = 1.0 / settings.period
    for run in range(runs):
        if done == 0 and told[run, STOP] == RAN:
            carry_state(carried, run, first_state(x[run, 0], x[run, 1], x[run, 2], settings))
    for sample in range(samples):
        going = False
        now = done + sample
        for run in range(runs):
            if told[run, STOP] != RAN:
                continue
            going = True
            before = carried_state(carried, run)
            if now & 255 == 0:
                flush(x[run])
                before = flushed_state(before)
            servo = servo_tick(
                before, settings, x[run, 0], x[run, 1], x[run, 2], memory[run], texture, law
            )
            carry_state(carried, run, servo)
            book_command(ledger[run], before, servo)
            _head, fx, fy, fz = wait_in_queue(
                queue[run], now % queue.shape[1], servo.fx, servo.fy, servo.fz
            )
            ax = anchor[run, sample, 0]
            ay = anchor[run, sample, 1]
            az = anchor[run, sample, 2]
            held[run, 0] = fx
            held[run, 1] = fy
            held[run, 2] = fz
            held[run, 3] = ax
            held[run, 4] = ay
            held[run, 5] = az
            held[run, 6] = (anchor[run, sample + 1, 0] - ax) * rate
            held[run, 7] = (anchor[run, sample + 1, 1] - ay) * rate
            held[run, 8] = (anchor[run, sample + 1, 2] - az) * rate
            held[run, 9] = 1.0 if probe_inside(servo.x, servo.y, servo.z, texture) else 0.0
            watch(trace, run, now, now * settings.period, x, ledger)
        if not going:
            break
        advance_lanes(x, ledger, held, told, plant)
        for run in range(runs):
            end_sample(x, told, run, now)


def watch(
    trace: FloatArray, run: int, row: int, time: float, x: FloatArray, ledger: FloatArray
) -> None:
    """Write a row of ``WATCHED``."""
    trace[run, row, 0] = time
    for i in range(6):
        trace[run, row, 1 + i] = x[run, i]
    trace[run, row, 7] = (
        ledger[run, SUPPLIED] + ledger[run, SUPPLIED + 1] + ledger[run, SUPPLIED + 2]
    )
    trace[run, row, 8] = ledger[run, LOST] - ledger[run, FRICTION]


def end_sample(x: FloatArray, told: NDArray[np.int64], run: int, now: int) -> None:
    """Count a sample of a run that goes on; one that leaves all bounds is stopped after it."""
    if told[run, STOP] != RAN:
        return
    told[run, SAMPLES] = now + 1
    size = 0.0
    for i in range(6):
        size += abs(x[run, i])
    if not size < 1e6:
        told[run, STOP] = DIVERGED
