"""The closed loop of several runs at once: the same surface, body and servo from other starts.

Their stiffnesses and delays may differ, and how far they have come. Sample by sample every run
ticks, and then all bodies move on together: see ``advance_lanes``. What a run does is what it does
alone, bit for bit. No trace is written: what tells a limit cycle are a few sums.
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
from asperity.simulation.kernels.servo_loop import flush

# Numbers of a servo's state.
CARRIED = 12
# Beside ``STOP`` and ``SAMPLES``: samples that a force waits.
DELAY = 2
# What is seen of a run, a row a run: the least and the greatest position so far; since ``ROWS`` was
# made 0 the number of samples, the first velocity, and the sums of what velocities differ from it,
# and of the squares; what the texture had supplied and what was taken before the last sample.
LOW, HIGH, ROWS, BASE, SUM, SQUARE, LAST, SEEN = 0, 3, 6, 7, 10, 13, 16, 18

KERNELS = Kernels(
    requires=(
        "advance_lanes", "first_state", "flush", "flushed_state", "probe_inside", "servo_tick",
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
    x: FloatArray, queue: FloatArray, carried: FloatArray, ledger: FloatArray, way: FloatArray,
    offset: FloatArray, span: int, plant: object, settings: ServoSettings, memory: FloatArray,
    texture: object, law: tuple[float, ...], stiffness: FloatArray, seen: FloatArray,
    told: NDArray[np.int64],
) -> None:  # fmt: skip
    """Run each of n runs over so many samples.

    Args:
        x: states of the bodies, see ``servo_batch``, a row a run; changed, like all that follow.
        queue: forces that wait (n, at least the longest delay + 1, 3) [N].
        carried: states of the servos (n, 12).
        ledger: sums (n, sums); those that follow from readings and commands stay as they are.
        way: positions of the hand's anchor at samples (k, 3) [m], up to the last of any run;
            neither changed, like all that follow but ``memory``, ``seen`` and ``told``.
        offset: by which it is shifted in each run (n, 3) [m].
        span: samples that are run.
        plant: record of the body.
        settings: of the servo.
        memory: of the contacts (n, 22).
        texture: record of the texture.
        law: parameters of the law but the first.
        stiffness: the first, of each run (n,) [N/m].
        seen: what is seen of each run (n, ``SEEN``).
        told: what stopped each run, its samples, and its delay (n, 3); only those run that say
            ``RAN``.
    """
    held = local_array((LANES, 10))
    runs = x.shape[0]
    rate = 1.0 / settings.period
    for run in range(runs):
        if told[run, SAMPLES] == 0 and told[run, STOP] == RAN:
            carry_state(carried, run, first_state(x[run, 0], x[run, 1], x[run, 2], settings))
    for _sample in range(span):
        going = False
        for run in range(runs):
            if told[run, STOP] != RAN:
                continue
            going = True
            before = carried_state(carried, run)
            now = told[run, SAMPLES]
            if now & 255 == 0:
                flush(x[run])
                before = flushed_state(before)
            own = (stiffness[run],) + law[1:]  # noqa: RUF005 - no stars in compiled functions
            servo = servo_tick(
                before, settings, x[run, 0], x[run, 1], x[run, 2], memory[run], texture, own
            )
            carry_state(carried, run, servo)
            size = told[run, DELAY] + 1
            head = now % size
            queue[run, head, 0] = servo.fx
            queue[run, head, 1] = servo.fy
            queue[run, head, 2] = servo.fz
            head = head + 1 if head + 1 < size else 0
            held[run, 0] = queue[run, head, 0]
            held[run, 1] = queue[run, head, 1]
            held[run, 2] = queue[run, head, 2]
            for i in range(3):
                here = way[now, i] + offset[run, i]
                held[run, 3 + i] = here
                held[run, 6 + i] = (way[now + 1, i] + offset[run, i] - here) * rate
            held[run, 9] = 1.0 if probe_inside(servo.x, servo.y, servo.z, texture) else 0.0
            see(seen, run, x, ledger)
        if not going:
            break
        advance_lanes(x, ledger, held, told, plant)
        for run in range(runs):
            end_sample(x, told, run)


def see(seen: FloatArray, run: int, x: FloatArray, ledger: FloatArray) -> None:
    """Take the state of a run before a sample into account; see ``SEEN``."""
    first = seen[run, ROWS] == 0.0
    seen[run, ROWS] += 1.0
    for i in range(3):
        seen[run, LOW + i] = min(seen[run, LOW + i], x[run, i])
        seen[run, HIGH + i] = max(seen[run, HIGH + i], x[run, i])
        if first:
            seen[run, BASE + i] = x[run, 3 + i]
            seen[run, SUM + i] = 0.0
            seen[run, SQUARE + i] = 0.0
        apart = x[run, 3 + i] - seen[run, BASE + i]
        seen[run, SUM + i] += apart
        seen[run, SQUARE + i] += apart * apart
    seen[run, LAST] = ledger[run, SUPPLIED] + ledger[run, SUPPLIED + 1] + ledger[run, SUPPLIED + 2]
    seen[run, LAST + 1] = ledger[run, LOST] - ledger[run, FRICTION]


def end_sample(x: FloatArray, told: NDArray[np.int64], run: int) -> None:
    """Count a sample of a run that goes on; one that leaves all bounds is stopped after it."""
    if told[run, STOP] != RAN:
        return
    told[run, SAMPLES] += 1
    size = 0.0
    for i in range(6):
        size += abs(x[run, i])
    if not size < 1e6:
        told[run, STOP] = DIVERGED
