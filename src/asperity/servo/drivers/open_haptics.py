"""Devices of 3D Systems (Touch, Touch X, Omni, Premium), by libHD of OpenHaptics.

Millimetres and newtons; x to the right, y up, z towards the user. libHD has a scheduler, a thread
of its own that calls back 1000 times a second, and allows a frame only there: the compiled
:func:`~asperity.servo.kernels.open_haptics.haptic_frame` runs in it; the loop exchanges with it.
"""

from __future__ import annotations

import ctypes
import time
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar

import numpy as np

from asperity.errors import ParameterError
from asperity.kernels.fuse import fuse_module
from asperity.servo.drivers.driver import RIGHT, TOWARDS, UP, DriverKind, Frame, frame_of
from asperity.servo.drivers.exchanged import ExchangedDriver, new_slot, wait_for_a_place
from asperity.servo.drivers.library import functions, load_library
from asperity.servo.kernels import open_haptics, slot
from asperity.servo.kernels.exchanged import ExchangedDevice
from asperity.servo.kernels.open_haptics import BEGIN, FRAMES, HANDLE, SELF
from asperity.servo.kernels.slot import CODE, WORDS, Slot
from asperity.servo.loop import system_clock

AXES, MILLIMETRE = (RIGHT, UP, TOWARDS), 1e-3
LYING = frame_of(AXES, "lying", (0.0, 0.0, 0.0), MILLIMETRE)
LIBRARY = "ASPERITY_LIBHD"
"""Variable of the environment that may hold the path of the library."""
_NAMES = ("libHD.so", "libHD.so.3.4", "hd.dll")
_FRAME = ("hdBeginFrame", "hdEndFrame", "hdGetDoublev", "hdSetDoublev", "hdGetError")
_USED = (
    *_FRAME, "hdInitDevice", "hdDisableDevice", "hdEnable", "hdDisable", "hdCheckCalibration",
    "hdScheduleAsynchronous", "hdUnschedule", "hdStartScheduler", "hdStopScheduler",
    "hdGetErrorString",
)  # fmt: skip
# Of hdDefines.h and hdScheduler.h.
_NO_HANDLE = 0xFFFFFFFF
_FORCE_OUTPUT = 0x4000
_CALIBRATED = 0x5000
_FIRST = 0xFFFF  # the greatest priority of a callback
_CLOSED = -1  # what the slot says once the device is let go
_LET_GO = 0.05  # [s] that the scheduler may take to hold no force


class _Error(ctypes.Structure):
    """``HDErrorInfo``."""

    _fields_: ClassVar[Any] = [
        ("code", ctypes.c_uint), ("internal", ctypes.c_int), ("device", ctypes.c_uint)
    ]  # fmt: skip


@dataclass
class OpenHapticsDriver(ExchangedDriver):
    """A device of 3D Systems.

    Attributes:
        device: its name in the vendor's setup, "Left Device"; empty for the default one.
    """

    name: ClassVar[str] = "openhaptics"
    when_lost: ClassVar[str] = (
        "Nobody tells the device then: count on its holding the last force, and pull the plug."
    )

    placed: Frame = LYING
    device: str = ""
    _slot: Slot = field(default_factory=new_slot, init=False, repr=False)
    _handle: int = field(default=_NO_HANDLE, init=False, repr=False)
    _scheduled: int = field(default=0, init=False, repr=False)
    _callback: Any = field(default=None, init=False, repr=False)

    def open(self) -> ExchangedDevice:
        """Open the device, start the scheduler, and wait for the first frame."""
        library = _library()
        self._callback = _callback()
        self._handle = library.hdInitDevice(self.device.encode() or None)
        said = _said(library)
        if said or self._handle == _NO_HANDLE:
            which = self.device or "the default device"
            raise ParameterError("driver", f"cannot open {which}: {said or 'no reason given'}")
        self._slot = self._new_slot(library)
        library.hdEnable(_FORCE_OUTPUT)
        memory = self._slot.words.ctypes.data
        self._scheduled = library.hdScheduleAsynchronous(self._callback.address, memory, _FIRST)
        library.hdStartScheduler()
        try:
            wait_for_a_place(self._slot, lambda: self._wrong(library))
            if library.hdCheckCalibration() != _CALIBRATED:
                words = "finds the device not calibrated: put the stylus into its inkwell, or run"
                raise ParameterError("driver", f"{words} the vendor's setup")
        except ParameterError:
            self.close()
            raise
        return self.record(self._slot)

    def close(self) -> None:
        """Hold no force, stop the scheduler, and let go of the device."""
        library = _library()
        words = self._slot.words
        words[CODE] = words[CODE] or _CLOSED
        done, end = words[FRAMES], time.monotonic() + _LET_GO
        while words[FRAMES] < done + 2 and time.monotonic() < end:
            time.sleep(1e-3)
        library.hdDisable(_FORCE_OUTPUT)
        library.hdStopScheduler()
        library.hdUnschedule(self._scheduled)
        library.hdDisableDevice(self._handle)

    def explain(self, code: int) -> str:
        """Return what libHD says of an error."""
        if code in {slot.STALE, slot.SILENT}:
            return super().explain(code)
        return f"libHD: {_words(_library(), code)} (0x{code:04x})"

    def _new_slot(self, library: ctypes.CDLL) -> Slot:
        """Return a slot with what the callback needs."""
        made = new_slot(self.patience)
        addresses = [*functions(library, *_FRAME), system_clock().gettime]
        made.words[BEGIN : BEGIN + len(addresses)] = addresses
        made.words[HANDLE], made.words[SELF] = self._handle, made.words.ctypes.data
        return made

    def _wrong(self, library: ctypes.CDLL) -> str:
        code = int(self._slot.words[CODE])
        return _words(library, code) if code else _said(library)


@cache
def _callback() -> Any:
    """Return the callback of the scheduler, compiled: no interpreter runs in its thread."""
    from numba import carray, cfunc, types  # type: ignore[attr-defined]  # it has no stubs

    frame = fuse_module(open_haptics, slot).haptic_frame

    @cfunc(types.uint32(types.voidptr))
    def callback(memory: Any) -> Any:
        words = carray(memory, (WORDS,), np.int64)
        return frame(words, carray(memory, (WORDS,), np.float64))

    return callback


def _library() -> ctypes.CDLL:
    install = "the Touch driver and OpenHaptics (support.3dsystems.com)"
    library = load_library(_NAMES, LIBRARY, install)
    functions(library, *_USED)
    library.hdInitDevice.restype = ctypes.c_uint
    library.hdInitDevice.argtypes = [ctypes.c_char_p]
    library.hdGetError.restype = _Error
    library.hdGetErrorString.restype = ctypes.c_char_p
    library.hdCheckCalibration.restype = ctypes.c_uint
    library.hdScheduleAsynchronous.restype = ctypes.c_ulong
    library.hdScheduleAsynchronous.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ushort]
    library.hdUnschedule.argtypes = [ctypes.c_ulong]
    for name in ("hdDisableDevice", "hdEnable", "hdDisable"):
        getattr(library, name).argtypes = [ctypes.c_uint]
    return library


def _said(library: ctypes.CDLL) -> str:
    """Return the last error in words, or nothing."""
    code = int(library.hdGetError().code)
    return _words(library, code) if code else ""


def _words(library: ctypes.CDLL, code: int) -> str:
    return (library.hdGetErrorString(code) or b"no reason given").decode(errors="replace")


KIND = DriverKind(
    "openhaptics", AXES, MILLIMETRE,
    lambda text, frame: OpenHapticsDriver(device=text, placed=frame), "openhaptics:Left Device",
)  # fmt: skip
