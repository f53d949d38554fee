"""A device of Force Dimension, by the C functions of libdhd.

They return 0 or a notice: 1 for a reading too soon after the last one, 2 for a saturated motor.
Errors are negative.
"""

# ruff: noqa: ARG001 - one signature for every device

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels, call_address, local_array

KERNELS = Kernels(provides=("device_read", "device_write"), native=("call_address",))


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
