"""Real-time priority and locked memory for the thread of a loop."""

from __future__ import annotations

import ctypes
import os
from contextlib import suppress
from typing import Any, NamedTuple

from asperity.core.platform.system import System, find_system, mach_time_unit, system_library

PRIORITY = 80
"""Real-time priority of the loop on Linux, 1 to 99: above user programs, below kernel threads."""
# Linux: lock all current and future pages; set the timer slack [ns].
_LOCK_ALL_PAGES = 1 | 2
_SET_TIMER_SLACK = 29
# Windows: HIGH_PRIORITY_CLASS, THREAD_PRIORITY_TIME_CRITICAL, THREAD_PRIORITY_HIGHEST.
_HIGH_CLASS = 0x80
_TIME_CRITICAL = 15
_HIGHEST = 2
# macOS: THREAD_TIME_CONSTRAINT_POLICY, and the shares of a period that the loop computes for, and
# within which it has to be done.
_TIME_CONSTRAINT = 2
_COMPUTATION = 0.25
_CONSTRAINT = 0.5


class Priority(NamedTuple):
    """What the system permitted.

    Attributes:
        is_realtime: whether the thread has real-time priority.
        notes: what was not permitted, in sentences; nothing if all was.
    """

    is_realtime: bool
    notes: tuple[str, ...]


def request_realtime_priority(period: float) -> Priority:
    """Request real-time priority, and locked memory where the system has it, for this thread.

    Args:
        period: time between two samples [s].
    """
    if find_system() is System.WINDOWS:
        is_realtime = _raise_windows_priority(_TIME_CRITICAL)
        hint = "Windows refused SetThreadPriority and the task 'Pro Audio' of MMCSS"
    elif find_system() is System.MACOS:
        is_realtime = _set_time_constraint(period)
        hint = "macOS refused THREAD_TIME_CONSTRAINT_POLICY"
    else:
        is_realtime = request_thread_priority(0)
        hint = "allow it by 'rtprio' in /etc/security/limits.conf"
    notes = []
    if not is_realtime:
        words = "Real-time priority is not allowed: samples may be late when the machine is busy"
        notes.append(f"{words} ({hint})")
    if find_system() is System.LINUX and not _lock_memory():
        notes.append("Memory may be paged out ('memlock' in the same file forbids it)")
    return Priority(is_realtime, tuple(notes))


def request_thread_priority(below: int) -> bool:
    """Request a priority by some levels below that of a loop; return whether it is permitted."""
    if find_system() is System.WINDOWS:
        return _raise_windows_priority(_HIGHEST)
    with suppress(OSError, AttributeError):  # not permitted, or not on this system
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY - below))
        return True
    return False


def _lock_memory() -> bool:
    """Lock the memory of this process, and let its waits end at the time asked for."""
    import resource

    library = system_library("")
    library.prctl(_SET_TIMER_SLACK, ctypes.c_ulong(1), 0, 0, 0)
    unlimited = resource.getrlimit(resource.RLIMIT_MEMLOCK)[0] == resource.RLIM_INFINITY
    may_lock = unlimited or os.geteuid() == 0
    return may_lock and bool(library.mlockall(_LOCK_ALL_PAGES) == 0)


def _raise_windows_priority(level: int) -> bool:
    """Raise the priority of this thread: by MMCSS too, whose service may be missing."""
    kernel = system_library("kernel32")
    current = kernel.GetCurrentThread
    current.restype = ctypes.c_void_p
    process = kernel.GetCurrentProcess
    process.restype = ctypes.c_void_p
    kernel.SetPriorityClass(ctypes.c_void_p(process()), _HIGH_CLASS)
    is_raised = bool(kernel.SetThreadPriority(ctypes.c_void_p(current()), level))
    with suppress(OSError, AttributeError):
        join_task: Any = system_library("avrt").AvSetMmThreadCharacteristicsW
        join_task.restype = ctypes.c_void_p
        task = ctypes.c_uint32(0)
        is_raised = bool(join_task(ctypes.c_wchar_p("Pro Audio"), ctypes.byref(task))) or is_raised
    return is_raised


def _set_time_constraint(period: float) -> bool:
    """Ask macOS for a share of every period [s]."""
    library = system_library("")
    numerator, denominator = mach_time_unit()
    ticks = 1e9 * period * denominator / numerator
    policy = (ctypes.c_uint32 * 4)(
        round(ticks), round(_COMPUTATION * ticks), round(_CONSTRAINT * ticks), 1
    )
    thread = library.mach_thread_self()
    return bool(library.thread_policy_set(thread, _TIME_CONSTRAINT, policy, len(policy)) == 0)
