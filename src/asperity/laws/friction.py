"""Friction of a surface, beside the force of its law: stick and slip of an anchor.

With the force f₀ = -∇U of a conservative law, N = √(2 k U) and a presliding stiffness κ, the
deflection d of the anchor follows the tangential displacement u of a tick,

    d₊ = clip(d + u, μ N (1 - a (1 + ĥ)/2)/κ),    f = f₀ - κ d₊,

where clip shortens a vector to a length, and ĥ is the height at the contact point scaled to
[-1, 1]. With constant κ the hand gains no energy on a closed path, whatever the limit does
(docs/theory/friction.md). On a closed body d and u have three coordinates, and the
length is multiplied by the sine of the angle between d + u and f₀.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from asperity.core.arguments import Argument
from asperity.core.files import Serializable

if TYPE_CHECKING:  # NumPy only where points are evaluated
    import numpy as np
    from numpy.typing import NDArray

    from asperity.core.checks import FloatArray

FLAT_SHARE = 2.0 / 3.0
"""Default κ/k of a smooth wall, at which friction lowers no stability limit."""
TEXTURED_SHARE = 0.25
"""Default κ/k of a surface with a texture."""

FRICTION = Argument(
    "friction",
    "friction coefficient μ of a surface with a conservative law, or of law F",
    default_description="0, law F 0.8",
)
PRESLIDING_STIFFNESS = Argument(
    "presliding_stiffness",
    "presliding stiffness κ of the friction",
    "N/m",
    default_description="2/3 of the stiffness for law W, else 1/4",
    must_be_positive=True,
)
FRICTION_MODULATION = Argument(
    "friction_modulation",
    "modulation a of the friction by the height, 0 to 1: μ (1 - a) on crests, μ in valleys",
    default=0.0,
    maximum=1.0,
)
FRICTION_ARGUMENTS = {
    argument.name: argument for argument in (FRICTION, PRESLIDING_STIFFNESS, FRICTION_MODULATION)
}
"""The arguments of a surface with friction, by name."""


@dataclass(frozen=True)
class Friction(Serializable):
    """Friction of a surface.

    Attributes:
        coefficient: μ [1], positive.
        presliding_stiffness: κ [N/m].
        modulation: a [1].
        stiffness_share: κ/k where κ follows the stiffness of the surface, 0 where it is given.
        in_space: whether the anchor moves in three directions, on a closed body.
    """

    coefficient: float
    presliding_stiffness: float
    modulation: float
    stiffness_share: float
    in_space: bool = False

    @property
    def axes(self) -> int:
        """Number of coordinates of the deflection."""
        return 3 if self.in_space else 2

    @property
    def arguments(self) -> tuple[float, ...]:
        """The last parameters of a probe: μ, a, κ/k, the rest of κ [N/m], 1 in space."""
        fixed = 0.0
        if not self.stiffness_share:
            fixed = self.presliding_stiffness
        return self.coefficient, self.modulation, self.stiffness_share, fixed, float(self.in_space)


def make_friction(
    values: Mapping[str, float], stiffness: float, default_share: float, *, in_space: bool = False
) -> Friction | None:
    """Return the friction of the arguments that were given; ``None`` without friction.

    Args:
        values: arguments by name.
        stiffness: k [N/m].
        default_share: κ/k if no presliding stiffness is given.
        in_space: whether the surface is a closed body.
    """
    coefficient = values.get(FRICTION.name, 0.0)
    if not coefficient:
        return None
    modulation = values.get(FRICTION_MODULATION.name, 0.0)
    if PRESLIDING_STIFFNESS.name in values:
        return Friction(coefficient, values[PRESLIDING_STIFFNESS.name], modulation, 0.0, in_space)
    return Friction(coefficient, default_share * stiffness, modulation, default_share, in_space)


def friction_jacobian(
    presliding_stiffness: float,
    deflection: FloatArray,
    sliding: NDArray[np.bool_],
    limit_gradient: FloatArray,
) -> FloatArray:
    """Return the Jacobian of -κ d₊ [N/m], shape (n, 3, 3).

    It is -κ I in the plane where the anchor sticks. Where it slides, the force is -S e, e = d/|d|,
    and its Jacobian -e ∇Sᵀ - κ (I - e eᵀ).

    Args:
        presliding_stiffness: κ [N/m].
        deflection: d [m], shape (n, 2).
        sliding: whether the anchor slides, shape (n,).
        limit_gradient: gradient of the slip limit S [N/m], shape (n, 3).
    """
    import numpy as np

    direction = np.zeros((len(deflection), 3))
    length = np.hypot(*deflection.T)
    slides = sliding & (length > 0.0)
    direction[slides, :2] = deflection[slides] / length[slides, None]
    plane = np.diag([1.0, 1.0, 0.0]) - direction[:, :, None] * direction[:, None, :]
    slip = direction[:, :, None] * limit_gradient[:, None, :]
    return np.asarray(-presliding_stiffness * plane - slip)
