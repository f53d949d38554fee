"""Numbers with proved bounds, and the witness at which a number is attained."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from asperity.analysis.bounds.branch_and_bound import DIFFERENCE_AMPLIFICATION, ROUNDING_ERROR
from asperity.analysis.bounds.measures import JacobianMeasure
from asperity.core.checks import FloatArray
from asperity.core.display import Displayable
from asperity.core.errors import InternalError
from asperity.core.files import Serializable
from asperity.surface import Surface

Method = Literal["theorem", "closed form", "certified", "sampled"]


@dataclass(frozen=True)
class Bound(Serializable, Displayable):
    """A supremum between bounds.

    Attributes:
        lower: a value that is attained at ``at``.
        upper: a proved upper bound; infinity without proof.
        method: ``"theorem"``, ``"closed form"``, ``"certified"`` or ``"sampled"``.
        at: the probe position [m] that attains ``lower``, or approaches it from inside; for an
            infinite number the point where it first diverges; ``None`` if there is none.
        note: derivation of the number, in one sentence.
        deflection: deflection [m], shape (2,), of the anchor at ``at``; ``None`` for a law without
            state.
        sliding: whether that anchor slides.

    Example:
        >>> Bound(2.0, math.inf, "sampled", (0.0, 0.0, -1e-3)).value
        2.0
    """

    serialized_attributes = "value lower upper method at note deflection sliding"

    lower: float
    upper: float
    method: Method
    at: tuple[float, float, float] | None = None
    note: str = ""
    deflection: tuple[float, float] | None = None
    sliding: bool = False

    @property
    def value(self) -> float:
        """``upper`` where one is proved, else ``lower``."""
        return self.upper if math.isfinite(self.upper) else self.lower

    @property
    def gap(self) -> float:
        """Relative gap (upper - lower)/lower; zero where both are infinite."""
        if math.isinf(self.lower):
            return 0.0
        return (self.upper - self.lower) / self.lower if self.lower > 0.0 else math.inf


# A witness is strictly inside: at depth zero there is no force.
_MIN_RELATIVE_DEPTH = 1e-9
_MIN_COORDINATE_DEPTH = 1e-14
_AGREEMENT = 1e-13


@dataclass(frozen=True)
class Witness:
    """A probe position and the measure of the Jacobian there.

    Attributes:
        value: measure of J/k [1].
        size: Frobenius norm of J/k [1].
        at: probe position [m].
        deflection: deflection of the anchor [m], for a law with state.
        sliding: whether the anchor slides.
    """

    value: float
    size: float
    at: tuple[float, float, float]
    deflection: tuple[float, float] | None = None
    sliding: bool = False


def probe_position(surface: Surface, xy: FloatArray, depth: float) -> FloatArray:
    """Return the probe position (3,) [m] in contact at a point of the plane, at a depth."""
    contact = surface.law.contact
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    # Deep enough that rounding of the position does not matter.
    size = contact.coordinate_scale(xy, float(derivatives[0, 0]))
    least = max(_MIN_RELATIVE_DEPTH * surface.max_depth, _MIN_COORDINATE_DEPTH * size)
    level = min(max(depth, least), surface.max_depth)
    if surface.effective_clamp.changes_force:
        # Slightly above the clamp, so that rounding does not decide on which side the probe is.
        level = min(level, (1.0 - _MIN_RELATIVE_DEPTH) * surface.max_depth)
    return np.asarray(contact.probe_positions(xy[None], np.array([level]), derivatives)[0])


def checked_upper_bound(
    surface: Surface, measure: JacobianMeasure, upper: float, witness: Witness
) -> float:
    """Return a proved bound, or the attained value where it exceeds the bound by rounding only.

    Raises:
        InternalError: if the witness contradicts the bound.
    """
    if not witness.value > upper:
        return upper
    allowed = _witness_rounding(surface, witness, upper) * max(witness.size, upper)
    if not witness.value <= upper + allowed:
        state = "" if witness.deflection is None else f", deflection {witness.deflection} m"
        raise InternalError(
            f"the {measure.name} of {surface!r} is proved to be at most {upper:.17g}, but "
            f"{witness.value:.17g} is attained at {witness.at} m{state}. No number of this surface "
            "can be trusted; please report it"
        )
    return witness.value


def _witness_rounding(surface: Surface, witness: Witness, upper: float) -> float:
    """Return the relative error of a witness.

    Rounded coordinates change the depth relative to its size, and J is sensitive to that by
    1/(1 - y) = 1 + y/(1 - y) <= 1 + q. The effect of rounded heights grows with their size.
    """
    xy, depth = np.array(witness.at[:2]), surface.max_depth
    height = float(surface.texture.height(xy[None])[0])
    moved = surface.law.contact.coordinate_scale(xy, height) / depth * (1.0 + upper)
    return ROUNDING_ERROR * (DIFFERENCE_AMPLIFICATION * (1.0 + abs(height) / depth) + moved)


def witness_in_contact(
    surface: Surface,
    measure: JacobianMeasure,
    xy: FloatArray,
    depth: float,
    deflection: FloatArray | None = None,
    *,
    sliding: bool = False,
) -> Witness:
    """Return the witness of the surface's own Jacobian for a contact."""
    probe = probe_position(surface, xy, depth)
    state = None if deflection is None else deflection[None]
    slides = None if deflection is None else np.array([sliding])
    jacobian = surface.jacobian(probe[None], state, slides)
    scaled = jacobian / surface.stiffness
    value, size = float(measure.accurate(scaled)[0]), float(np.linalg.norm(scaled))
    x, y, z = (float(v) for v in probe)
    held = None if deflection is None else (float(deflection[0]), float(deflection[1]))
    return Witness(value, size, (x, y, z), held, sliding)


def witness_at_depth(
    surface: Surface, measure: JacobianMeasure, xy: FloatArray, depth: float
) -> Witness:
    """Return the witness of the surface's own Jacobian at a contact point and any depth [m]."""
    derivatives = surface.texture.derivatives(np.ascontiguousarray(xy[None]))
    probe = surface.law.contact.probe_positions(xy[None], np.array([depth]), derivatives)
    scaled = surface.jacobian(probe) / surface.stiffness
    x, y, z = (float(v) for v in probe[0])
    return Witness(float(measure.accurate(scaled)[0]), float(np.linalg.norm(scaled)), (x, y, z))


def checked_lower_bound(
    surface: Surface, measure: JacobianMeasure, value: float, witness: Witness
) -> float:
    """Return the attained value of a number from a theorem, equal to it up to rounding.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    checked_upper_bound(surface, measure, value, witness)
    return value if witness.value >= value * (1.0 - _AGREEMENT) else witness.value


def bound_from_theorem(
    surface: Surface,
    measure: JacobianMeasure,
    value: float,
    method: Method,
    note: str,
    xy: FloatArray,
    depths: Sequence[float],
) -> Bound:
    """Return a number from a theorem, with the best witness of several depths.

    Raises:
        InternalError: if the witness contradicts the theorem.
    """
    witnesses = [witness_in_contact(surface, measure, xy, depth) for depth in depths]
    best = max(witnesses, key=lambda witness: witness.value)
    return Bound(checked_lower_bound(surface, measure, value, best), value, method, best.at, note)
