"""What the commands that run a closed loop share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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
) -> Setup:
    """Return the closed loop that a scene file and the options name.

    Args:
        source: path of the scene.
        values: of the options, by name.
        duration: of the run [s]; comes before the scene's.
        laws: those that the loop will be changed to; the scene's own does not count then.
        keeps_delay: whether the device's delay counts.
        defaults: of the surface, where neither the options nor the scene say anything.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    from asperity.scene import load_scene
    from asperity.scene.setup import make_setup

    if not source.lower().endswith(".toml"):
        words = "must be a scene file (.toml) with [texture], [hand] and [motion]"
        raise ParameterError("scene", words, source)
    surface = surface_values(values)
    if laws:
        surface.setdefault("law", find_law("W"))
    with progress_bar("reading the surface"):
        scene = load_scene(source, file_values(values))
    surface |= {k: v for k, v in (defaults or {}).items() if k not in {**scene.surface, **surface}}
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


def chosen_laws(laws: tuple[Law, ...] | None, law: Law | None) -> tuple[Law, ...]:
    """Return the laws to try: those asked for, else the one of ``--law``, else all."""
    return laws or (() if law is None else (law,)) or tuple(KNOWN_LAWS.values())
