"""The command ``asperity``."""

from __future__ import annotations

import importlib
import sys
import warnings
from typing import Any, NoReturn

import click

import asperity
from asperity.cache import CacheWarning, size_limit
from asperity.cli.group import Group
from asperity.cli.own_code import own_fault
from asperity.errors import AsperityError, InternalError, tell

BAD_INPUT = 2
INTERNAL_ERROR = 70  # as sysexits.h has it

COMMANDS = {
    "analyze": "Say all that is known of one law on a surface and a device.",
    "cache": "Say what is kept between runs, or delete it.",
    "calibrate": "Measure a device: K₀, steps, delay, damping, friction.",
    "compare": "Compare the laws on a surface and a device.",
    "devices": "List devices, and the source of every number.",
    "export": "Write a surface with its law as a C program.",
    "init": "Write a scene to begin with.",
    "lab": "Watch, hear and steer a texture in a browser.",
    "limits": "Say whether a texture can be felt on a device.",
    "maps": "Write heights or normals for other tools.",
    "onset": "Find the stiffness at which limit cycles begin.",
    "prepare": "Prepare a measured surface and save it.",
    "recording": "Say, draw, export or replay what a loop did.",
    "reproduce": "Redo the paper and judge each of its statements.",
    "run": "Render a surface on a device, or a simulated one, as time goes.",
    "scan": "Energy per stroke, against speed and depth.",
    "show": "Say a measured surface in numbers, step by step.",
    "simulate": "Run texture, device and hand in one loop.",
    "surfaces": "List the surfaces that can be asked for by name.",
    "warm": "Compile the shipped laws ahead.",
}
"""The commands with what each does; each is ``command`` in the module of its name."""


class Commands(Group):
    """Commands that are imported when they are asked for, so that the program starts at once."""

    def list_commands(self, ctx: click.Context) -> list[str]:  # noqa: ARG002 - click's signature
        """Return the names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:  # noqa: ARG002 - as above
        """Return a command by its name."""
        if cmd_name not in COMMANDS:
            return None
        command: click.Command = importlib.import_module(f"asperity.cli.{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:  # noqa: ARG002 - as above
        """Write what the commands do."""
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(asperity.__version__, prog_name="asperity")
def cli() -> None:
    """Haptic textures for the device you have: which law, at which stiffness, what goes wrong.

    Start with: asperity compare sinusoid:amplitude=0.8mm,period=1mm --device omega.3
    """


def _show_warning(message: Warning | str, category: type[Warning], *_: Any, **__: Any) -> None:
    """Say a warning of asperity's own in one line; others are for developers."""
    if issubclass(category, CacheWarning):
        tell(str(message))


def main() -> None:
    """Run the command line; bad input is one line on standard error and exit code 2."""
    warnings.showwarning = _show_warning
    try:
        size_limit()  # a wrong one is said before any work is done
        cli(prog_name="asperity", standalone_mode=False)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.Abort:
        raise KeyboardInterrupt from None  # asperity.__main__ says it
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_INPUT)
    except InternalError as error:
        _stop(error, INTERNAL_ERROR)
    except AsperityError as error:
        _stop(error, error.exit_code)
    except MemoryError:
        _stop("the surface is too large for this machine's memory", BAD_INPUT)
    except Exception as error:  # code of the user's own may raise anything
        said = own_fault(error)
        if said is None:
            raise  # a fault of asperity's own, or of the streams: see asperity.__main__
        _stop(said, BAD_INPUT)


def _stop(said: object, code: int) -> NoReturn:
    tell(str(said))
    sys.exit(code)
