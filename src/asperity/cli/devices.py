"""``asperity devices``: what is known of real devices, and from where."""

from __future__ import annotations

import click

from asperity.cli.output import Outputs, output_options


@click.command("devices")
@click.argument("names", nargs=-1, metavar="[ID|FILE]...")
@output_options(None, "Write the list as JSON; - is standard output.")
def command(names: tuple[str, ...], outputs: Outputs) -> None:
    """List the devices of the catalogue.

    Given an ID, or a device of your own as a TOML FILE, says everything that is known of it: each
    number with its unit, its source, and whether it was verified.
    """
    from asperity.devices import device_names, load_device
    from asperity.report.devices import print_devices

    devices = [load_device(name) for name in names or device_names()]
    data = {"schema": 1, "devices": devices}
    outputs.write(data, lambda console: print_devices(devices, console, in_detail=bool(names)))
