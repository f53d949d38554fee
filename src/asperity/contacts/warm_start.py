"""State of a warm-started search for a contact point: one array owned by the caller.

It only speeds up the next search. The result is that of the stateless search unless the budget was
used up; then the array holds an error bound of the result.
"""

from __future__ import annotations

import numpy as np

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError

# No limit, as a number from which evaluations can still be subtracted.
UNLIMITED = 2.0**48

# Indices into the array.
BUDGET = 0
"""Evaluations that a tick may take."""
EVALUATIONS = 1
"""Evaluations of the last tick."""
ERROR_BOUND = 2
"""Error bound of the last result [m]; see ``Contact.bounds_force_error``."""
MAX_ERROR_BOUND = 3
"""Greatest error bound so far [m]."""
TRUNCATED_TICKS = 4
"""Number of ticks whose search was truncated."""
POINT_COUNT = 5
"""Number of surface points that follow."""
FIRST_POINT = 6
"""First of the points: x, y, z [m] and weight of each, at most four points."""
WARM_START_SIZE = 22


def new_warm_start(budget: float) -> FloatArray:
    """Return the state before the first search, shape (22,).

    Args:
        budget: evaluations of the surface that a tick may take: the ``max_evaluations`` of the
            contact for a servo loop, ``UNLIMITED`` for exact results.

    Raises:
        ParameterError: for a budget that is not positive.
    """
    warm_start = np.zeros(WARM_START_SIZE)
    warm_start[BUDGET] = check_positive("budget", budget, "evaluations")
    return warm_start


def check_warm_start(warm_start: FloatArray) -> FloatArray:
    """Return the state unchanged.

    Raises:
        ParameterError: for anything but an array of :func:`new_warm_start`.
    """
    is_state = isinstance(warm_start, np.ndarray) and warm_start.shape == (WARM_START_SIZE,)
    if not (is_state and warm_start[BUDGET] > 0.0):
        raise ParameterError(
            "warm_start", "must be an array of asperity.contacts.warm_start.new_warm_start"
        )
    return warm_start
