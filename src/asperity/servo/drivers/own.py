"""A device of a user's own: a shared library with four C functions, see ``examples/own_device.c``.

Metres and newtons; x to the right, y away from the user, z up.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import ClassVar

from asperity.errors import ParameterError
from asperity.servo.drivers.driver import AWAY, RIGHT, UNTURNED, UP, Driver, DriverKind, Frame
from asperity.servo.drivers.library import functions, load_library
from asperity.servo.kernels import by_address
from asperity.servo.kernels.by_address import AddressedDevice

FUNCTIONS = ("asperity_open", "asperity_read", "asperity_write", "asperity_close")


@dataclass(frozen=True)
class OwnDriver(Driver):
    """A device that a shared library drives.

    Attributes:
        path: of the library.
        placed: where the surface lies.
    """

    name: ClassVar[str] = "own"
    when_lost: ClassVar[str] = "What your device does then is in your hands: see its C file."

    path: str
    placed: Frame = UNTURNED

    @property
    def frame(self) -> Frame:
        """Where the surface lies in the device's frame."""
        return self.placed

    def kernels(self) -> tuple[ModuleType, ...]:
        """Return what calls the two functions."""
        return (by_address,)

    def blank(self) -> AddressedDevice:
        """Return a record of no device."""
        return AddressedDevice(0, 0)

    def open(self) -> AddressedDevice:
        """Load the library and open the device."""
        library = self._library()
        _open, read, write, _close = functions(library, *FUNCTIONS)
        answer = library.asperity_open()
        if answer != 0:
            raise ParameterError("driver", f"{self.path}: asperity_open returned {answer}, not 0")
        return AddressedDevice(read, write)

    def close(self) -> None:
        """Close the device."""
        self._library().asperity_close()

    def explain(self, code: int) -> str:
        """Return which number its functions returned."""
        return f"{Path(self.path).name} returned {code}"

    def _library(self) -> ctypes.CDLL:
        # The system knows a library by its path only if that has a slash.
        return load_library([str(Path(self.path).resolve())], "", "it: compile your C file")


KIND = DriverKind("own", (RIGHT, AWAY, UP), 1.0, OwnDriver, "own:./device.so")
