"""Plants, and their motion over one sample for the compiled loop."""

# ruff: noqa: ARG002 - one signature for all plants

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_nonnegative
from asperity.core.errors import ParameterError
from asperity.loop.bodies import (
    axis_body,
    body_parts,
    coupled_body,
    elastic_band,
    prescribed_motion,
)
from asperity.simulation.discretization import Resonance, integrate, linear_body
from asperity.simulation.hands import Hand, NamedPart, SpringHand, per_axis
from asperity.simulation.servo import Servo

# Parts of a sample over which dry friction is held constant.
_FRICTION_SUBSTEPS = 4
# Largest share of a time constant that one Runge-Kutta step covers: energy then closes to 1e-10.
_MAX_STEP_FRACTION = 0.01
# Largest number of substeps: a body that needs more is too fast for its period.
_MAX_SUBSTEPS = 10_000
# Typical values; the error names the parameter furthest from its typical value.
_TYPICAL_VALUES = {
    "mass": 0.1,
    "handle": 0.1,
    "stiffness": 1e3,
    "damping": 1.0,
    "joint_damping": 1e-2,
    "frequency": 100.0,
    "damping_ratio": 0.1,
    "period": 1e-3,
}


@dataclass(frozen=True)
class SampledPlant:
    """A device and the hand that holds it, over one sample.

    Attributes:
        modules: compiled functions that move it, see ``kernels/body_interface.py``.
        record: its parameters, the record ``plant`` of those functions.
        order: number of states: position and velocity, and those of further masses.
    """

    modules: tuple[ModuleType, ...]
    record: tuple[Any, ...]
    order: int

    def initial_state(self, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the state of a body whose masses share a position [m] and a velocity [m/s]."""
        return np.concatenate([position, velocity] * (self.order // 6))


class Plant(NamedPart, ABC):
    """A device whose handle moves; a subclass is a dataclass of its numbers.

    Attributes:
        kind: name of the plant.
        is_planar: whether the handle stays in the plane y = 0.
    """

    is_planar: ClassVar[bool] = False

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on parameters that are guesses."""
        return ()

    @abstractmethod
    def sample(self, hand: Hand, period: float) -> SampledPlant:
        """Return the plant held by a hand, over one sample of a period [s].

        Raises:
            ParameterError: for a hand that the plant does not support.
            ArithmeticError: for a body that is too fast for the period.
        """

    def check_points(self, argument: str, points: FloatArray) -> None:
        """Check that positions [m] or velocities [m/s] are possible, shape (..., 3).

        Raises:
            ParameterError: if they are not, with the name of the argument.
        """
        if self.is_planar and (points[..., 1] != 0.0).any():
            raise ParameterError(
                argument, f"must stay at y = 0: a {self.kind} moves in the x-z plane"
            )

    def workspace_violation(self, position: FloatArray) -> str:
        """Return why a position [m] is outside the workspace; empty if it is inside."""
        return ""

    def describe_exit(self, state: FloatArray) -> str:
        """Return where the handle left the workspace."""
        return ""

    @abstractmethod
    def min_damping(
        self, low: ArrayLike, high: ArrayLike, hand: Hand | None = None, top: float = 0.0
    ) -> float:
        """Return the smallest damping of the handle in any direction in a box [N s/m].

        Args:
            low: lower corner of the box [m], shape (3,).
            high: upper corner [m], shape (3,).
            hand: hand whose damping counts as well, as far as it is guaranteed.
            top: height up to which brakes may act [m].
        """

    def rates(self) -> list[tuple[str, float]]:
        """Return the numbers that make the plant fast, by name."""
        return []


def sampled_plant(plant: Plant, hand: Hand, servo: Servo) -> SampledPlant:
    """Return a plant that a hand holds, sampled by a servo.

    Raises:
        ParameterError: for a resonance on an elastic band, which is not supported; for a body that
            is too fast for the period, or whose numbers overflow.
    """
    if hand.is_prescribed:
        record = prescribed_motion.PrescribedMotionRecord(float(servo.period))
        return SampledPlant((prescribed_motion,), record, 6)
    try:
        with np.errstate(all="ignore"):  # an overflow is refused below
            sampled = plant.sample(hand, servo.period)
    except (ArithmeticError, np.linalg.LinAlgError):
        raise _too_fast_error(plant, hand, servo.period) from None
    if not _is_finite_record(sampled.record):
        raise _too_fast_error(plant, hand, servo.period)
    return sampled


def _is_finite_record(record: object) -> bool:
    """Return whether all numbers of a record, and of records in it, are finite."""
    if isinstance(record, tuple):
        return all(_is_finite_record(part) for part in record)
    return bool(np.isfinite(np.asarray(record, dtype=np.float64)).all())


def _too_fast_error(plant: Plant, hand: Hand, period: float) -> ParameterError:
    """Return the error that names the parameter furthest from its typical value."""
    rates = [*hand.rates()[:2], ("period", period), *plant.rates(), *hand.rates()[2:]]
    name, value = max(
        ((name, value) for name, value in rates if value > 0.0),
        key=lambda rate: abs(math.log(rate[1] / _TYPICAL_VALUES.get(rate[0], 1.0))),
    )
    words = f"makes the body too fast to be computed in samples of {period:g} s"
    return ParameterError(name, words, float(value))


def substep_count(friction: float, max_rate: float, period: float) -> int:
    """Return the number of steps of a sample for rates up to this one [1/s].

    Raises:
        OverflowError: for more than ``_MAX_SUBSTEPS``.
    """
    if not max_rate * period / _MAX_STEP_FRACTION <= _MAX_SUBSTEPS:
        raise OverflowError
    return max(math.ceil(max_rate * period / _MAX_STEP_FRACTION), friction_substeps(friction))


def friction_substeps(friction: float) -> int:
    """Return the number of parts of a sample over which dry friction [N] is held constant."""
    if friction > 0.0:
        return _FRICTION_SUBSTEPS
    return 1


def max_rate(mass: float, damping: float, hand: Hand) -> float:
    """Return the fastest rate of a mass with damping on a hand [1/s]."""
    force = hand.record()
    return max((damping + max(force.damping)) / mass, math.sqrt(max(force.stiffness) / mass))


def symmetric_matrix(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Return a positive semidefinite matrix, from a number, one number per axis, or a matrix.

    Raises:
        ParameterError: for any other value.
    """
    if np.ndim(value) < 2:
        return np.diag(per_axis(name, value, unit))
    matrix = check_array(name, value, (3, 3), unit)
    size = float(np.abs(matrix).max())
    if np.abs(matrix - matrix.T).max() > 1e-12 * size:
        raise ParameterError(name, "must be symmetric", value)
    if np.linalg.eigvalsh(matrix)[0] < -1e-12 * size:
        raise ParameterError(name, "must be positive semidefinite", value)
    return np.asarray(0.5 * (matrix + matrix.T))


@dataclass(frozen=True, eq=False)
class Cartesian(Plant):
    """A handle with constant mass and damping in space.

    M p'' = f - B p' - F_c p'/|p'| + hand.

    Attributes:
        mass: mass as felt at the handle [kg], one per axis.
        damping: B [N s/m], a symmetric matrix (3, 3), positive semidefinite.
        resonance: first structural mode, the same along all axes, or ``None``.
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

    kind: ClassVar[str] = "cartesian"

    mass: body_parts.Triple
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
        axes = per_axis("mass", mass, "kg", signed=True)
        if min(axes) <= 0.0:
            raise ParameterError("mass", "must be positive [kg]", mass)
        if resonance is not None and not isinstance(resonance, Resonance):
            raise ParameterError("resonance", "must be a Resonance or None", resonance)
        object.__setattr__(self, "mass", axes)
        object.__setattr__(self, "damping", symmetric_matrix("damping", damping, "N s/m"))
        object.__setattr__(self, "resonance", resonance)
        object.__setattr__(self, "friction", check_nonnegative("friction", friction, "N"))

    def sample(self, hand: Hand, period: float) -> SampledPlant:
        """Return the mass held by a hand, over one sample."""
        if not isinstance(hand, SpringHand):
            return _elastic_band_plant(self, hand, period)
        is_diagonal = not np.any(self.damping - np.diag(np.diag(self.damping)))
        separate = is_diagonal and self.resonance is None
        if separate:
            return _axis_plant(self, hand, period)
        return coupled_plant(self, hand, period)

    def min_damping(
        self, low: ArrayLike, high: ArrayLike, hand: Hand | None = None, top: float = 0.0
    ) -> float:
        """Return the smallest damping of the handle [N s/m], the same everywhere."""
        damping = self.damping
        if hand is not None and self.resonance is None:
            # Behind a resonance the hand does not damp the handle.
            damping = damping + hand.damping_matrix
        return float(np.linalg.eigvalsh(damping)[0])

    def rates(self) -> list[tuple[str, float]]:
        """Return the numbers that make the body fast."""
        mode = self.resonance
        rates = [("mass", min(self.mass)), ("damping", float(np.abs(self.damping).max()))]
        if mode is not None:
            rates += [("frequency", mode.frequency), ("damping_ratio", mode.damping_ratio)]
        return rates


def _axis_plant(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    """Return a rigid body without coupling between its axes."""
    parts = friction_substeps(plant.friction)
    body = linear_body(plant.mass, plant.damping, hand)
    span = period / parts
    used = np.arange(18).reshape(6, 3).T[:, [0, 1, 4]]  # e, w and F of each axis
    axes = used[:, :, None], used[:, None, :]
    changes, losses = integrate(body.dynamics[axes], body.loss[axes], span)
    rows, columns = np.triu_indices(3)
    loss = losses[:, rows, columns] * np.where(rows == columns, 1.0, 2.0)
    force = np.array(hand.force)
    numbers = [np.diag(plant.damping), body.mass, body.stiffness, force, np.full(3, span)]
    table = np.hstack([changes[:, :2].reshape(3, -1), loss, np.array(numbers).T])
    stops = np.zeros((3, 3))
    if plant.friction > 0.0:
        stops = np.diag(span / changes[:, 1, 2])
    record = axis_body.AxisBodyRecord(table, plant.friction, stops, parts, span)
    return SampledPlant((axis_body, body_parts), record, 6)


def coupled_plant(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    """Return a linear body with any coupling, moved by whole matrices."""
    parts = friction_substeps(plant.friction)
    body = linear_body(plant.mass, plant.damping, hand, plant.resonance)
    span = period / parts
    change, loss = integrate(body.dynamics, body.loss, span)
    stops = np.asarray(span * np.linalg.inv(change[3:6, 12:15]))
    record = coupled_body.CoupledBodyRecord(
        np.ascontiguousarray(change[:12].T),
        np.ascontiguousarray(loss),
        plant.damping,
        body.mass,
        body.carrier_mass,
        body.coupling,
        body.stiffness,
        np.array(hand.force),
        plant.friction,
        stops,
        parts,
        span,
    )
    order = 6 if plant.resonance is None else 12
    return SampledPlant((coupled_body, body_parts), record, order)


def _elastic_band_plant(plant: Cartesian, hand: Hand, period: float) -> SampledPlant:
    """Return a body that is integrated, on any hand."""
    if plant.resonance is not None:
        raise ParameterError("resonance", "is not offered together with an elastic band")
    damping = float(np.linalg.eigvalsh(plant.damping)[-1])
    parts = substep_count(plant.friction, max_rate(min(plant.mass), damping, hand), period)
    record = elastic_band.ElasticBandRecord(
        np.diag(plant.mass), plant.damping, hand.record(), plant.friction, parts, period / parts
    )
    return SampledPlant((elastic_band, body_parts), record, 6)
