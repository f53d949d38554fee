"""A handle whose motion is prescribed: that of the hand's anchor."""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels
from asperity.loop.body_interface import RUNNING, SampleInput
from asperity.loop.simulated_device import add_energies

# ruff: noqa: ARG001 - one signature for every body


KERNELS = Kernels(provides=("advance_body", "stored_energy"))


class PrescribedMotionRecord(NamedTuple):
    """A handle whose motion is prescribed.

    Attributes:
        period: T [s].
    """

    period: float


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: PrescribedMotionRecord
) -> int:
    """Move the handle over one sample; see ``body_interface``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = inputs
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
    add_energies(ledger, wx, wy, wz, 0.0, -(wx + wy + wz), 0.0)
    return RUNNING


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: PrescribedMotionRecord
) -> float:
    """Nothing is stored."""
    return 0.0
