"""A linear body and one sample of it, exactly: motion, loss and work by matrix exponentials.

The body is a handle with mass and damping, the hand that holds it, a spring to its anchor. Between
two samples everything is linear, with a force held constant and an anchor that moves at constant
velocity, so the motion and every energy of it are exact.

With z = (x, f, a, v, g), f, v and g constant and a' = v over the sample, z' = F z. So
z(T) = e^{FT} z(0); the loss ∫ zᵀQz dt is a quadratic form of z(0) (Van Loan, IEEE Trans. Autom.
Control 23 (1978) 395), and the work of the anchor is v · N ∫ z dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, positive
from asperity.simulation.hands import SpringHand
from asperity.simulation.plants import Cartesian, Resonance

# The first term left out is 0.25^15/15!, 1e-21.
_TERMS = 14


@dataclass(frozen=True)
class Body:
    """A linear body, x' = F z with z = (x, f, a, v, g), and its energies as quadratic forms.

    f is the force on the handle [N], a and v position and velocity of the hand's anchor, g the
    constant force of the hand. The stored energy is ½ zᵀ S z and the rate of loss zᵀ Q z; the
    anchor feeds the power v · N z. S and Q are symmetric.

    Attributes:
        flow: F, shape (n, n + 12); the first three states are the handle's position [m], the next
            three its velocity [m/s]; then the same of the part that carries the hand, if it is
            another one.
        storage: S, shape (n + 12, n + 12).
        loss: Q, shape (n + 12, n + 12).
        pull: N, the force of the anchor on the body, shape (3, n + 12).
    """

    flow: FloatArray
    storage: FloatArray
    loss: FloatArray
    pull: FloatArray

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.flow)


def body(
    mass: ArrayLike, damping: ArrayLike, hand: SpringHand, resonance: Resonance | None = None
) -> Body:
    """Return the body of a device that a hand holds.

    M p'' = f - B p' + K_h (a - p) + B_h (v - p') + g; with a resonance the share of the device's
    mass and the hand hang on a spring from the part that motor and sensor see.

    Args:
        mass: of the device as felt at the handle [kg], one per axis.
        damping: B [N s/m], symmetric, positive semidefinite, shape (3, 3).
        hand: spring, damper, mass and constant force of the hand.
        resonance: first structural mode, alike along all axes.

    Example:
        >>> body([0.05] * 3, np.eye(3), SpringHand(stiffness=200.0)).order
        6
    """
    device, friction = np.diag(np.asarray(mass, dtype=float)), np.asarray(damping, dtype=float)
    spring, damper = np.diag(hand.stiffness), np.diag(hand.damping)
    if resonance is None:
        return _assembled(device + hand.mass * np.eye(3), friction, spring, damper)
    return _two_masses(device, friction, hand.mass, spring, damper, resonance)


class _Blocks:
    """Rows of z, three by three: ``blocks(r=1, p=-1)`` is the matrix of r - p."""

    def __init__(self, names: tuple[str, ...]) -> None:
        self._names = names

    def __call__(self, **weights: float) -> FloatArray:
        matrix = np.zeros((3, 3 * len(self._names)))
        for name, weight in weights.items():
            first = 3 * self._names.index(name)
            matrix[:, first : first + 3] = weight * np.eye(3)
        return matrix


def _assembled(
    mass: FloatArray, friction: FloatArray, spring: FloatArray, damper: FloatArray
) -> Body:
    """One mass: x = (p, p')."""
    z = _Blocks(("p", "dp", "f", "a", "v", "g"))
    stretch, rate, speed = z(a=1.0, p=-1.0), z(v=1.0, dp=-1.0), z(dp=1.0)
    pull = spring @ stretch + damper @ rate
    rows = [speed, np.linalg.inv(mass) @ (z(f=1.0, g=1.0) - friction @ speed + pull)]
    storage = _form(mass, speed) + _form(spring, stretch)
    loss = _form(friction, speed) + _form(damper, rate)
    return Body(np.vstack(rows), storage, loss, pull)


def _two_masses(
    device: FloatArray,
    friction: FloatArray,
    held: float,
    spring: FloatArray,
    damper: FloatArray,
    resonance: Resonance,
) -> Body:
    """Two masses: x = (p, p', r, r'), r the part that hangs on a spring and carries the hand."""
    near = (1.0 - resonance.share) * device
    far = resonance.share * device + held * np.eye(3)
    reduced = near @ far @ np.linalg.inv(near + far)
    omega = 2.0 * np.pi * resonance.frequency
    inner, inner_damper = omega**2 * reduced, 2.0 * resonance.damping_ratio * omega * reduced
    z = _Blocks(("p", "dp", "r", "dr", "f", "a", "v", "g"))
    bend, bend_rate = z(r=1.0, p=-1.0), z(dr=1.0, dp=-1.0)
    stretch, rate = z(a=1.0, r=-1.0), z(v=1.0, dr=-1.0)
    pull = spring @ stretch + damper @ rate
    between = inner @ bend + inner_damper @ bend_rate
    rows = [
        z(dp=1.0),
        np.linalg.inv(near) @ (z(f=1.0) - friction @ z(dp=1.0) + between),
        z(dr=1.0),
        np.linalg.inv(far) @ (z(g=1.0) + pull - between),
    ]
    storage = _form(near, z(dp=1.0)) + _form(far, z(dr=1.0))
    storage += _form(inner, bend) + _form(spring, stretch)
    loss = _form(friction, z(dp=1.0)) + _form(inner_damper, bend_rate) + _form(damper, rate)
    return Body(np.vstack(rows), storage, loss, pull)


def _form(matrix: FloatArray, rows: FloatArray) -> FloatArray:
    return np.asarray(rows.T @ matrix @ rows)


@dataclass(frozen=True)
class Step:
    """What happens in one sample, for z = (x, f, a, v, g) at its beginning.

    Attributes:
        period: T [s].
        motion: x at the end is ``motion @ z``, shape (n, n + 12).
        loss: the energy lost is zᵀ loss z, symmetric, shape (n + 12, n + 12).
        anchor_work: the anchor's work is v · (anchor_work @ z), shape (3, n + 12).
        storage: the energy stored at the beginning is ½ zᵀ storage z.
    """

    period: float
    motion: FloatArray
    loss: FloatArray
    anchor_work: FloatArray
    storage: FloatArray


def exponential(matrix: FloatArray) -> FloatArray:
    """Return e^A of small matrices, shape (..., n, n), by squaring a Taylor sum.

    SciPy's takes milliseconds here, most of it in starting threads, and many short runs need it.
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


def exact_step(moved: Body, period: float) -> Step:
    """Return one sample of a body.

    Args:
        moved: the body.
        period: T [s].

    Raises:
        ParameterError: for a period that is not positive.
    """
    span = positive("period", period, "s")
    n = moved.order
    size = n + 12
    flow = np.zeros((size, size))
    flow[:n] = moved.flow
    flow[n + 3 : n + 6, n + 6 : n + 9] = np.eye(3)
    # In units of one sample: the exponent stays of order one.
    whole = exponential(span * flow)
    # Van Loan: the exponential of [[-Fᵀ, Q], [0, F]] holds e^{-FᵀT} ∫ e^{Fᵀt} Q e^{Ft} dt.
    blocks = np.block([[-flow.T, moved.loss], [np.zeros((size, size)), flow]])
    large = exponential(span * blocks)
    lost = large[size:, size:].T @ large[:size, size:]
    summed = exponential(span * np.block([[flow, np.eye(size)], [np.zeros((size, 2 * size))]]))
    return Step(
        period=span,
        motion=np.ascontiguousarray(whole[:n]),
        loss=np.ascontiguousarray(0.5 * (lost + lost.T)),
        anchor_work=np.ascontiguousarray(moved.pull @ summed[:size, size:]),
        storage=moved.storage,
    )


def axis_table(plant: Cartesian, hand: SpringHand, axis: int, period: float) -> FloatArray:
    """Return one sample of one axis of a body without coupling, for ``kernels/rigid.py``.

    Relative to the anchor, (e, w, F) with F constant: the changes of e and w, the quadratic form of
    ∫ (b + b_h) w² dt, and the numbers b, m, K, g and T.
    """
    span = positive("period", period, "s")
    damping, held = float(plant.damping[axis, axis]), hand.damping[axis]
    mass, stiffness = plant.mass[axis] + hand.mass, hand.stiffness[axis]
    flow = np.zeros((3, 3))
    flow[0, 1] = 1.0
    flow[1] = np.array([-stiffness, -(damping + held), 1.0]) / mass
    change, form = _changes(flow, np.diag([0.0, damping + held, 0.0]), span)
    numbers = [damping, mass, stiffness, hand.force[axis], span]
    return np.array([*change[:2].ravel(), *form, *numbers])


def resonant_table(
    plant: Cartesian, mode: Resonance, hand: SpringHand, axis: int, period: float
) -> FloatArray:
    """Return one sample of one axis of a body with a resonance, for ``kernels/resonant.py``.

    As :func:`axis_table` for (e, w, e_r, w_r, F, g), with the numbers b, both masses, the spring
    between them, K, g and T.
    """
    span = positive("period", period, "s")
    damping, held = float(plant.damping[axis, axis]), hand.damping[axis]
    near, far = (1.0 - mode.share) * plant.mass[axis], mode.share * plant.mass[axis] + hand.mass
    omega, reduced = 2.0 * math.pi * mode.frequency, near * far / (near + far)
    spring, damper = omega**2 * reduced, 2.0 * mode.damping_ratio * omega * reduced
    flow = np.zeros((6, 6))
    flow[0, 1] = flow[2, 3] = 1.0
    between = np.array([-spring, -damper, spring, damper, 0.0, 0.0])
    flow[1] = (between + np.array([0.0, -damping, 0.0, 0.0, 1.0, 0.0])) / near
    flow[3] = (np.array([0.0, 0.0, -hand.stiffness[axis], -held, 0.0, 1.0]) - between) / far
    rate = np.zeros((6, 6))
    rate[1, 1], rate[3, 3] = damping + damper, held + damper
    rate[1, 3] = rate[3, 1] = -damper
    change, form = _changes(flow, rate, span)
    numbers = [damping, near, far, spring, hand.stiffness[axis], hand.force[axis], span]
    return np.array([*change[:4].ravel(), *form, *numbers])


def _changes(flow: FloatArray, rate: FloatArray, span: float) -> tuple[FloatArray, FloatArray]:
    """Return e^{FT} - 1 and the upper triangle of ∫ zᵀ rate z dt as a form of z(0), by rows."""
    n = len(flow)
    # e^{FT} - 1 = F ∫ e^{Ft} dt: no difference of nearly equal numbers.
    wide = exponential(span * np.block([[flow, np.eye(n)], [np.zeros((n, 2 * n))]]))
    large = exponential(span * np.block([[-flow.T, rate], [np.zeros((n, n)), flow]]))
    lost = large[n:, n:].T @ large[:n, n:]
    both = lost + lost.T
    form = np.triu(both, 1) + np.diag(np.diag(lost))
    return flow @ wide[:n, n:], form[np.triu_indices(n)]
