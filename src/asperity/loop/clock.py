"""The clock of a servo loop: that of the system, or none for a loop that runs unpaced.

It counts the time in which the machine sleeps, so that the sample after it is late.
"""

from typing import NamedTuple

from asperity.core.compiled import IntArray, Kernels, call_address

KERNELS = Kernels(provides=("clock_now", "clock_wait_until"), native=("call_address",))

# Linux: the monotonic clock that goes on while the machine sleeps, absolute times, and the answer
# of a wait that a signal interrupted.
CLOCK_BOOTTIME = 7
TIMER_ABSTIME = 1
EINTR = 4
NANOSECONDS = 1_000_000_000


class Clock(NamedTuple):
    """A clock.

    Attributes:
        gettime: address of ``clock_gettime``; 0 for no clock, whose time is always the due time.
        nanosleep: address of ``clock_nanosleep``.
        timespec: seconds and nanoseconds, as both functions take them (2,).
    """

    gettime: int
    nanosleep: int
    timespec: IntArray


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]."""
    if clock.gettime == 0:
        return due
    call_address(clock.gettime, CLOCK_BOOTTIME, clock.timespec)
    return int(clock.timespec[0]) * NANOSECONDS + int(clock.timespec[1])


def clock_wait_until(due: int, clock: Clock) -> int:
    """Wait until a time [ns]; return the time after the wait [ns]."""
    if clock.gettime == 0:
        return due
    answer = EINTR
    while answer == EINTR:
        clock.timespec[0] = due // NANOSECONDS
        clock.timespec[1] = due % NANOSECONDS
        answer = call_address(clock.nanosleep, CLOCK_BOOTTIME, TIMER_ABSTIME, clock.timespec, 0)
    return clock_now(due, clock)
