"""The commands ``simulate``, ``onset``, ``scan``, ``sweep``, and ``recording`` with its own."""

from __future__ import annotations

import os
import pickle
from dataclasses import replace
from datetime import timedelta
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.loop_setup import load_setup, loop_options, select_laws, stiffness_option
from asperity.cli.main import StrictGroup, declare_command
from asperity.cli.options import (
    GRIP,
    JOBS,
    SPEED,
    argument_options,
    command_arguments,
    laws_option,
    list_parser,
    plugin_option,
    provided_values,
    single_value_parser,
)
from asperity.cli.output import Outputs, force_option, is_confirmed, output_options, progress_bar
from asperity.cli.plugins import has_plugins, load_plugin_files, plugin_files
from asperity.core.errors import ParameterError, escape_unprintable
from asperity.core.files import check_output
from asperity.core.processes import available_cores
from asperity.core.units import count_text

if TYPE_CHECKING:
    from asperity.laws import Law
    from asperity.scene.setup import Setup
    from asperity.sweeps.sweep_plan import SweepPlan

_STIFFNESS = stiffness_option("the scene's, else 1000 N/m")
_SIMULATE_ARGUMENTS = command_arguments("simulate")


@declare_command("simulate")
@loop_options(_STIFFNESS)
@argument_options(_SIMULATE_ARGUMENTS)
@click.option(
    "--trace", "trace_path", metavar="PATH", help="Write the samples to a recording ('run.mcap')."
)
@click.option("--yes", is_flag=True, help="Simulate a long duration without confirmation.")
@output_options()
def simulate_command(
    scene: str,
    outputs: Outputs,
    duration: float | None,
    every: int | None,
    *,
    yes: bool,
    **values: Any,
) -> None:
    """Simulate the closed loop of SCENE (TOML) and report its energy balance.

    A scene has the sections [texture], [surface], [device], [hand], [motion] and [run];
    [servo] is for asperity run. The trace has columns for positions, velocities, forces and
    energies, with units.
    """
    setup = load_setup(scene, values, duration)
    if every is not None:
        setup = replace(setup, every=every)
    if not yes:
        _confirm_long_run(setup, has_trace=outputs.trace is not None)
    from asperity.report.pages.run_report import run_page
    from asperity.simulation.trace import MAX_ROWS

    # Rows are needed for figures only.
    max_rows = MAX_ROWS if outputs.html is not None else 0
    with progress_bar("simulating") as update:
        run = setup.simulate(trace=outputs.trace or True, progress=update, max_rows=max_rows)

    outputs.write({"schema": 2, "scene": setup, "run": run}, run_page(setup, run))


_SAMPLE_TIME = 2e-7  # [s], about
_ROW_TIME = 5e-7  # [s]
_ROW_BYTES = 300
_MAX_UNASKED_TIME = 600.0
# Estimated time [s] and trace [bytes] of a simulation above which it is asked for.
_MAX_UNASKED_SIZE = 1e10


def _confirm_long_run(setup: Setup, *, has_trace: bool) -> None:
    """Ask the user to confirm a simulation that takes long or fills the disk.

    Raises:
        ParameterError: without a confirmation.
    """
    samples = setup.duration / setup.servo.period
    rows = samples / setup.every if has_trace else 0.0
    seconds = samples * _SAMPLE_TIME + rows * _ROW_TIME
    size = rows * _ROW_BYTES
    if seconds <= _MAX_UNASKED_TIME and size <= _MAX_UNASKED_SIZE:
        return
    size_text = f"{samples:.3g} samples, which take about {timedelta(seconds=round(seconds))} here"
    if has_trace:
        size_text += f" and a trace of {1e-9 * size:.3g} GB"
    if not is_confirmed(f"{size_text}. Simulate?"):
        fault = f"of {setup.duration:g} s is {size_text}; --yes simulates it"
        raise ParameterError("duration", fault)


_DELAYS, *_ONSET_SEARCH, _DURATION = command_arguments("onset")
_laws_option = laws_option("Laws to simulate.  [default: all]")
_report_options = output_options()


@declare_command("onset")
@loop_options(None, several_laws=True)
@_laws_option
@argument_options([_DELAYS], list_parser)
@argument_options(_ONSET_SEARCH, single_value_parser)
@argument_options([_DURATION])
@_report_options
def onset_command(
    scene: str, outputs: Outputs, laws: tuple[Law, ...] | None, **values: Any
) -> None:
    """Simulate SCENE to find the stiffness at which limit cycles begin, for each law and delay.

    The motion of the scene must end at rest ([motion] kind = "still"). The report compares each
    onset with the passivity criteria.
    """
    if values["stiffness"] is not None:
        raise ParameterError("stiffness", "is the result of onset: leave it out")
    chosen = select_laws(laws, values["law"])
    setup = load_setup(scene, values, values["duration"], chosen, include_delay=False)
    from asperity.scene.sweeps import DEFAULT_DELAYS, sweep_onsets

    delays = values["delays"] or DEFAULT_DELAYS
    done = count(1)
    total = len(chosen) * len(delays)
    search = provided_values(values, _ONSET_SEARCH)
    with progress_bar("simulating onsets") as update:
        result = sweep_onsets(
            setup, chosen, delays, progress=lambda: update(next(done) / total), **search
        )

    from asperity.report.pages.sweep_report import onset_page

    outputs.write(result, onset_page(result))


*_SCAN_LISTS, _STROKES = command_arguments("scan")


@declare_command("scan")
@loop_options(_STIFFNESS, several_laws=True)
@_laws_option
@argument_options(_SCAN_LISTS, list_parser)
@argument_options([_STROKES], single_value_parser)
@_report_options
def scan_command(scene: str, outputs: Outputs, laws: tuple[Law, ...] | None, **values: Any) -> None:
    """Simulate strokes on the surface of SCENE; report their energy by law, speed and depth.

    The motion of the scene must consist of strokes; their speed and depth are replaced.
    """
    from asperity.scene.sweeps import sweep_strokes

    chosen = select_laws(laws, values["law"])
    setup = load_setup(scene, values, laws=chosen)
    arguments = provided_values(values, (*_SCAN_LISTS, _STROKES))
    with progress_bar("simulating strokes") as update:
        result = sweep_strokes(setup, chosen, progress=update, **arguments)

    from asperity.report.pages.sweep_report import strokes_page

    outputs.write(result, strokes_page(result))


_RUN, _DESIGN, _SCHEDULER = command_arguments("sweep")
_SINGLE = (*_ONSET_SEARCH, _STROKES)
# Number of cases above which a sweep is asked for.
_MAX_UNASKED_CASES = 10_000


@declare_command("sweep")
@click.argument("scene")
@click.option(
    "--vary",
    metavar="KEY=VALUES",
    multiple=True,
    help="Vary a key of the scene, such as 'device=touch,omega.3': KEY=START:STOP:COUNT,"
    " KEY=START:STOP:COUNTlog or KEY=a,b,c; may be repeated, for all combinations.",
)
@argument_options([_RUN, _DESIGN, _SCHEDULER, JOBS])
@_laws_option
@argument_options([SPEED, GRIP, _DURATION])
@argument_options([_DELAYS, *_SCAN_LISTS], list_parser)
@argument_options(_SINGLE, single_value_parser)
@click.option(
    "-o",
    "--output",
    metavar="FOLDER",
    help="Results folder, in which the same command goes on where it was stopped.",
)
@click.option("--yes", is_flag=True, help=f"Compute more than {_MAX_UNASKED_CASES} cases.")
@plugin_option
@_report_options
def sweep_command(
    scene: str,
    vary: tuple[str, ...],
    laws: tuple[Law, ...] | None,
    outputs: Outputs,
    *,
    output: str | None,
    yes: bool,
    **values: Any,
) -> None:
    """Compute SCENE for many values of its keys, on all cores or on a cluster.

    SCENE is a scene file (TOML), a texture with its arguments or a measured file. With --output,
    the same command goes on where it was stopped.
    """
    from asperity.sweeps.run_sweep import cluster_place, local_place, run_plan
    from asperity.sweeps.sweep_plan import make_plan

    processes = values["jobs"]
    if processes is None:
        processes = available_cores()
    JOBS.validate(processes)
    scheduler = values["scheduler"]
    place = cluster_place(scheduler) if scheduler is not None else local_place(processes)
    prepare = _prepare_worker() if processes > 1 or scheduler is not None else b""
    plan = make_plan(
        scene,
        _parse_vary(vary),
        values["run"] or str(_RUN.default),
        design=values["design"] or "",
        laws=[law.letter for law in laws or ()] or None,
        options=provided_values(values, [SPEED, GRIP, _DURATION, _DELAYS, *_SCAN_LISTS, *_SINGLE]),
        prepare=prepare,
    )
    if not yes and len(plan) > _MAX_UNASKED_CASES:
        _confirm_many_cases(plan, processes)
    with progress_bar(f"computing {count_text(len(plan), 'case')}") as update:
        result = run_plan(plan, place, output, update)

    from asperity.report.pages.sweep_report import sweep_page

    extra = ""
    if output is not None:
        table = Path(output) / "table.csv"
        result.to_csv(table)
        extra = f"Table: {table}"
    outputs.write(result, sweep_page(result), extra_line=extra)


def _parse_vary(texts: tuple[str, ...]) -> dict[str, str]:
    """Return the values of ``--vary`` by key."""
    vary: dict[str, str] = {}
    for text in texts:
        key, equals, values = text.partition("=")
        if not equals:
            raise ParameterError("vary", "must be KEY=VALUES", text)
        if key.strip() in vary:
            raise ParameterError("vary", "names a key twice", text)
        vary[key.strip()] = values
    return vary


def _prepare_worker() -> bytes:
    """Return the pickled function that loads the plugins; empty without any."""
    files = tuple([str(Path(file).resolve()) for file in plugin_files()])
    return pickle.dumps(partial(load_plugin_files, files)) if has_plugins() else b""


def _confirm_many_cases(plan: SweepPlan, processes: int) -> None:
    """Ask the user to confirm a large sweep.

    Raises:
        ParameterError: without a confirmation.
    """
    from asperity.sweeps.run_sweep import estimate_case_time

    seconds = estimate_case_time(plan) * len(plan)
    time = timedelta(seconds=round(seconds / processes))
    size_text = (
        f"{count_text(len(plan), 'case')}, which take about {time} on {processes} processes here"
    )
    if not is_confirmed(f"{size_text}. Compute?"):
        raise ParameterError("vary", f"makes {size_text}; --yes computes them")


@click.group("recording", cls=StrictGroup)
def recording_command() -> None:
    """Show, plot, export or replay a recording.

    A recording is the file that asperity simulate writes with --trace run.mcap, or asperity run
    with --record. It remains readable if the process that writes it is killed.
    """


@recording_command.command("info", short_help="Show surface, law, device and column ranges.")
@click.argument("file")
@output_options(html=False)
def info_command(file: str, outputs: Outputs) -> None:
    """Show surface, law and device of the recording FILE, and the range of each column."""
    from asperity.recording.recording import open_recording
    from asperity.recording.replay import recorded_limits
    from asperity.report.pages.run_report import recording_page

    recording = open_recording(file)
    with progress_bar("reading the rows"):
        ranges = recording.ranges()
    columns = [
        {"name": name, "unit": unit, "least": low, "greatest": high}
        for (name, unit), low, high in zip(recording.columns, *ranges, strict=True)
    ]
    data = recording.to_dict() | {"columns": columns, "limits": recorded_limits(recording)}
    outputs.write(data, recording_page(recording, ranges))


_output_option = partial(click.option, "-o", "--output", metavar="PATH", required=True)


def _check_output(file: str, output: str, *, force: bool) -> None:
    """Check before a computation that a file can be written, and is not the recording."""
    if os.path.exists(output) and os.path.exists(file) and os.path.samefile(output, file):
        raise ParameterError("output", "must be another file than the recording", output)
    check_output("output", output, force=force)


@recording_command.command("plot", short_help="Plot motion, force, energy and phase.")
@click.argument("file")
@plugin_option
@_output_option(help="The file to write: a page (.html), or the figure alone (.svg, .png, .pdf).")
@force_option
def plot_command(file: str, output: str, *, force: bool) -> None:
    """Plot motion, force, energy and phase of the recording FILE."""
    _check_output(file, output, force=force)
    from asperity.recording.recording import open_recording
    from asperity.report.pages.run_report import write_recording_report

    with progress_bar("plotting"):
        write_recording_report(open_recording(file), output)
    click.echo(f"Saved: {escape_unprintable(output)}")


@recording_command.command("export", short_help="Export a recording as CSV or MAT.")
@click.argument("file")
@_output_option(help="The file to write: .csv or .mat (MATLAB).")
@force_option
def export_rows_command(file: str, output: str, *, force: bool) -> None:
    """Export the rows of the recording FILE with all digits as CSV or MAT."""
    _check_output(file, output, force=force)
    from asperity.recording.recording import open_recording
    from asperity.recording.table_export import export_recording

    with progress_bar("exporting") as update:
        export_recording(open_recording(file), output, update)
    click.echo(f"Saved: {escape_unprintable(output)}")


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
    from asperity.report.pages.run_report import replay_page

    recording = open_recording(file)
    other = None
    if surface is not None:
        from asperity.scene import load_scene

        other = recorded_surface_on(recording, load_scene(surface).texture)
    with progress_bar("replaying"):
        result = replay(recording, other)
    outputs.write({"schema": 1, **result.to_dict()}, replay_page(result))
