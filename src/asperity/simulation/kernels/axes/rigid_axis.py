"""One axis of a rigid body: small forms, written out.

Along one axis, relative to the anchor, with e = p - a, w = p' - u, F = f + g - b u and

    m w' = F - (b + b_h) w - K e,

the changes of e and w over a part of a sample are linear in (e, w, F), and ∫ (b + b_h) w² dt is a
quadratic form. b p'² + b_h w² = (b + b_h) w² + 2 b u w + b u², and the impulse of the anchor's
spring and damper is m Δp' - (f + g) T + b Δp.
"""

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels
from asperity.simulation.kernels.axes.axis_body import AxisBodyRecord

KERNELS = Kernels(provides=("advance_axis", "final_velocity", "stored_energy"))


# Where the numbers of an axis stand in its row of the table, after the changes of e and w and the
# loss: damping and mass of the device, stiffness and constant force of the hand, and the period.
DEVICE_DAMPING, MASS, HAND_STIFFNESS, HAND_FORCE, SUBSTEP = 12, 13, 14, 15, 16


def advance_axis(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> tuple[float, float, float]:
    """Move along one axis; returns the displacement [m], loss and work of the hand [J].

    Row i of the table: 0-5 changes of e and w, 6-11 the loss in ee, ew, eF, ww, wF, FF, and the
    numbers named above.
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
    """Velocity along one axis at the end of the part, without friction [m/s]."""
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
    """½ m v² + ½ K (a - p)² of every axis [J]."""
    table = plant.coefficients
    total = 0.0
    for i in range(3):
        anchor = ax if i == 0 else ay if i == 1 else az
        hand_strain = anchor - x[i]
        kinetic = 0.5 * table[i, MASS] * x[3 + i] ** 2
        total += kinetic + 0.5 * table[i, HAND_STIFFNESS] * hand_strain * hand_strain
    return total
