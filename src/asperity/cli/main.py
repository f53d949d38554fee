"""The command ``asperity``."""

from __future__ import annotations

import sys

import click

import asperity
from asperity.cli.analyze import analyze_command
from asperity.cli.compare import compare_command
from asperity.cli.devices import devices_command
from asperity.cli.limits import limits_command
from asperity.cli.onset import onset_command
from asperity.cli.prepare import prepare_command
from asperity.cli.reproduce import reproduce_command
from asperity.cli.scan import scan_command
from asperity.cli.simulate import simulate_command
from asperity.cli.surfaces import surfaces_command
from asperity.errors import AsperityError

BAD_INPUT = 2


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(asperity.__version__, prog_name="asperity")
def cli() -> None:
    """Haptic textures that neither buzz nor feel alive, on the device you have.

    Start with: asperity compare sinusoid:amplitude=0.8mm,period=1mm --device omega.3
    """


cli.add_command(analyze_command)
cli.add_command(compare_command)
cli.add_command(devices_command)
cli.add_command(limits_command)
cli.add_command(onset_command)
cli.add_command(prepare_command)
cli.add_command(reproduce_command)
cli.add_command(scan_command)
cli.add_command(simulate_command)
cli.add_command(surfaces_command)


def main() -> None:
    """Run the command line; bad input is one line on standard error and exit code 2."""
    try:
        cli(standalone_mode=False)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.Abort:
        click.echo("asperity: interrupted", err=True)
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except AsperityError as error:
        click.echo(f"asperity: {error}", err=True)
        sys.exit(BAD_INPUT)
    except MemoryError:
        click.echo("asperity: the surface is too large for this machine's memory", err=True)
        sys.exit(BAD_INPUT)
