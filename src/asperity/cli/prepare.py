"""``asperity prepare``: a measured surface, prepared once and kept."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import file_options, file_values
from asperity.cli.progress import progress_bar
from asperity.errors import printable

if TYPE_CHECKING:
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
    "write": "writing",
}


@click.command("prepare")
@click.argument("file")
@click.option(
    "-o", "--output", metavar="PATH", required=True, help="The file to write, surface.npz."
)
@file_options
def command(file: str, output: str, **values: Any) -> None:
    """Prepare the measured surface FILE as told, and save it with everything that was done.

    In this order: read, outliers, fill, form, filter, tip, blend, magnify. Every command takes
    the result in place of the measured file. Lengths are in the surface's own metres, before
    magnification.
    """
    from asperity.measured.prepared import check_target, save_prepared
    from asperity.textures.loading import prepare_file

    check_target(Path(output), Path(file))
    stages = list(_WORDS)
    with progress_bar(_WORDS["read"]) as told:

        def begin(stage: str) -> None:
            told(stages.index(stage) / len(stages), _WORDS[stage])

        prepared = prepare_file(file, progress=begin, **file_values(values))
        begin("write")
        save_prepared(output, prepared, file)
    _print(prepared, output)


def _print(prepared: Prepared, output: str) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(justify="right", style="dim")
    table.add_column()
    for number, step in enumerate(prepared.steps, start=1):
        table.add_row(str(number), Text(step))  # a file's own words are no markup
    console = Console(highlight=False)
    console.print(table)
    console.print(summary(prepared), markup=False, soft_wrap=True)
    console.print(f"Saved: {printable(output)}", markup=False, soft_wrap=True)


def summary(prepared: Prepared) -> str:
    """Return a surface in one line: size, pitch, heights.

    Example:
        >>> import numpy as np
        >>> from asperity.measured.prepared import Prepared
        >>> summary(Prepared(np.array([0.0, 1e-6, 0.0, 1e-6]), (1e-5,), ()))
        '4 points, pitch 10 µm, peak to valley 1 µm, RMS 500 nm'
    """
    import numpy as np

    from asperity.measured.length_words import by_text, lengths_text
    from asperity.units import engineering

    heights = prepared.heights
    span = float(heights.max()) - float(heights.min())
    parts = [
        f"{by_text(heights.shape[::-1])} points",
        f"pitch {lengths_text(prepared.pitch)}",
        f"peak to valley {engineering(span, 'm')}",
        f"RMS {engineering(float(np.std(heights)), 'm')}",
    ]
    if prepared.filled is not None:
        parts.append(f"{100.0 * float(prepared.filled.mean()):.2g} % filled")
    if prepared.periodic:
        parts.append("periodic")
    return ", ".join(parts)
