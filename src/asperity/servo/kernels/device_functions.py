"""What the compiled loop asks of a device: where its handle is, and to hold a force.

These are the interface alone: the module of a driver defines them, and the linker binds the calls
of the loop to the one that runs. ``device`` is the record (NamedTuple) that the module declares.
"""

from asperity.checks import FloatArray

# What both functions return where nothing went wrong.
FINE = 0


def device_read(place: FloatArray, device: object) -> int:
    """Write the position of the handle (3,), in the device's own frame and unit.

    Returns:
        ``FINE``, or a number of the driver's own for what went wrong.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def device_write(fx: float, fy: float, fz: float, inside: bool, device: object) -> int:
    """Command a force [N] in the device's own frame; devices with brakes switch them by inside.

    Returns:
        ``FINE``, or a number of the driver's own for what went wrong.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it
