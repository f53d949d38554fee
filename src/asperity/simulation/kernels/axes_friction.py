"""One sample of a body without coupling between its axes but for dry friction, in parts."""

# ruff: noqa: ARG001 - one signature for every body

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.axes import DAMPING, PUSH, advance_axis, stored_in_axes
from asperity.simulation.kernels.body_functions import RAN
from asperity.simulation.kernels.booking import book_energies
from asperity.simulation.kernels.dense import friction_force

KERNELS = Kernels(
    provides=("advance_body", "stored_energy"),
    requires=("advance_axis", "book_energies", "friction_force", "stored_in_axes"),
)


class FrictionAxesPlant(NamedTuple):
    """A body without coupling between its axes but for dry friction, over a part of a sample.

    Attributes:
        table: of :mod:`asperity.simulation.kernels.axes` (3, 17).
        friction: dry friction [N].
        mass: that friction stops (3, 3) [kg].
        parts: of a sample.
        span: duration of a part [s].
    """

    table: FloatArray
    friction: float
    mass: FloatArray
    parts: int
    span: float


def final_speed(x: FloatArray, i: int, f: float, a: float, u: float, table: FloatArray) -> float:
    """Velocity along one axis at the end of the part, without friction [m/s]."""
    v = x[3 + i]
    push = f + table[i, PUSH] - table[i, DAMPING] * u
    speed: float = v + table[i, 3] * (x[i] - a) + table[i, 4] * (v - u) + table[i, 5] * push
    return speed


def advance_body(
    x: FloatArray, ledger: FloatArray,
    fx: float, fy: float, fz: float,
    ax: float, ay: float, az: float,
    ux: float, uy: float, uz: float,
    inside: bool, plant: FrictionAxesPlant,
) -> int:  # fmt: skip
    """Move the body over one sample; see ``body_functions``."""
    table, friction, mass, parts, span = plant
    for part in range(parts):
        bx = ax + part * span * ux
        by = ay + part * span * uy
        bz = az + part * span * uz
        gx, gy, gz = friction_force(
            final_speed(x, 0, fx, bx, ux, table), final_speed(x, 1, fy, by, uy, table),
            final_speed(x, 2, fz, bz, uz, table), friction, mass, span,
        )  # fmt: skip
        dx, lost_x, hand_x = advance_axis(x, 0, fx + gx, bx, ux, table)
        dy, lost_y, hand_y = advance_axis(x, 1, fy + gy, by, uy, table)
        dz, lost_z, hand_z = advance_axis(x, 2, fz + gz, bz, uz, table)
        lost = lost_x + lost_y + lost_z
        hand = hand_x + hand_y + hand_z
        rubbed = gx * dx + gy * dy + gz * dz
        book_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)
    return RAN


def stored_energy(
    x: FloatArray, ax: float, ay: float, az: float, plant: FrictionAxesPlant
) -> float:
    """½ m v² + ½ K (a - p)² of every axis [J]."""
    return stored_in_axes(x, ax, ay, az, plant.table)
