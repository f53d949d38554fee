"""A mass in space on an elastic band, over one sample, by Runge-Kutta steps."""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.loop.bodies.body_parts import (
    HandRecord,
    band_changes_state,
    friction_force,
    hand_energy,
    hand_force,
)
from asperity.loop.body_interface import RUNNING, SampleInput
from asperity.loop.simulated_device import add_energies

KERNELS = Kernels(provides=("advance_body", "stored_energy"))


class ElasticBandRecord(NamedTuple):
    """A mass in space on an elastic band.

    Attributes:
        mass: (3, 3), diagonal [kg].
        damping: (3, 3) [N s/m].
        hand: the band.
        friction: dry friction [N].
        substeps: number of parts of a sample.
        substep: duration of a part [s].
    """

    mass: FloatArray
    damping: FloatArray
    hand: HandRecord
    friction: float
    substeps: int
    substep: float


def elastic_band_rates(
    y: FloatArray, k: FloatArray, t: float, inputs: SampleInput, plant: ElasticBandRecord
) -> None:
    """Write the rate of y = (p, p', loss, work of the hand) into k.

    Args:
        y: position [m] and velocity [m/s].
        k: rate of change (8,); written.
        t: time since the start of the step [s].
        inputs: input of the step.
        plant: the body.
    """
    fx, fy, fz, ax, ay, az, ux, uy, uz, _in_contact = inputs
    hand = plant.hand
    hx, hy, hz, lost = hand_force(
        ax + t * ux - y[0],
        ay + t * uy - y[1],
        az + t * uz - y[2],
        ux - y[3],
        uy - y[4],
        uz - y[5],
        hand,
    )
    k[6] = lost
    k[7] = ux * hx + uy * hy + uz * hz
    push = (fx + hx, fy + hy, fz + hz)
    for i in range(3):
        drag = plant.damping[i, 0] * y[3] + plant.damping[i, 1] * y[4]
        drag += plant.damping[i, 2] * y[5]
        k[i] = y[3 + i]
        k[3 + i] = (push[i] + hand.force[i] - drag) / plant.mass[i, i]
        k[6] += drag * y[3 + i]
        k[7] += hand.force[i] * y[3 + i]


def elastic_band_step(
    x: FloatArray, change: FloatArray, inputs: SampleInput, h: float, plant: ElasticBandRecord
) -> None:
    """Add the change of one step h of the classical Runge-Kutta method to x."""
    stage = local_array((6,))
    rate = local_array((8,))
    for i in range(8):
        change[i] = 0.0
        rate[i] = 0.0
    times = (0.0, 0.5, 0.5, 1.0)
    weights = (1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0)
    for number in range(4):
        time = times[number]
        for i in range(6):
            stage[i] = x[i] + time * h * rate[i]
        elastic_band_rates(stage, rate, time * h, inputs, plant)
        for i in range(8):
            change[i] += weights[number] * h * rate[i]
    for i in range(6):
        x[i] += change[i]


def elastic_band_friction(
    x: FloatArray, inputs: SampleInput, h: float, plant: ElasticBandRecord
) -> tuple[float, float, float]:
    """Return the dry friction [N] that stops the body in a step h, or its limit."""
    if plant.friction == 0.0:
        return 0.0, 0.0, 0.0
    rate = local_array((8,))
    elastic_band_rates(x, rate, 0.0, inputs, plant)
    return friction_force(
        x[3] + h * rate[3], x[4] + h * rate[4], x[5] + h * rate[5], plant.friction, plant.mass, h
    )


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: ElasticBandRecord
) -> int:
    """Move the body over one sample; see ``body_interface``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, touches = inputs
    change = local_array((8,))
    time = 0.0
    part = fine = 0
    h = plant.substep
    while part < plant.substeps:
        bx = ax + time * ux
        by = ay + time * uy
        bz = az + time * uz
        free = SampleInput(fx, fy, fz, bx, by, bz, ux, uy, uz, touches)
        gx, gy, gz = elastic_band_friction(x, free, h, plant)
        pull = SampleInput(fx + gx, fy + gy, fz + gz, bx, by, bz, ux, uy, uz, touches)
        elastic_band_step(x, change, pull, h, plant)
        if fine == 0 and elastic_band_changes_state(x, change, h, pull, plant.hand):
            for i in range(6):
                x[i] -= change[i]
            fine = 256  # the force has a kink there: again, in small steps
            h = plant.substep / 256.0
            continue
        time += h
        rubbed = gx * change[0] + gy * change[1] + gz * change[2]
        add_energies(
            ledger, fx * change[0], fy * change[1], fz * change[2], change[6], change[7], rubbed
        )
        fine = max(fine - 1, 0)
        if fine == 0:
            part += 1
            h = plant.substep
    return RUNNING


def elastic_band_changes_state(
    x: FloatArray, change: FloatArray, h: float, inputs: SampleInput, hand: HandRecord
) -> bool:
    """Return whether the band turned slack or taut in a step h of the body, by a change to x."""
    ex = inputs.ax - x[0]
    ey = inputs.ay - x[1]
    ez = inputs.az - x[2]
    return band_changes_state(
        ex + change[0],
        ey + change[1],
        ez + change[2],
        ex + h * inputs.ux,
        ey + h * inputs.uy,
        ez + h * inputs.uz,
        hand,
    )


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: ElasticBandRecord
) -> float:
    """Return ½ m v² of every axis and the energy of the hand [J]."""
    total = hand_energy(ax - x[0], ay - x[1], az - x[2], plant.hand)
    for i in range(3):
        total += 0.5 * plant.mass[i, i] * x[3 + i] * x[3 + i]
    return total
