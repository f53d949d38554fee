"""The drivers of real devices, and the one that a word on the command line names."""

from __future__ import annotations

from asperity.devices import Device
from asperity.errors import ParameterError, nearest_names
from asperity.servo.drivers import force_dimension, haply, open_haptics, own
from asperity.servo.drivers.driver import Driver, DriverKind, Vector, frame_of

REAL = "real"
"""The word for the driver that the device's entry names."""
KINDS: dict[str, DriverKind] = {
    module.KIND.name: module.KIND for module in (haply, force_dimension, open_haptics, own)
}
"""The drivers of real devices by name."""
_ELSEWHERE = ("simulated", "replay:run.mcap", REAL)
_LIBRARIES = (".so", ".dylib", ".dll")


def register(kind: DriverKind) -> DriverKind:
    """Add a driver of your own; the command line and device files know it, too.

    Raises:
        ParameterError: for a name that is taken.
    """
    if KINDS.setdefault(kind.name, kind) is not kind:
        raise ParameterError("driver", "is registered already", kind.name)
    return kind


def hardware_driver(text: str, wall: str, origin: Vector, device: Device | None = None) -> Driver:
    """Return the driver of a real device.

    Args:
        text: a name, with more after a colon (``forcedimension:1``, ``haply:049D``); the path of a
            shared library; or ``real`` for what the device's entry names.
        wall: how the surface lies, "lying" or "standing".
        origin: of the surface, in the device's axes [m].
        device: whose entry counts.

    Raises:
        ParameterError: for another text.
    """
    if text.lower() == REAL:
        text = _named_by(device)
    if text.lower().endswith(_LIBRARIES) and not text.startswith("own:"):
        text = f"own:{text}"
    name, _colon, more = text.partition(":")
    kind = KINDS.get(name.lower())
    if kind is None:
        choices = [*_ELSEWHERE, *(known.example for known in KINDS.values())]
        raise ParameterError("driver", f"is unknown: {text!r}; {nearest_names(name, choices)}")
    return kind.make(more, frame_of(kind.axes, wall, origin, kind.unit))


def _named_by(device: Device | None) -> str:
    if device is None or not device.driver:
        who = "no device is given" if device is None else f"{device.id} names none"
        known = ", ".join(kind.example for kind in KINDS.values())
        raise ParameterError("driver", f"of the device is not known, {who}: choose from {known}")
    return device.driver
