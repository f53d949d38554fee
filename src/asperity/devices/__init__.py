"""Real devices, as data with a source for every number."""

from asperity.devices.device import FIELD_TABLE, FIELDS, Datum, Device, Field, WallTest
from asperity.devices.reading import changed_device, device_names, load_device, parse_device

__all__ = [
    "FIELDS",
    "FIELD_TABLE",
    "Datum",
    "Device",
    "Field",
    "WallTest",
    "changed_device",
    "device_names",
    "load_device",
    "parse_device",
]
