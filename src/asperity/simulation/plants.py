"""The devices whose handle moves: a mass in space, or a pantograph."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array, positive, real
from asperity.devices.five_bar import FiveBar, joint_angles
from asperity.errors import ParameterError
from asperity.files import Record, record
from asperity.simulation.hands import Triple, not_negative, triple


def symmetric(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Return a symmetric positive semidefinite matrix of a number, one per axis, or a matrix.

    Raises:
        ParameterError: for anything else.
    """
    given = np.asarray(value)
    if given.ndim < 2:
        return np.diag(triple(name, value, unit))
    matrix = array(name, given, (3, 3), unit)
    size = float(np.abs(matrix).max())
    if np.abs(matrix - matrix.T).max() > 1e-12 * size:
        raise ParameterError(name, "must be symmetric", value)
    if np.linalg.eigvalsh(matrix)[0] < -1e-12 * size:
        raise ParameterError(name, "must be positive semidefinite", value)
    return np.asarray(0.5 * (matrix + matrix.T))


@dataclass(frozen=True)
class Resonance(Record):
    """The first structural mode: part of the mass hangs on a spring, away from motor and sensor.

    Attributes:
        frequency: of the free vibration of the two masses against each other [Hz].
        damping_ratio: of that mode [1].
        share: of the mass that hangs on the spring [1], between 0 and 1.
    """

    frequency: float
    damping_ratio: float = 0.02
    share: float = 0.5

    def __post_init__(self) -> None:
        positive("frequency", self.frequency, "Hz")
        if real("damping_ratio", self.damping_ratio) < 0.0:
            raise ParameterError("damping_ratio", "must not be negative", self.damping_ratio)
        if not 0.0 < real("share", self.share) < 1.0:
            raise ParameterError("share", "must be between 0 and 1", self.share)


@dataclass(frozen=True, eq=False)
class Cartesian:
    """A handle with mass and damping in space, alike everywhere.

    M p'' = f - B p' - F_c p'/|p'| + hand.

    Attributes:
        mass: as felt at the handle [kg], one per axis.
        damping: B [N s/m], a symmetric matrix (3, 3), positive semidefinite.
        resonance: first structural mode, alike along all axes, or ``None``.
        friction: F_c, dry friction [N].

    Args:
        mass: a number or one per axis.
        damping: a number, one per axis, or the matrix.
        resonance: see above.
        friction: see above.

    Raises:
        ParameterError: for a mass that is not positive, damping that is not positive semidefinite,
            or negative friction.

    Example:
        >>> Cartesian(mass=0.05, damping=1.0).mass
        (0.05, 0.05, 0.05)
    """

    mass: Triple
    damping: FloatArray
    resonance: Resonance | None
    friction: float

    def __init__(
        self,
        mass: ArrayLike = 0.05,
        damping: ArrayLike = 0.0,
        resonance: Resonance | None = None,
        friction: float = 0.0,
    ) -> None:
        axes = triple("mass", mass, "kg", signed=True)
        if min(axes) <= 0.0:
            raise ParameterError("mass", "must be positive [kg]", mass)
        if resonance is not None and not isinstance(resonance, Resonance):
            raise ParameterError("resonance", "must be a Resonance or None", resonance)
        object.__setattr__(self, "mass", axes)
        object.__setattr__(self, "damping", symmetric("damping", damping, "N s/m"))
        object.__setattr__(self, "resonance", resonance)
        object.__setattr__(self, "friction", not_negative("friction", friction, "N"))

    @property
    def notes(self) -> tuple[str, ...]:
        """What is guessed: nothing."""
        return ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": "cartesian"} | record(self)


@dataclass(frozen=True)
class LinkMasses:
    """Masses of a five-bar's links, uniform rods, and of its handle.

    Attributes:
        proximal: of each link at a motor [kg].
        distal: of each link at the handle [kg].
        handle: a point mass at the handle [kg].
        rotor: moment of inertia of each motor and brake [kg m²].

    Raises:
        ParameterError: for a negative mass, or no mass at the handle at all.
    """

    proximal: float = 0.008
    distal: float = 0.006
    handle: float = 0.010
    rotor: float = 0.0

    def __post_init__(self) -> None:
        for name in ("proximal", "distal", "handle"):
            not_negative(name, getattr(self, name), "kg")
        not_negative("rotor", self.rotor, "kg m²")
        if self.distal + self.handle == 0.0:
            raise ParameterError("handle", "must have a mass if the distal links have none")


_GUESSED = (
    "Link masses of the pantograph are a guess: about 20 g as felt at the handle.",
    "Link lengths are remembered from the literature, not read in a source.",
)


# Lengths of the Pantograph Mk-II, remembered from the literature.
MK_TWO = FiveBar(proximal=0.063, distal=0.075, base=0.025)


@dataclass(frozen=True)
class Pantograph:
    """A planar five-bar in the x-z plane of the scene; its inertia depends on where it is.

    M(p) p'' + c(p, p') = f - b J⁻ᵀ J⁻¹ p' + hand. The point of its plane is ``centre + (x, z)``
    and y stays 0. Brakes damp the joints; with ``inside_only`` the servo switches them at the
    sample, by the measured position, and holds them over the sample: on while the probe is in the
    body (z < 0 for a law on the nominal contact, z < h otherwise).

    **The link masses are a guess** that gives about 20 g at the handle in the middle of the
    workspace; the link lengths are remembered, not read in a source.

    Attributes:
        linkage: lengths of the links.
        masses: of the links and the handle.
        joint_damping: b of each joint [N m s].
        centre: point of the linkage's plane that is the scene's origin [m], shape (2,).
        inside_only: whether the brakes act only inside the body.
        friction: dry friction at the handle [N].

    Raises:
        ParameterError: for a negative value, or a centre that the arms do not reach.

    Example:
        >>> Pantograph().notes[0]
        'Link masses of the pantograph are a guess: about 20 g as felt at the handle.'
    """

    linkage: FiveBar = MK_TWO
    masses: LinkMasses = LinkMasses()
    joint_damping: float = 4.7e-3
    centre: tuple[float, float] = (-0.0125, 0.1)
    inside_only: bool = True
    friction: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.linkage, FiveBar):
            raise ParameterError("linkage", "must be a FiveBar", self.linkage)
        if not isinstance(self.masses, LinkMasses):
            raise ParameterError("masses", "must be LinkMasses", self.masses)
        not_negative("joint_damping", self.joint_damping, "N m s")
        not_negative("friction", self.friction, "N")
        x, z = array("centre", self.centre, (2,), "m")
        object.__setattr__(self, "centre", (float(x), float(z)))
        joint_angles(self.linkage, self.centre)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is guessed, in words."""
        return _GUESSED if self.masses == LinkMasses() else _GUESSED[1:]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": "pantograph"} | record(self)


Plant = Cartesian | Pantograph
