"""The clock of Windows: the performance counter, and a waitable timer.

A timer may expire up to a tick of the system early, or a wait may end late: the time is read
again until it is due.
"""

from asperity.core.compiled import IntArray, Kernels, call_address
from asperity.core.platform.clock_interface import NANOSECONDS, UNIT, WAIT, Clock

KERNELS = Kernels(provides=("clock_now", "clock_wait_until", "read_time"), native=("call_address",))

# Words: the counts of a second; the timer, and the address of WaitForSingleObject.
TIMER = WAIT
WAIT_FOR_OBJECT = WAIT + 1
TIMER_UNIT = 100  # [ns]
MILLISECOND = 1_000_000  # [ns]


def read_time(gettime: int, place: IntArray | int, words: IntArray, first: int) -> int:
    """Return the system's time [ns], by ``QueryPerformanceCounter``."""
    call_address(gettime, place)
    rate = int(words[first + UNIT])
    count = int(words[first])
    return count // rate * NANOSECONDS + count % rate * NANOSECONDS // rate


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]."""
    if clock.gettime == 0:
        return due
    return read_time(clock.gettime, clock.words, clock.words, 0) * clock.speed


def clock_wait_until(due: int, clock: Clock) -> int:
    """Wait by ``SetWaitableTimer``; return the time after the wait [ns]."""
    if clock.gettime == 0:
        return due
    now = clock_now(due, clock)
    while now < due:
        remaining = (due - now) // clock.speed
        timer = int(clock.words[TIMER])
        # A negative time counts from now on.
        clock.words[0] = -max(remaining // TIMER_UNIT, 1)
        call_address(clock.wait, timer, clock.words, 0, 0, 0, 0)
        # Whatever the timer does, the wait ends.
        call_address(clock.words[WAIT_FOR_OBJECT], timer, remaining // MILLISECOND + 2)
        now = clock_now(due, clock)
    return now
