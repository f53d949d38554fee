"""Descriptions of height maps and normal maps, with their errors."""

from __future__ import annotations

import math

from asperity.analysis import characteristic_number, worst_loop
from asperity.core.units import format_quantity
from asperity.export.surface_maps import SampledMap, height_resolution, normal_error
from asperity.report.sentences.number_text import energy_text
from asperity.report.sentences.texts import sentence, sentence_case
from asperity.surface import Surface
from asperity.textures.texture import Texture

_SHADING_LAW = "G"


def describe_map(sampled_map: SampledMap) -> str:
    """Return content and size of a map."""
    size = " x ".join([format_quantity(side, "m") for side in sampled_map.size])
    tiled = "it can be tiled" if sampled_map.is_periodic else "it cannot be tiled"
    content = sentence_case(sampled_map.description)
    return sentence("sampled_map", content=content, size=size, tiled=tiled)


def describe_heights(sampled_map: SampledMap, suffix: str) -> str:
    """Return the range of the heights in a file, and their rounding error."""
    low = format_quantity(float(sampled_map.heights.min()), "m", digits=6)
    high = format_quantity(float(sampled_map.heights.max()), "m", digits=6)
    error = height_resolution(sampled_map, suffix)
    accuracy = "exact"
    if error:
        accuracy = f"with errors up to {format_quantity(error, 'm', digits=3)}"
    return f"Heights from {low} to {high}, {accuracy}; the interpolation depends on the tool."


def describe_normals(sampled_map: SampledMap, convention: str) -> str:
    """Return the errors of normals in 8 bits, and of forces computed from them."""
    angle = normal_error(sampled_map, convention)
    error = 100.0 * 2.0 * math.sin(0.5 * angle)
    return sentence("normals", angle=f"{math.degrees(angle):.2g}°", error=f"{error:.2g} %")


def describe_shading(texture: Texture, stiffness: float | None) -> str:
    """Return loop energy and q of a force along these normals, which is law G.

    Args:
        texture: the texture.
        stiffness: [N/m]; default: that of a surface.
    """
    surface = Surface(texture, _SHADING_LAW)
    if stiffness is not None:
        surface = surface.to_stiffness(stiffness)
    q = characteristic_number(surface)
    leak = worst_loop(surface)
    energy = "no loop gains energy"
    if leak.energy > 0.0:
        energy = f"a loop gains {energy_text(leak.energy)}"
    at = format_quantity(surface.stiffness, "N/m")
    depth = format_quantity(surface.max_depth, "m")
    return sentence("shading", law=_SHADING_LAW, at=at, depth=depth, energy=energy, q=q)
