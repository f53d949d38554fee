"""``asperity devices``: what is known of real devices, and from where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from asperity.cli.output import STANDARD_OUTPUT, check_output, write_output
from asperity.files import json_text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from asperity.devices import Device

SCHEMA = 1


@click.command("devices", short_help="List devices, and the source of every number.")
@click.argument("names", nargs=-1, metavar="[ID|FILE]...")
@click.option(
    "--json", "json_path", metavar="PATH", help="Write the list as JSON; - is standard output."
)
def devices_command(names: tuple[str, ...], json_path: str | None) -> None:
    """List the devices of the catalogue.

    Given an ID, or a device of your own as a TOML FILE, says everything that is known of it: each
    number with its unit, its source, and whether it was verified.
    """
    from asperity.devices import device_names, load_device

    check_output("json", json_path)
    devices = [load_device(name) for name in names or device_names()]
    if json_path is not None:
        content = {"schema": SCHEMA, "devices": devices}
        write_output("json", json_path, json_text(content))
    if json_path != STANDARD_OUTPUT:
        _print(devices, bool(names))


def _print(devices: Sequence[Device], in_detail: bool) -> None:
    from rich.console import Console

    from asperity.report.device_table import print_device, print_devices

    console = Console(highlight=False)
    if not in_detail:
        print_devices(devices, console)
        return
    for number, device in enumerate(devices):
        if number:
            console.print()
        print_device(device, console)
