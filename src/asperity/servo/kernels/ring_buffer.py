"""A ring buffer between two threads, without locks: positions one way, forces the other.

Each direction has a ring of rows with a single writer, which increments a count when a row is
complete; the reader takes the newest counted row. No side waits, and the writer returns to a row
only after all the others.

The buffer is one block of memory, seen as words and as numbers, so that a C function can take its
address: first the words below, then the rows of a time [ns] and three numbers.
"""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, IntArray, Kernels, load_acquire, store_release

KERNELS = Kernels(
    provides=("set_failure", "failure_code", "latest_row", "push_row"),
    loops=("push_position", "latest_force", "report_failure"),
    native=("load_acquire", "store_release"),
)

# Words: counts of positions and of forces, failure code or 0, and the time after which the thread
# releases a force that the loop does not renew [ns]. The rest is free for a driver.
POSITIONS = 0
FORCES = 1
FAILURE_CODE = 2
FORCE_TIMEOUT = 3
DRIVER_WORDS = 4
HEADER_WORDS = 16
# Failure codes: of the loop, a position that is too old; of the thread, a force not renewed.
STALE = 1
LOOP_SILENT = 2
RING_ROWS = 1024
"""Rows of each direction: a tenth of a second of the fastest loop."""
ROW_WORDS = 4
BUFFER_WORDS = HEADER_WORDS + 2 * RING_ROWS * ROW_WORDS


class TimedRow(NamedTuple):
    """A row of a ring buffer.

    Attributes:
        x: component of a position [m, or the device's unit] or of a force [N].
        y: likewise.
        z: likewise.
        time: time of the row [ns]; 0 for no row, or one that was overwritten meanwhile.
    """

    x: float
    y: float
    z: float
    time: int


class RingBuffer(NamedTuple):
    """The memory of a ring buffer, in two views.

    Attributes:
        words: as integers (WORDS,).
        numbers: as numbers (WORDS,).
    """

    words: IntArray
    numbers: FloatArray


def push_row(
    words: IntArray, numbers: FloatArray, direction: int, x: float, y: float, z: float, time: int
) -> None:
    """Write the next row of a direction, ``POSITIONS`` or ``FORCES``; for a single writer."""
    count = words[direction]
    row = HEADER_WORDS + ROW_WORDS * (direction * RING_ROWS + count % RING_ROWS)
    words[row] = time
    numbers[row + 1] = x
    numbers[row + 2] = y
    numbers[row + 3] = z
    store_release(words, direction, count + 1)


def latest_row(words: IntArray, numbers: FloatArray, direction: int) -> TimedRow:
    """Return the newest row of a direction."""
    count = load_acquire(words, direction)
    if count == 0:
        return TimedRow(0.0, 0.0, 0.0, 0)
    row = HEADER_WORDS + ROW_WORDS * (direction * RING_ROWS + (count - 1) % RING_ROWS)
    time = words[row]
    x = numbers[row + 1]
    y = numbers[row + 2]
    z = numbers[row + 3]
    # A reader suspended for a whole ring between these lines has read a mixture.
    overtaken = load_acquire(words, direction) - count >= RING_ROWS - 1
    return TimedRow(x, y, z, 0 if overtaken else time)


def set_failure(words: IntArray, code: int) -> None:
    """Report a failure by a nonzero code; the first one is kept."""
    if words[FAILURE_CODE] == 0:
        store_release(words, FAILURE_CODE, code)


def failure_code(words: IntArray) -> int:
    """Return the failure code, or 0."""
    return load_acquire(words, FAILURE_CODE)


def push_position(
    words: IntArray, numbers: FloatArray, x: float, y: float, z: float, time: int
) -> None:
    """Push a position, from Python."""
    push_row(words, numbers, POSITIONS, x, y, z, time)


def latest_force(words: IntArray, numbers: FloatArray) -> tuple[float, float, float, int]:
    """Return the newest force and its time [ns], for Python."""
    force = latest_row(words, numbers, FORCES)
    return force.x, force.y, force.z, force.time


def report_failure(words: IntArray, code: int) -> None:
    """Report a failure, from Python."""
    set_failure(words, code)
