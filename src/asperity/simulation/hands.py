"""What holds the handle: a spring to an anchor that moves, a rubber band, or a fixed motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import array, positive, real
from asperity.errors import ParameterError
from asperity.files import record

Triple = tuple[float, float, float]


def triple(name: str, value: ArrayLike, unit: str, *, signed: bool = False) -> Triple:
    """Return one number per axis, of one number or three.

    Raises:
        ParameterError: for another shape, a value that is not finite, or (unless signed) negative.
    """
    given = np.asarray(value)
    wide = np.broadcast_to(given, (3,)) if given.ndim == 0 else given
    x, y, z = array(name, wide, (3,), unit)
    if not signed and min(x, y, z) < 0.0:
        raise ParameterError(name, f"must not be negative [{unit}]", value)
    return float(x), float(y), float(z)


def not_negative(name: str, value: object, unit: str) -> float:
    """Return a number that is finite and not negative.

    Raises:
        ParameterError: for another one.
    """
    number = real(name, value, unit)
    if number < 0.0:
        raise ParameterError(name, f"must not be negative [{unit}]", value)
    return number


@dataclass(frozen=True)
class SpringHand:
    """A spring and a damper from the handle to the moving anchor, a mass and a constant force.

    F = K (a - p) + B (a' - p') + f, with the mass moving along with the handle.

    Attributes:
        stiffness: K [N/m], a number or one per axis.
        damping: B [N s/m], a number or one per axis.
        mass: of the hand that moves with the handle [kg].
        force: f, a constant force of the hand [N], one per axis; (0, 0, -1) presses with 1 N.

    Raises:
        ParameterError: for a value that is negative (except the force) or not finite.

    Example:
        >>> SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0, 0, -1)).stiffness
        (300.0, 300.0, 300.0)
    """

    stiffness: Triple = (0.0, 0.0, 0.0)
    damping: Triple = (0.0, 0.0, 0.0)
    mass: float = 0.0
    force: Triple = (0.0, 0.0, 0.0)

    def __init__(
        self,
        stiffness: ArrayLike = 0.0,
        damping: ArrayLike = 0.0,
        mass: float = 0.0,
        force: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        object.__setattr__(self, "stiffness", triple("stiffness", stiffness, "N/m"))
        object.__setattr__(self, "damping", triple("damping", damping, "N s/m"))
        object.__setattr__(self, "mass", not_negative("mass", mass, "kg"))
        object.__setattr__(self, "force", triple("force", force, "N", signed=True))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": "spring"} | record(self)


@dataclass(frozen=True)
class BandHand:
    """An elastic band that pulls the handle into the wall, with its true geometry.

    Its far end lies ``length`` below the anchor of the motion, at e = a - (0, 0, length). With
    L = |e - p| and the rest length L₀ = length - tension/stiffness it stores ½ K (L - L₀)² while
    L > L₀, pulls with K (L - L₀) towards e, and is slack otherwise. So a handle at the anchor feels
    the tension, along -z. The damping acts on the whole velocity of the handle relative to the far
    end, along the band and across it: it stands for the rubber, the joints and the air together.

    Attributes:
        stiffness: K [N/m].
        tension: at z = 0 [N].
        length: at z = 0 [m].
        damping: [N s/m].

    Raises:
        ParameterError: for a value that is not positive (damping: negative), or a tension that
            would need a rest length below zero.

    Reference:
        Campion and Hayward, section V.A, where the band is not described; the numbers are a guess.

    Example:
        >>> round(BandHand().rest_length, 6)
        0.065
    """

    stiffness: float = 200.0
    tension: float = 3.0
    length: float = 0.08
    damping: float = 0.02

    def __post_init__(self) -> None:
        positive("stiffness", self.stiffness, "N/m")
        positive("length", self.length, "m")
        not_negative("tension", self.tension, "N")
        not_negative("damping", self.damping, "N s/m")
        if self.rest_length <= 0.0:
            limit = f"must be less than stiffness * length = {self.stiffness * self.length:g} N"
            raise ParameterError("tension", limit, self.tension)

    @property
    def rest_length(self) -> float:
        """L₀ [m]."""
        return float(self.length - self.tension / self.stiffness)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": "band"} | record(self)


@dataclass(frozen=True)
class MovedHand:
    """A prescribed motion: the handle itself follows the motion, whatever the force.

    There are no dynamics: mass, damping and friction of the plant take no part, nothing is stored,
    and the work of the hand is what the texture takes. The texture's own sums mean the same as
    ever.

    Example:
        >>> MovedHand().to_dict()
        {'kind': 'moved'}
    """

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"kind": "moved"}


Hand = SpringHand | BandHand | MovedHand
