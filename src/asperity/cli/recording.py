"""``asperity recording``: what a loop did, from its file."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable

import click

from asperity.cli.group import Group
from asperity.cli.options import own_code_option
from asperity.cli.output import Outputs, check_outputs, output_options
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError, printable


@click.group("recording", cls=Group)
def command() -> None:
    """Say, draw, export or replay what a loop did.

    A recording is the file that asperity simulate writes with --trace run.mcap. It opens also where
    it ends in the middle, since its process was killed.
    """


@command.command("info")
@click.argument("file")
@output_options(None)
def info(file: str, outputs: Outputs) -> None:
    """Say what the recording FILE holds: surface, law, device, and the range of each column."""
    from asperity.recording.recording import open_recording
    from asperity.report.recording import print_recording

    recording = open_recording(file)
    with progress_bar("reading the rows"):
        ranges = recording.ranges()
    columns = [
        {"name": name, "unit": unit, "least": low, "greatest": high}
        for (name, unit), low, high in zip(recording.columns, *ranges, strict=True)
    ]
    outputs.write(
        recording.to_dict() | {"columns": columns},
        lambda console: print_recording(recording, ranges, console),
    )


def _output(words: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds ``--output``, checked before any work is done."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def run(file: str, output: str) -> None:
            check_outputs(output=output)
            if os.path.exists(output) and os.path.exists(file) and os.path.samefile(output, file):
                raise ParameterError("output", "must be another file than the recording", output)
            function(file, output)
            click.echo(f"Saved: {printable(output)}")

        return click.option("-o", "--output", metavar="PATH", required=True, help=words)(run)

    return decorate


@command.command("plot")
@click.argument("file")
@own_code_option
@_output("The file to write: a page (.html), or the picture alone (.svg, .png, .pdf).")
def plot(file: str, output: str) -> None:
    """Draw motion, force, energy and phase of the recording FILE."""
    from asperity.recording.recording import open_recording
    from asperity.report.recording import save_picture

    with progress_bar("drawing"):
        save_picture(open_recording(file), output)


@command.command("export")
@click.argument("file")
@_output("The file to write: .csv, .mat (MATLAB), or .parquet, which needs the extra 'parquet'.")
def export(file: str, output: str) -> None:
    """Write the rows of the recording FILE for other tools, every digit of them."""
    from asperity.recording.export import export_recording
    from asperity.recording.recording import open_recording

    with progress_bar("exporting") as told:
        export_recording(open_recording(file), output, told)


@command.command("replay")
@click.argument("file")
@click.option(
    "--surface",
    metavar="SURFACE",
    help="Another one to compare with, law and parameters as recorded.  [default: the recorded]",
)
@own_code_option
@output_options(None)
def replay(file: str, outputs: Outputs, surface: str | None) -> None:
    """Say whether the law gives the forces of the recording FILE again, bit for bit.

    If not: the first row that differs, by how much, and what has changed since it was recorded.
    """
    from asperity.recording.recording import open_recording
    from asperity.recording.replay import recorded_on, replay
    from asperity.report.recording import print_replay

    recording = open_recording(file)
    other = None
    if surface is not None:
        from asperity.scene import load_scene

        other = recorded_on(recording, load_scene(surface).texture)
    with progress_bar("replaying"):
        found = replay(recording, other)
    outputs.write({"schema": 1, **found.to_dict()}, lambda console: print_replay(found, console))
