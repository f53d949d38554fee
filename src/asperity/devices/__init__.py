"""Real devices, as data with a source for every number."""

from asperity.devices.device import Datum, Device, device_names, load_device, parse_device

__all__ = ["Datum", "Device", "device_names", "load_device", "parse_device"]
