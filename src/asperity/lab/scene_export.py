"""The scene of a clip as a scene file."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from asperity.core.checks import FloatArray
from asperity.core.files import read_toml
from asperity.devices import Device
from asperity.devices.device_file import to_device_toml
from asperity.lab.scene_state import SceneState
from asperity.measured.file_arguments import FILE_ARGUMENTS
from asperity.scene.recorded_scene import hand_section, run_section
from asperity.scene.scene_file import RECORDING_KIND
from asperity.scene.sections import RUN_ARGUMENTS, SURFACE_FIELDS, to_scene_values
from asperity.textures.catalogue import is_scene, parse_specification


def format_scene(
    scene_state: SceneState,
    path_file: str,
    recording_file: str,
    duration: float,
    start: FloatArray,
    velocity: FloatArray,
) -> str:
    """Return a scene (TOML) with the recorded motion of the hand.

    Args:
        scene_state: the scene of the clip.
        path_file: file of the positions of the anchor of the hand.
        recording_file: recording that contains the surface; empty if the surface is too large.
        duration: of the run [s].
        start: of the handle [m], shape (3,).
        velocity: of the handle at the start [m/s], shape (3,).
    """
    setup = scene_state.setup
    surface = scene_state.setup.surface
    values = {name: getattr(surface, name) for name in ("stiffness", "max_depth", "clamp")}
    surface_fields = (*SURFACE_FIELDS, *surface.law.arguments.values())
    course = {"duration": duration, "start": list(start), "velocity": list(velocity)}
    sections = {
        "texture": texture_section(scene_state, recording_file),
        "surface": {"law": surface.law.letter}
        | to_scene_values(values | dict(surface.law_parameters), surface_fields),
        "hand": hand_section(setup.hand.to_dict()),
        "motion": {"kind": "path", "file": path_file},
        "run": to_scene_values(course, RUN_ARGUMENTS)
        | run_section(setup.plant.to_dict(), setup.servo),
    }
    parts = [f"[{name}]\n{_format_values(values)}" for name, values in sections.items()]
    # The command names the plugins, which a scene cannot name.
    named = "".join(f" --plugin {name}" for name in scene_state.plugin_files)
    header = f"# In this folder: asperity simulate scene.toml{named}\n"
    return "\n".join([header, *parts, _format_device(scene_state.rated_device)])


def texture_section(scene_state: SceneState, recording_file: str) -> dict[str, Any]:
    """Return the section [texture] of a scene.

    A kind is given with its arguments. A measured, prepared or magnified texture is read from the
    recording, bit for bit, wherever both files are moved; only a texture too large for a recording
    is given by its absolute path.
    """
    plain = (
        parse_specification(scene_state.source) is not None
        and scene_state.magnification == (1.0, 1.0)
        and not scene_state.preparation
    )
    if recording_file and not plain:
        return {"kind": RECORDING_KIND.name, "path": recording_file}
    section = source_section(scene_state.source)
    if scene_state.source == scene_state.initial_texture[0]:
        section |= to_scene_values(scene_state.preparation, FILE_ARGUMENTS)
    size, height = scene_state.magnification
    if not size == height == 1.0:
        before = float(section.get("magnify", 1.0))
        rise = float(section.get("magnify_height", before))
        section |= {"magnify": f"{before * size!r}", "magnify_height": f"{rise * height!r}"}
    return section


def source_section(source: str) -> dict[str, Any]:
    """Return the section [texture] of a source: a kind, a scene, or a file.

    Example:
        >>> source_section("sinusoid:amplitude=0.8mm,period=1mm")
        {'kind': 'sinusoid', 'amplitude': '0.8mm', 'period': '1mm'}
    """
    if (named := parse_specification(source)) is not None:
        return {"kind": named[0], **named[1]}
    if not is_scene(source):
        return {"kind": "file", "path": os.path.abspath(source)}
    section = dict(read_toml("scene", source)["texture"])
    if "path" in section:
        section["path"] = str((Path(source).parent / section["path"]).resolve())
    return section


def _format_device(device: Device) -> str:
    """Return the section [device] with all of its fields."""
    text = re.sub(r"^(\[+)", r"\1device.", to_device_toml(device), flags=re.MULTILINE)
    return "[device]\n" + re.sub(r"^id = .*\n", "", text)


def _format_values(values: Mapping[str, Any]) -> str:
    # JSON of strings, numbers, booleans and their lists is valid TOML.
    return "".join(
        f"{name} = {json.dumps(value, ensure_ascii=False)}\n" for name, value in values.items()
    )
