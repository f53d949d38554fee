"""A simulated device: delay, body and hand, which advance by a sample with each force."""

from typing import Any, NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.kernels.tick import flush_subnormal, quantize
from asperity.simulation.kernels.body_interface import DIVERGED, RUNNING, SampleInput, advance_body

KERNELS = Kernels(
    provides=("anchor_segment", "delay_force", "device_read", "device_write", "due_force",
              "flush_subnormals"),
)  # fmt: skip


class SimulatedDevice(NamedTuple):
    """A body that a hand holds.

    Attributes:
        x: state of the body, position [m], velocity [m/s], more.
        queue: delayed forces (d + 1, 3) [N].
        counters: index of the newest force in the queue; samples done; number of the sample of the
            anchor's first row (3,).
        anchor: positions of the hand's anchor at the samples (k, 3) [m], after which it rests; or
            the memory of another ``anchor_segment``.
        ledger: sums of energies, see ``body_parts``.
        update_rate: 1/T [1/s].
        plant: record of the body.
        position_step: step of the device's own encoders [m]; 0 for none.
        force_step: step of the device's own force [N]; 0 for none.
        clock: clock of an ``anchor_segment`` that waits, see :mod:`asperity.loop.guards`.
    """

    x: FloatArray
    queue: FloatArray
    counters: IntArray
    anchor: FloatArray
    ledger: FloatArray
    update_rate: float
    plant: object
    position_step: float = 0.0
    force_step: float = 0.0
    clock: Any = ()


def flush_subnormals(values: FloatArray) -> None:
    """Flush subnormal numbers to zero."""
    for i in range(values.shape[0]):
        values[i] = flush_subnormal(values[i])


def delay_force(
    queue: FloatArray, head: int, fx: float, fy: float, fz: float
) -> tuple[int, float, float, float]:
    """Put a force into a queue (d + 1, 3); return the new head and the delayed force [N]."""
    queue[head, 0] = fx
    queue[head, 1] = fy
    queue[head, 2] = fz
    head += 1
    if head == queue.shape[0]:
        head = 0
    return head, queue[head, 0], queue[head, 1], queue[head, 2]


def due_force(
    fx: float, fy: float, fz: float, device: SimulatedDevice
) -> tuple[float, float, float]:
    """Return the delayed force [N] that a command will apply."""
    head = device.counters[0] + 1
    if device.queue.shape[0] == 1:
        return (
            quantize(fx, device.force_step),
            quantize(fy, device.force_step),
            quantize(fz, device.force_step),
        )
    if head == device.queue.shape[0]:
        head = 0
    return device.queue[head, 0], device.queue[head, 1], device.queue[head, 2]


def device_read(position: FloatArray, device: SimulatedDevice) -> int:
    """Write the position of the handle [m], quantised by its encoders; see ``interface``."""
    x = device.x
    if device.counters[1] & 255 == 0:
        flush_subnormals(x)
    for i in range(3):
        position[i] = quantize(x[i], device.position_step)
    return RUNNING


def anchor_segment(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return the position of the hand's anchor at this sample and at the next [m]."""
    last = device.anchor.shape[0] - 1
    here = min(device.counters[1] - device.counters[2], last)
    there = min(here + 1, last)
    return (
        device.anchor[here, 0], device.anchor[here, 1], device.anchor[here, 2],
        device.anchor[there, 0], device.anchor[there, 1], device.anchor[there, 2],
    )  # fmt: skip


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: SimulatedDevice) -> int:
    """Apply the delayed force [N] and advance by a sample; see ``interface``."""
    x = device.x
    step = device.force_step
    head, hx, hy, hz = delay_force(
        device.queue, device.counters[0], quantize(fx, step), quantize(fy, step), quantize(fz, step)
    )
    ax, ay, az, bx, by, bz = anchor_segment(device)
    rate = device.update_rate
    inputs = SampleInput(
        hx, hy, hz, ax, ay, az, (bx - ax) * rate, (by - ay) * rate, (bz - az) * rate, in_contact
    )
    device.counters[0] = head
    device.counters[1] += 1
    stop = advance_body(x, device.ledger, inputs, device.plant)
    size = abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) + abs(x[4]) + abs(x[5])
    if stop == RUNNING and not size < 1e6:
        return DIVERGED
    return stop
