"""One sample of a linear body, exactly: motion, loss and work by matrix exponentials.

With z = (x, f, a, v, g), f, v and g constant and a' = v over the sample, z' = F z. So
z(T) = e^{FT} z(0); the loss ∫ zᵀQz dt is a quadratic form of z(0) (Van Loan, IEEE Trans. Autom.
Control 23 (1978) 395), and the work of the anchor is v · N ∫ z dt.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray, positive
from asperity.simulation.body import Body, Resonance
from asperity.simulation.hands import SpringHand
from asperity.simulation.plants import Cartesian

# The first term left out is 0.25^15/15!, 1e-21.
_TERMS = 14


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
    squarings = max(0, math.ceil(math.log2(size / 0.25))) if size > 0.25 else 0
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
    flow[:n] = np.hstack([moved.dynamics, moved.force, moved.anchor, moved.press])
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
    """Return one sample of one axis of a body without coupling, for ``kernels/axes.py``.

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
