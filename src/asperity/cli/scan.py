"""``asperity scan``: what a stroke gains or costs, against speed and depth."""

from __future__ import annotations

from typing import Any

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
from asperity.files import json_text


@click.command("scan", short_help="Energy per stroke, against speed and depth.")
@click.argument("scene")
@loop_options
@click.option("--laws", metavar="LETTERS", help="Laws to try.  [default: WABCDEFGH]")
@click.option(
    "--speeds", metavar="LIST", help="Of the hand, '0.05m/s; 0.1m/s'.  [default: 0.02 to 0.2 m/s]"
)
@click.option("--depths", metavar="LIST", help="Of the hand below z = 0.  [default: the scene's]")
@click.option("--strokes", metavar="N", help="Strokes per run.  [default: the scene's, at least 5]")
@click.option("--json", "json_path", metavar="PATH", help="Write the result as JSON; - is stdout.")
@click.option("--html", "html_path", metavar="PATH", help="Write a report; - is standard output.")
def scan_command(
    scene: str,
    laws: str | None,
    speeds: str | None,
    depths: str | None,
    strokes: str | None,
    json_path: str | None,
    html_path: str | None,
    **values: Any,
) -> None:
    """Stroke the surface of SCENE and say what each stroke gains or costs, by law.

    The motion of the scene must be strokes; their speed and depth are replaced.
    """
    check_outputs(json=json_path, html=html_path)
    from asperity.scene.scans import scans

    setup = read_setup(scene, values | {"law": values["law"] or "W"})
    letters = read_laws(laws or values["law"] or "WABCDEFGH")
    wanted: dict[str, Any] = {}
    if speeds is not None:
        wanted["speeds"] = read_list("speeds", speeds, "m/s")
    if depths is not None:
        wanted["depths"] = read_list("depths", depths, "m")
    if strokes is not None:
        wanted["strokes"] = int(read_one("strokes", strokes, whole=True))
    with progress_bar("stroking") as told:
        found = scans(setup, letters, progress=told, **wanted)
    if json_path is not None:
        data = {
            "schema": 1,
            "scene": setup,
            "strokes": found,
        }
        write_output("json", json_path, json_text(data))
    if html_path is not None:
        from asperity.report.scan_report import scan_html

        write_output("html", html_path, scan_html(setup, found))
    if STANDARD_OUTPUT not in {json_path, html_path}:
        from asperity.report.scan_report import print_scans

        print_report(lambda console: print_scans(setup, found, console), html_path)
