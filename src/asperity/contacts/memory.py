"""What a query remembers from tick to tick: one array of numbers that the caller keeps.

It only makes the next answer quicker. The answer is that of the stateless query as long as the
budget was enough; where it was not, the array says by how much the answer may be wrong.
"""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray, positive
from asperity.errors import ParameterError

# No budget, as a number that looks can still be counted down from.
UNLIMITED = 2.0**48

# Places in the array.
BUDGET = 0
"""Looks that a tick may take."""
TAKEN = 1
"""Looks that the last tick took."""
GAP = 2
"""How far from certain the last answer is [m]: see the contacts."""
WORST = 3
"""The greatest gap so far [m]."""
SHORT = 4
"""Ticks whose budget was not enough."""
POINTS = 5
"""How many surface points follow."""
FIRST = 6
"""Where the points begin: x, y, z [m] and weight of each, at most four."""
SIZE = 22


def new_memory(budget: float) -> FloatArray:
    """Return the memory of a query that has not been asked yet, shape (22,).

    Args:
        budget: looks that a tick may take, a look being an evaluation of the surface: the ``looks``
            of the contact for a servo loop, ``UNLIMITED`` for the exact answer at any price.

    Raises:
        ParameterError: for a budget that is not positive.
    """
    memory = np.zeros(SIZE)
    memory[BUDGET] = positive("budget", budget, "looks")
    return memory


def checked_memory(memory: FloatArray) -> FloatArray:
    """Return a memory as it is.

    Raises:
        ParameterError: for anything but an array of :func:`new_memory`.
    """
    if not (isinstance(memory, np.ndarray) and memory.shape == (SIZE,) and memory[BUDGET] > 0.0):
        raise ParameterError("memory", "must be an array of asperity.contacts.memory.new_memory")
    return memory
