"""The scene that does again what was felt in the lab."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from asperity.arguments import Argument
from asperity.checks import FloatArray
from asperity.devices import Device, changed_device
from asperity.devices.writing import device_text
from asperity.files import plain, read_toml
from asperity.lab.stage import Stage
from asperity.measured.arguments import FILE_ARGUMENTS
from asperity.scene.sections import HANDS, RUN, SURFACE
from asperity.textures.naming import is_scene, specified


def scene_text(
    stage: Stage, way: str, duration: float, start: FloatArray, velocity: FloatArray
) -> str:
    """Return a scene (TOML) that moves the hand as it was moved.

    Args:
        stage: what was shown.
        way: file of the positions of the hand's anchor.
        duration: of the run [s].
        start: of the handle [m], shape (3,).
        velocity: of the handle at the start [m/s], shape (3,).
    """
    setup = stage.setup
    surface = setup.surface
    hand = {name: value for name, value in setup.hand.to_dict().items() if value is not None}
    numbers = {name: getattr(surface, name) for name in ("stiffness", "max_depth", "clamp")}
    run = {"duration": duration, "start": list(start), "velocity": list(velocity),
           "velocity_share": setup.servo.velocity_share, **_bars(setup.plant)}  # fmt: skip
    sections = {
        "texture": texture_section(stage),
        "surface": {"law": surface.law.letter}
        | _texts(numbers | dict(surface.law_parameters),
                 (*SURFACE, *surface.law.arguments.values())),
        "hand": {"kind": hand["kind"]} | _texts(hand, HANDS[hand["kind"]].arguments),
        "motion": {"kind": "path", "file": way},
        "run": _texts(run, RUN),
    }  # fmt: skip
    parts = [f"[{name}]\n{_lines(values)}" for name, values in sections.items()]
    return "\n".join([*parts, _device(setup.device, setup.servo.delay)])


def texture_section(stage: Stage) -> dict[str, Any]:
    """Return the section [texture] of what the stage shows."""
    section = source_section(stage.named)
    if stage.named == stage.first[0]:
        section |= _texts(stage.told, FILE_ARGUMENTS)
    size, height = stage.magnified
    if not size == height == 1.0:
        before = float(section.get("magnify", 1.0))
        rise = float(section.get("magnify_height", before))
        section |= {"magnify": f"{before * size!r}", "magnify_height": f"{rise * height!r}"}
    return section


def source_section(source: str) -> dict[str, Any]:
    """Return the section [texture] of what names a texture: a kind, a scene, or a file.

    Example:
        >>> source_section("sinusoid:amplitude=0.8mm,period=1mm")
        {'kind': 'sinusoid', 'amplitude': '0.8mm', 'period': '1mm'}
    """
    if (named := specified(source)) is not None:
        return {"kind": named[0], **named[1]}
    if not is_scene(source):
        return {"kind": "file", "path": os.path.abspath(source)}
    section = dict(read_toml("scene", source)["texture"])
    if "path" in section:
        section["path"] = str((Path(source).parent / section["path"]).resolve())
    return section


def _texts(values: Mapping[str, Any], arguments: Iterable[Argument]) -> dict[str, Any]:
    """Return the values that the arguments declare, as a scene writes them, with their units."""
    known = {argument.name: argument for argument in arguments}
    return {
        name: _text(plain(value), known[name].unit)
        for name, value in values.items()
        if name in known and value is not None
    }


def _text(value: Any, unit: str) -> Any:
    if isinstance(value, list):
        return [_text(part, unit) for part in value]
    if isinstance(value, (bool, str)):
        return value
    return f"{value!r} {unit}" if unit else value


def _bars(plant: Any) -> dict[str, Any]:
    """Return what a five-bar was told besides its device."""
    if not hasattr(plant, "inside_only"):
        return {}
    return {"centre": plant.centre, "brakes": "inside" if plant.inside_only else "always"}


def _device(device: Device, delay: int) -> str:
    """Return the section [device] with all of its fields, and the delay that was chosen."""
    words = {"value": float(delay), "unit": "1", "source": "chosen in the lab"}
    late = changed_device(device, {"delay_samples": words})
    text = re.sub(r"^(\[+)", r"\1device.", device_text(late), flags=re.MULTILINE)
    return "[device]\n" + re.sub(r"^id = .*\n", "", text)


def _lines(values: Mapping[str, Any]) -> str:
    # What JSON writes of texts, numbers, booleans and lists of them, TOML reads.
    return "".join(
        f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in values.items()
    )
