"""A device that is simulated: delay, body and hand, one sample on for each force."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.tick import flushed
from asperity.simulation.kernels.body_functions import DIVERGED, RAN, Held, advance_body
from asperity.simulation.kernels.servo_loop import wait_in_queue

KERNELS = Kernels(
    provides=("anchor_step", "device_read", "device_write"),
    requires=("advance_body", "flushed", "wait_in_queue"),
)


class SimulatedDevice(NamedTuple):
    """A body that a hand holds.

    Attributes:
        x: state of the body, position [m], velocity [m/s], more.
        queue: forces that wait (d + 1, 3) [N].
        done: where in the queue the newest force waits; samples that were done (2,).
        anchor: positions of the hand's anchor at the samples (k, 3) [m]; then it stays. Or what
            another ``anchor_step`` makes of it.
        ledger: sums of energies, see ``simulation.kernels.booking``.
        rate: 1/T [1/s].
        plant: record of the body.
        position_step: in which its own encoders read [m]; 0 for none.
        force_step: in which its own motors hold a force [N]; 0 for none.
    """

    x: FloatArray
    queue: FloatArray
    done: NDArray[np.int64]
    anchor: FloatArray
    ledger: FloatArray
    rate: float
    plant: object
    position_step: float = 0.0
    force_step: float = 0.0


def stepped(value: float, step: float) -> float:
    """Return the nearest multiple of a step; the value itself for no step."""
    return step * math.floor(value / step + 0.5) if step > 0.0 else value


def device_read(place: FloatArray, device: SimulatedDevice) -> int:
    """Write the position of the handle [m], in steps if it has some; see ``device_functions``."""
    x = device.x
    if device.done[1] & 255 == 0:
        for i in range(x.shape[0]):
            x[i] = flushed(x[i])
    for i in range(3):
        place[i] = stepped(x[i], device.position_step)
    return RAN


def anchor_step(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return where the hand's anchor is in this sample, and in the next [m]."""
    here = min(device.done[1], device.anchor.shape[0] - 1)
    there = min(here + 1, device.anchor.shape[0] - 1)
    return (
        device.anchor[here, 0], device.anchor[here, 1], device.anchor[here, 2],
        device.anchor[there, 0], device.anchor[there, 1], device.anchor[there, 2],
    )  # fmt: skip


def device_write(fx: float, fy: float, fz: float, inside: bool, device: SimulatedDevice) -> int:
    """Hold the force that is due [N] and move on by a sample; see ``device_functions``."""
    x = device.x
    step = device.force_step
    head, hx, hy, hz = wait_in_queue(
        device.queue, device.done[0], stepped(fx, step), stepped(fy, step), stepped(fz, step)
    )
    ax, ay, az, bx, by, bz = anchor_step(device)
    rate = device.rate
    held = Held(
        hx, hy, hz, ax, ay, az, (bx - ax) * rate, (by - ay) * rate, (bz - az) * rate, inside
    )
    device.done[0] = head
    device.done[1] += 1
    stop = advance_body(x, device.ledger, held, device.plant)
    size = abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) + abs(x[4]) + abs(x[5])
    if stop == RAN and not size < 1e6:
        return DIVERGED
    return stop
