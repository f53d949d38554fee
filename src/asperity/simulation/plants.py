"""Plants with a constant mass: a handle with mass and damping in space."""

# ruff: noqa: ARG002 - one signature for all plants

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.simulation.discretization import (
    Resonance,
    discretize,
    linear_body,
    resonant_axis_coefficients,
    rigid_axis_coefficients,
)
from asperity.simulation.hands import Hand, SpringHand, Triple, nonnegative, per_axis
from asperity.simulation.kernels import coupled_body, elastic_band, energy_ledger, hand_force
from asperity.simulation.kernels.axes import axis_body, resonant_axis, rigid_axis
from asperity.simulation.sampled_plant import (
    FRICTION_SUBSTEPS,
    Plant,
    SampledPlant,
    max_rate,
    substep_count,
)


def symmetric_matrix(name: str, value: ArrayLike, unit: str) -> FloatArray:
    """Return a positive semidefinite matrix, from a number, one number per axis, or a matrix.

    Raises:
        ParameterError: for any other value.
    """
    given = np.asarray(value)
    if given.ndim < 2:
        return np.diag(per_axis(name, value, unit))
    matrix = check_array(name, given, (3, 3), unit)
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
        axes = per_axis("mass", mass, "kg", signed=True)
        if min(axes) <= 0.0:
            raise ParameterError("mass", "must be positive [kg]", mass)
        if resonance is not None and not isinstance(resonance, Resonance):
            raise ParameterError("resonance", "must be a Resonance or None", resonance)
        object.__setattr__(self, "mass", axes)
        object.__setattr__(self, "damping", symmetric_matrix("damping", damping, "N s/m"))
        object.__setattr__(self, "resonance", resonance)
        object.__setattr__(self, "friction", nonnegative("friction", friction, "N"))

    def sample(self, hand: Hand, period: float) -> SampledPlant:
        """Return the mass held by a hand, over one sample."""
        if not isinstance(hand, SpringHand):
            return _elastic_band_plant(self, hand, period)
        if np.abs(self.damping - np.diag(np.diag(self.damping))).max() > 0.0:
            return coupled_plant(self, hand, period)
        return _axis_plant(self, hand, period)

    def min_damping(
        self, low: ArrayLike, high: ArrayLike, hand: Hand | None = None, top: float = 0.0
    ) -> float:
        """Return the smallest damping of the handle [N s/m], the same everywhere."""
        # Behind a resonance the hand does not damp the handle.
        held = 0.0 if hand is None or self.resonance is not None else hand.damping_matrix
        return float(np.linalg.eigvalsh(self.damping + held)[0])

    def rates(self) -> list[tuple[str, float]]:
        """Return the numbers that make the body fast."""
        mode = self.resonance
        rates = [("mass", min(self.mass)), ("damping", float(np.abs(self.damping).max()))]
        if mode is not None:
            rates += [("frequency", mode.frequency), ("damping_ratio", mode.damping_ratio)]
        return rates


def _axis_plant(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    """Return a linear body without coupling between its axes."""
    parts = FRICTION_SUBSTEPS if plant.friction > 0.0 else 1
    span, mode = float(period / parts), plant.resonance
    numbers = zip(plant.mass, np.diag(plant.damping).tolist(), range(3), strict=True)
    if mode is None:
        table = np.array([rigid_axis_coefficients(*axis, hand, span) for axis in numbers])
    else:
        table = np.array([resonant_axis_coefficients(*axis, hand, span, mode) for axis in numbers])
    speed = table[:, 5 if mode is None else 10]
    stops = np.diag(span / speed) if plant.friction > 0.0 else np.zeros((3, 3))
    record = axis_body.AxisBodyRecord(table, plant.friction, stops, parts, span)
    modules = (axis_body, rigid_axis if mode is None else resonant_axis, coupled_body)
    return SampledPlant((*modules, energy_ledger), record, 6 if mode is None else 12)


def coupled_plant(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    """Return a linear body moved by whole matrices, with any coupling."""
    parts = FRICTION_SUBSTEPS if plant.friction > 0.0 else 1
    body = linear_body(plant.mass, plant.damping, hand, plant.resonance)
    step = discretize(body, period / parts)
    n = body.order
    stops = np.asarray(step.period * np.linalg.inv(step.transition[3:6, n : n + 3]))
    record = coupled_body.CoupledBodyRecord(
        step.transition, step.loss, step.anchor_work, step.storage, np.zeros(n + 12),
        np.array(hand.force), plant.friction, stops, parts, period / parts,
    )  # fmt: skip
    return SampledPlant((coupled_body, energy_ledger), record, n)


def _elastic_band_plant(plant: Cartesian, hand: Hand, period: float) -> SampledPlant:
    """Return a body that is integrated, on any hand."""
    if plant.resonance is not None:
        raise ParameterError("resonance", "is not offered together with an elastic band")
    damping = float(np.linalg.eigvalsh(plant.damping)[-1])
    parts = substep_count(plant.friction, max_rate(min(plant.mass), damping, hand), period)
    record = elastic_band.ElasticBandRecord(
        np.diag(plant.mass), plant.damping, hand.record(), plant.friction, parts, period / parts
    )
    return SampledPlant((elastic_band, hand_force, coupled_body, energy_ledger), record, 6)
