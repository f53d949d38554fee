"""Devices of Force Dimension (omega, delta, sigma, lambda) and the Falcon, by libdhd.

Metres and newtons; x towards the user, y to his right, z up.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field
from types import ModuleType
from typing import ClassVar

from asperity.errors import ParameterError
from asperity.servo.drivers.driver import RIGHT, TOWARDS, UNTURNED, UP, Driver, DriverKind, Frame
from asperity.servo.drivers.library import functions, load_library
from asperity.servo.kernels import force_dimension
from asperity.servo.kernels.force_dimension import ForceDimensionDevice

LIBRARY = "ASPERITY_LIBDHD"
"""Variable of the environment that may hold the path of the library."""
_NAMES = ("libdhd.so.3", "libdhd.so", "dhd64.dll")
_USED = (
    "dhdGetDeviceCount", "dhdOpenID", "dhdEnableForce", "dhdClose", "dhdErrorGetLastStr",
    "dhdGetPosition", "dhdSetForce",
)  # fmt: skip


@dataclass
class ForceDimensionDriver(Driver):
    """A device of Force Dimension.

    Attributes:
        number: of the device among those that are connected, from 0; ``None`` for the only one.
        placed: where the surface lies.
    """

    name: ClassVar[str] = "forcedimension"
    when_lost: ClassVar[str] = (
        "Nobody tells the device then: count on its holding the last force, and cut it with the"
        " force switch."
    )

    number: int | None = None
    placed: Frame = UNTURNED
    _opened: int = field(default=-1, init=False, repr=False)

    @property
    def frame(self) -> Frame:
        """Where the surface lies in the device's frame."""
        return self.placed

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return what calls libdhd."""
        return (force_dimension,)

    def blank(self) -> ForceDimensionDevice:
        """Return a record of no device."""
        return ForceDimensionDevice(0, 0, 0)

    def open(self) -> ForceDimensionDevice:
        """Open the device and switch its force on."""
        library = _library()
        *_others, get_position, set_force = functions(library, *_USED)
        number = self._chosen(library.dhdGetDeviceCount())
        opened = library.dhdOpenID(number)
        if opened < 0:
            raise ParameterError("driver", f"cannot open device {number}: {_said(library)}")
        if library.dhdEnableForce(1, opened) < 0:
            library.dhdClose(opened)
            raise ParameterError("driver", f"cannot switch the force on: {_said(library)}")
        self._opened = opened
        return ForceDimensionDevice(get_position, set_force, opened)

    def _chosen(self, count: int) -> int:
        if count < 1:
            raise ParameterError("driver", "finds no device of Force Dimension: is it switched on?")
        if self.number is None and count > 1:
            numbers = ", ".join(f"forcedimension:{number}" for number in range(count))
            raise ParameterError("driver", f"finds {count} devices: choose one, {numbers}")
        if (self.number or 0) >= count:
            raise ParameterError("driver", f"finds {count} devices, from 0 on", self.number)
        return self.number or 0

    def close(self) -> None:
        """Switch the force off and close the device."""
        library = _library()
        set_force = library.dhdSetForce
        set_force.argtypes = [ctypes.c_double] * 3 + [ctypes.c_byte]
        set_force(0.0, 0.0, 0.0, self._opened)
        library.dhdEnableForce(0, self._opened)
        library.dhdClose(self._opened)

    def explain(self, code: int) -> str:
        """Return what libdhd says of its last error."""
        return f"libdhd: {_said(_library())} ({code})"


def _library() -> ctypes.CDLL:
    return load_library(_NAMES, LIBRARY, "the SDK of Force Dimension (forcedimension.com)")


def _said(library: ctypes.CDLL) -> str:
    library.dhdErrorGetLastStr.restype = ctypes.c_char_p
    return (library.dhdErrorGetLastStr() or b"no reason given").decode(errors="replace")


def _numbered(text: str, frame: Frame) -> ForceDimensionDriver:
    if text and not text.isdecimal():
        raise ParameterError("driver", "must have a number after the colon, from 0", text)
    return ForceDimensionDriver(int(text) if text else None, frame)


KIND = DriverKind("forcedimension", (TOWARDS, RIGHT, UP), 1.0, _numbered, "forcedimension:1")
