"""The point, and the state, at which a number is attained: what anybody can evaluate again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.analysis.bounds.measures import Number
from asperity.checks import FloatArray
from asperity.surface import Surface

# A witness is strictly inside: at depth zero the force has just ended.
_LEAST_DEPTH = 1e-9
_LEAST_OF_SIZE = 1e-14
_AGREES = 1e-13


@dataclass(frozen=True)
class Witness:
    """A probe position and what is measured there.

    Attributes:
        value: of the measure of J/k [1].
        at: probe position [m].
        deflection: of the anchor [m], for a law with state.
        sliding: whether the anchor is dragged.
    """

    value: float
    at: tuple[float, float, float]
    deflection: tuple[float, float] | None = None
    sliding: bool = False


def probe_of(surface: Surface, xy: FloatArray, depth: float) -> FloatArray:
    """Return the probe position (3,) [m] in contact at a point of the plane, at a depth."""
    contact = surface.law.contact
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    # Not so little inside that rounding of the position decides.
    size = contact.coordinate_size(xy, float(derivatives[0, 0]))
    least = max(_LEAST_DEPTH * surface.max_depth, _LEAST_OF_SIZE * size)
    level = min(max(depth, least), surface.max_depth)
    if surface.clamp != "none":
        # At the very depth of the clamp rounding decides on which side the probe is.
        level = min(level, (1.0 - _LEAST_DEPTH) * surface.max_depth)
    return np.asarray(contact.probe(xy[None], np.array([level]), derivatives)[0])


def lower_of(value: float, witness: Witness) -> float:
    """Return what is attained of a number that a theorem gives: all of it, but for rounding."""
    return value if witness.value >= value * (1.0 - _AGREES) else witness.value


def attained(
    surface: Surface,
    number: Number,
    xy: FloatArray,
    depth: float,
    deflection: FloatArray | None = None,
    *,
    sliding: bool = False,
) -> Witness:
    """Return what the surface's own Jacobian gives for a contact."""
    probe = probe_of(surface, xy, depth)
    state = None if deflection is None else deflection[None]
    slides = None if deflection is None else np.array([sliding])
    jacobian = surface.jacobian(probe[None], state, slides)
    value = float(number.careful(jacobian / surface.stiffness)[0])
    x, y, z = (float(v) for v in probe)
    held = None if deflection is None else (float(deflection[0]), float(deflection[1]))
    return Witness(value, (x, y, z), held, sliding)
