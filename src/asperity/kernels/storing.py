"""Results of one point into the arrays of all."""

from asperity.checks import FloatArray
from asperity.compiled import Kernels

KERNELS = Kernels(provides=("store_force", "store_jacobian"))


def store_force(out: FloatArray, i: int, fx: float, fy: float, fz: float) -> None:
    """Write a row of (n, 3)."""
    out[i, 0] = fx
    out[i, 1] = fy
    out[i, 2] = fz


def store_jacobian(
    out: FloatArray, i: int,
    j00: float, j01: float, j02: float,
    j10: float, j11: float, j12: float,
    j20: float, j21: float, j22: float,
) -> None:  # fmt: skip
    """Write a matrix of (n, 3, 3)."""
    out[i, 0, 0] = j00
    out[i, 0, 1] = j01
    out[i, 0, 2] = j02
    out[i, 1, 0] = j10
    out[i, 1, 1] = j11
    out[i, 1, 2] = j12
    out[i, 2, 0] = j20
    out[i, 2, 1] = j21
    out[i, 2, 2] = j22
