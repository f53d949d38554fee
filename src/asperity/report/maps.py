"""What is said of a height map or a normal map: what is on it, and what it costs."""

from __future__ import annotations

import math

from asperity.analysis import characteristic_number, worst_loop
from asperity.export.maps import height_step, normal_error
from asperity.export.sampled import SampledMap
from asperity.report.run import energy
from asperity.surface import Surface
from asperity.textures.texture import Texture
from asperity.units import engineering

_SHADING = "G"


def map_words(sampled: SampledMap) -> str:
    """Return what is on a map."""
    wide, high = (engineering(side, "m") for side in sampled.size)
    tiled = "it can be tiled" if sampled.repeats else "it cannot be tiled"
    words = f"{sampled.words[:1].upper()}{sampled.words[1:]}"
    return (
        f"{words}: {wide} x {high} as a picture, x to the right, y down; {tiled}. On a mesh v"
        " is y / height where it goes down (glTF), 1 - y / height where it goes up (CHAI3D)."
    )


def height_words(sampled: SampledMap, suffix: str) -> str:
    """Return what heights a file holds, and how exactly."""
    low, high = (engineering(float(end), "m", digits=6) for end in (
        sampled.heights.min(), sampled.heights.max(),
    ))  # fmt: skip
    error = height_step(sampled, suffix)
    off = f"off by at most {engineering(error, 'm', digits=3)}" if error else "to the last bit"
    return f"Heights from {low} to {high}, {off}; in between a tool interpolates its own way."


def normal_words(sampled: SampledMap, convention: str) -> str:
    """Return what 8 bits cost."""
    angle = normal_error(sampled, convention)
    return (
        f"8 bits turn a normal by up to {math.degrees(angle):.2g}°: a force by them is up to"
        f" {100.0 * 2.0 * math.sin(0.5 * angle):.2g} % of itself aside."
    )


def shading_words(texture: Texture, stiffness: float | None) -> str:
    """Return what a force costs that is turned by normals: law G.

    Args:
        texture: the texture.
        stiffness: [N/m]; default: that of a surface.
    """
    surface = Surface(texture, _SHADING)
    surface = surface if stiffness is None else surface.to_stiffness(stiffness)
    q, leak = characteristic_number(surface), worst_loop(surface)
    gains = f"a loop gains {energy(leak.energy)}" if leak.energy > 0.0 else "no loop gains anything"
    at, depth = engineering(surface.stiffness, "N/m"), engineering(surface.max_depth, "m")
    return (
        f"A force that is turned by them is law {_SHADING}. At {at}, pressed to {depth}, {gains},"
        f" and its stiffness is up to {q.value:.3g} times the wall's (q, {q.method})."
    )
