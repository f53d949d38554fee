"""The hand that holds the handle: the motions of its anchor, and the models of its mechanics."""

from __future__ import annotations

import math
from abc import ABC
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_nonnegative, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict
from asperity.loop.bodies.body_parts import HandRecord, Triple

# ruff: noqa: ARG002 - one signature for all hands


@runtime_checkable
class Motion(Protocol):
    """A motion of the hand's anchor."""

    def at(self, times: FloatArray) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""


class NamedPart:
    """Mixin for the dataclasses of a closed loop that a scene names by their kind.

    Attributes:
        kind: name of the kind.
    """

    kind: ClassVar[str]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": self.kind} | attributes_to_dict(self)


def _check_point(name: str, value: ArrayLike) -> tuple[float, float, float]:
    x, y, z = check_array(name, value, (3,), "m")
    return float(x), float(y), float(z)


@dataclass(frozen=True)
class Stationary(NamedPart):
    """An anchor that stays where it is.

    Attributes:
        point: [m], shape (3,).

    Raises:
        ParameterError: for another shape or a value that is not finite.

    Example:
        >>> Stationary((0.0, 0.0, -1e-3)).at([0.0, 1.0])
        array([[ 0.   ,  0.   , -0.001],
               [ 0.   ,  0.   , -0.001]])
    """

    kind: ClassVar[str] = "still"

    point: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", _check_point("point", self.point))

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        return np.tile(np.array(self.point), (len(check_array("times", times, (None,), "s")), 1))


@dataclass(frozen=True)
class Strokes(NamedPart):
    """Back and forth between two points at constant speed, ending where the last stroke ends.

    Attributes:
        start: where the first stroke begins [m], shape (3,).
        end: where it ends and the second begins [m], shape (3,).
        speed: [m/s].
        count: number of strokes.

    Raises:
        ParameterError: for points that coincide or are infinitely far apart, a speed that is not
            positive or gives no finite duration, or a count that is not a positive whole number.

    Example:
        >>> there = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), speed=0.2, count=2)
        >>> there.period, there.duration
        (0.5, 1.0)
        >>> there.at([0.25, 0.75, 2.0])[:, 0]
        array([0.05, 0.05, 0.  ])
    """

    kind: ClassVar[str] = "strokes"

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    speed: float
    count: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", _check_point("start", self.start))
        object.__setattr__(self, "end", _check_point("end", self.end))
        check_positive("speed", self.speed, "m/s")
        if self.start == self.end:
            raise ParameterError("end", "must differ from start", self.end)
        if check_positive("count", self.count) % 1 != 0:
            raise ParameterError("count", "must be a whole number of strokes", self.count)
        object.__setattr__(self, "count", int(self.count))
        if not math.isfinite(math.dist(self.start, self.end)):
            raise ParameterError("end", "must be at a finite distance from start [m]", self.end)
        if not (self.period > 0.0 and math.isfinite(self.duration)):
            raise ParameterError(
                "speed", "must make a stroke last, and all of them a finite time [m/s]", self.speed
            )

    @property
    def period(self) -> float:
        """Duration of one stroke [s]."""
        return math.dist(self.start, self.end) / self.speed

    @property
    def duration(self) -> float:
        """Duration of all strokes [s]."""
        return self.count * self.period

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        strokes = check_array("times", times, (None,), "s") / self.period
        strokes = np.clip(strokes, 0.0, self.count)
        share = 1.0 - np.abs(1.0 - strokes % 2.0)
        begin = np.array(self.start)
        way = np.subtract(self.end, self.start)
        return np.asarray(begin + share[:, None] * way)


@dataclass(frozen=True, eq=False)
class Waypoints(NamedPart):
    """Through given points at given times, straight and at constant speed in between.

    Before the first time and after the last one it rests there.

    Attributes:
        times: [s], increasing, shape (n,).
        points: [m], shape (n, 3).

    Raises:
        ParameterError: for other shapes, values that are not finite, or times that do not increase.

    Example:
        >>> Waypoints([0.0, 1.0], [[0.0, 0.0, 0.0], [0.0, 0.0, 2.0]]).at([0.25, 3.0])[:, 2]
        array([0.5, 2. ])
    """

    kind: ClassVar[str] = "path"

    times: FloatArray
    points: FloatArray

    def __post_init__(self) -> None:
        times = check_array("times", self.times, (None,), "s")
        points = check_array("points", self.points, (None, 3), "m")
        if len(times) < 1 or len(times) != len(points):
            raise ParameterError("points", f"must be one for each of {len(times)} times")
        if (np.diff(times) <= 0.0).any():
            raise ParameterError("times", "must increase [s]")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "points", points)

    @property
    def duration(self) -> float:
        """The last time [s]."""
        return float(self.times[-1])

    def at(self, times: ArrayLike) -> FloatArray:
        """Return the positions [m], shape (n, 3), at the times [s], shape (n,)."""
        wanted = check_array("times", times, (None,), "s")
        columns = [np.interp(wanted, self.times, self.points[:, i]) for i in range(3)]
        return np.stack(columns, axis=-1)


def per_axis(name: str, value: ArrayLike, unit: str, *, signed: bool = False) -> Triple:
    """Return one number per axis, from one number or three.

    Raises:
        ParameterError: for another shape, a value that is not finite, or (unless signed) negative.
    """
    axes = value
    if np.ndim(value) == 0:
        axes = np.full(3, value)
    x, y, z = check_array(name, axes, (3,), unit)
    if not signed and min(x, y, z) < 0.0:
        raise ParameterError(name, f"must not be negative [{unit}]", value)
    return float(x), float(y), float(z)


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
        object.__setattr__(self, "mass", check_nonnegative("mass", mass, "kg"))
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
        check_nonnegative("tension", self.tension, "N")
        check_nonnegative("damping", self.damping, "N s/m")
        if self.rest_length <= 0.0:
            raise ParameterError(
                "tension",
                f"must be less than stiffness * length = {self.stiffness * self.length:g} N",
                self.tension,
            )

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
