"""The commands ``simulate``, ``onset`` and ``scan``."""

from __future__ import annotations

import sys
from dataclasses import replace
from datetime import timedelta
from itertools import count
from typing import TYPE_CHECKING, Any

import click

from asperity.cli import options
from asperity.cli.loop_setup import load_setup, loop_options, select_laws, stiffness_option
from asperity.cli.main import declare_command
from asperity.cli.output import Outputs, output_options, progress_bar
from asperity.core.errors import ParameterError

if TYPE_CHECKING:
    from asperity.laws import Law
    from asperity.scene.setup import Setup


_STIFFNESS = stiffness_option("the scene's, else 1000 N/m")
_SIMULATE_ARGUMENTS = options.command_arguments("simulate")


@declare_command("simulate")
@loop_options(_STIFFNESS)
@options.argument_options(_SIMULATE_ARGUMENTS)
@click.option(
    "--trace",
    "trace_path",
    metavar="PATH",
    help="Write the samples to a recording ('run.mcap') or to a text table ('run.csv').",
)
@click.option("--yes", is_flag=True, help="Simulate a long duration without confirmation.")
@output_options()
def simulate_command(
    scene: str, outputs: Outputs, duration: float | None, every: int | None, *, yes: bool,
    **values: Any,
) -> None:  # fmt: skip
    """Simulate the closed loop of SCENE (TOML) and report its energy balance.

    A scene has the sections [texture], [surface], [device], [hand], [motion] and [run];
    [servo] is for asperity run. The trace has columns for positions, velocities, forces and
    energies, with units.
    """
    setup = load_setup(scene, values, duration)
    setup = setup if every is None else replace(setup, every=every)
    if not yes:
        _confirm_long_run(setup, has_trace=outputs.trace is not None)
    from asperity.report.loop.run_report import run_page
    from asperity.simulation.trace import MAX_ROWS

    # Rows are needed for figures only.
    max_rows = 0 if outputs.html is None else MAX_ROWS
    with progress_bar("simulating") as update:
        run = setup.simulate(trace=outputs.trace or True, progress=update, max_rows=max_rows)

    outputs.write({"schema": 2, "scene": setup, "run": run}, run_page(setup, run))


_SAMPLE_TIME, _ROW_TIME, _ROW_BYTES = 2e-7, 5e-7, 300  # [s], [s], [bytes], about
_MAX_UNASKED_TIME, _MAX_UNASKED_SIZE = 600.0, 1e10
"""Estimated time [s] and trace [bytes] of a simulation above which it is asked for."""


def _confirm_long_run(setup: Setup, *, has_trace: bool) -> None:
    """Ask the user to confirm a simulation that takes long or fills the disk.

    Raises:
        ParameterError: without a confirmation.
    """
    samples = setup.duration / setup.servo.period
    rows = samples / setup.every if has_trace else 0.0
    seconds, size = samples * _SAMPLE_TIME + rows * _ROW_TIME, rows * _ROW_BYTES
    if seconds <= _MAX_UNASKED_TIME and size <= _MAX_UNASKED_SIZE:
        return
    words = f"{samples:.3g} samples, which take about {timedelta(seconds=round(seconds))} here"
    words += f" and a trace of {1e-9 * size:.3g} GB" if has_trace else ""
    if not (sys.stdin.isatty() and click.confirm(f"{words}. Simulate?", err=True)):
        words = f"of {setup.duration:g} s is {words}; --yes simulates it"
        raise ParameterError("duration", words)


_DELAYS, *_ONSET_SEARCH, _DURATION = options.command_arguments("onset")
_laws_option = options.laws_option("Laws to simulate.  [default: all]")
_report_options = output_options()


@declare_command("onset")
@loop_options(None, several_laws=True)
@_laws_option
@options.argument_options([_DELAYS], options.list_parser)
@options.argument_options(_ONSET_SEARCH, options.single_value_parser)
@options.argument_options([_DURATION])
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
    done, total = count(1), len(chosen) * len(delays)
    search = options.provided_values(values, _ONSET_SEARCH)
    with progress_bar("simulating onsets") as update:
        result = sweep_onsets(
            setup, chosen, delays, progress=lambda: update(next(done) / total), **search
        )

    from asperity.report.loop.sweep_report import onset_page

    outputs.write(result, onset_page(result))


*_SCAN_LISTS, _STROKES = options.command_arguments("scan")


@declare_command("scan")
@loop_options(_STIFFNESS, several_laws=True)
@_laws_option
@options.argument_options(_SCAN_LISTS, options.list_parser)
@options.argument_options([_STROKES], options.single_value_parser)
@_report_options
def scan_command(scene: str, outputs: Outputs, laws: tuple[Law, ...] | None, **values: Any) -> None:
    """Simulate strokes on the surface of SCENE; report their energy by law, speed and depth.

    The motion of the scene must consist of strokes; their speed and depth are replaced.
    """
    from asperity.scene.sweeps import sweep_strokes

    chosen = select_laws(laws, values["law"])
    setup = load_setup(scene, values, laws=chosen)
    arguments = options.provided_values(values, (*_SCAN_LISTS, _STROKES))
    with progress_bar("simulating strokes") as update:
        result = sweep_strokes(setup, chosen, progress=update, **arguments)

    from asperity.report.loop.sweep_report import strokes_page

    outputs.write(result, strokes_page(result))
