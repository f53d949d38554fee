"""``asperity simulate``: texture, device and hand in one loop."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import click

from asperity.arguments import Argument
from asperity.cli.loop import loop_options, read_setup
from asperity.cli.options import options
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import progress_bar

_RUN = (
    Argument("duration", "of the run", "s", default_words="the scene's", example="2s"),
    Argument(
        "every",
        "samples per row of trace and pictures",
        default_words="the scene's, 1",
        form="integer",
    ),
)


@click.command("simulate")
@loop_options
@options(_RUN)
@click.option(
    "--trace",
    "trace_path",
    metavar="PATH",
    help="Record every sample as it comes, 'run.mcap'; as a table of text, 'run.csv'.",
)
@output_options("Write a report; - is standard output.")
def command(
    scene: str, outputs: Outputs, duration: float | None, every: int | None, **values: Any
) -> None:
    """Run the closed loop of SCENE (TOML) and say where the energy went.

    A scene has the sections [texture], [surface], [device], [hand], [motion] and [run]. The trace
    is a table whose columns have units: positions, velocities, forces, energies.
    """
    setup = read_setup(scene, values, duration)
    setup = setup if every is None else replace(setup, every=every)
    from asperity.report.run import print_run, run_page
    from asperity.simulation.run import MOST_ROWS, reread

    # Only pictures need rows, and no more than these.
    most_rows = 0 if outputs.html is None else MOST_ROWS
    with progress_bar("simulating") as told:
        run = setup.simulate(trace=outputs.trace or True, progress=told, most_rows=most_rows)

    outputs.write(
        {"schema": 1, "scene": setup, "run": run},
        lambda console: print_run(setup, run, console),
        lambda: run_page(setup, run if outputs.trace is None else reread(run)),
    )
