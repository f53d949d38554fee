"""``asperity scan``: what a stroke gains or costs, against speed and depth."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.loop import chosen_laws, loop_options, read_setup
from asperity.cli.options import given, laws_option, one, options, several
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import progress_bar

if TYPE_CHECKING:
    from asperity.laws import Law

_LISTS = (
    Argument(
        "speeds",
        "of the hand",
        "m/s",
        default_words="0.02 to 0.2 m/s",
        example="0.05m/s; 0.1m/s",
    ),
    Argument("depths", "of the hand below z = 0", "m", default_words="the scene's"),
)
_STROKES = Argument(
    "strokes", "strokes per run", default_words="the scene's, at least 5", form="integer"
)


@click.command("scan")
@loop_options
@laws_option("Laws to try.  [default: all]")
@options(_LISTS, several)
@options([_STROKES], one)
@output_options("Write a report; - is standard output.")
def command(scene: str, outputs: Outputs, laws: tuple[Law, ...] | None, **values: Any) -> None:
    """Stroke the surface of SCENE and say what each stroke gains or costs, by law.

    The motion of the scene must be strokes; their speed and depth are replaced.
    """
    from asperity.scene.sweeps import scans

    chosen = chosen_laws(laws, values["law"])
    setup = read_setup(scene, values, laws=chosen)
    letters = [law.letter for law in chosen]
    with progress_bar("stroking") as told:
        found = scans(setup, letters, progress=told, **given(values, (*_LISTS, _STROKES)))

    from asperity.report.scan import print_scans, scan_page

    data = {"schema": 1, "scene": setup, "strokes": found}
    outputs.write(
        data, lambda console: print_scans(setup, found, console), lambda: scan_page(setup, found)
    )
