"""The memory that a loop and its supervising process share: requests, counts, rows.

Each number has one writer, and no side waits: the loop writes a row and then increments the count
of rows, so a reader that reads the count finds the row; see
:class:`asperity.servo.loop_memory.LoopMemory`.
"""

# ruff: noqa: ARG001 - one signature for all traces

import math
from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels, store_release
from asperity.kernels.tick import ServoSettings, ServoState
from asperity.loop.interface import RUNNING, GuardedForce, Reading

KERNELS = Kernels(
    provides=("count_timing", "trace_sample", "trace_timing"), native=("store_release",)
)

# Words written by the supervising process.
HEARTBEAT_WORD = 0
STOP_WORD = 1
CONTROL_SIZE = 2
# Words written by the loop: rows, then counts since the start, then histograms.
ROW_COUNT = 0
LATE_COUNT = 1
SKIPPED_COUNT = 2
MAX_LATENESS = 3
FORCE_LIMIT_COUNT = 4
SLEW_LIMIT_COUNT = 5
DEEP_COUNT = 6
DEEPEST = 7  # in whole picometres
LAST_START_TIME = 8
HISTOGRAM_BINS = 40
LATENESS_HISTOGRAM = 9
PERIOD_HISTOGRAM = LATENESS_HISTOGRAM + HISTOGRAM_BINS
STATUS_SIZE = PERIOD_HISTOGRAM + HISTOGRAM_BINS

COLUMNS = (
    ("time", "s"),
    ("x", "m"),
    ("y", "m"),
    ("z", "m"),
    ("commanded x", "N"),
    ("commanded y", "N"),
    ("commanded z", "N"),
    ("applied x", "N"),
    ("applied y", "N"),
    ("applied z", "N"),
    ("share", "1"),
    ("supplied", "J"),
    ("controlled", "N s/m"),
    ("late", "s"),
    ("took", "s"),
    ("inside", "1"),
    ("law anchor x", "m"),
    ("law anchor y", "m"),
    ("law held", "1"),
    ("law anchor z", "m"),
)
"""Columns of the rows with their units; positions and forces are in the surface's frame."""
# The first of the columns of the applied force.
APPLIED = 7


class SharedBlock(NamedTuple):
    """The shared memory.

    Attributes:
        control: words written by the supervising process (``CONTROL_SIZE``,).
        status: words written by the loop (``STATUS_SIZE``,).
        rows: the newest rows, the k-th at k modulo their number (n, columns).
        swap: nonzero while another surface is ready (1,).
        pending: the newest commanded forces, the k-th at k modulo their number (the delay of the
            device in samples + 1, 3) [N].
    """

    control: IntArray
    status: IntArray
    rows: FloatArray
    swap: IntArray
    pending: FloatArray


def trace_sample(
    trace: SharedBlock,
    sample: int,
    reading: Reading,
    before: ServoState,
    servo: ServoState,
    force: GuardedForce,
    in_contact: bool,
    settings: ServoSettings,
    device: object,
) -> None:
    """Write the row of a sample; see ``interface``.

    The applied force is the one that acts from this sample on, commanded a delay ago.
    """
    rows = trace.rows
    pending = trace.pending
    count = trace.status[ROW_COUNT]
    row = count % rows.shape[0]
    newest = count % pending.shape[0]
    oldest = (count + 1) % pending.shape[0]
    pending[newest, 0] = force.fx
    pending[newest, 1] = force.fy
    pending[newest, 2] = force.fz
    rows[row, 0] = sample * settings.period
    rows[row, 1] = reading.x
    rows[row, 2] = reading.y
    rows[row, 3] = reading.z
    rows[row, 4] = servo.fx
    rows[row, 5] = servo.fy
    rows[row, 6] = servo.fz
    for i in range(3):
        rows[row, APPLIED + i] = pending[oldest, i]
    rows[row, 10] = force.ramp
    rows[row, 11] = force.energy
    rows[row, 12] = force.damping
    rows[row, 15] = 1.0 if in_contact else 0.0
    rows[row, 16] = servo.anchor_x
    rows[row, 17] = servo.anchor_y
    rows[row, 18] = 1.0 if servo.held else 0.0
    rows[row, 19] = servo.anchor_z


def trace_timing(trace: SharedBlock, reading: Reading, lateness: int, duration: int) -> None:
    """Complete the row, and count it; a sample that was not read has none."""
    if reading.cause != RUNNING:
        return
    head = trace.status[ROW_COUNT]
    row = head % trace.rows.shape[0]
    trace.rows[row, 13] = 1e-9 * lateness
    trace.rows[row, 14] = 1e-9 * duration
    store_release(trace.status, ROW_COUNT, head + 1)


def histogram_bin(nanoseconds: int) -> int:
    """Return the bin of a time: n for less than 2ⁿ ns, but not less than 2ⁿ⁻¹."""
    _part, exponent = math.frexp(float(max(nanoseconds, 0)))
    return min(exponent, HISTOGRAM_BINS - 1)


def count_timing(block: SharedBlock, due: int, start_time: int, end_time: int, period: int) -> None:
    """Count how late a sample started, and whether it ended after the next one was due."""
    status = block.status
    lateness = start_time - due
    status[LATENESS_HISTOGRAM + histogram_bin(lateness)] += 1
    if status[ROW_COUNT] > 1:
        deviation = abs(start_time - status[LAST_START_TIME] - period)
        status[PERIOD_HISTOGRAM + histogram_bin(deviation)] += 1
    status[LAST_START_TIME] = start_time
    status[MAX_LATENESS] = max(status[MAX_LATENESS], lateness)
    if end_time > due + period:
        status[LATE_COUNT] += 1
        status[SKIPPED_COUNT] += (end_time - due) // period - 1
