"""Plants as a servo samples them: device and hand over one sample, for the compiled loop."""

# ruff: noqa: ARG002 - one signature for all plants

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict
from asperity.simulation.hands import Hand
from asperity.simulation.kernels import energy_ledger, prescribed_motion
from asperity.simulation.servo import Servo

# Parts of a sample over which dry friction is held constant.
FRICTION_SUBSTEPS = 4
# Largest share of a time constant that one Runge-Kutta step covers: energy then closes to 1e-10.
_MAX_STEP_FRACTION = 0.01
# Largest number of substeps: a body that needs more is too fast for its period.
_MAX_SUBSTEPS = 10_000
# Typical values; the error names the parameter furthest from its typical value.
_TYPICAL_VALUES = {
    "mass": 0.1, "handle": 0.1, "stiffness": 1e3, "damping": 1.0, "joint_damping": 1e-2,
    "frequency": 100.0, "damping_ratio": 0.1, "period": 1e-3,
}  # fmt: skip


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


class Plant(ABC):
    """A device whose handle moves; a subclass is a dataclass of its numbers.

    Attributes:
        kind: name of the plant.
        is_planar: whether the handle stays in the plane y = 0.
    """

    kind: ClassVar[str]
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
            words = f"must stay at y = 0: a {self.kind} moves in the x-z plane"
            raise ParameterError(argument, words)

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

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {"kind": self.kind} | attributes_to_dict(self)


def sampled_plant(plant: Plant, hand: Hand, servo: Servo) -> SampledPlant:
    """Return a plant that a hand holds, sampled by a servo.

    Raises:
        ParameterError: for a resonance on an elastic band, which is not supported; for a body that
            is too fast for the period, or whose numbers overflow.
    """
    if hand.is_prescribed:
        record = prescribed_motion.PrescribedMotionRecord(float(servo.period))
        return SampledPlant((prescribed_motion, energy_ledger), record, 6)
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
    count = math.ceil(max_rate * period / _MAX_STEP_FRACTION)
    return max(count, FRICTION_SUBSTEPS if friction > 0.0 else 1)


def max_rate(mass: float, damping: float, hand: Hand) -> float:
    """Return the fastest rate of a mass with damping on a hand [1/s]."""
    force = hand.record()
    return max((damping + max(force.damping)) / mass, math.sqrt(max(force.stiffness) / mass))
