"""Which system this is, and its libraries."""

from __future__ import annotations

import ctypes
import os
import platform
from collections.abc import Mapping
from enum import Enum
from functools import cache
from pathlib import Path
from typing import Any


class System(Enum):
    """An operating system, with its name."""

    LINUX = "Linux"
    MACOS = "macOS"
    WINDOWS = "Windows"


# Only Windows has its calling convention; only macOS waits until a time of the Mach kernel. Other
# systems have what Linux has, or say what they lack.
_WINDOWS_LOADER = "WinDLL"


@cache
def find_system() -> System:
    """Return the system that this process runs on."""
    if hasattr(ctypes, _WINDOWS_LOADER):
        return System.WINDOWS
    if hasattr(ctypes.CDLL(None), "mach_wait_until"):
        return System.MACOS
    return System.LINUX


def describe_system() -> str:
    """Return name, version and processor of the system."""
    return f"{platform.platform()}, {platform.machine()}"


def system_library(windows_name: str) -> Any:
    """Return a library of Windows by its name; elsewhere the C library, whatever the name."""
    if find_system() is System.WINDOWS:
        return getattr(ctypes, _WINDOWS_LOADER)(windows_name)
    return ctypes.CDLL(None, use_errno=True)


def function_address(function: Any) -> int:
    """Return the address of a C function."""
    return int(ctypes.cast(function, ctypes.c_void_p).value or 0)


def mach_time_unit() -> tuple[int, int]:
    """Return the unit of time of macOS as numerator and denominator [ns]."""
    unit = (ctypes.c_uint32 * 2)()
    system_library("").mach_timebase_info(unit)
    return int(unit[0]), int(unit[1])


LibraryNames = Mapping[System, tuple[str, ...]]
"""Names of a vendor's library by system; a system that is missing has none."""


def library_file(name: str) -> str:
    """Return what loads a library: its name, or on Windows its file in a folder of ``PATH``.

    There, Python itself searches beside the program and among the system's libraries only.
    """
    if find_system() is System.WINDOWS:
        for folder in filter(None, os.environ.get("PATH", "").split(os.pathsep)):
            file = Path(folder, name)
            if file.is_file():
                return str(file.resolve())
    return name


def memory_folder() -> str | None:
    """Return a folder whose files are in memory; ``None`` for the folder of temporary files."""
    folder = Path("/dev/shm")
    return str(folder) if folder.is_dir() else None
