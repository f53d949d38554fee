"""The scene that does again what was felt in the lab."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.checks import FloatArray
from asperity.devices import Device
from asperity.devices.writing import device_text
from asperity.files import read_toml
from asperity.lab.stage import Stage
from asperity.measured.arguments import FILE_ARGUMENTS
from asperity.scene.loading import RECORDED
from asperity.scene.sections import HANDS, RUN, SURFACE, written
from asperity.textures.naming import is_scene, specified


def scene_text(
    stage: Stage, way: str, held: str, duration: float, start: FloatArray, velocity: FloatArray
) -> str:
    """Return a scene (TOML) that moves the hand as it was moved.

    Args:
        stage: what was shown.
        way: file of the positions of the hand's anchor.
        held: recording that holds the surface; empty if it is too large for one.
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
        "texture": texture_section(stage, held),
        "surface": {"law": surface.law.letter}
        | written(numbers | dict(surface.law_parameters),
                 (*SURFACE, *surface.law.arguments.values())),
        "hand": {"kind": hand["kind"]} | written(hand, HANDS[hand["kind"]].arguments),
        "motion": {"kind": "path", "file": way},
        "run": written(run, RUN),
    }  # fmt: skip
    parts = [f"[{name}]\n{_lines(values)}" for name, values in sections.items()]
    return "\n".join([_head(stage), *parts, _device(stage.judged)])


def _head(stage: Stage) -> str:
    """Return what to type: a scene names no code, and the command line must."""
    named = "".join(f" --law-module {name}" for name in stage.code)
    return f"# In this folder: asperity simulate scene.toml{named}\n"


def texture_section(stage: Stage, held: str) -> dict[str, Any]:
    """Return the section [texture] of what the stage shows.

    A kind with its arguments is named. What was measured, prepared or magnified is taken from the
    recording, to the last bit, wherever both are moved; only what is too large for it is named, by
    the place where it is here.
    """
    plain = specified(stage.named) is not None and stage.magnified == (1.0, 1.0) and not stage.told
    if held and not plain:
        return {"kind": RECORDED.name, "path": held}
    section = source_section(stage.named)
    if stage.named == stage.first[0]:
        section |= written(stage.told, FILE_ARGUMENTS)
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


def _bars(plant: Any) -> dict[str, Any]:
    """Return what a plant was told besides its device."""
    if not hasattr(plant, "inside_only"):
        return {"resonance": True} if plant.resonance is not None else {}
    return {"centre": plant.centre, "brakes": "inside" if plant.inside_only else "always"}


def _device(device: Device) -> str:
    """Return the section [device] with all of its fields."""
    text = re.sub(r"^(\[+)", r"\1device.", device_text(device), flags=re.MULTILINE)
    return "[device]\n" + re.sub(r"^id = .*\n", "", text)


def _lines(values: Mapping[str, Any]) -> str:
    # What JSON writes of texts, numbers, booleans and lists of them, TOML reads.
    return "".join(
        f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in values.items()
    )
