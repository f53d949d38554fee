"""What the commands that run a closed loop share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from asperity.cli.options import (
    Command,
    chosen_device,
    device_option,
    file_options,
    file_values,
    law_option,
    law_options,
    refuse_idle,
    surface_values,
)
from asperity.cli.progress import progress_bar
from asperity.errors import ParameterError
from asperity.laws import KNOWN_LAWS, Law, find_law

if TYPE_CHECKING:
    from asperity.scene import Scene
    from asperity.scene.setup import Setup


def loop_options(command: Command) -> Command:
    """Add the scene and the options of surface, law and device."""
    command = law_options()(file_options(command))
    command = device_option("Comes before the scene's.  [default: omega.3]")(command)
    command = law_option("Comes before the scene's.")(command)
    return click.argument("scene")(command)


def read_setup(
    source: str,
    values: dict[str, Any],
    duration: float | None = None,
    laws: Sequence[Law] = (),
    *,
    keeps_delay: bool = True,
    defaults: Mapping[str, Any] | None = None,
    simulated: bool = True,
) -> Setup:
    """Return the closed loop that a scene file and the options name.

    Args:
        source: path of the scene.
        values: of the options, by name.
        duration: of the run [s]; comes before the scene's.
        laws: those that the loop will be changed to; the scene's own does not count then.
        keeps_delay: whether the device's delay counts.
        defaults: of the surface, where neither the options nor the scene say anything.
        simulated: whether device and hand are; if not, any surface will do for a scene.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    from asperity.scene import load_scene
    from asperity.scene.setup import make_setup

    if simulated and not source.lower().endswith(".toml"):
        words = "must be a scene file (.toml) with [texture], [hand] and [motion]"
        raise ParameterError("scene", words, source)
    surface = surface_values(values)
    if laws:
        surface.setdefault("law", find_law("W"))
    with progress_bar("reading the surface"):
        scene = load_scene(source, file_values(values))
    scene = scene if simulated else replace(scene, loop={**_NOBODY, **_servo(scene)})
    unsaid = (defaults or {}).keys() - scene.surface.keys() - surface.keys()
    surface |= {name: (defaults or {})[name] for name in unsaid}
    named = {**scene.surface, **surface}
    if laws or "law" in named:
        refuse_idle(surface, laws or (find_law(named["law"]),))
    return make_setup(
        scene,
        surface=surface,
        device=chosen_device(values["device"], scene, values),
        duration=duration,
        laws=laws,
        keeps_delay=keeps_delay,
    )


# Where a real hand holds a real device nothing of it is computed.
_NOBODY: dict[str, Any] = {
    "hand": {"kind": "moved"},
    "motion": {"kind": "still", "point": [0, 0, 0]},
}


def _servo(scene: Scene) -> dict[str, Any]:
    """Return what a scene says of the loop itself."""
    return {name: section for name, section in scene.loop.items() if name == "servo"}


def chosen_laws(laws: tuple[Law, ...] | None, law: Law | None) -> tuple[Law, ...]:
    """Return the laws to try: those asked for, else the one of ``--law``, else all."""
    return laws or (() if law is None else (law,)) or tuple(KNOWN_LAWS.values())
