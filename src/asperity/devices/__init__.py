"""Real devices, as data with a source for every number."""

from asperity.devices.device import Datum, Device
from asperity.devices.fields import FIELD_TABLE, FIELDS, Field
from asperity.devices.reading import device_names, load_device, parse_device

__all__ = [
    "FIELDS",
    "FIELD_TABLE",
    "Datum",
    "Device",
    "Field",
    "device_names",
    "load_device",
    "parse_device",
]
