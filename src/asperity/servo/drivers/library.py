"""Shared libraries of vendors, and the driver of a user-defined one.

A user-defined device is a shared library with four C functions, see ``examples/own_device.c``. The
loop calls two of them: ``read(double position[3])`` and ``write(force[3], contact)``.

Metres and newtons; x to the right, y away from the user, z up.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, NamedTuple

from asperity.core.compiled import FloatArray, Kernels, call_address, local_array
from asperity.core.errors import ParameterError
from asperity.core.platform.system import LibraryNames, find_system, library_file
from asperity.servo.driver import AWAY, IDENTITY_FRAME, RIGHT, UP, Driver, DriverKind, Frame

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))

_WRONG_ARCHITECTURE = (
    "wrong elf class",
    "invalid elf header",
    "incompatible architecture",
    "exec format",
)


def load_library(names: Sequence[str] | LibraryNames, variable: str, install: str) -> ctypes.CDLL:
    """Return a shared library.

    Args:
        names: possible names or the path of it, or possible names by system.
        variable: environment variable of its path, which takes precedence.
        install: what to do if it is missing.

    Raises:
        ParameterError: if it is not found, damaged, or built for another machine.
    """
    path = os.environ.get(variable)
    if isinstance(names, Mapping):
        names = names.get(find_system(), ())
    reasons = {}
    for name in [path] if path else names:
        try:
            return ctypes.CDLL(library_file(name))
        except OSError as error:
            reasons[name] = str(error)
    for name, reason in reasons.items():
        is_there = os.path.dirname(name) and Path(name).is_file()
        if is_there or any(sign in reason.lower() for sign in _WRONG_ARCHITECTURE):
            raise ParameterError(
                "driver", f"finds a library that does not load (is it for this machine?): {reason}"
            )
    tried = path or " or ".join(names)
    elsewhere = f", or name the file in {variable}" if variable else ""
    raise ParameterError("driver", f"needs {tried}, which is not found: {install}{elsewhere}")


def function_addresses(library: ctypes.CDLL, *names: str) -> list[int]:
    """Return the addresses of functions.

    Raises:
        ParameterError: for a missing function, with its name.
    """
    addresses = []
    for name in names:
        if not hasattr(library, name):
            raise ParameterError("driver", f"{library._name} has no function {name}")
        pointer = ctypes.cast(getattr(library, name), ctypes.c_void_p)
        addresses.append(int(pointer.value or 0))
    return addresses


FUNCTIONS = ("asperity_open", "asperity_read", "asperity_write", "asperity_close")


class LibraryDevice(NamedTuple):
    """The addresses of a library's functions; both return 0 if there is no error.

    Attributes:
        read: address of ``int read(double position[3])``.
        write: address of ``int write(const double force[3], int contact)``.
    """

    read: int
    write: int


def device_read(position: FloatArray, device: LibraryDevice) -> int:
    """Read the position by the library; see ``interface``."""
    return call_address(device.read, position)


def device_write(fx: float, fy: float, fz: float, in_contact: bool, device: LibraryDevice) -> int:
    """Command a force by the library; see ``interface``."""
    force = local_array((3,))
    force[0] = fx
    force[1] = fy
    force[2] = fz
    return call_address(device.write, force, in_contact)


@dataclass(frozen=True)
class LibraryDriver(Driver):
    """A device that a shared library drives.

    Attributes:
        path: path of the library.
        surface_frame: pose of the surface.
    """

    name: ClassVar[str] = "own"
    loss_notice: ClassVar[str] = "What the device does then depends on its library: see its C file."

    path: str
    surface_frame: Frame = IDENTITY_FRAME

    @property
    def device_name(self) -> str:
        """Name of the device for its lock."""
        return str(Path(self.path).resolve())

    def placeholder_record(self) -> LibraryDevice:
        """Return a record of no device."""
        return LibraryDevice(0, 0)

    def check_library(self) -> None:
        """Load the library."""
        self._load()

    def open(self) -> LibraryDevice:
        """Load the library and open the device."""
        library = self._load()
        _open, read, write, _close = function_addresses(library, *FUNCTIONS)
        answer = library.asperity_open()
        if answer != 0:
            raise ParameterError("driver", f"{self.path}: asperity_open returned {answer}, not 0")
        return LibraryDevice(read, write)

    def close(self) -> None:
        """Close the device."""
        self._load().asperity_close()

    def describe_error(self, code: int) -> str:
        """Return the error code of the library."""
        return f"{Path(self.path).name} returned {code}"

    def _load(self) -> ctypes.CDLL:
        # The system takes a name for a path only if it contains a slash.
        return load_library([str(Path(self.path).resolve())], "", "compile your C file")


KIND = DriverKind("own", (RIGHT, AWAY, UP), 1.0, LibraryDriver, "own:./device.so")
