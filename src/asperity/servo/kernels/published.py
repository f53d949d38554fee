"""What the loop and the process that watches it share, and where each number stands.

One side writes each number, and nobody waits: the loop writes a row and then the count of rows, so
whoever reads the count finds the row; see :class:`asperity.servo.shared.Shared`.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray

# Words that the watching process writes.
HEARTBEAT, STOP = 0, 1
CONTROLS = 2
# Words that the loop writes: rows, then counts since the start, then histograms.
HEAD, LATE, SKIPPED, WORST_LATE, LENGTHS, SLEWS, DEEP, BEGUN = range(8)
BINS = 40
LATENESS = 8
PERIODS = LATENESS + BINS
STATUS = PERIODS + BINS

COLUMNS = (
    ("time", "s"),
    ("x", "m"), ("y", "m"), ("z", "m"),
    ("commanded x", "N"), ("commanded y", "N"), ("commanded z", "N"),
    ("applied x", "N"), ("applied y", "N"), ("applied z", "N"),
    ("share", "1"), ("supplied", "J"), ("controlled", "N s/m"),
    ("late", "s"), ("took", "s"), ("inside", "1"),
    ("law anchor x", "m"), ("law anchor y", "m"), ("law held", "1"),
)  # fmt: skip
"""Columns of the rows with their units; the frame is the surface's."""

# What ends the loop.
GOING, STOPPED, SWAP, FINISHED = 0, 1, 2, 3
NUMBER, DEVICE, WORKSPACE, DEPTH, MISSES, LATENESS_LIMIT, PARENT = 4, 5, 6, 7, 8, 9, 10


class Board(NamedTuple):
    """What is shared.

    Attributes:
        control: words that the watching process writes (CONTROLS,).
        status: words that the loop writes (STATUS,).
        rows: the newest rows, the k-th at k modulo their number (n, columns).
        swap: not 0 when another surface is ready (1,).
    """

    control: NDArray[np.int64]
    status: NDArray[np.int64]
    rows: FloatArray
    swap: NDArray[np.int64]
