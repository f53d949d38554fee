"""Models of the hand that holds the handle."""

# ruff: noqa: ARG002 - one signature for all hands

from __future__ import annotations

from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict
from asperity.simulation.kernels.hand_force import HandRecord
from asperity.simulation.motions import Motion, NamedPart

Triple = tuple[float, float, float]


def per_axis(name: str, value: ArrayLike, unit: str, *, signed: bool = False) -> Triple:
    """Return one number per axis, from one number or three.

    Raises:
        ParameterError: for another shape, a value that is not finite, or (unless signed) negative.
    """
    given = np.asarray(value)
    wide = np.broadcast_to(given, (3,)) if given.ndim == 0 else given
    x, y, z = check_array(name, wide, (3,), unit)
    if not signed and min(x, y, z) < 0.0:
        raise ParameterError(name, f"must not be negative [{unit}]", value)
    return float(x), float(y), float(z)


def nonnegative(name: str, value: object, unit: str) -> float:
    """Return a finite nonnegative number.

    Raises:
        ParameterError: for any other value.
    """
    number = check_real(name, value, unit)
    if number < 0.0:
        raise ParameterError(name, f"must not be negative [{unit}]", value)
    return number


class Hand(NamedPart, ABC):
    """A model of the hand that holds the handle; a subclass is a dataclass of its numbers.

    Attributes:
        kind: name of the model.
        is_prescribed: whether the handle follows the motion, whatever the force.
        holds_height: whether the hand holds the handle at a height.
    """

    is_prescribed: ClassVar[bool] = False

    @property
    def holds_height(self) -> bool:
        """Whether the hand holds the handle at a height."""
        return True

    @property
    def moving_mass(self) -> float:
        """Mass of the hand that moves with the handle [kg]."""
        return 0.0

    @property
    def damping_matrix(self) -> FloatArray:
        """Damping of the handle by the hand, as far as it is guaranteed (3, 3) [N s/m]."""
        return np.zeros((3, 3))

    @property
    def settings(self) -> dict[str, float | None]:
        """Stiffness [N/m] and damping [N s/m] of a spring along x; ``None`` for other hands."""
        return {"hand_stiffness": None, "hand_damping": None}

    def with_values(self, **values: Any) -> Hand:
        """Return a spring with other numbers.

        Raises:
            ParameterError: for a hand that is no spring.
        """
        raise ParameterError("hand", "is an elastic band without these parameters")

    def initial_motion(
        self, motion: Motion, start: FloatArray | None, velocity: FloatArray | None, period: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the initial position [m] and velocity [m/s] of the handle.

        Args:
            motion: motion of the anchor.
            start: requested position; default: where the motion starts.
            velocity: requested velocity; default: at rest.
            period: T [s].
        """
        position = motion.at(np.zeros(1))[0] if start is None else start
        return position, np.zeros(3) if velocity is None else velocity

    def record(self) -> HandRecord:
        """Return the hand as compiled bodies take it."""
        raise NotImplementedError(f"{self.kind} has no record")

    def rates(self) -> list[tuple[str, float]]:
        """Return the numbers that make a body fast, by name: stiffness, damping, mass."""
        force = self.record()
        rates = [("stiffness", max(force.stiffness)), ("damping", max(force.damping))]
        return [*rates, ("mass", self.moving_mass)]


@dataclass(frozen=True)
class SpringHand(Hand):
    """A spring and a damper from the handle to the moving anchor, a mass and a constant force.

    F = K (a - p) + B (a' - p') + f; the mass moves with the handle.

    Attributes:
        stiffness: K [N/m], a number or one per axis.
        damping: B [N s/m], a number or one per axis.
        mass: mass of the hand that moves with the handle [kg].
        force: f, constant force of the hand [N], one per axis; (0, 0, -1) presses with 1 N.

    Raises:
        ParameterError: for a value that is negative (except the force) or not finite.

    Example:
        >>> SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0, 0, -1)).stiffness
        (300.0, 300.0, 300.0)
    """

    kind: ClassVar[str] = "spring"

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
        object.__setattr__(self, "stiffness", per_axis("stiffness", stiffness, "N/m"))
        object.__setattr__(self, "damping", per_axis("damping", damping, "N s/m"))
        object.__setattr__(self, "mass", nonnegative("mass", mass, "kg"))
        object.__setattr__(self, "force", per_axis("force", force, "N", signed=True))

    @property
    def holds_height(self) -> bool:
        """Whether the spring acts along z."""
        return self.stiffness[2] > 0.0

    @property
    def moving_mass(self) -> float:
        """Mass of the hand that moves with the handle [kg]."""
        return self.mass

    @property
    def damping_matrix(self) -> FloatArray:
        """Damping of the handle by the hand (3, 3) [N s/m]."""
        return np.diag(self.damping)

    @property
    def settings(self) -> dict[str, float | None]:
        """Stiffness [N/m] and damping [N s/m] along x."""
        return {"hand_stiffness": self.stiffness[0], "hand_damping": self.damping[0]}

    def with_values(self, **values: Any) -> SpringHand:
        """Return a spring with other numbers."""
        return SpringHand(**(attributes_to_dict(self) | values))

    def record(self) -> HandRecord:
        """Return the hand as compiled bodies take it."""
        return HandRecord(False, self.stiffness, self.damping, self.force, 0.0, 0.0)


@dataclass(frozen=True)
class BandHand(Hand):
    """An elastic band that pulls the handle into the wall, with its true geometry.

    Its far end lies ``length`` below the anchor of the motion, at e = a - (0, 0, length). With
    L = |e - p| and the rest length L₀ = length - tension/stiffness it stores ½ K (L - L₀)² while
    L > L₀ and pulls with K (L - L₀) towards e; otherwise it is slack. A handle at the anchor is
    pulled with the tension, along -z. The damping acts on the whole velocity of the handle relative
    to the far end, along the band and across it: it stands for rubber, joints and air together.

    Attributes:
        stiffness: K [N/m].
        tension: at z = 0 [N].
        length: at z = 0 [m].
        damping: [N s/m].

    Raises:
        ParameterError: for a value that is not positive (damping: negative), or a tension that
            requires a negative rest length.

    Reference:
        Campion and Hayward, section V.A, where the band is not described; the numbers are a guess.

    Example:
        >>> round(BandHand().rest_length, 6)
        0.065
    """

    kind: ClassVar[str] = "band"

    stiffness: float = 200.0
    tension: float = 3.0
    length: float = 0.08
    damping: float = 0.02

    def __post_init__(self) -> None:
        check_positive("stiffness", self.stiffness, "N/m")
        check_positive("length", self.length, "m")
        nonnegative("tension", self.tension, "N")
        nonnegative("damping", self.damping, "N s/m")
        if self.rest_length <= 0.0:
            limit = f"must be less than stiffness * length = {self.stiffness * self.length:g} N"
            raise ParameterError("tension", limit, self.tension)

    @property
    def rest_length(self) -> float:
        """L₀ [m]."""
        return float(self.length - self.tension / self.stiffness)

    def record(self) -> HandRecord:
        """Return the hand as compiled bodies take it."""
        k = float(self.stiffness)
        b = float(self.damping)
        zero = (0.0, 0.0, 0.0)
        length = float(self.length)
        rest_length = float(self.rest_length)
        return HandRecord(True, (k, k, k), (b, b, b), zero, length, rest_length)


@dataclass(frozen=True)
class PrescribedHand(Hand):
    """A prescribed motion: the handle itself follows the motion, whatever the force.

    There are no dynamics: mass, damping and friction of the plant are not used, nothing is stored,
    and the work of the hand is the energy that the texture takes. The energies of the texture keep
    their meaning.

    Example:
        >>> PrescribedHand().to_dict()
        {'kind': 'moved'}
    """

    kind: ClassVar[str] = "moved"
    is_prescribed: ClassVar[bool] = True

    def initial_motion(
        self, motion: Motion, start: FloatArray | None, velocity: FloatArray | None, period: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return the start of the motion [m] and its velocity [m/s].

        Raises:
            ParameterError: for another start, or a velocity.
        """
        origin = motion.at(np.zeros(1))[0]
        if velocity is not None or (start is not None and (start != origin).any()):
            raise ParameterError("start", "must be the start of a prescribed motion")
        return origin, (motion.at(np.array([period]))[0] - origin) / period
