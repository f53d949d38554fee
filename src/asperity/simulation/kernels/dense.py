"""One sample of a coupled linear body: matrices of ``exact.py``, dry friction in parts."""

# ruff: noqa: ARG001 - one signature for every body

import math
from typing import Any

from asperity.compiled import Kernels
from asperity.simulation.kernels.booking import book_energies

KERNELS = Kernels(
    provides=("advance_body", "friction_force", "stored_energy"), requires=("book_energies",)
)


def advance_body(
    x: Any, ledger: Any,
    fx: float, fy: float, fz: float,
    ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float,
    inside: bool, plant: Any,
) -> int:  # fmt: skip
    """Move the body over one sample; see ``kernels/__init__.py``.

    plant: motion, loss, anchor_work, storage of a ``Step`` of T/parts, room for z, the hand's
    force, friction [N], mass that friction stops [kg], parts, duration of a part [s].
    """
    _motion, _loss, _work, _storage, z, press, _friction, _mass, parts, span = plant
    n = x.shape[0]
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    z[n + 6] = ux
    z[n + 7] = uy
    z[n + 8] = uz
    for i in range(3):
        z[n + 9 + i] = press[i]
    for _part in range(parts):
        dense_part(x, ledger, fx, fy, fz, plant)
        for i in range(3):
            z[n + 3 + i] += z[n + 6 + i] * span
    return 0


def dense_part(x: Any, ledger: Any, fx: float, fy: float, fz: float, plant: Any) -> None:
    """Move the body by one part of a sample; z holds anchor and hand."""
    motion, loss, anchor_work, _storage, z, _press, friction, mass, _parts, span = plant
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    z[n] = fx
    z[n + 1] = fy
    z[n + 2] = fz
    dense_motion(x, z, motion)
    gx = gy = gz = 0.0
    if friction > 0.0:
        gx, gy, gz = friction_force(x[3], x[4], x[5], friction, mass, span)
        z[n] = fx + gx
        z[n + 1] = fy + gy
        z[n + 2] = fz + gz
        dense_motion(x, z, motion)
    dx = x[0] - z[0]
    dy = x[1] - z[1]
    dz = x[2] - z[2]
    h = n - 6  # the part that carries the hand
    lost = quadratic_form(z, loss)
    hand = z[n + 9] * (x[h] - z[h]) + z[n + 10] * (x[h + 1] - z[h + 1])
    hand += z[n + 11] * (x[h + 2] - z[h + 2])
    for i in range(3):
        row = 0.0
        for j in range(z.shape[0]):
            row += anchor_work[i, j] * z[j]
        hand += z[n + 6 + i] * row
    rubbed = gx * dx + gy * dy + gz * dz
    book_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)


def dense_motion(x: Any, z: Any, motion: Any) -> None:
    """Let x be that at the end of the part, from z at its beginning."""
    for i in range(x.shape[0]):
        row = 0.0
        for j in range(z.shape[0]):
            row += motion[i, j] * z[j]
        x[i] = row


def friction_force(
    vx: float, vy: float, vz: float, friction: float, mass: Any, span: float
) -> tuple[float, float, float]:
    """Dry friction [N] that stops the velocity at the end of a part, or its limit against it.

    ``mass`` (3, 3) is what it has to stop in the part's duration.
    """
    gx = -(mass[0, 0] * vx + mass[0, 1] * vy + mass[0, 2] * vz) / span
    gy = -(mass[1, 0] * vx + mass[1, 1] * vy + mass[1, 2] * vz) / span
    gz = -(mass[2, 0] * vx + mass[2, 1] * vy + mass[2, 2] * vz) / span
    speed = math.sqrt(vx * vx + vy * vy + vz * vz)
    if gx * gx + gy * gy + gz * gz <= friction * friction or speed == 0.0:
        return gx, gy, gz
    share = -friction / speed
    return share * vx, share * vy, share * vz


def quadratic_form(z: Any, matrix: Any) -> float:
    """zᵀ matrix z for a symmetric matrix."""
    total = 0.0
    for i in range(z.shape[0]):
        row = 0.0
        for j in range(i):
            row += matrix[i, j] * z[j]
        total += z[i] * (2.0 * row + matrix[i, i] * z[i])
    return total


def stored_energy(x: Any, ax: float, ay: float, az: float, plant: Any) -> float:
    """½ zᵀ storage z [J]; forces and the anchor's velocity store nothing."""
    storage, z = plant[3], plant[4]
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    for i in range(n, z.shape[0]):
        z[i] = 0.0
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    return 0.5 * quadratic_form(z, storage)
