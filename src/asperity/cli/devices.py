"""``asperity devices``: what is known of real devices, and from where."""

from __future__ import annotations

import click

from asperity.cli.output import Outputs, output_options
from asperity.errors import ParameterError


@click.command("devices")
@click.argument("names", nargs=-1, metavar="[ID|FILE]...")
@click.option(
    "--template", is_flag=True, help="Print a device file to fill in, every field with its unit."
)
@output_options(None, "Write the list as JSON; - is standard output.")
def command(names: tuple[str, ...], outputs: Outputs, *, template: bool) -> None:
    """List the devices of the catalogue.

    Given an ID, or a device of your own as a TOML FILE, says everything that is known of it: each
    number with its unit, its source, and whether it was verified.

    For a device of your own: asperity devices --template > mine.toml
    """
    from asperity.devices import device_names, load_device
    from asperity.devices.template import device_template
    from asperity.report.devices import print_devices

    if template:
        if names or outputs.json:
            raise ParameterError("template", "is a file to fill in: it goes with nothing else")
        click.echo(device_template(), nl=False)
        return
    devices = [load_device(name) for name in names or device_names()]
    data = {"schema": 1, "devices": devices}
    outputs.write(data, lambda console: print_devices(devices, console, in_detail=bool(names)))
