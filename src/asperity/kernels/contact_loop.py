"""The loop over given contacts, without a texture, so that the depth may be zero."""

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.loop_functions import sliding_derivative, store_jacobian
from asperity.kernels.probe_functions import contact_jacobian

KERNELS = Kernels(loops=("contact_batch",))


def contact_batch(
    points: FloatArray,
    depths: FloatArray,
    derivatives: FloatArray,
    deflection: FloatArray,
    sliding: NDArray[np.bool_],
    force: FloatArray,
    jacobian: FloatArray,
    law: object,
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m] of contacts.

    Args:
        points: probe positions of the contacts (n, 3) [m].
        depths: (n,) [m].
        derivatives: h, h_x, h_y, h_xx, h_xy, h_yy at the contact points (n, 6), SI units.
        deflection: of the anchor (n, 2) [m].
        sliding: whether the anchor is dragged (n,).
        force: result.
        jacobian: result.
        law: parameters of the law.
    """
    for i in range(depths.shape[0]):
        dx = deflection[i, 0]
        dy = deflection[i, 1]
        sxx, sxy, syy = sliding_derivative(dx, dy, sliding[i])
        values = contact_jacobian(
            points[i, 0],
            points[i, 1],
            points[i, 2],
            depths[i],
            derivatives[i, 0],
            derivatives[i, 1],
            derivatives[i, 2],
            derivatives[i, 3],
            derivatives[i, 4],
            derivatives[i, 5],
            dx,
            dy,
            sxx,
            sxy,
            syy,
            law,
        )
        store_jacobian(force, jacobian, i, values)
