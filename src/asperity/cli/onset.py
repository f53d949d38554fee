"""``asperity onset``: at which stiffness does it begin to buzz?"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.loop import chosen_laws, loop_options, read_setup
from asperity.cli.options import given, laws_option, one, options, several
from asperity.cli.output import Outputs, output_options
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError

if TYPE_CHECKING:
    from asperity.laws import Law

_DELAYS = Argument(
    "delays", "delays in samples", default_words="0 to 5", form="integer", example="0; 2; 5"
)
_SEARCH = (
    Argument("starts", "phases of the texture to start at", default=12, form="integer"),
    Argument("tolerance", "width of the bracket", default=0.05),
    Argument("lowest", "stiffness to begin with", "N/m", 1.0),
)
_DURATION = Argument("duration", "of each run", "s", default_words="the scene's")


@click.command("onset")
@loop_options
@laws_option("Laws to try.  [default: all]")
@options([_DELAYS], several)
@options(_SEARCH, one)
@options([_DURATION])
@output_options("Write a report; - is standard output.")
def command(
    scene: str,
    outputs: Outputs,
    laws: tuple[Law, ...] | None,
    delays: list[int] | None,
    duration: float | None,
    **values: Any,
) -> None:
    """Find the stiffness at which SCENE begins to buzz, by law and delay, in simulation.

    The hand of the scene must come to rest. Beside each onset stands what the criteria allow.
    """
    if values["stiffness"] is not None:
        raise ParameterError("stiffness", "is what onset looks for: leave it out")
    chosen = chosen_laws(laws, values["law"])
    setup = read_setup(scene, values, duration, chosen, keeps_delay=False)
    from asperity.scene.sweeps import onsets

    lags, letters = delays or list(range(6)), [law.letter for law in chosen]
    done, total, search = count(1), len(letters) * len(lags), given(values, _SEARCH)
    with progress_bar("looking for onsets") as told:
        found = onsets(setup, letters, lags, progress=lambda: told(next(done) / total), **search)

    from asperity.report.onset import onset_page, print_onsets

    data = {"schema": 1, "scene": setup, "onsets": found}
    outputs.write(
        data, lambda console: print_onsets(setup, found, console), lambda: onset_page(setup, found)
    )
