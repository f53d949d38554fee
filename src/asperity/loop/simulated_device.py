"""A simulated device: delay, body and hand, which advance by a sample with each force.

It keeps the ledger: the sums of all energies that the body exchanges.
"""

from typing import Any, NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.kernels.tick import flush_subnormal, quantize
from asperity.loop.body_interface import (
    DIVERGED,
    LEFT_WORKSPACE,
    RUNNING,
    SampleInput,
    advance_body,
)

KERNELS = Kernels(
    provides=(
        "add_energies",
        "anchor_segment",
        "delay_force",
        "device_read",
        "device_write",
        "due_force",
        "flush_subnormals",
    )
)

# The ledger [J]: work of the held force, per axis; the paper's same-sample sum, per axis; loss;
# work of the hand; work of dry friction; what sampling adds; all without their signs.
SUPPLIED = 0
SAME_SAMPLE = 3
LOST = 6
HAND = 7
FRICTION = 8
SAMPLING = 9
EXCHANGED = 10
LEDGER_SIZE = 11
# The counters: index of the newest force in the queue; samples done; number of the sample of the
# anchor's first row; delay [samples].
QUEUE_HEAD = 0
SAMPLES = 1
FIRST_SAMPLE = 2
DELAY = 3
COUNTERS_SIZE = 4


class SimulatedDevice(NamedTuple):
    """A body that a hand holds.

    Attributes:
        x: state of the body, position [m], velocity [m/s], more.
        queue: delayed forces (at least delay + 1, 3) [N].
        counters: numbers named above (at least 4,).
        anchor: positions of the hand's anchor at the samples (k, 3) [m], after which it rests; or
            the memory of another ``anchor_segment``.
        offset: shift of these positions (3,) [m].
        ledger: sums of energies (``LEDGER_SIZE``,).
        update_rate: 1/T [1/s].
        plant: record of the body.
        position_step: step of the device's own encoders [m]; 0 for none.
        force_step: step of the device's own force [N]; 0 for none.
        clock: :class:`~asperity.core.platform.clock_interface.Clock` of an ``anchor_segment`` that
            waits.
    """

    x: FloatArray
    queue: FloatArray
    counters: IntArray
    anchor: FloatArray
    offset: FloatArray
    ledger: FloatArray
    update_rate: float
    plant: object
    position_step: float = 0.0
    force_step: float = 0.0
    clock: Any = ()


def add_energies(
    ledger: FloatArray, wx: float, wy: float, wz: float, lost: float, hand: float, rubbed: float
) -> None:
    """Add work of the held force per axis, loss, work of the hand and of dry friction [J]."""
    ledger[SUPPLIED] += wx
    ledger[SUPPLIED + 1] += wy
    ledger[SUPPLIED + 2] += wz
    ledger[LOST] += lost
    ledger[HAND] += hand
    ledger[FRICTION] += rubbed
    ledger[EXCHANGED] += abs(wx) + abs(wy) + abs(wz) + abs(lost) + abs(hand) + abs(rubbed)


def flush_subnormals(values: FloatArray) -> None:
    """Flush subnormal numbers to zero."""
    for i in range(values.shape[0]):
        values[i] = flush_subnormal(values[i])


def delay_force(
    queue: FloatArray, head: int, delay: int, fx: float, fy: float, fz: float
) -> tuple[int, float, float, float]:
    """Put a force into a queue; return the new head and the force before the delay [N]."""
    queue[head, 0] = fx
    queue[head, 1] = fy
    queue[head, 2] = fz
    head = next_place(head, delay)
    return head, queue[head, 0], queue[head, 1], queue[head, 2]


def next_place(head: int, delay: int) -> int:
    """Return the place after one in a queue of delay + 1 forces."""
    if head == delay:
        return 0
    return head + 1


def due_force(
    fx: float, fy: float, fz: float, device: SimulatedDevice
) -> tuple[float, float, float]:
    """Return the delayed force [N] that a command will apply."""
    delay = device.counters[DELAY]
    if delay == 0:
        return (
            quantize(fx, device.force_step),
            quantize(fy, device.force_step),
            quantize(fz, device.force_step),
        )
    head = next_place(device.counters[QUEUE_HEAD], delay)
    return device.queue[head, 0], device.queue[head, 1], device.queue[head, 2]


def device_read(position: FloatArray, device: SimulatedDevice) -> int:
    """Write the position of the handle [m], quantised by its encoders; see ``interface``."""
    x = device.x
    if device.counters[SAMPLES] & 255 == 0:
        flush_subnormals(x)
    for i in range(3):
        position[i] = quantize(x[i], device.position_step)
    return RUNNING


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the hand's anchor at this sample and at the next [m]."""
    anchor = device.anchor
    shift = device.offset
    last = anchor.shape[0] - 1
    here = min(device.counters[SAMPLES] - device.counters[FIRST_SAMPLE], last)
    there = min(here + 1, last)
    return (
        anchor[here, 0] + shift[0],
        anchor[here, 1] + shift[1],
        anchor[here, 2] + shift[2],
        anchor[there, 0] + shift[0],
        anchor[there, 1] + shift[1],
        anchor[there, 2] + shift[2],
    )


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: SimulatedDevice) -> int:
    """Apply the delayed force [N] and advance by a sample; see ``interface``.

    A sample in which the body leaves its workspace is not counted.
    """
    x = device.x
    counters = device.counters
    step = device.force_step
    head, hx, hy, hz = delay_force(
        device.queue,
        counters[QUEUE_HEAD],
        counters[DELAY],
        quantize(fx, step),
        quantize(fy, step),
        quantize(fz, step),
    )
    ax, ay, az, bx, by, bz = anchor_segment(device)
    rate = device.update_rate
    inputs = SampleInput(
        hx, hy, hz, ax, ay, az, (bx - ax) * rate, (by - ay) * rate, (bz - az) * rate, in_contact
    )
    counters[QUEUE_HEAD] = head
    stop = advance_body(x, device.ledger, inputs, device.plant)
    if stop == LEFT_WORKSPACE:
        return stop
    counters[SAMPLES] += 1
    size = abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) + abs(x[4]) + abs(x[5])
    if not size < 1e6:
        return DIVERGED
    return stop
