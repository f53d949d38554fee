"""A slot between two threads, without locks: places go one way, forces the other.

Each way has a ring of rows that one thread alone writes, and a count of them that it raises when a
row is whole: whoever reads takes the newest row that is counted. Nobody waits for anybody, and the
writer comes back to a row only after all the others.

All of it is one block of memory, seen as words and as numbers, so that a C function can be given
its address: first the words below, then the rows, of a time [ns] and three numbers.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.native import load_acquire, store_release

KERNELS = Kernels(
    provides=("fail", "failure", "newest_row", "put_row"),
    loops=("deliver", "fetch", "give_up"),
    native=("load_acquire", "store_release"),
)

# Words: rows of places, of forces, what was found wrong, or 0, and how long the loop may hold a
# force without a word [ns]; then the thread takes it away. The rest is free for a driver.
PLACES, FORCES, CODE, PATIENCE, FREE = 0, 1, 2, 3, 4
HEADER = 16
# What the loop finds: a place that is too old; and the thread: a force that nobody gives any more.
STALE, SILENT = 1, 2
RING = 1024
"""Rows of each way: a tenth of a second of the fastest loop."""
ROW = 4
WORDS = HEADER + 2 * RING * ROW


class Stamped(NamedTuple):
    """A row of a slot.

    Attributes:
        x: of a place [m, or the device's unit] or of a force [N].
        y: likewise.
        z: likewise.
        time: when it was so [ns]; 0 for never, or for a row that was overwritten meanwhile.
    """

    x: float
    y: float
    z: float
    time: int


class Slot(NamedTuple):
    """The memory of a slot, twice.

    Attributes:
        words: as integers (WORDS,).
        numbers: as numbers (WORDS,).
    """

    words: NDArray[np.int64]
    numbers: FloatArray


def put_row(
    words: NDArray[np.int64], numbers: FloatArray, way: int, x: float, y: float, z: float, time: int
) -> None:
    """Write the next row of a way, ``PLACES`` or ``FORCES``; one thread alone does this."""
    count = words[way]
    row = HEADER + ROW * (way * RING + count % RING)
    words[row] = time
    numbers[row + 1] = x
    numbers[row + 2] = y
    numbers[row + 3] = z
    store_release(words, way, count + 1)


def newest_row(words: NDArray[np.int64], numbers: FloatArray, way: int) -> Stamped:
    """Return the newest row of a way."""
    count = load_acquire(words, way)
    if count == 0:
        return Stamped(0.0, 0.0, 0.0, 0)
    row = HEADER + ROW * (way * RING + (count - 1) % RING)
    time = words[row]
    x = numbers[row + 1]
    y = numbers[row + 2]
    z = numbers[row + 3]
    # Whoever was held up for the whole ring between these lines has read a mixture.
    overtaken = load_acquire(words, way) - count >= RING - 1
    return Stamped(x, y, z, 0 if overtaken else time)


def fail(words: NDArray[np.int64], code: int) -> None:
    """Say that something is wrong, with a number that is not 0; the first one stays."""
    if words[CODE] == 0:
        store_release(words, CODE, code)


def failure(words: NDArray[np.int64]) -> int:
    """Return what is wrong, or 0."""
    return load_acquire(words, CODE)


def deliver(
    words: NDArray[np.int64], numbers: FloatArray, x: float, y: float, z: float, time: int
) -> None:
    """Put a place, from Python."""
    put_row(words, numbers, PLACES, x, y, z, time)


def fetch(words: NDArray[np.int64], numbers: FloatArray) -> tuple[float, float, float, int]:
    """Return the newest force and when the loop gave it [ns], for Python."""
    force = newest_row(words, numbers, FORCES)
    return force.x, force.y, force.z, force.time


def give_up(words: NDArray[np.int64], code: int) -> None:
    """Say that something is wrong, from Python."""
    fail(words, code)
