"""``asperity onset``: at which stiffness does it begin to buzz?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.loop import (
    loop_options,
    print_report,
    progress_bar,
    read_laws,
    read_list,
    read_one,
    read_setup,
)
from asperity.cli.output import STANDARD_OUTPUT, check_outputs, write_output
from asperity.errors import ParameterError
from asperity.files import json_text

if TYPE_CHECKING:
    from asperity.scene.setup import Setup
    from asperity.simulation.prediction import Prediction


@click.command("onset", short_help="Find the stiffness at which limit cycles begin.")
@click.argument("scene")
@loop_options
@click.option("--laws", metavar="LETTERS", help="Laws to try.  [default: WABCDEFGH]")
@click.option("--delays", metavar="LIST", help="Delays in samples, '0; 2; 5'.  [default: 0 to 5]")
@click.option("--starts", metavar="N", help="Phases of the texture to start at.  [default: 12]")
@click.option("--tolerance", metavar="SHARE", help="Width of the bracket.  [default: 0.05]")
@click.option("--lowest", metavar="TEXT", help="Stiffness to begin with.  [default: 1 N/m]")
@click.option("--duration", metavar="TEXT", help="Of each run.  [default: the scene's]")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON; - is stdout.")
@click.option("--html", "html_path", metavar="PATH", help="Write a report; - is standard output.")
def onset_command(
    scene: str,
    laws: str | None,
    delays: str | None,
    starts: str | None,
    tolerance: str | None,
    lowest: str | None,
    duration: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Find the stiffness at which SCENE begins to buzz, by law and delay, in simulation.

    The hand of the scene must come to rest. Beside each onset stands what the criteria allow.
    """
    check_outputs(json=json_path, html=html_path)
    if values["stiffness"] is not None:
        raise ParameterError("stiffness", "is what onset looks for: leave it out")
    # The scene's law is one of many here; a scene without one is as good.
    setup = read_setup(scene, values | {"law": values["law"] or "W"}, duration)
    # Nor is its delay assumed: --delays sets it.
    said = tuple(sentence for sentence in setup.assumptions if "delay" not in sentence)
    setup = replace(setup, assumptions=said)
    letters = read_laws(laws or values["law"] or "WABCDEFGH")
    waits = read_list("delays", delays or "0; 1; 2; 3; 4; 5", whole=True)
    chosen = {
        "starts": int(read_one("starts", starts or "12", whole=True)),
        "tolerance": read_one("tolerance", tolerance or "0.05"),
        "lowest": read_one("lowest", lowest or "1", "N/m"),
    }
    found = _onsets(setup, letters, [int(wait) for wait in waits], chosen)
    if json_path is not None:
        data = {
            "schema": 1,
            "scene": setup,
            "onsets": found,
        }
        write_output("json", json_path, json_text(data))
    if html_path is not None:
        from asperity.report.onset_report import onset_html

        write_output("html", html_path, onset_html(setup, found))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        from asperity.report.onset_report import print_onsets

        print_report(lambda console: print_onsets(setup, found, console), html_path)


def _onsets(
    setup: Setup, letters: list[str], delays: list[int], options: dict[str, Any]
) -> tuple[Prediction, ...]:
    from asperity.scene.onsets import onsets

    with progress_bar("looking for onsets") as told:
        counted = _counter(told, len(letters) * len(delays))
        return onsets(setup, letters, delays, progress=counted, **options)


def _counter(told: Callable[[float], None], count: int) -> Callable[[], None]:
    done = [0]

    def step() -> None:
        done[0] += 1
        told(done[0] / count)

    return step
