"""A mass in space on an elastic band, over one sample, by Runge-Kutta steps."""

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.simulation.kernels.body_functions import RAN, Held
from asperity.simulation.kernels.booking import book_energies
from asperity.simulation.kernels.dense import friction_force
from asperity.simulation.kernels.hand import HandRecord, band_turns, hand_energy, hand_force

KERNELS = Kernels(
    provides=("advance_body", "stored_energy"),
    requires=("band_turns", "book_energies", "friction_force", "hand_energy", "hand_force"),
)


class BandedPlant(NamedTuple):
    """A mass in space on an elastic band.

    Attributes:
        mass: (3, 3), diagonal [kg].
        damping: (3, 3) [N s/m].
        hand: the band.
        friction: dry friction [N].
        parts: of a sample.
        span: duration of a part [s].
    """

    mass: FloatArray
    damping: FloatArray
    hand: HandRecord
    friction: float
    parts: int
    span: float


def banded_rates(
    y: FloatArray, k: FloatArray, fx: float, fy: float, fz: float, ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float, plant: BandedPlant,
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


def banded_part(
    x: FloatArray, fx: float, fy: float, fz: float, ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float, span: float, plant: BandedPlant,
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
            stage[i] = x[i] + late * span * rate[i]
        banded_rates(
            stage, rate, fx, fy, fz,
            ax + late * span * ux, ay + late * span * uy, az + late * span * uz,
            ux, uy, uz, plant,
        )  # fmt: skip
        for i in range(8):
            change[i] += weight * span * rate[i]
    for i in range(6):
        x[i] += change[i]


def advance_body(x: FloatArray, ledger: FloatArray, held: Held, plant: BandedPlant) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = held
    change = local_array((8,))
    stage = local_array((8,))
    rate = local_array((8,))
    gx = gy = gz = time = 0.0
    part = fine = 0
    h = plant.span
    while part < plant.parts:
        bx = ax + time * ux
        by = ay + time * uy
        bz = az + time * uz
        if plant.friction > 0.0:
            banded_rates(x, rate, fx, fy, fz, bx, by, bz, ux, uy, uz, plant)
            for i in range(3):
                stage[i] = x[3 + i] + h * rate[3 + i]
            gx, gy, gz = friction_force(stage[0], stage[1], stage[2], plant.friction, plant.mass, h)
        banded_part(
            x, fx + gx, fy + gy, fz + gz, bx, by, bz, ux, uy, uz, h, plant,
            change, stage, rate,
        )  # fmt: skip
        if fine == 0 and banded_kink(x, change, time, h, held, plant.hand):
            for i in range(6):
                x[i] -= change[i]
            fine = 256
            h = plant.span / 256.0
            continue
        time += h
        rubbed = gx * change[0] + gy * change[1] + gz * change[2]
        book_energies(
            ledger, fx * change[0], fy * change[1], fz * change[2], change[6], change[7], rubbed
        )
        fine = max(fine - 1, 0)
        if fine == 0:
            part += 1
            h = plant.span
    return RAN


def banded_kink(
    x: FloatArray, change: FloatArray, time: float, h: float, held: Held, hand: HandRecord
) -> bool:
    """Whether the band turned slack or taut in a step h from a time on: its force has a kink."""
    ex = held.ax + time * held.ux - x[0]
    ey = held.ay + time * held.uy - x[1]
    ez = held.az + time * held.uz - x[2]
    return band_turns(
        ex + change[0], ey + change[1], ez + change[2],
        ex + h * held.ux, ey + h * held.uy, ez + h * held.uz, hand,
    )  # fmt: skip


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: BandedPlant) -> float:
    """½ m v² of every axis and the energy of the hand [J]."""
    total = hand_energy(ax - x[0], ay - x[1], az - x[2], plant.hand)
    for i in range(3):
        total += 0.5 * plant.mass[i, i] * x[3 + i] * x[3 + i]
    return total
