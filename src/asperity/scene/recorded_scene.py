"""Rebuild the scene of a recording."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from typing import Any

from asperity.core.errors import ParameterError
from asperity.devices import Device, load_device, override_device
from asperity.devices.device import FIELD_UNITS
from asperity.devices.device_file import parse_device
from asperity.recording.recording import Recording
from asperity.recording.replay import describe_changes, recorded_surface_on, recorded_texture
from asperity.scene.scene_defaults import make_servo
from asperity.scene.scene_file import Scene
from asperity.scene.sections import HANDS, RUN_ARGUMENTS, to_scene_values
from asperity.scene.setup import SIMULATED_DRIVER
from asperity.simulation import Servo

# Fields of a device by the attributes of its servo.
_SERVO_FIELDS = {"update_rate": "period", "delay_samples": "delay"} | {
    name: name
    for name in ("position_resolution", "force_resolution", "max_force", "virtual_damping")
}


def load_recorded_scene(recording: Recording) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene of a recording, and sentences about the parts that are replaced.

    Texture, law and parameters are the recorded ones. The device is the recorded one, else the one
    in the catalogue with its id, with the rate, delay, resolution and limits of the recorded servo.
    The hand is the simulated one, if there was one. There is no motion: the rows hold the path.

    Raises:
        ParameterError: the recording has no surface, or an unknown one.
    """
    surface = recorded_surface_on(recording, recorded_texture(recording))
    numbers = {"stiffness": surface.stiffness, "max_depth": surface.max_depth}
    clamp = {"clamp": surface.clamp} if surface.law.clampable else {}
    metadata = recording.metadata
    notes = [*describe_changes(recording, surface.law)]
    device = _parse_device(metadata)
    servo = _parse_servo(metadata)
    if device is None:
        notes.append("The recording names no known device; the default one is simulated")
    elif metadata.get("driver", SIMULATED_DRIVER) == SIMULATED_DRIVER:
        device = _with_servo(device, servo)  # a real device has its own servo
    hand = hand_section(metadata.get("hand"))
    run = run_section(metadata.get("plant"), servo)
    if not hand:
        notes.append("The recording has no hand that can be simulated; the default one is")
    values = {"law": surface.law, **numbers, **clamp, **surface.law_parameters}
    loop = {name: section for name, section in (("hand", hand), ("run", run)) if section}
    return Scene(surface.texture, values, device, loop), tuple(notes)


def _parse_device(metadata: Mapping[str, Any]) -> Device | None:
    data = metadata.get("device")
    if not isinstance(data, Mapping):
        return None
    try:
        if "file" in data:
            return parse_device(tomllib.loads(data["file"]), str(data.get("id")), from_file=True)
        return load_device(str(data.get("id")))
    except (ParameterError, TypeError, ValueError):
        return None


def _with_servo(device: Device, servo: Servo) -> Device:
    """Return a device with the numbers of a servo that differ from its own."""
    own = make_servo(device)[0]
    changed = {}
    for field, name in _SERVO_FIELDS.items():
        value = float(getattr(servo, name))
        if value != getattr(own, name) and math.isfinite(value):
            value = 1.0 / value if name == "period" else value
            unit = FIELD_UNITS[field]
            changed[field] = {"value": value, "unit": unit, "source": "recording"}
    return override_device(device, changed)


def _parse_servo(metadata: Mapping[str, Any]) -> Servo:
    try:
        data = metadata["servo"]
        values: dict[str, Any] = {name: float(data[name]) for name in Servo.__dataclass_fields__}
        return Servo(**values)
    except (KeyError, TypeError, ValueError):
        raise ParameterError("recording", "has no settings of its servo") from None


def hand_section(description: Any) -> dict[str, Any]:
    """Return the section [hand] of a hand simulated as a spring or a band."""
    kind = description.get("kind") if isinstance(description, Mapping) else None
    if kind not in HANDS or not HANDS[kind].arguments:
        return {}
    return {"kind": kind} | to_scene_values(description, HANDS[kind].arguments)


def run_section(plant: Any, servo: Servo) -> dict[str, Any]:
    """Return the section [run] of a plant and a servo."""
    values: dict[str, Any] = {"velocity_share": servo.velocity_share}
    if isinstance(plant, Mapping) and "centre" in plant:
        brakes = "inside" if plant.get("inside_only") else "always"
        values |= {"centre": plant["centre"], "brakes": brakes}
    elif isinstance(plant, Mapping) and plant.get("resonance"):
        values["resonance"] = True
    return to_scene_values(values, RUN_ARGUMENTS)
