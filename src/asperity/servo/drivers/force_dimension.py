"""Devices of Force Dimension (omega, delta, sigma, lambda) and the Falcon, by libdhd.

Metres and newtons; x towards the user, y to the user's right, z up. The C functions that the loop
calls return 0 or a notice: 1 for a reading too soon after the last one, 2 for a saturated motor.
Errors are negative.
"""

# ruff: noqa: ARG001 - one signature for every device

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from asperity.core.compiled import FloatArray, Kernels, call_address, local_array
from asperity.core.errors import ParameterError
from asperity.core.platform.system import LibraryNames, System
from asperity.servo import driver
from asperity.servo.driver import RIGHT, TOWARDS, UP, Driver, DriverKind
from asperity.servo.drivers.library import function_addresses, load_library

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))

LIBRARY = "ASPERITY_LIBDHD"
"""Environment variable of the path of the library."""
WATCHDOG = 255
"""Time without a command after which compatible devices disable their force [125 µs]: the longest.

The loop ends before, when it is late for 20 ms.
"""
_LIBRARY_NAMES: LibraryNames = {
    System.LINUX: ("libdhd.so.3", "libdhd.so"),
    System.WINDOWS: ("dhd64.dll",),
    System.MACOS: ("libdhd.dylib",),
}
_FUNCTIONS = (
    "dhdGetDeviceCount",
    "dhdOpenID",
    "dhdEnableForce",
    "dhdClose",
    "dhdErrorGetLastStr",
    "dhdGetPosition",
    "dhdSetForce",
)


class ForceDimensionDevice(NamedTuple):
    """An open device.

    Attributes:
        get_position: address of ``int dhdGetPosition(double *x, double *y, double *z, char id)``.
        set_force: address of ``int dhdSetForce(double x, double y, double z, char id)``.
        number: id of the device.
    """

    get_position: int
    set_force: int
    number: int


def device_read(position: FloatArray, device: ForceDimensionDevice) -> int:
    """Read the position by libdhd; see ``interface``."""
    x = local_array((1,))
    y = local_array((1,))
    z = local_array((1,))
    answer = call_address(device.get_position, x, y, z, device.number)
    position[0] = x[0]
    position[1] = y[0]
    position[2] = z[0]
    return min(answer, 0)


def device_write(
    fx: float, fy: float, fz: float, in_contact: bool, device: ForceDimensionDevice
) -> int:
    """Command a force by libdhd; see ``interface``."""
    return min(call_address(device.set_force, fx, fy, fz, device.number), 0)


@dataclass
class ForceDimensionDriver(Driver):
    """A device of Force Dimension.

    Attributes:
        number: number of the device among the connected ones, from 0; ``None`` for the only one.
        surface_frame: pose of the surface.
    """

    name: ClassVar[str] = "forcedimension"
    can_reopen: ClassVar[bool] = True
    loss_notice: ClassVar[str] = (
        "The device receives no further commands and may hold the last force: cut it with the force"
        " switch."
    )

    number: int | None = None
    surface_frame: driver.Frame = driver.IDENTITY_FRAME
    _device_id: int = field(default=-1, init=False, repr=False)

    @property
    def device_name(self) -> str:
        """Name of the device for its lock."""
        return str(self.number or 0)

    def placeholder_record(self) -> ForceDimensionDevice:
        """Return a record of no device."""
        return ForceDimensionDevice(0, 0, 0)

    def check_library(self) -> None:
        """Load the library."""
        _library()

    def open(self) -> ForceDimensionDevice:
        """Open the device and enable its force."""
        library = _library()
        *_others, get_position, set_force = function_addresses(library, *_FUNCTIONS)
        number = self._choose_device(library.dhdGetDeviceCount())
        opened = library.dhdOpenID(number)
        if opened < 0:
            raise ParameterError("driver", f"cannot open device {number}: {_last_error(library)}")
        if library.dhdEnableForce(1, opened) < 0:
            library.dhdClose(opened)
            raise ParameterError("driver", f"cannot switch the force on: {_last_error(library)}")
        self._device_id = opened
        _set_watchdog(library, WATCHDOG, opened)
        return ForceDimensionDevice(get_position, set_force, opened)

    def _choose_device(self, count: int) -> int:
        if count < 1:
            raise ParameterError("driver", "finds no device of Force Dimension: is it switched on?")
        if self.number is None and count > 1:
            numbers = ", ".join(f"forcedimension:{number}" for number in range(count))
            raise ParameterError("driver", f"finds {count} devices: choose one, {numbers}")
        if (self.number or 0) >= count:
            raise ParameterError("driver", f"finds {count} devices, from 0 on", self.number)
        return self.number or 0

    def close(self) -> None:
        """Disable the force and close the device."""
        library = _library()
        set_force = library.dhdSetForce
        set_force.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
        set_force(0.0, 0.0, 0.0, self._device_id)
        library.dhdEnableForce(0, self._device_id)
        _set_watchdog(library, 0, self._device_id)
        library.dhdClose(self._device_id)

    def describe_error(self, code: int) -> str:
        """Return the last error of libdhd."""
        return f"libdhd: {_last_error(_library())} ({code})"


def _set_watchdog(library: ctypes.CDLL, duration: int, device: int) -> None:
    """Set the watchdog, where library and device have one; 0 for none."""
    if hasattr(library, "dhdSetWatchdog"):
        library.dhdSetWatchdog.argtypes = [ctypes.c_ubyte, ctypes.c_byte]
        library.dhdSetWatchdog(duration, device)


def _library() -> ctypes.CDLL:
    return load_library(
        _LIBRARY_NAMES, LIBRARY, "install the SDK of Force Dimension (forcedimension.com)"
    )


def _last_error(library: ctypes.CDLL) -> str:
    library.dhdErrorGetLastStr.restype = ctypes.c_char_p
    return (library.dhdErrorGetLastStr() or b"no reason given").decode(errors="replace")


def _create_driver(text: str, frame: driver.Frame) -> ForceDimensionDriver:
    if text and not text.isdecimal():
        raise ParameterError("driver", "must have a number after the colon, from 0", text)
    return ForceDimensionDriver(int(text) if text else None, frame)


KIND = DriverKind("forcedimension", (TOWARDS, RIGHT, UP), 1.0, _create_driver, "forcedimension:1")
