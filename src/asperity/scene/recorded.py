"""The scene that a recording was made in, as far as the recording says it."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from typing import Any

from asperity.devices import Device, changed_device, load_device
from asperity.devices.device import FIELD_TABLE
from asperity.devices.reading import parse_device
from asperity.errors import ParameterError
from asperity.recording.recording import Recording
from asperity.recording.replay import changes, recorded_on, recorded_texture
from asperity.scene.loading import Scene
from asperity.scene.plant import default_servo
from asperity.scene.sections import HANDS, RUN, written
from asperity.scene.setup import SIMULATED
from asperity.simulation import Servo

# Fields of a device that are numbers of its servo.
_FIELDS = {"update_rate": "period", "delay_samples": "delay"} | {
    name: name
    for name in ("position_resolution", "force_resolution", "max_force", "virtual_damping")
}


def recorded_scene(recording: Recording) -> tuple[Scene, tuple[str, ...]]:
    """Return the scene of a recording, and in sentences what of it is not the recording's.

    Texture, law and parameters are those that it holds. The device is the one that it holds, else
    the one of the catalogue that it names, with the rate, delay, steps and limits of its servo. The
    hand is the simulated one, if there was any. A motion there is none: what moved, the rows say.

    Raises:
        ParameterError: if it holds no surface, or one that is not known here.
    """
    surface = recorded_on(recording, recorded_texture(recording))
    numbers = {"stiffness": surface.stiffness, "max_depth": surface.max_depth}
    clamp = {"clamp": surface.clamp} if surface.law.clampable else {}
    about, said = recording.about, [*changes(recording, surface.law)]
    device, servo = _device(about), _servo(about)
    if device is None:
        said.append("The recording names no device that is known here; another one is simulated")
    elif about.get("driver", SIMULATED) == SIMULATED:
        device = _with_servo(device, servo)  # a real one has its own: its loop adds none
    hand, run = _hand(about.get("hand")), _run(about.get("plant"), servo)
    if not hand:
        said.append("The recording says of no hand that can be simulated; a usual one is")
    values = {"law": surface.law, **numbers, **clamp, **surface.law_parameters}
    loop = {name: section for name, section in (("hand", hand), ("run", run)) if section}
    return Scene(surface.texture, values, device, loop), tuple(said)


def _device(about: Mapping[str, Any]) -> Device | None:
    said = about.get("device")
    if not isinstance(said, Mapping):
        return None
    try:
        if "file" in said:
            return parse_device(tomllib.loads(said["file"]), str(said.get("id")), from_file=True)
        return load_device(str(said.get("id")))
    except (ParameterError, TypeError, ValueError):
        return None


def _with_servo(device: Device, servo: Servo) -> Device:
    """Return a device with the numbers of a servo, where they are others."""
    usual, others = default_servo(device)[0], {}
    for field, name in _FIELDS.items():
        value = float(getattr(servo, name))
        if value != getattr(usual, name) and math.isfinite(value):
            value = 1.0 / value if name == "period" else value
            unit = FIELD_TABLE[field].unit
            others[field] = {"value": value, "unit": unit, "source": "of the recording"}
    return changed_device(device, others)


def _servo(about: Mapping[str, Any]) -> Servo:
    said = about.get("servo")
    try:
        values: dict[str, Any] = {
            name: float(said[name])  # type: ignore[index]  # else a TypeError
            for name in Servo.__dataclass_fields__
        }
        return Servo(**values)
    except (KeyError, TypeError, ValueError):
        raise ParameterError("recording", "does not say the settings of its servo") from None


def _hand(said: Any) -> dict[str, Any]:
    """Return the section [hand] of a simulated hand that a spring or a band pulls."""
    kind = said.get("kind") if isinstance(said, Mapping) else None
    if kind not in HANDS or not HANDS[kind].arguments:
        return {}
    return {"kind": kind} | written(said, HANDS[kind].arguments)


def _run(plant: Any, servo: Servo) -> dict[str, Any]:
    """Return what the section [run] says of plant and servo."""
    values: dict[str, Any] = {"velocity_share": servo.velocity_share}
    if isinstance(plant, Mapping) and "centre" in plant:
        brakes = "inside" if plant.get("inside_only") else "always"
        values |= {"centre": plant["centre"], "brakes": brakes}
    elif isinstance(plant, Mapping) and plant.get("resonance"):
        values["resonance"] = True
    return written(values, RUN)
