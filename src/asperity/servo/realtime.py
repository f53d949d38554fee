"""Real-time priority of a loop, as far as the system permits."""

from __future__ import annotations

import ctypes
import os
import resource

PRIORITY = 80
"""Real-time priority of the loop, 1 to 99: above user programs, below kernel threads."""
# Linux: lock all current and future pages; set the timer slack [ns].
_LOCK_ALL_PAGES = 1 | 2
_SET_TIMER_SLACK = 29


def request_realtime_priority() -> tuple[str, ...]:
    """Request real-time priority and locked memory for this thread.

    Returns:
        What was not permitted, in sentences; nothing if all was.
    """
    notes = []
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_SET_TIMER_SLACK, ctypes.c_ulong(1), 0, 0, 0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError:
        notes.append(
            "Real-time priority is not allowed: samples may be late when the machine is busy"
            " (allow it by 'rtprio' in /etc/security/limits.conf)"
        )
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or os.geteuid() == 0) or library.mlockall(_LOCK_ALL_PAGES) != 0:
        notes.append("Memory may be paged out ('memlock' in the same file forbids it)")
    return tuple(notes)
