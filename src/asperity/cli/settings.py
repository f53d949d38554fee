"""``--set NAME=VALUE``: any parameter of a law, and any field of the device."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import click

from asperity.devices import FIELDS, Device, changed_device
from asperity.errors import ParameterError, nearest_names
from asperity.laws import known_arguments

_DEVICE = "device."


@dataclass(frozen=True)
class Settings:
    """What ``--set`` says.

    Attributes:
        law: parameters of laws by name [SI].
        device: fields of the device by name, as text with units.
    """

    law: Mapping[str, Any] = field(default_factory=dict)
    device: Mapping[str, str] = field(default_factory=dict)

    def changed(self, device: Device) -> Device:
        """Return the device with the fields that were set."""
        return changed_device(device, self.device) if self.device else device


def read_settings(_ctx: click.Context, _option: click.Parameter, texts: Sequence[str]) -> Settings:
    """Return what several ``--set`` say together.

    A law's parameter comes before a device's field of the same name: "device.friction=80mN" is
    the field.

    Raises:
        ParameterError: for a name that is unknown (the nearest are offered), a value that is
            none, or two that contradict each other.
    """
    law: dict[str, Any] = {}
    device: dict[str, str] = {}
    said: dict[tuple[bool, str], str] = {}
    parameters = known_arguments()
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals:
            raise ParameterError("set", "must be NAME=VALUE", text)
        name = name.strip().replace("-", "_")
        of_device = name.startswith(_DEVICE) or (name not in parameters and name in FIELDS)
        name = name.removeprefix(_DEVICE)
        if name not in (FIELDS if of_device else parameters):
            words = f"names {name!r}, which is a parameter of no law and no field of a device"
            hint = nearest_names(name, [*parameters, *FIELDS])
            raise ParameterError("set", f"{words}; {hint}")
        before = said.setdefault((of_device, name), text)
        if before is not text:
            raise ParameterError("set", f"is given twice for {name}: {before!r} and {text!r}")
        if of_device:
            device[name] = value.strip()
        else:
            law[name] = parameters[name].read(value)
    return Settings(law, device)


set_option = click.option(
    "--set",
    "settings",
    metavar="NAME=VALUE",
    multiple=True,
    callback=read_settings,
    help="Parameter of a law, also of your own, 'gain=2.5', or field of the device,"
    " 'max_stiffness=1500N/m', 'device.friction=80mN'; more by repeating it.",
)
