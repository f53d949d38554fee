"""One sample of a linear body with coupling or a resonance, by whole matrices, and dry friction.

Relative to the anchor, with e = p - a, w = p' - u, the same (r, s) for a second mass that carries
the hand, F = f - B u and the constant force g of the hand, the changes of (e, w, r, s) over a part
of a sample are linear in z = (e, w, r, s, F, g), and the loss without the anchor's motion is a
quadratic form. With the anchor's motion it is larger by u · B (2 Δe + u T), and the impulse of the
anchor's spring and damper is M Δw + M_r Δs - (F + g) T + B Δe.
"""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.loop.bodies.body_parts import friction_force
from asperity.loop.body_interface import RUNNING, SampleInput
from asperity.loop.simulated_device import add_energies

KERNELS = Kernels(provides=("advance_body", "stored_energy"))

# First components of forces in z, and the number of all.
FORCE = 12
HAND_PUSH = 15
SIZE = 18


class CoupledBodyRecord(NamedTuple):
    """A coupled linear body over a part of a sample.

    Attributes:
        changes: change of (e, w, r, s) for each component of z (18, 12); 0 without a second mass.
        loss: the energy lost is zᵀ loss z, symmetric (18, 18).
        damping: B (3, 3) [N s/m].
        mass: of the handle, per axis (3,) [kg].
        carrier_mass: of the second mass, likewise; 0 if there is none.
        coupling: stiffness between the masses, likewise [N/m].
        stiffness: of the hand, likewise [N/m].
        hand_force: constant force of the hand (3,) [N].
        friction: dry friction [N].
        stopping_mass: mass that friction stops (3, 3) [kg].
        substeps: number of parts of a sample.
        substep: duration of a part [s].
    """

    changes: FloatArray
    loss: FloatArray
    damping: FloatArray
    mass: FloatArray
    carrier_mass: FloatArray
    coupling: FloatArray
    stiffness: FloatArray
    hand_force: FloatArray
    friction: float
    stopping_mass: FloatArray
    substeps: int
    substep: float


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: CoupledBodyRecord
) -> int:
    """Move the body over one sample; see ``body_interface``."""
    z = local_array((18,))
    for i in range(SIZE):
        z[i] = 0.0
    for part in range(plant.substeps):
        relative_state(x, inputs, part * plant.substep, plant, z)
        coupled_substep(x, ledger, inputs, plant, z)
    return RUNNING


def relative_state(
    x: FloatArray, inputs: SampleInput, time: float, plant: CoupledBodyRecord, z: FloatArray
) -> None:
    """Write z, a time after the start of the sample."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _in_contact = inputs
    force = (fx, fy, fz)
    anchor = (ax + time * ux, ay + time * uy, az + time * uz)
    velocity = (ux, uy, uz)
    damping = plant.damping
    for i in range(3):
        for mass in range(0, x.shape[0], 6):
            z[mass + i] = x[mass + i] - anchor[i]
            z[mass + 3 + i] = x[mass + 3 + i] - velocity[i]
        drag = damping[i, 0] * ux + damping[i, 1] * uy + damping[i, 2] * uz
        z[FORCE + i] = force[i] - drag
        z[HAND_PUSH + i] = plant.hand_force[i]


def coupled_substep(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: CoupledBodyRecord, z: FloatArray
) -> None:
    """Move the body by one part of a sample from z on, and add its energies to the ledger."""
    change = local_array((12,))
    weights = local_array((18,))
    fx, fy, fz, _ax, _ay, _az, ux, uy, uz, _in_contact = inputs
    velocity = (ux, uy, uz)
    damping = plant.damping
    span = plant.substep
    hand_mass = x.shape[0] - 6
    gx = gy = gz = 0.0
    multiply_columns(plant.changes, z, change)
    if plant.friction > 0.0:
        gx, gy, gz = friction_force(
            x[3] + change[3],
            x[4] + change[4],
            x[5] + change[5],
            plant.friction,
            plant.stopping_mass,
            span,
        )
        z[FORCE] += gx
        z[FORCE + 1] += gy
        z[FORCE + 2] += gz
        multiply_columns(plant.changes, z, change)
    multiply_columns(plant.loss, z, weights)
    lost = hand = 0.0
    for i in range(SIZE):
        lost += weights[i] * z[i]
    for i in range(3):
        braked = damping[i, 0] * change[0] + damping[i, 1] * change[1] + damping[i, 2] * change[2]
        drag = damping[i, 0] * ux + damping[i, 1] * uy + damping[i, 2] * uz
        impulse = plant.mass[i] * change[3 + i] + plant.carrier_mass[i] * change[9 + i]
        impulse += braked - (z[FORCE + i] + z[HAND_PUSH + i]) * span
        lost += velocity[i] * (2.0 * braked + drag * span)
        hand += velocity[i] * impulse
        hand += plant.hand_force[i] * (change[hand_mass + i] + velocity[i] * span)
        for mass in range(0, x.shape[0], 6):
            x[mass + i] += change[mass + i] + velocity[i] * span
            x[mass + 3 + i] += change[mass + 3 + i]
    dx = change[0] + ux * span
    dy = change[1] + uy * span
    dz = change[2] + uz * span
    add_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, gx * dx + gy * dy + gz * dz)


def multiply_columns(columns: FloatArray, z: FloatArray, result: FloatArray) -> None:
    """Write the sum of the rows ``columns[j]``, each times z[j]: a loop that is vectorized."""
    for i in range(result.shape[0]):
        result[i] = 0.0
    for j in range(z.shape[0]):
        for i in range(result.shape[0]):
            result[i] += columns[j, i] * z[j]


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: CoupledBodyRecord
) -> float:
    """Return the energy of both masses, of the spring between them, and of the hand [J]."""
    anchor = (ax, ay, az)
    last = x.shape[0] - 6
    total = 0.0
    for i in range(3):
        coupling_strain = x[last + i] - x[i]
        hand_strain = anchor[i] - x[last + i]
        total += plant.mass[i] * x[3 + i] ** 2 + plant.carrier_mass[i] * x[last + 3 + i] ** 2
        total += plant.coupling[i] * coupling_strain**2 + plant.stiffness[i] * hand_strain**2
    return 0.5 * total
