"""When a sample is due: the system's clock, or none, for a loop that runs as fast as it can."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from asperity.compiled import Kernels
from asperity.kernels.native import call_address

KERNELS = Kernels(provides=("clock_now", "clock_wait"), native=("call_address",))

# Of Linux: the clock that nobody sets, a time that is absolute, a wait that a signal has cut short.
MONOTONIC = 1
ABSOLUTE = 1
INTERRUPTED = 4
SECOND = 1_000_000_000


class Clock(NamedTuple):
    """A clock.

    Attributes:
        gettime: address of ``clock_gettime``; 0 for no clock: then it is always when it is due.
        nanosleep: address of ``clock_nanosleep``.
        words: seconds and nanoseconds, as both take them (2,).
    """

    gettime: int
    nanosleep: int
    words: NDArray[np.int64]


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]."""
    if clock.gettime == 0:
        return due
    call_address(clock.gettime, MONOTONIC, clock.words)
    return int(clock.words[0]) * SECOND + int(clock.words[1])


def clock_wait(due: int, clock: Clock) -> int:
    """Wait until a time [ns] and return when it is then."""
    if clock.gettime == 0:
        return due
    answer = INTERRUPTED
    while answer == INTERRUPTED:
        clock.words[0] = due // SECOND
        clock.words[1] = due % SECOND
        answer = call_address(clock.nanosleep, MONOTONIC, ABSOLUTE, clock.words, 0)
    return clock_now(due, clock)
