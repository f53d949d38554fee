"""A device by two C functions: ``read(double position[3])`` and ``write(force[3], contact)``."""

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.native import call_address

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))


class AddressedDevice(NamedTuple):
    """The addresses of a driver's functions; both return 0 where nothing went wrong.

    Attributes:
        read: of ``int read(double position[3])``.
        write: of ``int write(const double force[3], int contact)``.
    """

    read: int
    write: int


def device_read(place: FloatArray, device: AddressedDevice) -> int:
    """Ask the driver; see ``device_functions``."""
    return call_address(device.read, place)


def device_write(fx: float, fy: float, fz: float, inside: bool, device: AddressedDevice) -> int:
    """Tell the driver; see ``device_functions``."""
    force = local_array((3,))
    force[0] = fx
    force[1] = fy
    force[2] = fz
    return call_address(device.write, force, inside)
