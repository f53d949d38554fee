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

import numpy as np

from asperity.checks import FloatArray

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
    starts: FloatArray, ends: FloatArray, max_deflection: float
) -> list[Stretch]:
    """Return the edges of a path cut where contact, sticking or sliding begins or ends.

    Args:
        starts: first points of the edges [m], shape (n, 3).
        ends: last points [m], shape (n, 3).
        max_deflection: length of the deflection while sliding [m].
    """
    result: list[Stretch] = []
    deflection: FloatArray | None = None  # None: the anchor is released
    for start, end in zip(starts, ends, strict=True):
        for a, b, inside in _contact_parts(start, end):
            if not inside:
                deflection = None
                continue
            held = np.zeros(2) if deflection is None else deflection
            parts, deflection = _contact_stretches(a, b, held, max_deflection)
            result += parts
    return result


def _contact_parts(start: FloatArray, end: FloatArray) -> list[tuple[FloatArray, FloatArray, bool]]:
    """Return the parts of an edge above and below the nominal plane z = 0."""
    if (start[2] < 0.0) == (end[2] < 0.0):
        return [(start, end, bool(start[2] < 0.0))]
    if start[2] == 0.0 or end[2] == 0.0:
        return [(start, end, True)]
    s = start[2] / (start[2] - end[2])
    crossing = start + s * (end - start)
    return [
        (start, crossing, bool(start[2] < 0.0)),
        (crossing, end, bool(end[2] < 0.0)),
    ]


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
