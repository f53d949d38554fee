"""One sample of a body axis by axis, each as ``rigid.py`` or ``resonant.py`` has it.

Dry friction, which couples the axes, is constant over a part of a sample.
"""

from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.simulation.kernels.body_functions import RAN, Held, advance_axis, final_speed
from asperity.simulation.kernels.booking import book_energies
from asperity.simulation.kernels.dense import friction_force

KERNELS = Kernels(
    provides=("advance_body",),
    requires=("advance_axis", "book_energies", "final_speed", "friction_force"),
)


class AxesPlant(NamedTuple):
    """A body without coupling between its axes but for dry friction, over a part of a sample.

    Attributes:
        table: a row for each axis, of ``rigid.py`` (3, 17) or ``resonant.py`` (3, 52).
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


def advance_body(x: FloatArray, ledger: FloatArray, held: Held, plant: AxesPlant) -> int:
    """Move the body over one sample; see ``body_functions``."""
    fx, fy, fz, ax, ay, az, ux, uy, uz, _inside = held
    table, friction, mass, parts, span = plant
    gx = gy = gz = 0.0
    for part in range(parts):
        bx = ax + part * span * ux
        by = ay + part * span * uy
        bz = az + part * span * uz
        if friction > 0.0:
            vx = final_speed(x, 0, fx, bx, ux, table)
            vy = final_speed(x, 1, fy, by, uy, table)
            vz = final_speed(x, 2, fz, bz, uz, table)
            gx, gy, gz = friction_force(vx, vy, vz, friction, mass, span)
        dx, lost_x, hand_x = advance_axis(x, 0, fx + gx, bx, ux, table)
        dy, lost_y, hand_y = advance_axis(x, 1, fy + gy, by, uy, table)
        dz, lost_z, hand_z = advance_axis(x, 2, fz + gz, bz, uz, table)
        lost = lost_x + lost_y + lost_z
        hand = hand_x + hand_y + hand_z
        rubbed = gx * dx + gy * dy + gz * dz
        book_energies(ledger, fx * dx, fy * dy, fz * dz, lost, hand, rubbed)
    return RAN
