"""``asperity simulate``: texture, device and hand in one loop."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.cli.loop import loop_options, print_report, progress_bar, read_setup
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.files import json_text

if TYPE_CHECKING:
    from asperity.scene.setup import Setup
    from asperity.simulation import Run


@click.command("simulate", short_help="Run texture, device and hand in one loop.")
@click.argument("scene")
@loop_options
@click.option("--duration", metavar="TEXT", help="Of the run, '2s'.  [default: the scene's]")
@click.option(
    "--trace", "trace_path", metavar="PATH", help="Write every sample to a .csv file as it comes."
)
@click.option(
    "--every", metavar="N", help="Samples per row of trace and pictures.  [default: the scene's, 1]"
)
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON; - is stdout.")
@click.option("--html", "html_path", metavar="PATH", help="Write a report; - is standard output.")
def simulate_command(
    scene: str,
    duration: str | None,
    trace_path: str | None,
    every: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Run the closed loop of SCENE (TOML) and say where the energy went.

    A scene has the sections [texture], [surface], [device], [hand], [motion] and [run]. The trace
    is a table whose columns have units: positions, velocities, forces, energies.
    """
    check_outputs(json=json_path, html=html_path, trace=trace_path)
    setup = read_setup(scene, values, duration, every)
    with progress_bar("simulating") as told:
        run = setup.simulate(trace=True if trace_path is None else trace_path, progress=told)
    if json_path is not None:
        write_output("json", json_path, as_json(setup, run))
    if html_path is not None:
        from asperity.report.run_html import run_html
        from asperity.simulation.rereading import reread

        shown = run if trace_path is None else reread(run)
        write_output("html", html_path, run_html(setup, shown))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        from asperity.report.run_table import print_run

        print_report(lambda console: print_run(setup, run, console), html_path, trace_path)


def as_json(setup: Setup, run: Run) -> str:
    """Return scene and result as JSON text; null for what is not finite, if the run diverged."""
    return json_text({"schema": 1, "scene": setup, "run": run})
