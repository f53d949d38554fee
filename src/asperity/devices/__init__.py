"""Catalogue of real devices, with a source for every number."""

from asperity.devices.device import FIELD_TABLE, FIELD_UNITS, Datum, Device, WallTest
from asperity.devices.device_file import (
    DeviceLike,
    device_names,
    load_device,
    override_device,
    parse_device,
)

__all__ = [
    "FIELD_TABLE",
    "FIELD_UNITS",
    "Datum",
    "Device",
    "DeviceLike",
    "WallTest",
    "device_names",
    "load_device",
    "override_device",
    "parse_device",
]
