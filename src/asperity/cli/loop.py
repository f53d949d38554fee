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
from asperity.cli.progress import progress_bar, step_bar
from asperity.errors import ParameterError
from asperity.laws import KNOWN_LAWS, Law, find_law
from asperity.units import engineering

if TYPE_CHECKING:
    from asperity.devices import Device
    from asperity.scene import Scene
    from asperity.scene.setup import Setup
    from asperity.textures import Texture


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
    alone: bool = False,
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
        alone: whether a surface without a scene will do there, too, with a hand of its own; law and
            stiffness that nobody names are then those that a comparison recommends.

    Raises:
        ParameterError: for what is missing, unknown or wrong.
    """
    from asperity.scene import load_scene
    from asperity.scene.setup import make_setup

    if simulated and not alone and not source.lower().endswith(".toml"):
        words = "must be a scene file (.toml) with [texture], [hand] and [motion]"
        raise ParameterError("scene", words, source)
    surface = surface_values(values)
    if laws:
        surface.setdefault("law", find_law("W"))
    with progress_bar("reading the surface"):
        scene = load_scene(source, file_values(values))
    loop = scene.loop
    scene = scene if simulated else replace(scene, loop={**_NOBODY, **_servo(scene)})
    unsaid = (defaults or {}).keys() - scene.surface.keys() - surface.keys()
    surface |= {name: (defaults or {})[name] for name in unsaid}
    device = chosen_device(values["device"], scene, values)
    named, said = {**scene.surface, **surface}, ""
    if alone and not {"law", "stiffness"} <= named.keys() and "hand" not in loop:
        chosen, said = recommended(scene.texture, device, named)
        surface, named = {**surface, **chosen}, {**named, **chosen}
    if laws or "law" in named:
        refuse_idle(surface, laws or (find_law(named["law"]),))
    setup = make_setup(
        scene, surface=surface, device=device, duration=duration, laws=laws,
        keeps_delay=keeps_delay, alone=alone,
    )  # fmt: skip
    return replace(setup, assumptions=(said, *setup.assumptions)) if said else setup


def recommended(
    texture: Texture, device: Device, named: Mapping[str, Any]
) -> tuple[dict[str, Any], str]:
    """Return the law and the stiffness that a comparison recommends, and what is said of them.

    Args:
        texture: which is felt.
        device: on which.
        named: what is said of the surface already; law or stiffness among it stay.

    Raises:
        ParameterError: where nothing can be recommended.
    """
    from asperity.analysis.compare import compare
    from asperity.scene.sections import surface_keywords

    laws = [find_law(named["law"])] if "law" in named else list(KNOWN_LAWS.values())
    keywords = surface_keywords(named, *laws)
    keywords.pop("law", None)
    with step_bar("comparing the laws", len(laws)) as told:
        found = compare(texture, device, laws, progress=told, **keywords)
    row = found.rows[0] if "law" in named else found.recommended_row or found.nearest_row
    if row is None:
        words = f"is missing, and none can be recommended: {found.recommendation}"
        raise ParameterError("law", words)
    chosen: dict[str, Any] = {"law": row.law}
    if "stiffness" in named:
        return chosen, f"Law {row.law.letter}, as asperity compare recommends"
    if not row.start:
        words = f"is missing, and none is known to be quiet for law {row.law.letter}"
        raise ParameterError("stiffness", f"{words} on {device.id}: --stiffness 100N/m, say")
    start = engineering(row.start, "N/m")
    return {**chosen, "stiffness": row.start}, (
        f"Law {row.law.letter} at {start}, as asperity compare recommends to begin with"
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
