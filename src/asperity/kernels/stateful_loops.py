"""Loops over probe points of laws with state, the deflection of an anchor."""

import numpy as np
from numpy.typing import NDArray

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.loop_functions import sliding_derivative, store_force, store_jacobian
from asperity.kernels.probe_functions import probe_force, probe_jacobian

KERNELS = Kernels(loops=("force_batch", "jacobian_batch"))


def force_batch(
    points: FloatArray, deflection: FloatArray, out: FloatArray, texture: object, law: object
) -> None:
    """Write the forces (n, 3) [N] at points (n, 3) with deflections (n, 2) [m]."""
    for i in range(points.shape[0]):
        dx = deflection[i, 0]
        dy = deflection[i, 1]
        force = probe_force(points[i, 0], points[i, 1], points[i, 2], dx, dy, texture, law)
        store_force(out, i, force)


def jacobian_batch(
    points: FloatArray,
    deflection: FloatArray,
    sliding: NDArray[np.bool_],
    force: FloatArray,
    jacobian: FloatArray,
    texture: object,
    law: object,
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m]; ``sliding`` anchors are dragged."""
    for i in range(points.shape[0]):
        dx = deflection[i, 0]
        dy = deflection[i, 1]
        sxx, sxy, syy = sliding_derivative(dx, dy, sliding[i])
        values = probe_jacobian(
            points[i, 0], points[i, 1], points[i, 2], dx, dy, sxx, sxy, syy, texture, law
        )
        store_jacobian(force, jacobian, i, values)
