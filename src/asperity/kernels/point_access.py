"""Access to one row of the arrays of points, forces and Jacobians."""

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, multiply_add
from asperity.kernels.law_interface import Matrix3Rows, Vector3

KERNELS = Kernels(provides=("store_force", "store_jacobian", "load_point"))


def load_point(points: FloatArray, i: int) -> Vector3:
    """Return x, y, z of a row of (n, 3).

    All three are used by adding zero times them: coordinates that only some points need would be
    gathered one by one.
    """
    x = points[i, 0]
    y = points[i, 1]
    return x, y, multiply_add(0.0, y, multiply_add(0.0, x, points[i, 2]))


def store_force(out: FloatArray, i: int, force: Vector3) -> None:
    """Write a row of (n, 3).

    The last before the middle: the compiler turns two adjacent zeros, as of a law with a vertical
    force, into a call that clears memory, and does not vectorize a loop with calls.
    """
    out[i, 0] = force[0]
    out[i, 2] = force[2]
    out[i, 1] = force[1]


def store_jacobian(
    force: FloatArray, jacobian: FloatArray, i: int, values: tuple[*Vector3, *Matrix3Rows]
) -> None:
    """Write a row of (n, 3) and a matrix of (n, 3, 3)."""
    for d in range(3):
        force[i, d] = values[d]
    for d in range(9):
        jacobian[i, d // 3, d % 3] = values[3 + d]
