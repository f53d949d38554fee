"""Exact discretization of linear bodies: motion, loss and work by matrix exponentials.

The body is a handle with mass and damping and a hand, a spring to its anchor. Over a sample it is
linear, with a constant force and an anchor at constant velocity, so the motion and every energy are
exact.

Relative to the anchor, the state z, with the constant forces as components, changes by z' = A z. So
z(T) = e^{AT} z(0), and the loss ∫ zᵀQz dt is a quadratic form of z(0) (Van Loan, IEEE Trans. Autom.
Control 23 (1978) 395).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_nonnegative, check_positive, check_real
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
        check_nonnegative("damping_ratio", self.damping_ratio)
        if not 0.0 < check_real("mass_fraction", self.mass_fraction) < 1.0:
            raise ParameterError("mass_fraction", "must be between 0 and 1", self.mass_fraction)

    def split_mass(
        self, mass: FloatArray, hand_mass: float
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return near and far mass [kg], stiffness [N/m] and damping [N s/m] between them."""
        near = (1.0 - self.mass_fraction) * mass
        far = self.mass_fraction * mass + hand_mass
        omega = 2.0 * math.pi * self.frequency
        reduced = near * far / (near + far)
        return near, far, omega**2 * reduced, 2.0 * self.damping_ratio * omega * reduced


@dataclass(frozen=True)
class LinearBody:
    """A linear body, z' = A z with z = (e, w, r, s, F, g), three components each.

    e and w are position and velocity of the handle relative to the hand's anchor, r and s those of
    the mass that carries the hand if it is a second one (else constant), F is the force on the
    handle less its damping at the anchor's velocity, and g the constant force of the hand.

    Attributes:
        dynamics: A (18, 18).
        loss: Q, symmetric: the rate of loss is zᵀ Q z if the anchor rests (18, 18).
        damping: B, of the device (3, 3) [N s/m].
        mass: of the handle, per axis [kg].
        carrier_mass: of the second mass; 0 if there is none.
        coupling: stiffness between the masses [N/m].
        stiffness: of the hand [N/m].
    """

    dynamics: FloatArray
    loss: FloatArray
    damping: FloatArray
    mass: FloatArray
    carrier_mass: FloatArray
    coupling: FloatArray
    stiffness: FloatArray


def linear_body(
    mass: ArrayLike, damping: FloatArray, hand: SpringHand, resonance: Resonance | None = None
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
        >>> linear_body([0.05] * 3, np.eye(3), SpringHand(stiffness=200.0)).mass.tolist()
        [0.05, 0.05, 0.05]
    """
    e, w, r, s, force, push = np.eye(18).reshape(6, 3, 18)
    near, far, spring, damper = np.asarray(mass) + hand.mass, *np.zeros((3, 3))
    held = e
    held_rate = w
    if resonance is not None:
        near, far, spring, damper = resonance.split_mass(np.asarray(mass), hand.mass)
        held = r
        held_rate = s
    between = spring[:, None] * (r - e) + damper[:, None] * (s - w)
    push = push - np.diag(hand.stiffness) @ held - np.diag(hand.damping) @ held_rate
    dynamics = np.zeros((18, 18))
    dynamics[:3] = w
    dynamics[3:6] = force - damping @ w + between
    if resonance is None:
        dynamics[3:6] += push
    else:
        dynamics[6:9] = s
        dynamics[9:12] = (push - between) / far[:, None]
    dynamics[3:6] /= near[:, None]
    loss = w.T @ damping @ w + held_rate.T @ np.diag(hand.damping) @ held_rate
    loss += (s - w).T @ np.diag(damper) @ (s - w)
    return LinearBody(dynamics, loss, damping, near, far, spring, np.array(hand.stiffness))


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


_MAX_SIZE = 1e20  # of A T


def integrate(
    dynamics: FloatArray, loss_rate: FloatArray, span: float
) -> tuple[FloatArray, FloatArray]:
    """Return the change of z over a time T [s], and the loss, for z' = A z.

    Args:
        dynamics: A (..., n, n).
        loss_rate: Q (..., n, n), symmetric.
        span: T [s].

    Returns:
        e^{AT} - 1 and the symmetric matrix of ∫ zᵀ Q z dt as a form of z(0), (..., n, n).

    Raises:
        ArithmeticError: for a body that is too fast for so many doublings.
    """
    n = dynamics.shape[-1]
    zero = np.zeros_like(dynamics)
    # e^{AT} - 1 = A ∫ e^{At} dt: no difference of nearly equal numbers.
    unit = np.broadcast_to(np.eye(n), dynamics.shape)
    wide = exponential(span * np.block([[dynamics, unit], [zero, zero]]))
    # Van Loan: the exponential of [[-Aᵀ, Q], [0, A]] holds e^{-Aᵀτ} ∫ e^{Aᵀt} Q e^{At} dt. Over a
    # short τ, for e^{-Aᵀτ} of an overdamped body grows beyond all digits; then τ is doubled.
    size = span * float(np.abs(dynamics).sum(axis=-1).max())
    if not size < _MAX_SIZE:
        raise ArithmeticError("the body is too fast")
    doublings = math.ceil(math.log2(size)) if size > 1.0 else 0
    back = -np.swapaxes(dynamics, -1, -2)
    short = span / 2.0**doublings
    large = exponential(short * np.block([[back, loss_rate], [zero, dynamics]]))
    motion = large[..., n:, n:]
    lost = np.swapaxes(motion, -1, -2) @ large[..., :n, n:]
    for _ in range(doublings):
        lost = lost + np.swapaxes(motion, -1, -2) @ lost @ motion
        motion = motion @ motion
    return dynamics @ wide[..., :n, n:], 0.5 * (lost + np.swapaxes(lost, -1, -2))
