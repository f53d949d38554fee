"""A device of Force Dimension, by the C functions of libdhd.

They return 0, or what is no error: 1 where a reading is asked for too soon after the last one, 2
where a motor is saturated. Errors are negative.
"""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.native import call_address

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))


class ForceDimensionDevice(NamedTuple):
    """An open device.

    Attributes:
        get_position: address of ``int dhdGetPosition(double *x, double *y, double *z, char id)``.
        set_force: address of ``int dhdSetForce(double x, double y, double z, char id)``.
        number: of the device, the id.
    """

    get_position: int
    set_force: int
    number: int


def device_read(place: FloatArray, device: ForceDimensionDevice) -> int:
    """Ask libdhd; see ``device_functions``."""
    x = local_array((1,))
    y = local_array((1,))
    z = local_array((1,))
    answer = call_address(device.get_position, x, y, z, device.number)
    place[0] = x[0]
    place[1] = y[0]
    place[2] = z[0]
    return min(answer, 0)


def device_write(
    fx: float, fy: float, fz: float, inside: bool, device: ForceDimensionDevice
) -> int:
    """Tell libdhd; see ``device_functions``."""
    return min(call_address(device.set_force, fx, fy, fz, device.number), 0)
