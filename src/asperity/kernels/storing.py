"""Results of one point into the arrays of all."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.kernels.law_functions import Nine, Triple

KERNELS = Kernels(provides=("store_force", "store_jacobian"))


def store_force(out: FloatArray, i: int, force: Triple) -> None:
    """Write a row of (n, 3)."""
    for d in range(3):
        out[i, d] = force[d]


def store_jacobian(
    force: FloatArray, jacobian: FloatArray, i: int, values: tuple[*Triple, *Nine]
) -> None:
    """Write a row of (n, 3) and a matrix of (n, 3, 3)."""
    for d in range(3):
        force[i, d] = values[d]
    for d in range(9):
        jacobian[i, d // 3, d % 3] = values[3 + d]
