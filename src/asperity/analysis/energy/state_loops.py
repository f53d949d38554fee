"""Loops on which a law with state gains energy, by the path of its anchor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.analysis.energy.loop_integral import loop_work
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.texture import ScanLine

_START_POINTS = 64
_COLUMNS = 128
# In-plane loops whose work is computed, those with the greatest estimates.
_EVALUATED_LOOPS = 4
_RADIUS_FACTOR = 1.0 - 1e-9


@dataclass(frozen=True)
class StateLoop:
    """A closed polygon that starts at the onset of contact, where the anchor is created.

    Attributes:
        energy: work of the force on the probe [J].
        vertices: vertices (n, 3) [m].
        description: the loop in words.
    """

    energy: float
    vertices: FloatArray
    description: str


def friction_path(surface: Surface, start: FloatArray, along: FloatArray) -> FloatArray:
    """Return the paper's path of (27) from a point of the plane, vertices (5, 3) [m].

    Down to light contact, along by max_deflection, down to max_depth, back, and up.
    """
    depth, light = surface.max_depth, 1e-6 * surface.max_depth
    end = start + surface.parameter("max_deflection") * along
    above = 0.1 * depth
    return np.array(
        [[*start, above], [*start, -light], [*end, -light], [*end, -depth], [*start, -depth]]
    )


def light_then_deep_loop(surface: Surface, line: ScanLine) -> StateLoop:
    """Return the best of the paper's paths of (27), in both directions, from points on the line."""
    paths = [
        friction_path(surface, start, sign * line.direction)
        for start in line.points(_START_POINTS)
        for sign in (1.0, -1.0)
    ]
    energies = [loop_work(surface, path) for path in paths]
    best = int(np.argmax(energies))
    text = (
        f"the paper's path of (27), worst of {len(paths)} starts: "
        f"{surface.parameter('max_deflection') * 1e3:g} mm along in light contact, "
        f"back at {surface.max_depth * 1e3:g} mm"
    )
    return StateLoop(float(energies[best]), paths[best], text)


def in_plane_loop(surface: Surface, line: ScanLine) -> StateLoop:
    """Return the best loop at constant depth about an anchor that sticks.

    There f = -k D μ (1 - m) d/d_max is a field of the deflection d, whose curl k D μ ∇m × d/d_max
    has opposite signs on the two sides of the scan line, which swap where m falls instead of rises.
    The polygon encloses one sign of it within the circle |d| < d_max.
    """
    outlines = [
        _in_plane_outline(surface, line, start, sign)
        for start in line.points(_START_POINTS)
        for sign in (1.0, -1.0)
    ]
    outlines.sort(key=lambda outline: -outline[0])
    text = f"in the plane at {surface.max_depth * 1e3:g} mm about an anchor that sticks"
    best = [vertices for _estimate, vertices in outlines[:_EVALUATED_LOOPS]]
    loops = [StateLoop(loop_work(surface, vertices), vertices, text) for vertices in best]
    return max(loops, key=lambda loop: loop.energy)


def _in_plane_outline(
    surface: Surface, line: ScanLine, anchor: FloatArray, sign: float
) -> tuple[float, FloatArray]:
    """Return ∬|∇m × d| within the outline, up to a factor, and the polygon."""
    longest = surface.parameter("max_deflection")
    t = np.linspace(-1.0, 1.0, _COLUMNS + 1) * longest * _RADIUS_FACTOR
    along, across = line.direction, np.array([-line.direction[1], line.direction[0]])
    xy = anchor + t[:, None] * along
    slope = surface.texture.gradient(xy) @ along
    width = np.sqrt(np.maximum((_RADIUS_FACTOR * longest) ** 2 - t * t, 0.0))
    estimate = float((np.abs(slope) * width * width).sum())
    side = sign * np.where(slope >= 0.0, width, -width)
    low, high = np.minimum(side, 0.0), np.maximum(side, 0.0)
    forth = xy + low[:, None] * across
    back = (xy + high[:, None] * across)[::-1]
    plane = np.concatenate([anchor[None], forth, back, anchor[None]])
    depth = np.full((len(plane), 1), -surface.max_depth)
    above = np.array([[*anchor, 0.1 * surface.max_depth]])
    return estimate, np.concatenate([above, np.hstack([plane, depth])])
