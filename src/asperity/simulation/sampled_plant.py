"""The plant that a servo samples: device and hand together, as the compiled loop takes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.simulation.exact import axis_table, body, exact_step, resonant_table
from asperity.simulation.hands import BandHand, Hand, MovedHand, SpringHand
from asperity.simulation.kernels import (
    axes,
    banded,
    bar_lanes,
    booking,
    dense,
    five_bar,
    prescribed,
    resonant,
    rigid,
)
from asperity.simulation.kernels import hand as hand_kernels
from asperity.simulation.kernels.hand import HandRecord
from asperity.simulation.plants import Cartesian, Pantograph, Plant
from asperity.simulation.servo import Servo

# Parts of a sample over which dry friction is held constant.
FRICTION_PARTS = 4
# Least sine of the angle at the elbows of a pantograph: nearer to stretched or folded it stops.
LEAST_SINE = 0.05
# Greatest part of a time constant that one Runge-Kutta step covers: energy then closes to 1e-10.
_LARGEST_PART = 0.01
# Likewise of the method of order five that moves a pantograph: energy closes to 1e-11.
_LARGEST_STEP = 0.05
# Parts of a sample at most: a body that needs more is too fast for its period.
_MOST_PARTS = 10_000
# What is usual: of a body that cannot be computed, what is furthest from it is named.
_USUAL = {
    "mass": 0.1, "handle": 0.1, "stiffness": 1e3, "damping": 1.0, "joint_damping": 1e-2,
    "frequency": 100.0, "damping_ratio": 0.1, "period": 1e-3,
}  # fmt: skip


@dataclass(frozen=True)
class SampledPlant:
    """A device and the hand that holds it, over one sample, as the compiled loop takes them.

    Attributes:
        modules: the functions that move it, see ``kernels``.
        record: what it is made of, the record ``plant`` of the loop.
        order: number of states.
    """

    modules: tuple[ModuleType, ...]
    record: tuple[Any, ...]
    order: int

    def state(self, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Return the state of a body at a place [m], all of it at one velocity [m/s]."""
        return np.concatenate([position, velocity] * (self.order // 6))


def sampled_plant(plant: Plant, hand: Hand, servo: Servo) -> SampledPlant:
    """Return a plant that a hand holds, sampled by a servo.

    Raises:
        ParameterError: for a resonance on an elastic band, which is not offered; for a body that is
            too fast for the period, or whose numbers overflow.
    """
    if isinstance(hand, MovedHand):
        record = prescribed.PrescribedPlant(float(servo.period))
        return SampledPlant((prescribed, booking), record, 6)
    try:
        with np.errstate(all="ignore"):  # what overflows is refused here
            made = _held(plant, hand, servo.period)
    except (ArithmeticError, np.linalg.LinAlgError):
        raise _too_fast(plant, hand, servo.period) from None
    if not _finite(made.record):
        raise _too_fast(plant, hand, servo.period)
    return made


def _finite(record: object) -> bool:
    """Return whether all numbers of a record are finite, those of records in it too."""
    if isinstance(record, tuple):
        return all(_finite(part) for part in record)
    return bool(np.isfinite(np.asarray(record, dtype=np.float64)).all())


def _held(plant: Plant, hand: SpringHand | BandHand, period: float) -> SampledPlant:
    if isinstance(plant, Pantograph):
        return _pantograph(plant, hand, period)
    if isinstance(hand, BandHand):
        return _banded(plant, hand, period)
    return _linear(plant, hand, period)


def _too_fast(plant: Plant, hand: SpringHand | BandHand, period: float) -> ParameterError:
    """Return the error that names what is furthest from the usual."""
    given = [("stiffness", np.max(hand.stiffness)), ("damping", np.max(hand.damping))]
    given += [("period", period)]
    if isinstance(plant, Pantograph):
        given += [("handle", plant.masses.handle + plant.masses.distal)]
        given += [("joint_damping", plant.joint_damping)]
    else:
        given += [("mass", min(plant.mass)), ("damping", np.abs(plant.damping).max())]
        mode = plant.resonance
        given += [] if mode is None else [("frequency", mode.frequency)]
        given += [] if mode is None else [("damping_ratio", mode.damping_ratio)]
    if isinstance(hand, SpringHand):
        given += [("mass", hand.mass)]
    name, value = max(
        (one for one in given if one[1] > 0.0),
        key=lambda one: abs(math.log(one[1] / _USUAL[one[0]])),
    )
    words = f"makes the body too fast to be computed in samples of {period:g} s"
    return ParameterError(name, words, float(value))


def _linear(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    if np.abs(plant.damping - np.diag(np.diag(plant.damping))).max() > 0.0:
        return coupled_plant(plant, hand, period)
    parts = FRICTION_PARTS if plant.friction > 0.0 else 1
    span = float(period / parts)
    mode = plant.resonance
    if mode is None:
        table, speed = np.array([axis_table(plant, hand, i, span) for i in range(3)]), 5
    else:
        table, speed = np.array([resonant_table(plant, mode, hand, i, span) for i in range(3)]), 10
    stops = np.diag(span / table[:, speed]) if plant.friction > 0.0 else np.zeros((3, 3))
    record = axes.AxesPlant(table, plant.friction, stops, parts, span)
    modules = (axes, resonant if mode else rigid, dense, booking)
    return SampledPlant(modules, record, 12 if mode else 6)


def coupled_plant(plant: Cartesian, hand: SpringHand, period: float) -> SampledPlant:
    """Return a linear body moved by whole matrices, whatever its coupling."""
    parts = FRICTION_PARTS if plant.friction > 0.0 else 1
    moved = body(plant.mass, plant.damping, hand, plant.resonance)
    step = exact_step(moved, period / parts)
    n = moved.order
    stops = np.asarray(step.period * np.linalg.inv(step.motion[3:6, n : n + 3]), dtype=np.float64)
    record = dense.DensePlant(
        step.motion, step.loss, step.anchor_work, step.storage, np.zeros(n + 12),
        np.array(hand.force), plant.friction, stops, parts, period / parts,
    )  # fmt: skip
    return SampledPlant((dense, booking), record, n)


def _hand_record(hand: SpringHand | BandHand) -> HandRecord:
    if isinstance(hand, SpringHand):
        return HandRecord(False, hand.stiffness, hand.damping, hand.force, 0.0, 0.0)
    k, b = float(hand.stiffness), float(hand.damping)
    none = (0.0, 0.0, 0.0)
    return HandRecord(True, (k, k, k), (b, b, b), none, float(hand.length), float(hand.rest_length))


def _parts(friction: float, rate: float, period: float) -> int:
    """Return into how many steps a sample is divided, for rates up to this one [1/s].

    Raises:
        OverflowError: for more than ``_MOST_PARTS``.
    """
    if not rate * period / _LARGEST_PART <= _MOST_PARTS:
        raise OverflowError
    needed = math.ceil(rate * period / _LARGEST_PART)
    return max(needed, FRICTION_PARTS if friction > 0.0 else 1)


def _fastest(mass: float, damping: float, hand: SpringHand | BandHand) -> float:
    """Return the fastest rate of a mass with damping on a hand [1/s]."""
    stiffness = hand.stiffness if isinstance(hand, BandHand) else max(hand.stiffness)
    held = hand.damping if isinstance(hand, BandHand) else max(hand.damping)
    return max((damping + held) / mass, math.sqrt(stiffness / mass))


def _banded(plant: Cartesian, hand: BandHand, period: float) -> SampledPlant:
    if plant.resonance is not None:
        raise ParameterError("resonance", "is not offered together with an elastic band")
    damping = float(np.linalg.eigvalsh(plant.damping)[-1])
    parts = _parts(plant.friction, _fastest(min(plant.mass), damping, hand), period)
    record = banded.BandedPlant(
        np.diag(plant.mass), plant.damping, _hand_record(hand), plant.friction, parts,
        period / parts,
    )  # fmt: skip
    return SampledPlant((banded, hand_kernels, dense, booking), record, 6)


def _pantograph(plant: Pantograph, hand: SpringHand | BandHand, period: float) -> SampledPlant:
    held = hand.mass if isinstance(hand, SpringHand) else 0.0
    bar = bar_record(plant, held)
    mxx, mxz, mzz, _cx, _cz, bxx, _bxz, bzz = five_bar.bar_body(0.0, 0.0, 0.0, 0.0, bar)
    least = float(np.linalg.eigvalsh([[mxx, mxz], [mxz, mzz]])[0])
    # Twice the damping here: elsewhere in the workspace it may be larger.
    rate = _fastest(least, 2.0 * plant.joint_damping * (bxx + bzz), hand)
    _parts(plant.friction, rate, period)  # refuses too many; how many there are depends on speed
    fewest = FRICTION_PARTS if plant.friction > 0.0 else 1
    record = five_bar.PantographPlant(
        bar, _hand_record(hand), float(plant.friction), rate, fewest, float(period), _LARGEST_STEP,
        bool(plant.inside_only), LEAST_SINE,
    )  # fmt: skip
    return SampledPlant((five_bar, bar_lanes, hand_kernels, booking), record, 6)


def bar_record(plant: Pantograph, held: float = 0.0) -> five_bar.Bar:
    """Return the linkage of a pantograph, with a mass [kg] held at the handle."""
    bars, masses = plant.linkage, plant.masses
    first = masses.rotor + masses.proximal * bars.proximal**2 / 3.0
    inertia = first + masses.distal * bars.proximal**2 / 3.0
    numbers = (
        bars.proximal, bars.distal, bars.base, inertia, masses.distal, masses.handle + held,
        *plant.centre, plant.joint_damping,
    )  # fmt: skip
    return five_bar.Bar(*map(float, numbers))
