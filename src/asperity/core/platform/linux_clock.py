"""The clock of Linux: monotonic, it goes on while the machine sleeps."""

from asperity.core.compiled import IntArray, Kernels, call_address
from asperity.core.platform.clock_interface import NANOSECONDS, Clock

KERNELS = Kernels(provides=("clock_now", "clock_wait_until", "read_time"), native=("call_address",))

# Absolute times, and the answer of a wait that a signal interrupted.
CLOCK_BOOTTIME = 7
TIMER_ABSTIME = 1
EINTR = 4


def read_time(gettime: int, place: IntArray | int, words: IntArray, first: int) -> int:
    """Return the system's time [ns], by ``clock_gettime``."""
    call_address(gettime, CLOCK_BOOTTIME, place)
    return int(words[first]) * NANOSECONDS + int(words[first + 1])


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]."""
    if clock.gettime == 0:
        return due
    return read_time(clock.gettime, clock.words, clock.words, 0) * clock.speed


def clock_wait_until(due: int, clock: Clock) -> int:
    """Wait by ``clock_nanosleep``; return the time after the wait [ns]."""
    if clock.gettime == 0:
        return due
    system_due = due // clock.speed
    answer = EINTR
    while answer == EINTR:
        clock.words[0] = system_due // NANOSECONDS
        clock.words[1] = system_due % NANOSECONDS
        answer = call_address(clock.wait, CLOCK_BOOTTIME, TIMER_ABSTIME, clock.words, 0)
    return clock_now(due, clock)
