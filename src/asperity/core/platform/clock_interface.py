"""The clock of a loop: its record, and the compiled functions that each system defines.

The linker binds the calls of a loop to the module of the system's clock, see
:func:`asperity.core.platform.clocks.clock_module`.
"""

from typing import NamedTuple

from asperity.core.compiled import IntArray

NANOSECONDS = 1_000_000_000
# Words of a clock: the time as the system writes it (2), what the unit of the time is, and what a
# wait needs.
UNIT = 2
WAIT = 3
CLOCK_WORDS = 6


class Clock(NamedTuple):
    """A clock.

    Attributes:
        gettime: address of the function that reads the time; 0 for no clock, whose time is always
            the due time.
        wait: address of the function that waits.
        words: words of the clock (6,).
        speed: seconds of this clock in one of the system's; above 1 for tests alone.
    """

    gettime: int
    wait: int
    words: IntArray
    speed: int = 1


def read_time(gettime: int, place: IntArray | int, words: IntArray, first: int) -> int:
    """Return the system's time [ns].

    Args:
        gettime: address of the function that reads it.
        place: the words from the first one on, as an array or as an address.
        words: an array of which they are a part.
        first: index of the first word of the clock in it.
    """
    raise NotImplementedError  # the linker binds calls to the clock of the system


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]; without a clock the due time."""
    raise NotImplementedError  # the linker binds calls to the clock of the system


def clock_wait_until(due: int, clock: Clock) -> int:
    """Wait until a time [ns]; return the time after the wait [ns]."""
    raise NotImplementedError  # the linker binds calls to the clock of the system
