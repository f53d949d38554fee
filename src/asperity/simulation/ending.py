"""How a run ends, told from its rows as they come: no row has to be kept for it."""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray
from asperity.simulation.trace import COLUMNS

_LEAST_ROWS = 4
_NAMES = [name for name, _unit in COLUMNS]
_VELOCITY = slice(_NAMES.index("vx"), _NAMES.index("vz") + 1)
_SUPPLIED = slice(_NAMES.index("supplied x"), _NAMES.index("supplied z") + 1)
_LOST, _FRICTION = _NAMES.index("lost"), _NAMES.index("friction")
# Part of the loss that the texture supplies at least: amplitudes beat, so not all of it always.
FED = 0.2


class Ending:
    """The last quarter of a run, or of a part of it: how restless it is, and what feeds it.

    Args:
        rows: that the trace will have.
    """

    def __init__(self, rows: int) -> None:
        self._from = rows - rows // 4
        self._fed_from = rows - max(rows // 4, 2)
        self._wanted, self._seen, self._count = rows, 0, 0
        self._mean, self._squares = np.zeros(3), np.zeros(3)
        self._first = self._last = np.zeros(len(COLUMNS))

    @property
    def known(self) -> bool:
        """Whether all rows have come, and there are enough of them to tell anything."""
        return self._seen == self._wanted >= _LEAST_ROWS

    @property
    def restlessness(self) -> float:
        """Standard deviations of the velocity, summed over the axes [m/s]."""
        return float(np.sqrt(self._squares / self._count).sum())

    @property
    def fed(self) -> bool:
        """Whether the texture supplies at least a fifth of what damping and friction take."""
        return fed(self._first, self._last)

    def see(self, rows: FloatArray) -> None:
        """Take the next rows of the trace, shape (n, columns), into account."""
        begin, self._seen = self._seen, self._seen + len(rows)
        if begin <= self._fed_from < self._seen:
            self._first = rows[self._fed_from - begin].copy()
        part = rows[max(self._from - begin, 0) :, _VELOCITY]
        if len(rows):
            self._last = rows[-1].copy()
        if not len(part):
            return
        # Mean and squares of two parts together, without a difference of large numbers.
        mean, together = part.mean(axis=0), self._count + len(part)
        apart = mean - self._mean
        self._squares += ((part - mean) ** 2).sum(axis=0)
        self._squares += apart**2 * (self._count * len(part) / together)
        self._mean = self._mean + apart * (len(part) / together)
        self._count = together


def fed(first: FloatArray, last: FloatArray) -> bool:
    """Return whether the texture feeds the handle from one row of the trace to another."""
    supplied = (last[_SUPPLIED] - first[_SUPPLIED]).sum()
    taken = (last[_LOST] - first[_LOST]) - (last[_FRICTION] - first[_FRICTION])
    return bool(supplied > FED * taken)
