"""The trace of a simulation: the energy ledger of every sample, and rows of every n-th one."""

# ruff: noqa: ARG001 - one signature for all traces

from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.loop.interface import GuardedForce, Reading
from asperity.simulation.kernels.body_interface import stored_energy
from asperity.simulation.kernels.body_parts import SAME_SAMPLE, SAMPLING
from asperity.simulation.kernels.simulated_device import SimulatedDevice, anchor_segment, due_force

KERNELS = Kernels(provides=("trace_sample", "trace_timing"), loops=("stored_energy_at",))


class TraceRows(NamedTuple):
    """The trace of a simulation.

    Attributes:
        rows: rows to write (n, columns), see ``COLUMNS``; none are written if n is 0.
        counters: rows written, and samples until the next row (2,).
        every: samples per row.
    """

    rows: FloatArray
    counters: IntArray
    every: int


def add_command_energies(ledger: FloatArray, before: ServoState, after: ServoState) -> None:
    """Add the terms that follow from the readings and commands of two samples to the ledger."""
    dx = after.x - before.x
    dy = after.y - before.y
    dz = after.z - before.z
    ledger[SAME_SAMPLE] += after.fx * dx
    ledger[SAME_SAMPLE + 1] += after.fy * dy
    ledger[SAME_SAMPLE + 2] += after.fz * dz
    ledger[SAMPLING] += 0.5 * (
        (before.fx - after.fx) * dx + (before.fy - after.fy) * dy + (before.fz - after.fz) * dz
    )


def write_row(
    row: int, time: float, servo: ServoState, trace: FloatArray, device: SimulatedDevice
) -> None:
    """Write a row of the trace, see ``COLUMNS``."""
    fx, fy, fz = due_force(servo.fx, servo.fy, servo.fz, device)
    ax, ay, az, _bx, _by, _bz = anchor_segment(device)
    trace[row, 0] = time
    for i in range(6):
        trace[row, 1 + i] = device.x[i]
    trace[row, 7] = servo.fx
    trace[row, 8] = servo.fy
    trace[row, 9] = servo.fz
    trace[row, 10] = fx
    trace[row, 11] = fy
    trace[row, 12] = fz
    trace[row, 13] = ax
    trace[row, 14] = ay
    trace[row, 15] = az
    for i in range(10):
        trace[row, 16 + i] = device.ledger[i]
    trace[row, 26] = stored_energy(device.x, ax, ay, az, device.plant)
    trace[row, 27] = servo.anchor_x
    trace[row, 28] = servo.anchor_y
    trace[row, 29] = 1.0 if servo.held else 0.0


def trace_sample(
    trace: TraceRows, sample: int, reading: Reading, before: ServoState, servo: ServoState,
    force: GuardedForce, in_contact: bool, settings: ServoSettings, device: SimulatedDevice,
) -> None:  # fmt: skip
    """Add to the ledger, and write a row if one is due; see ``interface``."""
    add_command_energies(device.ledger, before, servo)
    if trace.rows.shape[0] == 0:
        return
    if trace.counters[1] == 0:
        write_row(trace.counters[0], sample * settings.period, servo, trace.rows, device)
        trace.counters[0] += 1
        trace.counters[1] = trace.every
    trace.counters[1] -= 1


def trace_timing(trace: TraceRows, lateness: int, duration: int) -> None:
    """Do nothing: there is no clock."""


def stored_energy_at(x: FloatArray, anchor: FloatArray, plant: object) -> float:
    """Return the stored energy [J] with the hand's anchor at a position (3,) [m]."""
    return stored_energy(x, anchor[0], anchor[1], anchor[2], plant)
