"""The pantograph: a planar five-bar linkage whose inertia depends on its position."""

# ruff: noqa: ARG002 - one signature for all plants

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_nonnegative
from asperity.core.errors import ParameterError
from asperity.devices.five_bar import FiveBar, handle_damping, joint_angles
from asperity.loop.bodies import body_parts
from asperity.loop.bodies import pantograph_dynamics as pantograph
from asperity.loop.bodies.pantograph_dynamics import LinkageRecord, PantographRecord
from asperity.simulation.hands import Hand
from asperity.simulation.plants import (
    Plant,
    SampledPlant,
    friction_substeps,
    max_rate,
    substep_count,
)

# Least sine of the angle at the elbows: nearer to stretched or folded the handle stops.
MIN_ELBOW_SINE = 0.05
# Largest share of a time constant that one step of order five covers: energy closes to 1e-11.
_MAX_STEP_FRACTION = 0.05


@dataclass(frozen=True)
class LinkMasses:
    """Masses of a five-bar's links, uniform rods, and of its handle.

    Attributes:
        proximal: mass of each link at a motor [kg].
        distal: mass of each link at the handle [kg].
        handle: point mass at the handle [kg].
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
            check_nonnegative(name, getattr(self, name), "kg")
        check_nonnegative("rotor", self.rotor, "kg m²")
        if self.distal + self.handle == 0.0:
            raise ParameterError("handle", "must have a mass if the distal links have none")


_UNVERIFIED = (
    "Link masses of the pantograph are a guess: about 20 g as felt at the handle.",
    "Link lengths are remembered from the literature, not read in a source.",
)


# Lengths of the Pantograph Mk-II, remembered from the literature.
MK_TWO = FiveBar(proximal=0.063, distal=0.075, base=0.025)


@dataclass(frozen=True)
class Pantograph(Plant):
    """A planar five-bar in the x-z plane of the scene; its inertia depends on its position.

    M(p) p'' + c(p, p') = f - b J⁻ᵀ J⁻¹ p' + hand. The point of its plane is ``centre + (x, z)``
    and y stays 0. Brakes damp the joints; with ``inside_only`` the servo switches them at the
    sample, by the measured position, and holds them over the sample: on while the probe is in the
    body (z < 0 for a law on the nominal contact, z < h otherwise).

    **The link masses are a guess** that gives about 20 g at the handle in the middle of the
    workspace; the link lengths are remembered, not read in a source.

    Attributes:
        linkage: lengths of the links.
        masses: masses of the links and the handle.
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

    kind: ClassVar[str] = "pantograph"
    is_planar: ClassVar[bool] = True

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
        check_nonnegative("joint_damping", self.joint_damping, "N m s")
        check_nonnegative("friction", self.friction, "N")
        x, z = check_array("centre", self.centre, (2,), "m")
        object.__setattr__(self, "centre", (float(x), float(z)))
        joint_angles(self.linkage, self.centre)

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on parameters that are guesses."""
        return _UNVERIFIED if self.masses == LinkMasses() else _UNVERIFIED[1:]

    def sample(self, hand: Hand, period: float) -> SampledPlant:
        """Return the linkage held by a hand, over one sample."""
        linkage = linkage_record(self, hand.moving_mass)
        mxx, mxz, mzz, _cx, _cz, bxx, _bxz, bzz = pantograph.linkage_dynamics(
            0.0, 0.0, 0.0, 0.0, linkage
        )
        min_mass = float(np.linalg.eigvalsh([[mxx, mxz], [mxz, mzz]])[0])
        # Twice the damping here: elsewhere in the workspace it may be larger.
        rate = max_rate(min_mass, 2.0 * self.joint_damping * (bxx + bzz), hand)
        substep_count(self.friction, rate, period)  # refuses too many; the number depends on speed
        record = PantographRecord(
            linkage,
            hand.record(),
            float(self.friction),
            rate,
            friction_substeps(self.friction),
            float(period),
            _MAX_STEP_FRACTION,
            bool(self.inside_only),
            MIN_ELBOW_SINE,
        )
        return SampledPlant((pantograph, body_parts), record, 6)

    def workspace_violation(self, position: FloatArray) -> str:
        """Return why a position [m] is outside the workspace; empty if it is inside."""
        x = self.centre[0] + position[0]
        z = self.centre[1] + position[2]
        if z <= 0.0:
            return f"the handle is behind the motors, at ({x:.4g}, {z:.4g}) m"
        near = self.linkage.proximal
        far = self.linkage.distal
        for name, motor in (("right", 0.0), ("left", -self.linkage.base)):
            reach = float(np.hypot(x - motor, z))
            cosine = (near**2 + far**2 - reach**2) / (2.0 * near * far)
            if abs(cosine) >= np.sqrt(1.0 - MIN_ELBOW_SINE**2):
                state = "folded" if cosine > 0.0 else "stretched"
                return f"the {name} arm is {state}, {reach:.4g} m from motor to handle"
        return ""

    def describe_exit(self, state: FloatArray) -> str:
        """Return from where the handle left the workspace, within a sample."""
        x = state[0]
        z = state[2]
        vx = state[3]
        vz = state[5]
        place = f"({x:.4g}, 0, {z:.4g}) m"
        speed = f"({vx:.3g}, 0, {vz:.3g}) m/s"
        return f"from {place} with {speed}, an arm is stretched or folded within a sample"

    def min_damping(
        self, low: ArrayLike, high: ArrayLike, hand: Hand | None = None, top: float = 0.0
    ) -> float:
        """Return the smallest damping of the brakes at 9 x 9 positions of a box [N s/m].

        The hand is left out, which is on the safe side.
        """
        if self.joint_damping == 0.0:
            return 0.0
        (x0, _, z0) = np.asarray(low, dtype=float)
        (x1, _, z1) = np.asarray(high, dtype=float)
        grid = [
            np.array([x, 0.0, z])
            for x in np.unique(np.linspace(x0, x1, 9))  # of a box without width each place once
            for z in np.unique(np.linspace(z0, min(z1, max(z0, top)), 9))
        ]
        # The handle was not at corners of the box that the arms do not reach.
        points = [self.centre + p[[0, 2]] for p in grid if not self.workspace_violation(p)]
        dampings = [handle_damping(self.linkage, self.joint_damping, point) for point in points]
        smallest = [float(np.linalg.eigvalsh(damping)[0]) for damping in dampings]
        return min(smallest, default=0.0)

    def rates(self) -> list[tuple[str, float]]:
        """Return the numbers that make the linkage fast."""
        mass = self.masses.handle + self.masses.distal
        return [("handle", mass), ("joint_damping", self.joint_damping)]


def linkage_record(plant: Pantograph, hand_mass: float = 0.0) -> LinkageRecord:
    """Return the linkage of a pantograph, with a mass [kg] held at the handle."""
    bars = plant.linkage
    masses = plant.masses
    first = masses.rotor + masses.proximal * bars.proximal**2 / 3.0
    inertia = first + masses.distal * bars.proximal**2 / 3.0
    numbers = (
        bars.proximal,
        bars.distal,
        bars.base,
        inertia,
        masses.distal,
        masses.handle + hand_mass,
        *plant.centre,
        plant.joint_damping,
    )
    return LinkageRecord(*map(float, numbers))
