"""Memory that the loop's process and the watching one share: rows, counts, heartbeat."""

from __future__ import annotations

import ctypes
from multiprocessing.context import SpawnContext
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.servo.kernels.published import (
    COLUMNS,
    CONTROLS,
    HEAD,
    HEARTBEAT,
    STATUS,
    STOP,
    Board,
)

ROWS = 40_000
"""That are kept for whoever reads them: 4 s of the fastest loop."""


class Shared:
    """Rows of a loop as they come, for one writer and any number of readers, none of which waits.

    The loop writes a row into its place and then counts it. A reader copies the rows that are
    counted and looks at the count again: what was overwritten meanwhile it throws away.
    """

    def __init__(self) -> None:
        context = SpawnContext()
        self._rows = ROWS
        self._columns = len(COLUMNS)
        self._control: Any = context.RawArray(ctypes.c_int64, CONTROLS)
        self._status: Any = context.RawArray(ctypes.c_int64, STATUS)
        self._table: Any = context.RawArray(ctypes.c_double, self._rows * self._columns)

    def board(self) -> Board:
        """Return it as the compiled loop takes it."""
        return Board(
            np.frombuffer(self._control, np.int64), np.frombuffer(self._status, np.int64),
            np.frombuffer(self._table, np.float64).reshape(self._rows, self._columns),
            np.zeros(1, np.int64),
        )  # fmt: skip

    @property
    def head(self) -> int:
        """Rows that were written since the start."""
        return int(self._status[HEAD])

    @property
    def status(self) -> list[int]:
        """Counts and histogram of the loop, see ``kernels.published``."""
        return list(self._status)

    def beat(self) -> None:
        """Let the loop hear that somebody watches."""
        self._control[HEARTBEAT] += 1

    def stop(self) -> None:
        """Ask the loop to let the force go and end."""
        self._control[STOP] = 1

    def rows(self, first: int) -> tuple[FloatArray, int]:
        """Return the rows from one on that are still there, and the number of the first.

        Args:
            first: number of the row.
        """
        table = self.board().rows
        head = self.head
        first = max(first, head - self._rows)
        taken = table[np.arange(first, head) % self._rows]
        # The row after the newest may be half written: it counts as overwritten.
        lost = max(0, self.head + 1 - self._rows - first)
        return taken[lost:], first + min(lost, len(taken))
