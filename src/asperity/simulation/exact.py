"""One sample of a linear body, exactly: motion, loss and work by matrix exponentials.

With z = (x, f, a, v), f and v constant and a' = v over the sample, z' = F z. So z(T) = e^{FT} z(0);
the loss ∫ zᵀQz dt is a quadratic form of z(0) (Van Loan, IEEE Trans. Autom. Control 23 (1978) 395),
and the work of the anchor is v · N ∫ z dt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray, positive
from asperity.simulation.body import Body


@dataclass(frozen=True)
class Step:
    """What happens in one sample, for z = (x, f, a, v) at its beginning.

    Attributes:
        period: T [s].
        motion: x at the end is ``motion @ z``, shape (n, n + 9).
        loss: the energy lost is zᵀ loss z, symmetric, shape (n + 9, n + 9).
        anchor_work: the anchor's work is v · (anchor_work @ z), shape (3, n + 9).
        storage: the energy stored at the beginning is ½ zᵀ storage z.
    """

    period: float
    motion: FloatArray
    loss: FloatArray
    anchor_work: FloatArray
    storage: FloatArray


def exact_step(moved: Body, period: float) -> Step:
    """Return one sample of a body.

    Args:
        moved: the body.
        period: T [s].

    Raises:
        ParameterError: for a period that is not positive.
    """
    from scipy.linalg import expm

    span = positive("period", period, "s")
    n = moved.order
    size = n + 9
    flow = np.zeros((size, size))
    flow[:n] = np.hstack([moved.dynamics, moved.force, moved.anchor])
    flow[n + 3 : n + 6, n + 6 :] = np.eye(3)
    # In units of one sample: the exponent stays of order one.
    whole = expm(span * flow)
    # Van Loan: the exponential of [[-Fᵀ, Q], [0, F]] holds e^{-FᵀT} ∫ e^{Fᵀt} Q e^{Ft} dt.
    blocks = np.block([[-flow.T, moved.loss], [np.zeros((size, size)), flow]])
    large = expm(span * blocks)
    lost = large[size:, size:].T @ large[:size, size:]
    summed = expm(span * np.block([[flow, np.eye(size)], [np.zeros((size, 2 * size))]]))
    return Step(
        period=span,
        motion=np.ascontiguousarray(whole[:n]),
        loss=np.ascontiguousarray(0.5 * (lost + lost.T)),
        anchor_work=np.ascontiguousarray(moved.pull @ summed[:size, size:]),
        storage=moved.storage,
    )
