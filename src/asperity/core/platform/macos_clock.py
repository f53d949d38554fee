"""The clock of macOS: monotonic, it goes on while the machine sleeps.

``mach_wait_until`` takes the time for which the machine was awake, in units of its own: a unit
is the word at UNIT over that at WAIT, in ns.
"""

from asperity.core.compiled import IntArray, Kernels, call_address
from asperity.core.platform.clock_interface import NANOSECONDS, UNIT, WAIT, Clock

KERNELS = Kernels(provides=("clock_now", "clock_wait_until", "read_time"), native=("call_address",))

CLOCK_MONOTONIC = 6
CLOCK_UPTIME_RAW = 8


def read_time(gettime: int, place: IntArray | int, words: IntArray, first: int) -> int:
    """Return the system's time [ns], by ``clock_gettime``."""
    call_address(gettime, CLOCK_MONOTONIC, place)
    return int(words[first]) * NANOSECONDS + int(words[first + 1])


def clock_now(due: int, clock: Clock) -> int:
    """Return the time [ns]."""
    if clock.gettime == 0:
        return due
    return read_time(clock.gettime, clock.words, clock.words, 0) * clock.speed


def clock_wait_until(due: int, clock: Clock) -> int:
    """Wait by ``mach_wait_until``, again if it was interrupted; return the time after [ns]."""
    if clock.gettime == 0:
        return due
    now = clock_now(due, clock)
    while now < due:
        call_address(clock.gettime, CLOCK_UPTIME_RAW, clock.words)
        awake = int(clock.words[0]) * NANOSECONDS + int(clock.words[1])
        end = awake + (due - now) // clock.speed + 1
        call_address(clock.wait, end * int(clock.words[WAIT]) // int(clock.words[UNIT]))
        now = clock_now(due, clock)
    return now
