"""Exact discretization of linear bodies: motion, loss and work by matrix exponentials.

The body is a handle with mass and damping and a hand, a spring to its anchor. Over a sample it is
linear, with a constant force and an anchor at constant velocity, so the motion and every energy are
exact.

With z = (x, f, a, v, g), f, v and g constant and a' = v over the sample, z' = F z. So
z(T) = e^{FT} z(0); the loss ∫ zᵀQz dt is a quadratic form of z(0) (Van Loan, IEEE Trans. Autom.
Control 23 (1978) 395), and the work of the anchor is v · N ∫ z dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable
from asperity.simulation.hands import SpringHand

# The first omitted term is 0.25^15/15!, 1e-21.
_TERMS = 14


@dataclass(frozen=True)
class Resonance(Serializable):
    """The first structural mode: part of the mass hangs on a spring, away from motor and sensor.

    Attributes:
        frequency: of the free vibration of the two masses against each other [Hz].
        damping_ratio: damping ratio of that mode [1].
        mass_fraction: share of the mass that hangs on the spring [1], between 0 and 1.
    """

    frequency: float
    damping_ratio: float = 0.02
    mass_fraction: float = 0.5

    def __post_init__(self) -> None:
        check_positive("frequency", self.frequency, "Hz")
        if check_real("damping_ratio", self.damping_ratio) < 0.0:
            raise ParameterError("damping_ratio", "must not be negative", self.damping_ratio)
        if not 0.0 < check_real("mass_fraction", self.mass_fraction) < 1.0:
            raise ParameterError("mass_fraction", "must be between 0 and 1", self.mass_fraction)

    def split_mass(self, mass: float, hand_mass: float) -> tuple[float, float, float, float]:
        """Return near and far mass [kg], stiffness [N/m] and damping [N s/m] between them."""
        near, far = (1.0 - self.mass_fraction) * mass, self.mass_fraction * mass + hand_mass
        omega, reduced = 2.0 * math.pi * self.frequency, near * far / (near + far)
        return near, far, omega**2 * reduced, 2.0 * self.damping_ratio * omega * reduced


@dataclass(frozen=True)
class LinearBody:
    """A linear body, x' = F z with z = (x, f, a, v, g), and its energies as quadratic forms.

    f is the force on the handle [N], a and v are position and velocity of the hand's anchor, g is
    the constant force of the hand. The stored energy is ½ zᵀ S z and the rate of loss zᵀ Q z; the
    anchor supplies the power v · N z. S and Q are symmetric.

    Attributes:
        dynamics: F, shape (n, n + 12); the first three states are the handle's position [m], the
            next
            three its velocity [m/s]; then the same of the mass that carries the hand, if it is
            a second one.
        storage: S, shape (n + 12, n + 12).
        loss: Q, shape (n + 12, n + 12).
        anchor_force: N, the force of the anchor on the body, shape (3, n + 12).
    """

    dynamics: FloatArray
    storage: FloatArray
    loss: FloatArray
    anchor_force: FloatArray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.dynamics)


def linear_body(
    mass: ArrayLike, damping: ArrayLike, hand: SpringHand, resonance: Resonance | None = None
) -> LinearBody:
    """Return the linear body of a device that a hand holds.

    M p'' = f - B p' + K_h (a - p) + B_h (v - p') + g; with a resonance the share of the device's
    mass and the hand hang on a spring from the mass at motor and sensor.

    Args:
        mass: mass of the device as felt at the handle [kg], one per axis.
        damping: B [N s/m], symmetric, positive semidefinite, shape (3, 3).
        hand: spring, damper, mass and constant force of the hand.
        resonance: first structural mode, alike along all axes.

    Example:
        >>> linear_body([0.05] * 3, np.eye(3), SpringHand(stiffness=200.0)).order
        6
    """
    device, friction = np.diag(np.asarray(mass, dtype=float)), np.asarray(damping, dtype=float)
    spring, damper = np.diag(hand.stiffness), np.diag(hand.damping)
    if resonance is None:
        return _single_mass_body(device + hand.mass * np.eye(3), friction, spring, damper)
    return _two_mass_body(device, friction, hand.mass, spring, damper, resonance)


class _BlockRows:
    """Rows of z, three by three: ``blocks(r=1, p=-1)`` is the matrix of r - p."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names

    def __call__(self, **weights: float) -> FloatArray:
        matrix = np.zeros((3, 3 * len(self._names)))
        for name, weight in weights.items():
            first = 3 * self._names.index(name)
            matrix[:, first : first + 3] = weight * np.eye(3)
        return matrix


def _single_mass_body(
    mass: FloatArray, friction: FloatArray, spring: FloatArray, damper: FloatArray
) -> LinearBody:
    """Return the body of one mass: x = (p, p')."""
    z = _BlockRows(("p", "dp", "f", "a", "v", "g"))
    length, rate, speed = z(a=1.0, p=-1.0), z(v=1.0, dp=-1.0), z(dp=1.0)
    pull = spring @ length + damper @ rate
    rows = [speed, np.linalg.inv(mass) @ (z(f=1.0, g=1.0) - friction @ speed + pull)]
    storage = _quadratic_form(mass, speed) + _quadratic_form(spring, length)
    loss = _quadratic_form(friction, speed) + _quadratic_form(damper, rate)
    return LinearBody(np.vstack(rows), storage, loss, pull)


def _two_mass_body(
    device: FloatArray, friction: FloatArray, hand_mass: float, spring: FloatArray,
    damper: FloatArray, resonance: Resonance,
) -> LinearBody:  # fmt: skip
    """Return the body of two masses: x = (p, p', r, r'), r the mass that carries the hand."""
    near = (1.0 - resonance.mass_fraction) * device
    far = resonance.mass_fraction * device + hand_mass * np.eye(3)
    reduced = near @ far @ np.linalg.inv(near + far)
    omega = 2.0 * np.pi * resonance.frequency
    inner, inner_damper = omega**2 * reduced, 2.0 * resonance.damping_ratio * omega * reduced
    z = _BlockRows(("p", "dp", "r", "dr", "f", "a", "v", "g"))
    speed, gap, gap_rate = z(dp=1.0), z(r=1.0, p=-1.0), z(dr=1.0, dp=-1.0)
    length, rate = z(a=1.0, r=-1.0), z(v=1.0, dr=-1.0)
    pull = spring @ length + damper @ rate
    between = inner @ gap + inner_damper @ gap_rate
    near_rate = np.linalg.inv(near) @ (z(f=1.0) - friction @ speed + between)
    far_rate = np.linalg.inv(far) @ (z(g=1.0) + pull - between)
    storage = _quadratic_form(near, speed) + _quadratic_form(far, z(dr=1.0))
    storage += _quadratic_form(inner, gap) + _quadratic_form(spring, length)
    loss = _quadratic_form(friction, speed) + _quadratic_form(inner_damper, gap_rate)
    loss = loss + _quadratic_form(damper, rate)
    return LinearBody(np.vstack([speed, near_rate, z(dr=1.0), far_rate]), storage, loss, pull)


def _quadratic_form(matrix: FloatArray, rows: FloatArray) -> FloatArray:
    return np.asarray(rows.T @ matrix @ rows)


@dataclass(frozen=True)
class LinearStep:
    """One sample of a linear body, for z = (x, f, a, v, g) at its start.

    Attributes:
        period: T [s].
        transition: x at the end is ``transition @ z``, shape (n, n + 12).
        loss: the energy lost is zᵀ loss z, symmetric, shape (n + 12, n + 12).
        anchor_work: the anchor's work is v · (anchor_work @ z), shape (3, n + 12).
        storage: the energy stored at the start is ½ zᵀ storage z.
    """

    period: float
    transition: FloatArray
    loss: FloatArray
    anchor_work: FloatArray
    storage: FloatArray


def exponential(matrix: FloatArray) -> FloatArray:
    """Return e^A of small matrices, shape (..., n, n), by squaring a Taylor sum.

    SciPy's function takes milliseconds here, mostly to start threads; many short runs need it.
    """
    size = float(np.abs(matrix).sum(axis=-1).max())
    squarings = math.ceil(math.log2(size / 0.25)) if size > 0.25 else 0
    part = matrix / 2.0**squarings
    result = np.eye(matrix.shape[-1]) + part / _TERMS
    for term in range(_TERMS - 1, 0, -1):
        result = np.eye(matrix.shape[-1]) + part @ result / term
    for _ in range(squarings):
        result = result @ result
    return result


def discretize(body: LinearBody, period: float) -> LinearStep:
    """Return one sample of a body over a period [s].

    Raises:
        ParameterError: for a period that is not positive.
    """
    span = check_positive("period", period, "s")
    n = body.order
    size = n + 12
    flow = np.zeros((size, size))
    flow[:n] = body.dynamics
    flow[n + 3 : n + 6, n + 6 : n + 9] = np.eye(3)
    # In units of one sample: the exponent stays of order one.
    whole = exponential(span * flow)
    # Van Loan: the exponential of [[-Fᵀ, Q], [0, F]] holds e^{-FᵀT} ∫ e^{Fᵀt} Q e^{Ft} dt.
    blocks = np.block([[-flow.T, body.loss], [np.zeros((size, size)), flow]])
    large = exponential(span * blocks)
    lost = large[size:, size:].T @ large[:size, size:]
    summed = exponential(span * np.block([[flow, np.eye(size)], [np.zeros((size, 2 * size))]]))
    return LinearStep(
        period=span,
        transition=np.ascontiguousarray(whole[:n]),
        loss=np.ascontiguousarray(0.5 * (lost + lost.T)),
        anchor_work=np.ascontiguousarray(body.anchor_force @ summed[:size, size:]),
        storage=body.storage,
    )


def rigid_axis_coefficients(
    mass: float, damping: float, axis: int, hand: SpringHand, period: float
) -> FloatArray:
    """Return one sample of one axis of a body without coupling, for ``kernels/rigid_axis.py``.

    Relative to the anchor, for (e, w, F) with F constant: the changes of e and w, the quadratic
    form of ∫ (b + b_h) w² dt, and the numbers b, m, K, g and T.

    Args:
        mass: mass of the device [kg].
        damping: damping of the device [N s/m].
        axis: number of the axis.
        hand: the hand.
        period: T [s].
    """
    span = check_positive("period", period, "s")
    held, mass, stiffness = hand.damping[axis], mass + hand.mass, hand.stiffness[axis]
    flow = np.zeros((3, 3))
    flow[0, 1] = 1.0
    flow[1] = np.array([-stiffness, -(damping + held), 1.0]) / mass
    change, form = _increments(flow, np.diag([0.0, damping + held, 0.0]), span)
    numbers = [damping, mass, stiffness, hand.force[axis], span]
    return np.array([*change[:2].ravel(), *form, *numbers])


def resonant_axis_coefficients(
    mass: float, damping: float, axis: int, hand: SpringHand, period: float, mode: Resonance
) -> FloatArray:
    """Return one sample of one axis of a body with a resonance, for ``kernels/resonant_axis.py``.

    As :func:`rigid_axis_coefficients` for (e, w, e_r, w_r, F, g), with the numbers b, both masses,
    the spring between them, K, g and T.
    """
    span = check_positive("period", period, "s")
    held = hand.damping[axis]
    near, far, spring, damper = mode.split_mass(mass, hand.mass)
    flow = np.zeros((6, 6))
    flow[0, 1] = flow[2, 3] = 1.0
    between = np.array([-spring, -damper, spring, damper, 0.0, 0.0])
    flow[1] = (between + np.array([0.0, -damping, 0.0, 0.0, 1.0, 0.0])) / near
    flow[3] = (np.array([0.0, 0.0, -hand.stiffness[axis], -held, 0.0, 1.0]) - between) / far
    rate = np.zeros((6, 6))
    rate[1, 1], rate[3, 3] = damping + damper, held + damper
    rate[1, 3] = rate[3, 1] = -damper
    change, form = _increments(flow, rate, span)
    numbers = [damping, near, far, spring, hand.stiffness[axis], hand.force[axis], span]
    return np.array([*change[:4].ravel(), *form, *numbers])


def _increments(
    dynamics: FloatArray, loss_rate: FloatArray, span: float
) -> tuple[FloatArray, FloatArray]:
    """Return e^{FT} - 1 and the upper triangle of ∫ zᵀ rate z dt as a form of z(0), by rows."""
    n = len(dynamics)
    # e^{FT} - 1 = F ∫ e^{Ft} dt: no difference of nearly equal numbers.
    wide = exponential(span * np.block([[dynamics, np.eye(n)], [np.zeros((n, 2 * n))]]))
    large = exponential(span * np.block([[-dynamics.T, loss_rate], [np.zeros((n, n)), dynamics]]))
    lost = large[n:, n:].T @ large[:n, n:]
    both = lost + lost.T
    form = np.triu(both, 1) + np.diag(np.diag(lost))
    return dynamics @ wide[:n, n:], form[np.triu_indices(n)]
