"""A mass in space on an elastic band, over one sample, by Runge-Kutta steps."""

from typing import NamedTuple

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.simulation.kernels.body_interface import RUNNING, SampleInput
from asperity.simulation.kernels.coupled_body import friction_force
from asperity.simulation.kernels.energy_ledger import add_energies
from asperity.simulation.kernels.hand_force import (
    HandRecord,
    band_changes_state,
    hand_energy,
    hand_force,
)

KERNELS = Kernels(provides=("advance_body", "stored_energy"))


class ElasticBandRecord(NamedTuple):
    """A mass in space on an elastic band.

    Attributes:
        mass: (3, 3), diagonal [kg].
        damping: (3, 3) [N s/m].
        hand: the band.
        friction: dry friction [N].
        substeps: of a sample.
        substep: duration of a part [s].
    """

    mass: FloatArray
    damping: FloatArray
    hand: HandRecord
    friction: float
    substeps: int
    substep: float


def elastic_band_rates(
    y: FloatArray, k: FloatArray, fx: float, fy: float, fz: float, ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float, plant: ElasticBandRecord,
) -> None:  # fmt: skip
    """Let k become the rate of y = (p, p', loss, work of the hand)."""
    hand = plant.hand
    hx, hy, hz, lost = hand_force(
        ax - y[0], ay - y[1], az - y[2], ux - y[3], uy - y[4], uz - y[5], hand
    )
    k[6] = lost
    k[7] = ux * hx + uy * hy + uz * hz
    for i in range(3):
        drag = plant.damping[i, 0] * y[3] + plant.damping[i, 1] * y[4]
        drag += plant.damping[i, 2] * y[5]
        push = fx + hx if i == 0 else fy + hy if i == 1 else fz + hz
        k[i] = y[3 + i]
        k[3 + i] = (push + hand.force[i] - drag) / plant.mass[i, i]
        k[6] += drag * y[3 + i]
        k[7] += hand.force[i] * y[3 + i]


def elastic_band_step(
    x: FloatArray, fx: float, fy: float, fz: float, ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float, substep: float, plant: ElasticBandRecord,
    change: FloatArray, stage: FloatArray, rate: FloatArray,
) -> None:  # fmt: skip
    """One step of the classical Runge-Kutta method; ``change`` becomes that of (p, p', ...)."""
    for i in range(8):
        change[i] = 0.0
        rate[i] = 0.0
    for turn in range(4):
        late = 0.0 if turn == 0 else 1.0 if turn == 3 else 0.5
        weight = 1.0 / 6.0 if turn in (0, 3) else 1.0 / 3.0
        for i in range(6):
            stage[i] = x[i] + late * substep * rate[i]
        elastic_band_rates(
            stage, rate, fx, fy, fz,
            ax + late * substep * ux, ay + late * substep * uy, az + late * substep * uz,
            ux, uy, uz, plant,
        )  # fmt: skip
        for i in range(8):
            change[i] += weight * substep * rate[i]
    for i in range(6):
        x[i] += change[i]


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: ElasticBandRecord
) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = inputs
    change = local_array((8,))
    stage = local_array((8,))
    rate = local_array((8,))
    gx = gy = gz = time = 0.0
    part = fine = 0
    h = plant.substep
    while part < plant.substeps:
        bx = ax + time * ux
        by = ay + time * uy
        bz = az + time * uz
        if plant.friction > 0.0:
            elastic_band_rates(x, rate, fx, fy, fz, bx, by, bz, ux, uy, uz, plant)
            for i in range(3):
                stage[i] = x[3 + i] + h * rate[3 + i]
            gx, gy, gz = friction_force(stage[0], stage[1], stage[2], plant.friction, plant.mass, h)
        elastic_band_step(
            x, fx + gx, fy + gy, fz + gz, bx, by, bz, ux, uy, uz, h, plant,
            change, stage, rate,
        )  # fmt: skip
        if fine == 0 and elastic_band_changes_state(x, change, time, h, inputs, plant.hand):
            for i in range(6):
                x[i] -= change[i]
            fine = 256
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
    x: FloatArray, change: FloatArray, time: float, h: float, inputs: SampleInput, hand: HandRecord
) -> bool:
    """Whether the band turned slack or taut in a step h from a time on: its force has a kink."""
    ex = inputs.ax + time * inputs.ux - x[0]
    ey = inputs.ay + time * inputs.uy - x[1]
    ez = inputs.az + time * inputs.uz - x[2]
    return band_changes_state(
        ex + change[0], ey + change[1], ez + change[2],
        ex + h * inputs.ux, ey + h * inputs.uy, ez + h * inputs.uz, hand,
    )  # fmt: skip


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: ElasticBandRecord
) -> float:
    """½ m v² of every axis and the energy of the hand [J]."""
    total = hand_energy(ax - x[0], ay - x[1], az - x[2], plant.hand)
    for i in range(3):
        total += 0.5 * plant.mass[i, i] * x[3 + i] * x[3 + i]
    return total
