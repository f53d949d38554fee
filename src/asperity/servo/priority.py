"""The priority of a loop: what the system allows, and what it does not."""

from __future__ import annotations

import ctypes
import os
import resource

PRIORITY = 80
"""Of the loop among the real-time ones, 1 to 99: above what users run, below the kernel's own."""
# Of Linux: lock all pages, those of now and of later; let timers be as late as this [ns].
_ALL_PAGES = 1 | 2
_TIMER_SLACK = 29


def ask_for_priority() -> tuple[str, ...]:
    """Ask for real-time priority and for memory that is never paged out, for this thread.

    Returns:
        What was not allowed, in sentences; nothing if all was.
    """
    said = []
    library = ctypes.CDLL(None, use_errno=True)
    library.prctl(_TIMER_SLACK, ctypes.c_ulong(1), 0, 0, 0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError:
        said.append(
            "Real-time priority is not allowed: samples may be late when the machine is busy"
            " (allow it by 'rtprio' in /etc/security/limits.conf)"
        )
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    if not (unlimited or os.geteuid() == 0) or library.mlockall(_ALL_PAGES) != 0:
        said.append("Memory may be paged out ('memlock' in the same file forbids it)")
    return tuple(said)
