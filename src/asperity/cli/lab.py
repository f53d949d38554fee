"""``asperity lab``: a page in a browser on which a loop is watched and steered."""

from __future__ import annotations

import webbrowser
from functools import partial
from typing import Any

import click

from asperity.arguments import Argument
from asperity.cli.options import (
    device_option,
    file_options,
    file_values,
    law_option,
    law_options,
    options,
    surface_values,
)
from asperity.cli.own_code import learn, own_files
from asperity.cli.progress import progress_bar
from asperity.cli.run import spare_process
from asperity.devices import load_device
from asperity.errors import tell

_LAB = (
    Argument("port", "of the page on this machine", "", form="integer", example="8137",
             default_words="8137, or the next that is free"),
)  # fmt: skip


@click.command("lab")
@click.argument("surface", required=False)
@law_option("First law.  [default: the scene's, else C]")
@law_options()
@file_options
@device_option("Simulated.  [default: the scene's, else touch-x]")
@options(_LAB)
@click.option("--no-browser", is_flag=True, help="Print the address and open nothing.")
def command(surface: str | None, port: int | None, no_browser: bool, **values: Any) -> None:
    """Watch, hear and steer SURFACE in a browser: the loop of `asperity run`, simulated.

    The pointer is the hand. The page is served to this machine alone, to whoever has the address;
    nothing comes from a network. Without SURFACE, a sinusoid. Ctrl-C ends it.
    """
    # Started first: it takes long, and not from here.
    spare = click.get_current_context().with_resource(spare_process())
    from asperity.lab.serving import free_socket, run_lab
    from asperity.lab.stage import DEVICE, SURFACE, make_stage
    from asperity.scene import load_scene

    named = surface or SURFACE
    with progress_bar("reading the surface"):
        told = file_values(values)
        scene = load_scene(named, told)
        device = values["device"] or scene.device or load_device(DEVICE)
        changed = values["settings"].changed(device)
        stage = make_stage(scene, named, surface_values(values), changed, told)

    def ready(address: str) -> None:
        tell(f"the lab is at {address}")
        if not no_browser and not webbrowser.open(address):
            tell("no browser was found: open the address in one of this machine's")

    run_lab(stage, free_socket(port), ready, partial(learn, own_files()), spare)
