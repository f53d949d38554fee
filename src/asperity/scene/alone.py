"""What a surface needs to be felt without a scene: a hand, its motion, and what a device lacks."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.devices import Device, changed_device
from asperity.scene.plant import LINKS
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering

ALONE_DURATION = 10.0
"""[s] for which a surface without a scene is felt, unless told otherwise."""
_MASS = 0.1  # [kg] of a handle of which nobody says anything
_SIDEWAYS, _HAND = "300 N/m", {"damping": "3 N*s/m", "mass": "50 g"}
_STROKE, _SPEED = 10e-3, 0.05  # [m], [m/s]
_DEEP = 0.8  # of max_depth: no deeper the hand would go if there were no wall at all


def with_mass(device: Device) -> tuple[Device, tuple[str, ...]]:
    """Return a device that can be simulated, and what was assumed of it."""
    five_bar = all(device.value(name) is not None for name in (*LINKS, "joint_damping"))
    if five_bar or device.value("apparent_mass") is not None:
        return device, ()
    given = {"apparent_mass": {"value": _MASS, "unit": "kg", "source": "assumed"}}
    mass = engineering(1e3 * _MASS, "g")
    return changed_device(device, given), (
        f"The apparent mass of {device.name} is not known; {mass} are simulated",
    )


def hand_alone(
    surface: Surface, device: Device, duration: float
) -> tuple[dict[str, dict[str, Any]], str]:
    """Return sections [hand] and [motion] of a hand that strokes a surface, and what it does.

    A spring as stiff as the surface pulls it to a depth within ``max_depth``, so that it presses
    about half as deep and stays in the depth that was analysed while the force comes in. It goes to
    and fro along the texture's scan line by 10 mm, at 50 mm/s, within a surface that ends.

    Args:
        surface: which is felt.
        device: on which; a five-bar moves along x alone.
        duration: of the run [s].
    """
    depth = _DEEP * surface.max_depth
    height = surface.law.contact.extremes(surface.texture)[1] - depth
    pull = min(surface.stiffness, 0.5 * (device.value("max_force") or math.inf) / depth)
    middle, way = _stroke(surface.texture, along_x=device.value(LINKS[0]) is not None)
    ends = [[*(float(value) for value in middle + sign * way), height] for sign in (-0.5, 0.5)]
    length = float(np.hypot(*way))
    count = max(1, math.ceil(duration * _SPEED / length))
    hand = {"kind": "spring", **_HAND, "stiffness": [_SIDEWAYS, _SIDEWAYS, f"{pull!r} N/m"]}
    motion = {"kind": "strokes", "speed": f"{_SPEED} m/s", "count": count}
    for name, end in zip(("start", "end"), ends, strict=True):
        motion[name] = [f"{value!r} m" for value in end]
    words = (
        f"A simulated hand is pulled {engineering(depth, 'm')} deep by a spring of"
        f" {engineering(pull, 'N/m')} and strokes"
        f" {engineering(length, 'm')} to and fro at {engineering(_SPEED, 'm/s')}"
    )
    return {"hand": hand, "motion": motion}, words


def _stroke(texture: Texture, *, along_x: bool) -> tuple[FloatArray, FloatArray]:
    """Return the middle of a stroke, and the way of it [m], each (2,)."""
    direction = np.array([1.0, 0.0]) if along_x else texture.scan_line().direction
    if not texture.ends:
        return np.zeros(2), _STROKE * direction
    domain = texture.domain
    middle = domain.origin + 0.5 * domain.spans.sum(axis=0)
    if along_x:
        middle[1] = 0.0
    # Half of the shortest side keeps every direction within.
    room = 0.5 * float(np.hypot(*domain.spans.T).min())
    return middle, min(_STROKE, room) * direction
