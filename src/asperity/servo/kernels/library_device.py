"""A device by two C functions: ``read(double position[3])`` and ``write(force[3], contact)``."""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels, call_address, local_array

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))


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
