"""One sample of a coupled linear body: matrices of ``exact.py``, dry friction in parts."""

import math
from typing import NamedTuple

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels
from asperity.simulation.kernels.body_interface import RUNNING, SampleInput
from asperity.simulation.kernels.energy_ledger import add_energies

KERNELS = Kernels(provides=("advance_body", "friction_force", "stored_energy"))


class CoupledBodyRecord(NamedTuple):
    """A coupled linear body over a part of a sample.

    See :class:`asperity.simulation.discretization.LinearStep`.

    Attributes:
        transition: of the step (n, n + 12).
        loss: likewise (n + 12, n + 12).
        anchor_work: likewise (3, n + 12).
        storage: likewise (n + 12, n + 12).
        workspace: for state, forces and anchor (n + 12,).
        hand_force: constant force of the hand (3,) [N].
        friction: dry friction [N].
        stopping_mass: that friction stops (3, 3) [kg].
        substeps: of a sample.
        substep: duration of a part [s].
    """

    transition: FloatArray
    loss: FloatArray
    anchor_work: FloatArray
    storage: FloatArray
    workspace: FloatArray
    hand_force: FloatArray
    friction: float
    stopping_mass: FloatArray
    substeps: int
    substep: float


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: CoupledBodyRecord
) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = inputs
    z = plant.workspace
    n = x.shape[0]
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    z[n + 6] = ux
    z[n + 7] = uy
    z[n + 8] = uz
    for i in range(3):
        z[n + 9 + i] = plant.hand_force[i]
    for _part in range(plant.substeps):
        coupled_substep(x, ledger, fx, fy, fz, plant)
        for i in range(3):
            z[n + 3 + i] += z[n + 6 + i] * plant.substep
    return RUNNING


def coupled_substep(
    x: FloatArray, ledger: FloatArray, fx: float, fy: float, fz: float, plant: CoupledBodyRecord
) -> None:
    """Move the body by one part of a sample; z holds anchor and hand."""
    z = plant.workspace
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    z[n] = fx
    z[n + 1] = fy
    z[n + 2] = fz
    coupled_transition(x, z, plant.transition)
    gx = gy = gz = 0.0
    if plant.friction > 0.0:
        gx, gy, gz = friction_force(
            x[3], x[4], x[5], plant.friction, plant.stopping_mass, plant.substep
        )
        z[n] = fx + gx
        z[n + 1] = fy + gy
        z[n + 2] = fz + gz
        coupled_transition(x, z, plant.transition)
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
    add_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)


def coupled_transition(x: FloatArray, z: FloatArray, transition: FloatArray) -> None:
    """Let x be that at the end of the part, from z at its beginning."""
    for i in range(x.shape[0]):
        row = 0.0
        for j in range(z.shape[0]):
            row += transition[i, j] * z[j]
        x[i] = row


def friction_force(
    vx: float, vy: float, vz: float, friction: float, stopping_mass: FloatArray, substep: float
) -> tuple[float, float, float]:
    """Dry friction [N] that stops the velocity at the end of a part, or its limit against it.

    ``stopping_mass`` (3, 3) is what it has to stop in the part's duration.
    """
    gx = -(stopping_mass[0, 0] * vx + stopping_mass[0, 1] * vy + stopping_mass[0, 2] * vz) / substep
    gy = -(stopping_mass[1, 0] * vx + stopping_mass[1, 1] * vy + stopping_mass[1, 2] * vz) / substep
    gz = -(stopping_mass[2, 0] * vx + stopping_mass[2, 1] * vy + stopping_mass[2, 2] * vz) / substep
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


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: CoupledBodyRecord
) -> float:
    """½ zᵀ storage z [J]; forces and the anchor's velocity store nothing."""
    z = plant.workspace
    n = x.shape[0]
    for i in range(n):
        z[i] = x[i]
    z[n + 3] = ax
    z[n + 4] = ay
    z[n + 5] = az
    return 0.5 * quadratic_form(z, plant.storage)
