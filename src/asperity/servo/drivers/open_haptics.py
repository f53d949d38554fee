"""Devices of 3D Systems (Touch, Touch X, Omni, Premium), by libHD of OpenHaptics.

Millimetres and newtons; x to the right, y up, z towards the user. libHD allows one frame per tick
of its scheduler, in the scheduler's thread, which calls back 1000 times a second: the compiled
:func:`~asperity.servo.drivers.open_haptics.haptic_frame` runs there, and the loop exchanges with it
through a ring buffer.
"""

from __future__ import annotations

import ctypes
import sys
import time
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar

import numpy as np

from asperity.core.compiled import (
    FloatArray,
    IntArray,
    Kernels,
    call_address,
    local_array,
    store_release,
)
from asperity.core.errors import ParameterError
from asperity.core.platform.clock_interface import UNIT, read_time
from asperity.core.platform.clocks import clock_module, system_clock
from asperity.core.platform.system import LibraryNames, System, find_system
from asperity.kernels.fuse import fuse_module
from asperity.servo.driver import RIGHT, TOWARDS, UP, DriverKind, Frame, surface_frame
from asperity.servo.drivers import threaded
from asperity.servo.drivers.library import function_addresses, load_library
from asperity.servo.drivers.threaded import (
    BUFFER_WORDS,
    DRIVER_WORDS,
    FAILURE_CODE,
    FORCE_TIMEOUT,
    FORCES,
    LOOP_SILENT,
    POSITIONS,
    RingBuffer,
    ThreadedDevice,
    ThreadedDriver,
    latest_row,
    new_ring_buffer,
    push_row,
    set_failure,
    wait_for_position,
)

KERNELS = Kernels(loops=("haptic_frame",), native=("call_address", "store_release"))

# Words of the driver: number of frames, addresses of functions, handle of the device, address of
# the ring buffer, the words of the clock, and the record of an error.
FRAMES, BEGIN_FRAME, END_FRAME, GET_DOUBLE, SET_DOUBLE = range(DRIVER_WORDS, DRIVER_WORDS + 5)
GET_ERROR, GETTIME, HANDLE, BUFFER_ADDRESS = range(DRIVER_WORDS + 5, DRIVER_WORDS + 9)
TIME = BUFFER_ADDRESS + 1  # and two more
RETURNS_BY_ADDRESS = TIME + 3
ERROR = RETURNS_BY_ADDRESS + 1  # and one more
# Constants of hdDefines.h and hdScheduler.h.
CURRENT_POSITION = 0x2050
CURRENT_FORCE = 0x2700
CALLBACK_CONTINUE = 1

AXES = (RIGHT, UP, TOWARDS)
MILLIMETRE = 1e-3
LYING_FRAME = surface_frame(AXES, "lying", (0.0, 0.0, 0.0), MILLIMETRE)
LIBRARY = "ASPERITY_LIBHD"
"""Environment variable of the path of the library."""
_LIBRARY_NAMES: LibraryNames = {
    System.LINUX: ("libHD.so", "libHD.so.3.4"),
    System.WINDOWS: ("hd.dll",),
    System.MACOS: ("/Library/Frameworks/HD.framework/HD",),
}
_FRAME_FUNCTIONS = ("hdBeginFrame", "hdEndFrame", "hdGetDoublev", "hdSetDoublev", "hdGetError")
_FUNCTIONS = (
    *_FRAME_FUNCTIONS,
    "hdInitDevice",
    "hdDisableDevice",
    "hdEnable",
    "hdDisable",
    "hdCheckCalibration",
    "hdScheduleAsynchronous",
    "hdUnschedule",
    "hdStartScheduler",
    "hdStopScheduler",
    "hdGetErrorString",
)
# Constants of hdDefines.h and hdScheduler.h.
_NO_HANDLE = 0xFFFFFFFF
_FORCE_OUTPUT = 0x4000
_CALIBRATED = 0x5000
_MAX_PRIORITY = 0xFFFF  # the greatest priority of a callback
_LOW_HALF = 0xFFFFFFFF  # of a word: the first number of a record
_CLOSED = -1  # failure code of a closed device
_RELEASE_TIMEOUT = 0.05  # [s] for the scheduler to release the force


def haptic_frame(words: IntArray, numbers: FloatArray) -> int:
    """Push the position of the handle, and apply the force of the loop.

    The force is zero after any failure, and if the loop does not renew it.
    ``hdGetError`` returns a record of 12 bytes, whose first number is the error: in a register, or
    on Windows in the memory whose address is passed.

    Args:
        words: words of the ring buffer.
        numbers: numbers of the ring buffer.

    Returns:
        The code for the scheduler to call again.
    """
    place = local_array((3,))
    force = local_array((3,))
    now = read_time(words[GETTIME], words[BUFFER_ADDRESS] + 8 * TIME, words, TIME)
    wanted = latest_row(words, numbers, FORCES)
    is_nonzero = wanted.x != 0.0 or wanted.y != 0.0 or wanted.z != 0.0
    if is_nonzero and now - wanted.time > words[FORCE_TIMEOUT]:
        set_failure(words, LOOP_SILENT)
    force[0] = 0.0
    force[1] = 0.0
    force[2] = 0.0
    if words[FAILURE_CODE] == 0 and wanted.time != 0:
        force[0] = wanted.x
        force[1] = wanted.y
        force[2] = wanted.z
    call_address(words[BEGIN_FRAME], words[HANDLE])
    call_address(words[GET_DOUBLE], CURRENT_POSITION, place)
    call_address(words[SET_DOUBLE], CURRENT_FORCE, force)
    call_address(words[END_FRAME], words[HANDLE])
    words[ERROR] = 0
    wrong = call_address(words[GET_ERROR], words[BUFFER_ADDRESS] + 8 * ERROR)
    if words[RETURNS_BY_ADDRESS] != 0:
        wrong = words[ERROR] & _LOW_HALF
    if wrong != 0:
        set_failure(words, wrong)
    else:
        push_row(words, numbers, POSITIONS, place[0], place[1], place[2], now)
    store_release(words, FRAMES, words[FRAMES] + 1)
    return CALLBACK_CONTINUE


class _ErrorInfo(ctypes.Structure):
    """``HDErrorInfo``."""

    _fields_: ClassVar[Any] = [
        ("code", ctypes.c_uint),
        ("internal", ctypes.c_int),
        ("device", ctypes.c_uint),
    ]


@dataclass
class OpenHapticsDriver(ThreadedDriver):
    """A device of 3D Systems.

    Attributes:
        device: name in the vendor's setup, "Left Device"; empty for the default one.
    """

    name: ClassVar[str] = "openhaptics"
    can_reopen: ClassVar[bool] = True
    loss_notice: ClassVar[str] = (
        "The device receives no further commands and may hold the last force: unplug the device."
    )

    surface_frame: Frame = LYING_FRAME
    device: str = ""
    _buffer: RingBuffer = field(default_factory=new_ring_buffer, init=False, repr=False)
    _handle: int = field(default=_NO_HANDLE, init=False, repr=False)
    _scheduled: int = field(default=0, init=False, repr=False)
    _callback: Any = field(default=None, init=False, repr=False)

    @property
    def device_name(self) -> str:
        """Name of the device for its lock."""
        return self.device

    def check_library(self) -> None:
        """Load the library."""
        _library()

    def open(self) -> ThreadedDevice:
        """Open the device, start the scheduler, and wait for the first frame."""
        library = _library()
        self._callback = _callback()
        self._handle = library.hdInitDevice(self.device.encode() or None)
        error = _last_error(library)
        if error or self._handle == _NO_HANDLE:
            which = self.device or "the default device"
            raise ParameterError("driver", f"cannot open {which}: {error or 'no reason given'}")
        self._buffer = self._create_buffer(library)
        library.hdEnable(_FORCE_OUTPUT)
        memory = self._buffer.words.ctypes.data
        self._scheduled = library.hdScheduleAsynchronous(
            self._callback.address, memory, _MAX_PRIORITY
        )
        library.hdStartScheduler()
        try:
            wait_for_position(self._buffer, lambda: self._failure(library))
            if library.hdCheckCalibration() != _CALIBRATED:
                words = "finds the device not calibrated: put the stylus into its inkwell, or run"
                raise ParameterError("driver", f"{words} the vendor's setup")
        except ParameterError:
            self.close()
            raise
        return self.device_record(self._buffer)

    def close(self) -> None:
        """Release the force, stop the scheduler, and close the device."""
        library = _library()
        words = self._buffer.words
        words[FAILURE_CODE] = words[FAILURE_CODE] or _CLOSED
        done = words[FRAMES]
        end = time.monotonic() + _RELEASE_TIMEOUT
        while words[FRAMES] < done + 2 and time.monotonic() < end:
            time.sleep(1e-3)
        library.hdDisable(_FORCE_OUTPUT)
        library.hdStopScheduler()
        library.hdUnschedule(self._scheduled)
        library.hdDisableDevice(self._handle)

    def describe_error(self, code: int) -> str:
        """Return an error of libHD in words."""
        if code in {threaded.STALE, LOOP_SILENT}:
            return super().describe_error(code)
        return f"libHD: {_error_text(_library(), code)} (0x{code:04x})"

    def _create_buffer(self, library: ctypes.CDLL) -> RingBuffer:
        """Return a ring buffer with the addresses that the callback needs."""
        buffer = new_ring_buffer(self.force_timeout)
        clock = system_clock()
        addresses = [*function_addresses(library, *_FRAME_FUNCTIONS), clock.gettime]
        words = buffer.words
        words[BEGIN_FRAME : BEGIN_FRAME + len(addresses)] = addresses
        words[HANDLE] = self._handle
        words[BUFFER_ADDRESS] = words.ctypes.data
        words[TIME + UNIT] = clock.words[UNIT]
        words[RETURNS_BY_ADDRESS] = find_system() is System.WINDOWS
        return buffer

    def _failure(self, library: ctypes.CDLL) -> str:
        code = int(self._buffer.words[FAILURE_CODE])
        return _error_text(library, code) if code else _last_error(library)


@cache
def _callback() -> Any:
    """Return the compiled callback of the scheduler: no interpreter runs in its thread."""
    from numba import carray, cfunc, types

    frame = fuse_module(sys.modules[__name__], threaded, clock_module()).haptic_frame

    @cfunc(types.uint32(types.voidptr))  # type: ignore[untyped-decorator]  # of Numba
    def callback(memory: Any) -> Any:
        words = carray(memory, (BUFFER_WORDS,), np.int64)
        return frame(words, carray(memory, (BUFFER_WORDS,), np.float64))

    return callback


def _library() -> ctypes.CDLL:
    library = load_library(
        _LIBRARY_NAMES, LIBRARY, "install the Touch driver and OpenHaptics (support.3dsystems.com)"
    )
    function_addresses(library, *_FUNCTIONS)
    library.hdInitDevice.restype = ctypes.c_uint
    library.hdInitDevice.argtypes = [ctypes.c_char_p]
    library.hdGetError.restype = _ErrorInfo
    library.hdGetErrorString.restype = ctypes.c_char_p
    library.hdCheckCalibration.restype = ctypes.c_uint
    library.hdScheduleAsynchronous.restype = ctypes.c_ulong
    library.hdScheduleAsynchronous.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_ushort]
    library.hdUnschedule.argtypes = [ctypes.c_ulong]
    for name in ("hdDisableDevice", "hdEnable", "hdDisable"):
        getattr(library, name).argtypes = [ctypes.c_uint]
    return library


def _last_error(library: ctypes.CDLL) -> str:
    """Return the last error in words; empty if there is none."""
    code = int(library.hdGetError().code)
    return _error_text(library, code) if code else ""


def _error_text(library: ctypes.CDLL, code: int) -> str:
    return (library.hdGetErrorString(code) or b"no reason given").decode(errors="replace")


def _create_driver(text: str, frame: Frame) -> OpenHapticsDriver:
    return OpenHapticsDriver(device=text, surface_frame=frame)


KIND = DriverKind("openhaptics", AXES, MILLIMETRE, _create_driver, "openhaptics:Left Device")
