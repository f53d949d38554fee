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
    wide, high = (format_quantity(side, "m") for side in sampled_map.size)
    tiled = "it can be tiled" if sampled_map.is_periodic else "it cannot be tiled"
    content = sentence_case(sampled_map.description)
    return sentence("sampled_map", content=content, size=f"{wide} x {high}", tiled=tiled)


def describe_heights(sampled_map: SampledMap, suffix: str) -> str:
    """Return the range of the heights in a file, and their rounding error."""
    ends = sampled_map.heights.min(), sampled_map.heights.max()
    low, high = (format_quantity(float(end), "m", digits=6) for end in ends)
    error = height_resolution(sampled_map, suffix)
    accuracy = f"with errors up to {format_quantity(error, 'm', digits=3)}" if error else "exact"
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
    surface = surface if stiffness is None else surface.to_stiffness(stiffness)
    q = characteristic_number(surface)
    leak = worst_loop(surface)
    has_gain = leak.energy > 0.0
    energy = f"a loop gains {energy_text(leak.energy)}" if has_gain else "no loop gains energy"
    at = format_quantity(surface.stiffness, "N/m")
    depth = format_quantity(surface.max_depth, "m")
    return sentence("shading", law=_SHADING_LAW, at=at, depth=depth, energy=energy, q=q)
