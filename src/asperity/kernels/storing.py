"""One point from the array of all, and its results into theirs."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels, multiply_add
from asperity.kernels.law_functions import Nine, Triple

KERNELS = Kernels(provides=("store_force", "store_jacobian", "take_point"))


def take_point(points: FloatArray, i: int) -> Triple:
    """Return x, y, z of a row of (n, 3).

    All are looked at, by adding nothing: numbers that the law needs of some points alone would be
    gathered one by one.
    """
    x = points[i, 0]
    y = points[i, 1]
    return x, y, multiply_add(0.0, y, multiply_add(0.0, x, points[i, 2]))


def store_force(out: FloatArray, i: int, force: Triple) -> None:
    """Write a row of (n, 3).

    The last before the middle: two zeros side by side, as of a law that pushes upwards alone, are
    made one call for clearing memory, and a loop that calls goes point by point.
    """
    out[i, 0] = force[0]
    out[i, 2] = force[2]
    out[i, 1] = force[1]


def store_jacobian(
    force: FloatArray, jacobian: FloatArray, i: int, values: tuple[*Triple, *Nine]
) -> None:
    """Write a row of (n, 3) and a matrix of (n, 3, 3)."""
    for d in range(3):
        force[i, d] = values[d]
    for d in range(9):
        jacobian[i, d // 3, d % 3] = values[3 + d]
