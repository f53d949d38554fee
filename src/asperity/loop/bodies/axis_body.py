"""One sample of a rigid body without coupling between its axes: small forms, written out.

Along one axis, relative to the anchor, with e = p - a, w = p' - u, F = f + g - b u and

    m w' = F - (b + b_h) w - K e,

the changes of e and w over a part of a sample are linear in (e, w, F), and ∫ (b + b_h) w² dt is a
quadratic form. b p'² + b_h w² = (b + b_h) w² + 2 b u w + b u², and the impulse of the anchor's
spring and damper is m Δp' - (f + g) T + b Δp. Dry friction, which couples the axes, is constant
over a part of a sample.
"""

from typing import NamedTuple

from asperity.core.compiled import FloatArray, Kernels
from asperity.loop.bodies.body_parts import friction_force
from asperity.loop.body_interface import RUNNING, SampleInput
from asperity.loop.simulated_device import add_energies

KERNELS = Kernels(provides=("advance_body", "stored_energy"))

# Columns of an axis after the changes of e and w and the loss: damping and mass of the device,
# stiffness and constant force of the hand, and the duration of a part.
DEVICE_DAMPING = 12
MASS = 13
HAND_STIFFNESS = 14
HAND_FORCE = 15
SUBSTEP = 16


class AxisBodyRecord(NamedTuple):
    """A body without coupling between its axes but for dry friction, over a part of a sample.

    Attributes:
        coefficients: of each axis (3, 17).
        friction: dry friction [N].
        stopping_mass: mass that friction stops (3, 3) [kg].
        substeps: number of parts of a sample.
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
    """Move the body over one sample; see ``body_interface``."""
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


def advance_axis(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> tuple[float, float, float]:
    """Move along one axis; return the displacement [m], loss and work of the hand [J].

    Columns: 0-5 the changes of e and w, 6-11 the loss in ee, ew, eF, ww, wF, FF, then those named
    above.
    """
    p = x[i]
    v = x[3 + i]
    b = coefficients[i, DEVICE_DAMPING]
    span = coefficients[i, SUBSTEP]
    g = coefficients[i, HAND_FORCE]
    e = p - a
    w = v - u
    push = f + g - b * u
    de = coefficients[i, 0] * e + coefficients[i, 1] * w + coefficients[i, 2] * push
    dw = coefficients[i, 3] * e + coefficients[i, 4] * w + coefficients[i, 5] * push
    dp = de + u * span
    lost = e * (coefficients[i, 6] * e + coefficients[i, 7] * w + coefficients[i, 8] * push)
    lost += (
        w * (coefficients[i, 9] * w + coefficients[i, 10] * push)
        + coefficients[i, 11] * push * push
    )
    lost += b * u * (de + dp)
    hand = u * (coefficients[i, MASS] * dw - (f + g) * span + b * dp) + g * dp
    x[i] = p + dp
    x[3 + i] = v + dw
    return dp, lost, hand


def final_velocity(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> float:
    """Return the velocity along one axis at the end of the part, without friction [m/s]."""
    v = x[3 + i]
    push = f + coefficients[i, HAND_FORCE] - coefficients[i, DEVICE_DAMPING] * u
    speed: float = (
        v
        + coefficients[i, 3] * (x[i] - a)
        + coefficients[i, 4] * (v - u)
        + coefficients[i, 5] * push
    )
    return speed


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: AxisBodyRecord) -> float:
    """Return ½ m v² + ½ K (a - p)² of every axis [J]."""
    table = plant.coefficients
    anchor = (ax, ay, az)
    total = 0.0
    for i in range(3):
        hand_strain = anchor[i] - x[i]
        kinetic = 0.5 * table[i, MASS] * x[3 + i] ** 2
        total += kinetic + 0.5 * table[i, HAND_STIFFNESS] * hand_strain * hand_strain
    return total
