"""``asperity lab``: a page in a browser on which a loop is watched and steered."""

from __future__ import annotations

import webbrowser
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from asperity.arguments import Argument
from asperity.cli.driver import (
    REPLAY,
    SIMULATED,
    driven_setup,
    driver_options,
    named_driver,
    refuse_risk,
    spare_process,
)
from asperity.cli.options import (
    device_option,
    file_options,
    file_values,
    law_option,
    law_options,
    options,
    surface_values,
)
from asperity.cli.own_code import learn, own_contents, own_files
from asperity.cli.progress import progress_bar
from asperity.devices import load_device
from asperity.errors import ParameterError, tell

if TYPE_CHECKING:
    from asperity.lab.handle import Handle
    from asperity.lab.reel import Reel
    from asperity.lab.stage import Stage

_LAB = (
    Argument("port", "of the page on this machine", "", form="integer", example="8137",
             default_words="8137, or the next that is free"),
)  # fmt: skip


@click.command("lab")
@click.argument("surface", required=False)
@law_option("First law.  [default: the scene's, else C; with --driver as compare recommends]")
@law_options()
@file_options
@device_option("Device.  [default: the scene's, else touch-x; with --driver omega.3]")
@driver_options
@options(_LAB)
@click.option("--no-browser", is_flag=True, help="Print the address and open nothing.")
def command(
    surface: str | None, port: int | None, driver: str, *, accept_risk: bool, no_browser: bool,
    **values: Any,
) -> None:  # fmt: skip
    """Watch, hear and steer SURFACE in a browser: the loop of `asperity run`.

    On the simulated device the pointer is the hand. With --driver the page is the window on a real
    one: whoever holds its handle feels, and the page starts, changes and ends it. SURFACE may be a
    recording (.mcap, or an archive that the lab has saved), which is shown again on its own
    surface. The page is served to this machine alone, to whoever has the address; nothing comes
    from a network. Without SURFACE, a sinusoid. Ctrl-C ends it.
    """
    # Started first: it takes long, and not from here.
    spare = click.get_current_context().with_resource(spare_process())
    from asperity.lab.serving import free_socket, run_lab
    from asperity.lab.stage import SURFACE

    named = surface or SURFACE
    reel = handle = None
    if driver == SIMULATED:
        stage, reel = _stage(named, values)
        stage = replace(stage, code=own_contents())
    else:
        stage, handle = _held(named, values, driver, accept_risk=accept_risk)

    def ready(address: str) -> None:
        tell(f"the lab is at {address}")
        if not no_browser and not webbrowser.open(address):
            tell("no browser was found: open the address in one of this machine's")

    run_lab(
        stage, free_socket(port), ready, partial(learn, own_files()), spare, reel, handle,
        accepts_risk=accept_risk,
    )  # fmt: skip


def _stage(named: str, values: dict[str, Any]) -> tuple[Stage, Reel | None]:
    """Return what is shown at first on the simulated device, and the rows of a recording."""
    from asperity.lab.opened import open_recorded, recording_in
    from asperity.lab.stage import DEVICE, make_stage
    from asperity.scene import load_scene

    own, told, settings = surface_values(values), file_values(values), values["settings"]
    if (path := recording_in(named, _folder())) is not None:
        for name in told:
            raise ParameterError(name, "means nothing for a recording, which holds its surface")
        with progress_bar("reading the recording"):
            return open_recorded(path, named, own, values["device"], settings.changed)
    with progress_bar("reading the surface"):
        scene = load_scene(named, told)
        device = values["device"] or scene.device or load_device(DEVICE)
        return make_stage(scene, named, own, settings.changed(device), told), None


def _folder() -> Path:
    """Return a folder that is there until the command ends."""
    return Path(click.get_current_context().with_resource(TemporaryDirectory()))


def _held(
    named: str, values: dict[str, Any], name: str, *, accept_risk: bool
) -> tuple[Stage, Handle]:
    """Return what is shown on the device of a driver, and its handle.

    Raises:
        ParameterError: for a driver that is unknown, a device without a greatest force, a
            stiffness above the limit, or a recording.
    """
    from asperity.lab.handle import make_handle
    from asperity.lab.opened import recording_in
    from asperity.lab.stage import held_stage
    from asperity.servo.process import need_greatest_force

    if recording_in(named, _folder()) is not None:
        words = f"cannot show {named} again, a recording: leave it out, or name a surface and"
        raise ParameterError("driver", f"{words} --driver {REPLAY}run.mcap, to feel it on that way")
    setup, own = driven_setup(named, values, name)
    driver = named_driver(name, setup)
    need_greatest_force(driver, setup.servo)
    if not accept_risk:
        refuse_risk(setup)
    return held_stage(setup, own, named, file_values(values)), make_handle(driver, setup)
