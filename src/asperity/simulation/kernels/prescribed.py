"""A handle whose motion is prescribed: that of the hand's anchor."""

# ruff: noqa: ARG001 - one signature for every body

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.body_functions import RAN, Held
from asperity.simulation.kernels.booking import book_energies

KERNELS = Kernels(provides=("advance_body", "stored_energy"), requires=("book_energies",))


class PrescribedPlant(NamedTuple):
    """A handle whose motion is prescribed.

    Attributes:
        period: T [s].
    """

    period: float


def advance_body(x: FloatArray, ledger: FloatArray, held: Held, plant: PrescribedPlant) -> int:
    """Move the handle over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = held
    period = plant.period
    dx = ux * period
    dy = uy * period
    dz = uz * period
    x[0] = ax + dx
    x[1] = ay + dy
    x[2] = az + dz
    x[3] = ux
    x[4] = uy
    x[5] = uz
    wx = fx * dx
    wy = fy * dy
    wz = fz * dz
    book_energies(ledger, wx, wy, wz, 0.0, -(wx + wy + wz), 0.0)
    return RAN


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: PrescribedPlant) -> float:
    """Nothing is stored."""
    return 0.0
