"""One sample of a body axis by axis, each as ``rigid.py`` or ``resonant.py`` has it.

Dry friction, which couples the axes, is constant over a part of a sample.
"""

from typing import NamedTuple

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels
from asperity.simulation.kernels.body_interface import (
    RUNNING,
    SampleInput,
    advance_axis,
    final_velocity,
)
from asperity.simulation.kernels.coupled_body import friction_force
from asperity.simulation.kernels.energy_ledger import add_energies

KERNELS = Kernels(provides=("advance_body",))


class AxisBodyRecord(NamedTuple):
    """A body without coupling between its axes but for dry friction, over a part of a sample.

    Attributes:
        coefficients: a row for each axis, of ``rigid.py`` (3, 17) or ``resonant.py`` (3, 52).
        friction: dry friction [N].
        stopping_mass: that friction stops (3, 3) [kg].
        substeps: of a sample.
        substep: duration of a part [s].
    """

    coefficients: FloatArray
    friction: float
    stopping_mass: FloatArray
    substeps: int
    substep: float


def advance_body(
    x: FloatArray, ledger: FloatArray, inputs: SampleInput, plant: AxisBodyRecord
) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = inputs
    table, friction, mass, parts, span = plant
    gx = gy = gz = 0.0
    for part in range(parts):
        bx = ax + part * span * ux
        by = ay + part * span * uy
        bz = az + part * span * uz
        if friction > 0.0:
            vx = final_velocity(x, 0, fx, bx, ux, table)
            vy = final_velocity(x, 1, fy, by, uy, table)
            vz = final_velocity(x, 2, fz, bz, uz, table)
            gx, gy, gz = friction_force(vx, vy, vz, friction, mass, span)
        dx, lost_x, hand_x = advance_axis(x, 0, fx + gx, bx, ux, table)
        dy, lost_y, hand_y = advance_axis(x, 1, fy + gy, by, uy, table)
        dz, lost_z, hand_z = advance_axis(x, 2, fz + gz, bz, uz, table)
        lost = lost_x + lost_y + lost_z
        hand = hand_x + hand_y + hand_z
        rubbed = gx * dx + gy * dy + gz * dz
        add_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)
    return RUNNING
