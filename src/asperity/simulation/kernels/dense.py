"""One sample of a coupled linear body: matrices of ``exact.py``, dry friction in parts."""

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.body_functions import RAN, Held
from asperity.simulation.kernels.booking import book_energies

KERNELS = Kernels(
    provides=("advance_body", "friction_force", "stored_energy"), requires=("book_energies",)
)


class DensePlant(NamedTuple):
    """A coupled linear body, over a part of a sample: see :class:`asperity.simulation.exact.Step`.

    Attributes:
        motion: of the step (n, n + 12).
        loss: likewise (n + 12, n + 12).
        anchor_work: likewise (3, n + 12).
        storage: likewise (n + 12, n + 12).
        room: for state, forces and anchor (n + 12,).
        press: constant force of the hand (3,) [N].
        friction: dry friction [N].
        mass: that friction stops (3, 3) [kg].
        parts: of a sample.
        span: duration of a part [s].
    """

    motion: FloatArray
    loss: FloatArray
    anchor_work: FloatArray
    storage: FloatArray
    room: FloatArray
    press: FloatArray
    friction: float
    mass: FloatArray
    parts: int
    span: float


def advance_body(x: FloatArray, ledger: FloatArray, held: Held, plant: DensePlant) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = held
    z = plant.room
    n = x.shape[0]
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    z[n + 6] = ux
    z[n + 7] = uy
    z[n + 8] = uz
    for i in range(3):
        z[n + 9 + i] = plant.press[i]
    for _part in range(plant.parts):
        dense_part(x, ledger, fx, fy, fz, plant)
        for i in range(3):
            z[n + 3 + i] += z[n + 6 + i] * plant.span
    return RAN


def dense_part(
    x: FloatArray, ledger: FloatArray, fx: float, fy: float, fz: float, plant: DensePlant
) -> None:
    """Move the body by one part of a sample; z holds anchor and hand."""
    z = plant.room
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    z[n] = fx
    z[n + 1] = fy
    z[n + 2] = fz
    dense_motion(x, z, plant.motion)
    gx = gy = gz = 0.0
    if plant.friction > 0.0:
        gx, gy, gz = friction_force(x[3], x[4], x[5], plant.friction, plant.mass, plant.span)
        z[n] = fx + gx
        z[n + 1] = fy + gy
        z[n + 2] = fz + gz
        dense_motion(x, z, plant.motion)
    dx = x[0] - z[0]
    dy = x[1] - z[1]
    dz = x[2] - z[2]
    h = n - 6  # the part that carries the hand
    lost = quadratic_form(z, plant.loss)
    hand = z[n + 9] * (x[h] - z[h]) + z[n + 10] * (x[h + 1] - z[h + 1])
    hand += z[n + 11] * (x[h + 2] - z[h + 2])
    for i in range(3):
        row = 0.0
        for j in range(z.shape[0]):
            row += plant.anchor_work[i, j] * z[j]
        hand += z[n + 6 + i] * row
    rubbed = gx * dx + gy * dy + gz * dz
    book_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)


def dense_motion(x: FloatArray, z: FloatArray, motion: FloatArray) -> None:
    """Let x be that at the end of the part, from z at its beginning."""
    for i in range(x.shape[0]):
        row = 0.0
        for j in range(z.shape[0]):
            row += motion[i, j] * z[j]
        x[i] = row


def friction_force(
    vx: float, vy: float, vz: float, friction: float, mass: FloatArray, span: float
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


def quadratic_form(z: FloatArray, matrix: FloatArray) -> float:
    """zᵀ matrix z for a symmetric matrix."""
    total = 0.0
    for i in range(z.shape[0]):
        row = 0.0
        for j in range(i):
            row += matrix[i, j] * z[j]
        total += z[i] * (2.0 * row + matrix[i, i] * z[i])
    return total


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: DensePlant) -> float:
    """½ zᵀ storage z [J]; forces and the anchor's velocity store nothing."""
    z = plant.room
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    return 0.5 * quadratic_form(z, plant.storage)
