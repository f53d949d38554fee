"""A device and a clock implemented by Python functions."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from types import ModuleType
from typing import Any, ClassVar

import numpy as np

from asperity.core.platform.clock_interface import Clock
from asperity.core.platform.system import function_address
from asperity.servo.driver import Driver
from asperity.servo.driver_loop import LoopProgram, build_program
from asperity.servo.drivers import library as by_address
from asperity.servo.drivers.library import LibraryDevice
from asperity.surface import Surface
from asperity.textures import Sinusoid

_NUMBERS = ctypes.POINTER(ctypes.c_double)
_READ = ctypes.CFUNCTYPE(ctypes.c_int, _NUMBERS)
_WRITE = ctypes.CFUNCTYPE(ctypes.c_int, _NUMBERS, ctypes.c_int)
_WORDS = ctypes.POINTER(ctypes.c_int64)
_GETTIME = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, _WORDS)
_SLEEP = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_int, ctypes.c_int, _WORDS, ctypes.c_void_p)


@dataclass(eq=False)
class PythonDevice(Driver):
    """A device whose handle is at ``path(k)`` at the k-th reading.

    ``codes`` maps ("read" or "write", k) to the return code of the k-th reading or writing.
    """

    name: ClassVar[str] = "python"
    loss_notice: ClassVar[str] = "Nothing."

    path: Callable[[int], Any]
    codes: dict[tuple[str, int], int] = field(default_factory=dict)
    forces: list[tuple[float, float, float]] = field(default_factory=list)
    reads: int = 0

    def _read(self, place: Any) -> int:
        for axis, value in enumerate(self.path(self.reads)):
            place[axis] = value
        self.reads += 1
        return self.codes.get(("read", self.reads - 1), 0)

    def _write(self, force: Any, _contact: int) -> int:
        self.forces.append((force[0], force[1], force[2]))
        return self.codes.get(("write", len(self.forces) - 1), 0)

    def kernel_modules(self) -> tuple[ModuleType, ...]:
        return (by_address,)

    def placeholder_record(self) -> LibraryDevice:
        return LibraryDevice(0, 0)

    def open(self) -> LibraryDevice:
        self._callbacks = _READ(self._read), _WRITE(self._write)
        return LibraryDevice(*map(function_address, self._callbacks))


class PythonClock:
    """A clock whose k-th wait ends ``lateness(k)`` [ns] late."""

    def __init__(self, lateness: Callable[[int], int]) -> None:
        self._lateness, self._now, self._waits = lateness, 10**9, 0
        self._callbacks = _GETTIME(self._gettime), _SLEEP(self._sleep)
        self.record = Clock(*map(function_address, self._callbacks), np.zeros(2, np.int64))

    def passes(self, time: int) -> None:
        """Advance the time [ns]."""
        self._now += time

    def _gettime(self, _clock: int, words: Any) -> int:
        words[0], words[1] = divmod(self._now, 10**9)
        return 0

    def _sleep(self, _clock: int, _flags: int, words: Any, _rest: Any) -> int:
        due = words[0] * 10**9 + words[1]
        self._now = max(self._now, due) + self._lateness(self._waits)
        self._waits += 1
        return 0


SURFACE = Surface(
    Sinusoid(0.2e-3, 1e-3, phase=0.4, direction=(2.0, 1.0)), "C", stiffness=900.0, max_depth=5e-3
)


@cache
def program_for(surface: Surface) -> LoopProgram:
    """Return the loop program of a surface on a :class:`PythonDevice`."""
    return build_program(surface, PythonDevice(lambda _k: (0.0, 0.0, 0.0)))
