"""The command ``recording`` with its subcommands."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable

import click

from asperity.cli.main import StrictGroup
from asperity.cli.options import plugin_option
from asperity.cli.output import Outputs, force_option, output_options, progress_bar
from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import check_output


@click.group("recording", cls=StrictGroup)
def recording_command() -> None:
    """Show, plot, export or replay a recording.

    A recording is the file that asperity simulate writes with --trace run.mcap, or asperity run
    with --record. It remains readable if the process that writes it is killed.
    """


@recording_command.command("info", short_help="Show surface, law, device and column ranges.")
@click.argument("file")
@output_options(html=False, uses_cache=False)
def info_command(file: str, outputs: Outputs) -> None:
    """Show surface, law and device of the recording FILE, and the range of each column."""
    from asperity.recording.recording import open_recording
    from asperity.report.loop.run_report import recording_page

    recording = open_recording(file)
    with progress_bar("reading the rows"):
        ranges = recording.ranges()
    columns = [
        {"name": name, "unit": unit, "least": low, "greatest": high}
        for (name, unit), low, high in zip(recording.columns, *ranges, strict=True)
    ]
    data = recording.to_dict() | {"columns": columns}
    outputs.write(data, recording_page(recording, ranges))


def _output_option(help_text: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that adds ``--output``, checked before the command runs."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(function)
        def run(file: str, output: str, *, force: bool) -> None:
            if os.path.exists(output) and os.path.exists(file) and os.path.samefile(output, file):
                raise ParameterError("output", "must be another file than the recording", output)
            check_output("output", output, force=force)
            function(file, output)
            click.echo(f"Saved: {escape_unprintable(output)}")

        out = click.option("-o", "--output", metavar="PATH", required=True, help=help_text)
        return out(force_option(run))

    return decorate


@recording_command.command("plot", short_help="Plot motion, force, energy and phase.")
@click.argument("file")
@plugin_option
@_output_option("The file to write: a page (.html), or the figure alone (.svg, .png, .pdf).")
def plot_command(file: str, output: str) -> None:
    """Plot motion, force, energy and phase of the recording FILE."""
    from asperity.recording.recording import open_recording
    from asperity.report.loop.run_report import write_recording_report

    with progress_bar("plotting"):
        write_recording_report(open_recording(file), output)


@recording_command.command("export", short_help="Export a recording as CSV, MAT or Parquet.")
@click.argument("file")
@_output_option(
    "The file to write: .csv, .mat (MATLAB), or .parquet (optional dependency 'parquet')."
)
def export_rows_command(file: str, output: str) -> None:
    """Export the rows of the recording FILE with all digits as CSV, MAT or Parquet."""
    from asperity.recording.recording import open_recording
    from asperity.recording.table_export import export_recording

    with progress_bar("exporting") as update:
        export_recording(open_recording(file), output, update)


@recording_command.command("replay", short_help="Replay a recording and compare the forces.")
@click.argument("file")
@click.option(
    "--surface",
    metavar="SURFACE",
    help="Another surface, with the recorded law and parameters.  [default: the recorded one]",
)
@plugin_option
@output_options(html=False)
def replay_command(file: str, outputs: Outputs, surface: str | None) -> None:
    """Replay the recording FILE and compare the forces bit by bit.

    If forces differ, report the first such row, the largest difference, and possible reasons.
    """
    from asperity.recording.recording import open_recording
    from asperity.recording.replay import recorded_surface_on, replay
    from asperity.report.loop.run_report import replay_page

    recording = open_recording(file)
    other = None
    if surface is not None:
        from asperity.scene import load_scene

        other = recorded_surface_on(recording, load_scene(surface).texture)
    with progress_bar("replaying"):
        result = replay(recording, other)
    outputs.write({"schema": 1, **result.to_dict()}, replay_page(result))
