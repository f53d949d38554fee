"""A handle that is moved: it is where the anchor is."""

# ruff: noqa: ARG001 - one signature for every body

from typing import Any

from asperity.compiled import Kernels
from asperity.simulation.kernels.booking import book_energies

KERNELS = Kernels(provides=("advance_body", "stored_energy"), requires=("book_energies",))


def advance_body(
    x: Any, ledger: Any,
    fx: float, fy: float, fz: float,
    ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float,
    inside: bool, plant: Any,
) -> int:  # fmt: skip
    """Move the handle over one sample; see ``kernels/__init__.py``. plant: the period [s]."""
    (period,) = plant
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
    return 0


def stored_energy(x: Any, ax: float, ay: float, az: float, plant: Any) -> float:
    """Nothing is stored."""
    return 0.0
