"""The clocks of loops: that of the system, and none for a loop that runs unpaced.

The time in which the machine sleeps counts where the system can tell, so that the sample after it
is late.
"""

from __future__ import annotations

import ctypes
import time
from types import ModuleType

import numpy as np

from asperity.core.compiled import IntArray
from asperity.core.platform import linux_clock, macos_clock, windows_clock
from asperity.core.platform.clock_interface import CLOCK_WORDS, UNIT, WAIT, Clock
from asperity.core.platform.system import (
    System,
    find_system,
    function_address,
    mach_time_unit,
    system_library,
)

# CREATE_WAITABLE_TIMER_HIGH_RESOLUTION, since Windows 10 version 1803; TIMER_ALL_ACCESS.
_HIGH_RESOLUTION = 2
_ALL_ACCESS = 0x1F0003
_MODULES: dict[System, ModuleType] = {
    System.LINUX: linux_clock,
    System.MACOS: macos_clock,
    System.WINDOWS: windows_clock,
}


def clock_module() -> ModuleType:
    """Return the compiled module of the system's clock."""
    return _MODULES[find_system()]


def no_clock() -> Clock:
    """Return a clock whose time is always that of the next due sample."""
    return Clock(0, 0, np.zeros(CLOCK_WORDS, np.int64))


def system_clock(speed: int = 1) -> Clock:
    """Return the system's clock, or a faster one."""
    words = np.zeros(CLOCK_WORDS, np.int64)
    library = system_library("kernel32")
    if find_system() is System.WINDOWS:
        _prepare_windows_clock(library, words)
        gettime = library.QueryPerformanceCounter
        wait = library.SetWaitableTimer
    elif find_system() is System.MACOS:
        words[UNIT], words[WAIT] = mach_time_unit()
        gettime = library.clock_gettime
        wait = library.mach_wait_until
    else:
        gettime = library.clock_gettime
        wait = library.clock_nanosleep
    return Clock(function_address(gettime), function_address(wait), words, speed)


def _prepare_windows_clock(library: ctypes.CDLL, words: IntArray) -> None:
    """Write the counts of a second, a timer and the function that waits for it."""
    create = library.CreateWaitableTimerExW
    create.restype = ctypes.c_void_p
    timer = create(None, None, _HIGH_RESOLUTION, _ALL_ACCESS)
    if not timer:
        system_library("winmm").timeBeginPeriod(1)  # the finest tick of the system [ms]
        timer = create(None, None, 0, _ALL_ACCESS)
    library.QueryPerformanceFrequency(words[UNIT:].ctypes.data_as(ctypes.c_void_p))
    words[windows_clock.TIMER] = timer or 0
    words[windows_clock.WAIT_FOR_OBJECT] = function_address(library.WaitForSingleObject)


def system_time() -> int:
    """Return the time of the system's clock, as compiled loops read it [ns]."""
    if find_system() is System.WINDOWS:
        return time.perf_counter_ns()  # that of QueryPerformanceCounter
    if find_system() is System.MACOS:
        return time.clock_gettime_ns(time.CLOCK_MONOTONIC)
    return time.clock_gettime_ns(linux_clock.CLOCK_BOOTTIME)
