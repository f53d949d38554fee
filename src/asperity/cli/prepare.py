"""``asperity prepare``: a measured surface, prepared once and kept."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import file_options, file_values
from asperity.cli.output import Outputs, check_outputs, output_options
from asperity.cli.progress import progress_bar
from asperity.errors import printable

if TYPE_CHECKING:
    from rich.console import Console

    from asperity.measured.prepared import Prepared

_WORDS = {
    "read": "reading the surface",
    "outliers": "looking for outliers",
    "form": "removing the form",
    "fill": "filling missing points",
    "filter": "filtering",
    "tip": "feeling with the tip",
    "repeat": "blending the borders",
    "magnify": "magnifying",
    "measure": "measuring",
    "write": "writing",
}


@contextmanager
def preparing() -> Iterator[Callable[[str], None]]:
    """Show which stage of a preparation is at work; yield what is told each before it begins."""
    stages = list(_WORDS)
    with progress_bar(_WORDS["read"]) as told:
        yield lambda stage: told(stages.index(stage) / len(stages), _WORDS[stage])


@click.command("prepare")
@click.argument("file")
@click.option(
    "-o", "--output", metavar="PATH", required=True, help="The file to write, surface.npz."
)
@file_options
@output_options(None, "Write what was done, in numbers, as JSON; - is standard output.")
def command(file: str, output: str, outputs: Outputs, **values: Any) -> None:
    """Prepare the measured surface FILE as told, and save it with everything that was done.

    In this order: read, outliers, fill, form, filter, tip, blend, magnify. Every command takes
    the result in place of the measured file. Lengths are in the surface's own metres, before
    magnification. Says the surface's parameters (ISO 25178-2, ISO 21920-2) after each step, as
    asperity show does in more detail.
    """
    from asperity.measured.prepared import check_target, save_prepared
    from asperity.textures.loading import prepare_file

    check_target(Path(output), Path(file))
    check_outputs(output=output, json=outputs.json)
    with preparing() as begin:
        prepared = prepare_file(file, progress=begin, **file_values(values))
        begin("write")
        save_prepared(output, prepared, file)
    outputs.write(prepared, lambda console: _print(prepared, output, console))


def _print(prepared: Prepared, output: str, console: Console) -> None:
    from asperity.report.show import print_steps, summary
    from asperity.report.stages import print_stages

    print_steps(prepared, console)
    console.print()
    if prepared.history:
        print_stages(prepared.history, console)
        console.print()
    console.print(summary(prepared), markup=False, soft_wrap=True)
    console.print(f"Saved: {printable(output)}", markup=False, soft_wrap=True)
