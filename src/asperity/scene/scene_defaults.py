"""Plant and servo of a device, and the default hand and motion for a surface without a scene."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.devices import Device, override_device
from asperity.devices.five_bar import FiveBar
from asperity.scene.loop_sections import BRAKES
from asperity.simulation import Cartesian, Pantograph, Plant, Resonance, Servo
from asperity.surface import Surface
from asperity.textures.texture import Texture

LINK_FIELDS = ("proximal_link", "distal_link", "base_distance")
DEFAULT_RATE = 1000.0


def make_plant(
    device: Device,
    *,
    centre: tuple[float, float] | None = None,
    has_resonance: bool = False,
    brakes: str | None = None,
    needs_dynamics: bool = True,
) -> tuple[Plant, list[str]]:
    """Return the plant of a device, and the assumptions about it.

    A device with links and joint damping is a five-bar in the x-z plane; one with an apparent mass
    is a mass in space, with its physical damping and its dry friction.

    Args:
        device: the device.
        centre: position of the scene's origin in the five-bar's plane [m]; default: on its axis of
            symmetry, 100 mm from the motors.
        has_resonance: whether to simulate the bandwidth as the first structural mode of a mass.
        brakes: brakes of a five-bar, "inside" the body only (default) or "always".
        needs_dynamics: whether the plant's motion is simulated; a prescribed handle needs no mass.

    Raises:
        ParameterError: the device lacks a number, or an argument does not apply to it.
    """
    if brakes is not None and brakes not in BRAKES.choices:
        raise ParameterError("run.brakes", "must be 'inside' or 'always'", brakes)
    if needs_dynamics and _is_five_bar(device):
        return _make_five_bar(device, centre, has_resonance, brakes)
    for name, value in (("centre", centre), ("brakes", brakes)):
        if value is not None:
            reason = f"needs a five-bar, which {device.id} is not"
            if not needs_dynamics:
                reason = "does not apply to a handle whose motion is prescribed"
            raise ParameterError(f"run.{name}", reason)
    if not needs_dynamics:
        return Cartesian(mass=1.0), []
    return _make_mass(device, has_resonance)


def _is_five_bar(device: Device) -> bool:
    return all(device.value(name) is not None for name in (*LINK_FIELDS, "joint_damping"))


def _make_five_bar(
    device: Device, centre: tuple[float, float] | None, has_resonance: bool, brakes: str | None
) -> tuple[Plant, list[str]]:
    if has_resonance:
        raise ParameterError("run.resonance", "is not modelled for a five-bar: leave it out")
    proximal, distal, base = (float(device.value(name) or 0.0) for name in LINK_FIELDS)
    plant = Pantograph(
        FiveBar(proximal, distal, base),
        joint_damping=device.value("joint_damping") or 0.0,
        centre=centre or (-0.5 * base, 0.1),
        inside_only=brakes != "always",
        friction=device.value("friction") or 0.0,
    )
    return plant, list(plant.notes)


def _make_mass(device: Device, has_resonance: bool) -> tuple[Plant, list[str]]:
    mass = device.value("apparent_mass")
    if mass is None:
        raise ParameterError(
            "device",
            f"{device.id}: its apparent_mass is not known: in a scene it is a key of [device], "
            "else {apparent_mass}",
            apparent_mass="50 g",
        )
    notes = []
    values: dict[str, float] = {}
    for field, quantity in (("damping", "physical damping"), ("friction", "dry friction")):
        value = device.value(field)
        values[field] = value or 0.0
        if value is None:
            notes.append(f"The {quantity} of {device.name} is not known; none is simulated")
    mode = None
    if has_resonance:
        bandwidth = device.value("bandwidth")
        if bandwidth is None:
            raise ParameterError("run.resonance", f"needs the bandwidth of {device.id} [Hz]")
        mode = Resonance(bandwidth)
        frequency = format_quantity(bandwidth, "Hz")
        notes.append(f"First mode at {frequency}: half the mass, 2 % damping")
    return Cartesian(mass, values["damping"], mode, values["friction"]), notes


def make_servo(device: Device, *, uses_delay: bool = True) -> tuple[Servo, list[str]]:
    """Return the servo of a device, and the assumptions about it.

    Args:
        device: the device.
        uses_delay: whether the device's delay is used; if not, no assumption is made about it.
    """
    rate = device.value("update_rate")
    notes = []
    if rate is None:
        rate = DEFAULT_RATE
        notes.append(f"The update rate of {device.name} is not known; {rate:g} Hz is simulated")
    fields = ("position_resolution", "force_resolution", "max_force", "virtual_damping")
    known: dict[str, Any] = {name: device.value(name) for name in fields if name in device.data}
    delay = device.value("delay_samples")
    if delay is None and uses_delay:
        notes.append(f"The delay of {device.name} is not known; none is simulated")
    return Servo(1.0 / rate, delay=int(delay or 0), **known), notes


DEFAULT_STROKE_DURATION = 10.0
"""Default length of a run [s] for a surface without a scene."""
_ASSUMED_MASS = 0.1  # [kg], if the apparent mass is unknown
_LATERAL_STIFFNESS = "300 N/m"
_HAND_VALUES = {"damping": "3 N*s/m", "mass": "50 g"}
_STROKE = 10e-3  # [m], [m/s]
_SPEED = 0.05
_DEPTH_FRACTION = 0.8  # depth of the anchor over max_depth, which bounds that of the hand


def with_assumed_mass(device: Device) -> tuple[Device, tuple[str, ...]]:
    """Return a device that can be simulated, and the assumptions about it."""
    if _is_five_bar(device) or device.value("apparent_mass") is not None:
        return device, ()
    fields = {"apparent_mass": {"value": _ASSUMED_MASS, "unit": "kg", "source": "assumed"}}
    mass = format_quantity(1e3 * _ASSUMED_MASS, "g")
    return override_device(device, fields), (
        f"The apparent mass of {device.name} is not known; {mass} are simulated",
    )


def default_hand_sections(
    surface: Surface, device: Device, duration: float
) -> tuple[dict[str, dict[str, Any]], str]:
    """Return sections [hand] and [motion] of a hand that strokes a surface, and a description.

    A spring as stiff as the surface pulls the hand to a depth within ``max_depth``: it presses
    about half as deep and stays within the analysed depth during the onset of the force. It moves
    to and fro along the texture's scan line by 10 mm, at 50 mm/s, within a finite surface.

    Args:
        surface: the surface.
        device: the device; a five-bar moves along x only.
        duration: length of the run [s].
    """
    depth = _DEPTH_FRACTION * surface.max_depth
    height = surface.law.contact.extremes(surface.texture)[1] - depth
    pull = min(surface.stiffness, 0.5 * (device.value("max_force") or math.inf) / depth)
    is_planar = device.value(LINK_FIELDS[0]) is not None
    middle, stroke = _default_stroke(surface.texture, along_x=is_planar)
    ends = [[*(float(value) for value in middle + sign * stroke), height] for sign in (-0.5, 0.5)]
    length = float(np.hypot(*stroke))
    count = max(1, math.ceil(duration * _SPEED / length))
    hand = {
        "kind": "spring",
        **_HAND_VALUES,
        "stiffness": [_LATERAL_STIFFNESS, _LATERAL_STIFFNESS, f"{pull!r} N/m"],
    }
    motion = {"kind": "strokes", "speed": f"{_SPEED} m/s", "count": count}
    for name, end in zip(("start", "end"), ends, strict=True):
        motion[name] = [f"{value!r} m" for value in end]
    note = (
        f"A simulated hand is pulled {format_quantity(depth, 'm')} deep by a spring of"
        f" {format_quantity(pull, 'N/m')} and strokes"
        f" {format_quantity(length, 'm')} to and fro at {format_quantity(_SPEED, 'm/s')}"
    )
    return {"hand": hand, "motion": motion}, note


def _default_stroke(texture: Texture, *, along_x: bool) -> tuple[FloatArray, FloatArray]:
    """Return the middle and the vector of a stroke [m], each shape (2,)."""
    direction = np.array([1.0, 0.0]) if along_x else texture.scan_line().direction
    if not texture.is_mirrored:
        return np.zeros(2), _STROKE * direction
    domain = texture.domain
    middle = domain.origin + 0.5 * domain.spans.sum(axis=0)
    if along_x:
        middle[1] = 0.0
    # Half of the shortest side fits along every direction.
    limit = 0.5 * float(np.hypot(*domain.spans.T).min())
    return middle, min(_STROKE, limit) * direction
