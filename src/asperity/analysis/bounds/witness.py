"""The point, and the state, at which a number is attained: what anybody can evaluate again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from asperity.analysis.bounds.bound import Bound, Method
from asperity.analysis.bounds.branch_and_bound import DIFFERENCES, OPERATIONS
from asperity.analysis.bounds.measures import Number
from asperity.checks import FloatArray
from asperity.errors import InternalError
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
        size: of J/k itself, its Frobenius norm [1].
        at: probe position [m].
        deflection: of the anchor [m], for a law with state.
        sliding: whether the anchor is dragged.
    """

    value: float
    size: float
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


def upper_of(surface: Surface, number: Number, proved: float, witness: Witness) -> float:
    """Return a proved bound, or what is attained where rounding alone puts that above it.

    Raises:
        InternalError: if the witness contradicts the bound.
    """
    if not witness.value > proved:
        return proved
    allowed = _rounding(surface, witness, proved) * max(witness.size, proved)
    if not witness.value <= proved + allowed:
        state = "" if witness.deflection is None else f", deflection {witness.deflection} m"
        raise InternalError(
            f"the {number.name} of {surface!r} is proved to be at most {proved:.17g}, but "
            f"{witness.value:.17g} is attained at {witness.at} m{state}. No number of this surface "
            "can be trusted; please report it"
        )
    return witness.value


def _rounding(surface: Surface, witness: Witness, proved: float) -> float:
    """Return the relative error of a witness.

    Rounded coordinates move its depth by their size over the depth, to which J is as sensitive as
    1/(1 - y) = 1 + y/(1 - y) <= 1 + q. Rounded heights count as much more as they are higher.
    """
    xy, depth = np.array(witness.at[:2]), surface.max_depth
    height = float(surface.texture.height(xy[None])[0])
    moved = surface.law.contact.coordinate_size(xy, height) / depth * (1.0 + proved)
    return OPERATIONS * (DIFFERENCES * (1.0 + abs(height) / depth) + moved)


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
    scaled = jacobian / surface.stiffness
    value, size = float(number.careful(scaled)[0]), float(np.linalg.norm(scaled))
    x, y, z = (float(v) for v in probe)
    held = None if deflection is None else (float(deflection[0]), float(deflection[1]))
    return Witness(value, size, (x, y, z), held, sliding)


def rendered(surface: Surface, number: Number, xy: FloatArray, depth: float) -> Witness:
    """Return what the surface's own Jacobian gives at a contact point, at any depth [m]."""
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    probe = surface.law.contact.probe(xy[None], np.array([depth]), derivatives)
    scaled = surface.jacobian(probe) / surface.stiffness
    x, y, z = (float(v) for v in probe[0])
    return Witness(float(number.careful(scaled)[0]), float(np.linalg.norm(scaled)), (x, y, z))


def lower_of(surface: Surface, number: Number, value: float, witness: Witness) -> float:
    """Return what is attained of a number that a theorem gives: all of it, but for rounding.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    upper_of(surface, number, value, witness)
    return value if witness.value >= value * (1.0 - _AGREES) else witness.value


def proved(
    surface: Surface,
    number: Number,
    value: float,
    method: Method,
    note: str,
    xy: FloatArray,
    depths: Sequence[float],
) -> Bound:
    """Return a number that a theorem gives, with the best witness of some depths.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    witnesses = [attained(surface, number, xy, depth) for depth in depths]
    best = max(witnesses, key=lambda witness: witness.value)
    return Bound(lower_of(surface, number, value, best), value, method, best.at, note)
