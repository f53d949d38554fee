"""The drivers of real devices by name."""

from __future__ import annotations

from asperity.core.errors import ParameterError, suggest_names
from asperity.devices import Device
from asperity.servo.driver import Driver, DriverKind, Vector, surface_frame
from asperity.servo.drivers import force_dimension, haply, library, open_haptics

DEVICE_DRIVER = "real"
"""Name of the driver in the device's entry."""
DRIVER_KINDS: dict[str, DriverKind] = {
    module.KIND.name: module.KIND for module in (haply, force_dimension, open_haptics, library)
}
_OTHER_DRIVERS = ("simulated", "replay:run.mcap", DEVICE_DRIVER)
_LIBRARY_SUFFIXES = (".so", ".dylib", ".dll")


def register_driver(kind: DriverKind) -> DriverKind:
    """Register a user-defined driver, for the command line and device files.

    Raises:
        ParameterError: for a name that is taken.
    """
    if DRIVER_KINDS.setdefault(kind.name, kind) is not kind:
        raise ParameterError("driver", "is registered already", kind.name)
    return kind


def find_driver(text: str, device: Device | None = None) -> tuple[DriverKind, str]:
    """Return the kind of a real device's driver, and its argument.

    Args:
        text: a name, with an argument after a colon (``forcedimension:1``, ``haply:049D``); the
            path of a shared library; or ``real`` for the driver in the device's entry.
        device: device whose entry applies.

    Raises:
        ParameterError: for any other text.
    """
    if text.lower() == DEVICE_DRIVER:
        text = _driver_of_device(device)
    if text.lower().endswith(_LIBRARY_SUFFIXES) and not text.startswith("own:"):
        text = f"own:{text}"
    name, _colon, argument = text.partition(":")
    kind = DRIVER_KINDS.get(name.lower())
    if kind is None:
        choices = [*_OTHER_DRIVERS, *(known.example for known in DRIVER_KINDS.values())]
        raise ParameterError("driver", f"is unknown: {text!r}; {suggest_names(name, choices)}")
    return kind, argument


def hardware_driver(text: str, wall: str, origin: Vector, device: Device | None = None) -> Driver:
    """Return the driver of a real device.

    Args:
        text: the driver, as :func:`find_driver` takes it.
        wall: orientation of the surface, "lying" or "standing".
        origin: origin of the surface, in the device's axes [m].
        device: device whose entry applies.

    Raises:
        ParameterError: for an unknown driver.
    """
    kind, argument = find_driver(text, device)
    return kind.create(argument, surface_frame(kind.axes, wall, origin, kind.unit))


def _driver_of_device(device: Device | None) -> str:
    if device is None or not device.driver:
        reason = "no device is given" if device is None else f"{device.id} names none"
        examples = ", ".join(kind.example for kind in DRIVER_KINDS.values())
        raise ParameterError(
            "driver", f"of the device is not known, {reason}: choose from {examples}"
        )
    return device.driver
