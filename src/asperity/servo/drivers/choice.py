"""The driver that a word on the command line names."""

from __future__ import annotations

from asperity.errors import ParameterError, nearest_names
from asperity.servo.drivers.driver import AWAY, RIGHT, TOWARDS, UP, Driver, Vector, frame_of
from asperity.servo.drivers.force_dimension import ForceDimensionDriver
from asperity.servo.drivers.own import OwnDriver

NAMES = ("simulated", "replay:run.mcap", "forcedimension", "a library of your own, ./device.so")
_LIBRARIES = (".so", ".dylib", ".dll")


def hardware_driver(text: str, wall: str, origin: Vector) -> Driver:
    """Return the driver of a real device.

    Args:
        text: ``forcedimension``, ``forcedimension:1`` for the second device, or the path of a
            shared library.
        wall: how the surface lies, "lying" or "standing".
        origin: of the surface, in the device's axes [m].

    Raises:
        ParameterError: for another text.
    """
    if text.lower().endswith(_LIBRARIES):
        return OwnDriver(text, frame_of((RIGHT, AWAY, UP), wall, origin, 1.0))
    name, _colon, number = text.lower().partition(":")
    if name != "forcedimension":
        hint = nearest_names(name, NAMES)
        raise ParameterError("driver", f"is unknown: {text!r}; {hint}")
    if number and not number.isdecimal():
        raise ParameterError("driver", "must have a number after the colon, from 0", text)
    frame = frame_of((TOWARDS, RIGHT, UP), wall, origin, 1.0)
    return ForceDimensionDriver(int(number) if number else None, frame)
