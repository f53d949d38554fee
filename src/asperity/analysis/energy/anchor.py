"""The anchor of the stick-slip model along straight edges, exactly.

Between two points of an edge the anchor either stays (sticking: the deflection grows with the
probe) or is dragged at full deflection (sliding: the anchor runs along a tractrix, the curve of an
object pulled by a string of fixed length). The step-by-step map of the device tends to this for
small steps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from asperity.checks import FloatArray
from asperity.surface import Surface

# Steps by which it is found where an edge enters and leaves contact: per wave of the height, and
# at most.
_STEPS_PER_WAVE, _STEPS = 16, 65_536
_HALVINGS = 52

Deflection = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Stretch:
    """A part of an edge along which the anchor does one thing.

    Attributes:
        start: first point [m], shape (3,).
        end: last point [m], shape (3,).
        deflection: of the anchor [m] at fractions of the stretch, (m,) -> (m, 2).
    """

    start: FloatArray
    end: FloatArray
    deflection: Deflection


def anchored_stretches(
    surface: Surface, starts: FloatArray, ends: FloatArray, wave: float = math.inf
) -> list[Stretch]:
    """Return the edges of a path cut where contact, sticking or sliding begins or ends.

    The anchor is held while the contact's own depth is positive, as in the kernel: a vertex
    exactly on the surface is out of contact and releases it.

    Args:
        surface: a surface whose law has state.
        starts: first points of the edges [m], shape (n, 3).
        ends: last points [m], shape (n, 3).
        wave: length over which the height can change its course [m].
    """
    longest = surface.parameter("max_deflection")
    result: list[Stretch] = []
    deflection: FloatArray | None = None  # None: the anchor is released
    for start, end in zip(starts, ends, strict=True):
        for a, b, inside in _contact_parts(surface, start, end, wave):
            if not inside:
                deflection = None
                continue
            held = np.zeros(2) if deflection is None else deflection
            parts, deflection = _contact_stretches(a, b, held, longest)
            result += parts
    return result


def _contact_parts(
    surface: Surface, start: FloatArray, end: FloatArray, wave: float
) -> list[tuple[FloatArray, FloatArray, bool]]:
    """Return the parts of an edge in and out of contact, in order; they may be points."""
    contact = surface.law.contact

    def points(s: FloatArray) -> FloatArray:
        return np.asarray((1.0 - s)[:, None] * start + s[:, None] * end)

    steps = _STEPS_PER_WAVE
    if contact.begins_on_texture:  # else contact begins at a plane, which an edge meets once
        length = float(np.linalg.norm(end - start))
        steps = max(steps, min(math.ceil(steps * length / wave), _STEPS))
    s: FloatArray = np.linspace(0.0, 1.0, steps + 1)
    inside = contact.inside(surface.texture, points(s))
    turns = np.flatnonzero(inside[1:] != inside[:-1])
    low, high = s[turns], s[turns + 1]
    for _ in range(_HALVINGS if len(turns) else 0):
        middle = 0.5 * (low + high)
        same = contact.inside(surface.texture, points(middle)) == inside[turns]
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    places = [start, *points(high), end]
    held = [bool(inside[0]), *inside[turns + 1].tolist()]
    return [(a, b, kind) for (a, b), kind in zip(pairwise(places), held, strict=True)]


def _contact_stretches(
    start: FloatArray, end: FloatArray, held: FloatArray, max_deflection: float
) -> tuple[list[Stretch], FloatArray]:
    """Return the stretches of an edge in contact, and the deflection at its end."""
    move = (end - start)[:2]
    distance = float(np.hypot(*move))
    if distance == 0.0:
        return [Stretch(start, end, lambda s: np.tile(held, (len(s), 1)))], held
    along = move / distance
    free = min(_free_run(held, along, max_deflection), distance)
    middle = start + (free / distance) * (end - start)
    result = []
    if free > 0.0:
        result.append(Stretch(start, middle, lambda s: held + (free * s)[:, None] * along))
    if free == distance:
        return result, held + distance * along
    slide = _tractrix(held + free * along, along, distance - free, max_deflection)
    result.append(Stretch(middle, end, slide))
    return result, slide(np.array([1.0]))[0]


def _free_run(held: FloatArray, along: FloatArray, max_deflection: float) -> float:
    """Return how far the probe runs until the deflection is at its greatest [m]."""
    b = float(held @ along)
    c = float(held @ held) - max_deflection**2
    # The greater root of r² + 2 b r + c = 0, without cancellation.
    root = math.sqrt(max(b * b - c, 0.0))
    run = -b + root if b <= 0.0 else -c / (b + root)
    return max(run, 0.0)


def _tractrix(
    held: FloatArray, along: FloatArray, distance: float, max_deflection: float
) -> Deflection:
    """Return the deflection while the anchor is dragged along a straight line.

    With φ the angle from the direction of motion to d: tan(φ/2) falls as exp(-run/d_max).
    """
    across = np.array([-along[1], along[0]])
    angle = math.atan2(float(held @ across), float(held @ along))
    start = math.tan(0.5 * angle)

    def deflection(s: FloatArray) -> FloatArray:
        phi = 2.0 * np.arctan(start * np.exp(-distance * s / max_deflection))
        turned = np.cos(phi)[:, None] * along + np.sin(phi)[:, None] * across
        result: FloatArray = max_deflection * turned
        return result

    return deflection
