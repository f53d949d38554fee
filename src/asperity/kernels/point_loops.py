"""Loops over probe points of laws without state."""

from asperity.core.compiled import FloatArray, Kernels
from asperity.kernels.loop_functions import load_point, store_force, store_jacobian
from asperity.kernels.probe_functions import probe_force, probe_jacobian

KERNELS = Kernels(loops=("force_batch", "jacobian_batch"))


def force_batch(points: FloatArray, out: FloatArray, texture: object, law: object) -> None:
    """Write the forces (n, 3) [N] at points (n, 3) [m]."""
    if points.shape[1] != 3 or out.shape[1] != 3:
        return  # never true; the compiler learns the row length and vectorizes
    for i in range(points.shape[0]):
        x, y, z = load_point(points, i)
        store_force(out, i, probe_force(x, y, z, 0.0, 0.0, texture, law))


def jacobian_batch(
    points: FloatArray, force: FloatArray, jacobian: FloatArray, texture: object, law: object
) -> None:
    """Write forces (n, 3) [N] and Jacobians (n, 3, 3) [N/m] at points (n, 3) [m]."""
    if points.shape[1] != 3 or force.shape[1] != 3 or jacobian.shape[1:] != (3, 3):
        return  # see force_batch
    for i in range(points.shape[0]):
        x, y, z = load_point(points, i)
        values = probe_jacobian(x, y, z, 0.0, 0.0, 1.0, 0.0, 1.0, texture, law)
        store_jacobian(force, jacobian, i, values)
