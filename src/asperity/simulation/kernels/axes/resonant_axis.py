"""One axis of a body with a resonance.

As in ``rigid.py`` but for two masses: with e = p - a, w = p' - u and the same for the part r that
hangs on a spring and carries the hand, (e, w, e_r, w_r) changes linearly in itself, F = f - b u and
the hand's constant force g.
"""

from asperity.core.checks import FloatArray
from asperity.core.compiled import Kernels, local_array
from asperity.simulation.kernels.axes.axis_body import AxisBodyRecord

KERNELS = Kernels(provides=("advance_axis", "final_velocity", "stored_energy"))


# Where the numbers of an axis stand in its row of the table, after 24 numbers of the changes and 21
# of the loss: damping of the device, masses near and far, the spring between them, stiffness and
# constant force of the hand, and the period.
DEVICE_DAMPING, NEAR_MASS, FAR_MASS, COUPLING_STIFFNESS, HAND_STIFFNESS, HAND_FORCE, SUBSTEP = (
    45,
    46,
    47,
    48,
    49,
    50,
    51,
)


def resonant_state(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray, z: FloatArray
) -> float:  # fmt: skip
    """Let z become (e, w, e_r, w_r, F, g) of one axis; returns p' at the end of the part [m/s]."""
    z[0] = x[i] - a
    z[1] = x[3 + i] - u
    z[2] = x[6 + i] - a
    z[3] = x[9 + i] - u
    z[4] = f - coefficients[i, DEVICE_DAMPING] * u
    z[5] = coefficients[i, HAND_FORCE]
    speed: float = x[3 + i]
    for j in range(6):
        speed += coefficients[i, 6 + j] * z[j]
    return speed


def advance_axis(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> tuple[float, float, float]:
    """Move along one axis; returns the displacement [m], loss and work of the hand [J].

    Row i of the table: 0-23 the changes, 24-44 the loss, upper triangle by rows, and the numbers
    named above.
    """
    z = local_array((6,))
    v = x[3 + i]
    dw = resonant_state(x, i, f, a, u, coefficients, z) - v
    de = dr = ds = lost = 0.0
    place = 24
    for j in range(6):
        de += coefficients[i, j] * z[j]
        dr += coefficients[i, 12 + j] * z[j]
        ds += coefficients[i, 18 + j] * z[j]
        row = 0.0
        for k in range(j, 6):
            row += coefficients[i, place] * z[k]
            place += 1
        lost += z[j] * row
    b = coefficients[i, DEVICE_DAMPING]
    span = coefficients[i, SUBSTEP]
    dp = de + u * span
    lost += b * u * (de + dp)
    impulse = (
        coefficients[i, NEAR_MASS] * dw
        + coefficients[i, FAR_MASS] * ds
        - (f + z[5]) * span
        + b * dp
    )
    hand = u * impulse + z[5] * (dr + u * span)
    x[i] += dp
    x[3 + i] = v + dw
    x[6 + i] += dr + u * span
    x[9 + i] += ds
    return dp, lost, hand


def final_velocity(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray
) -> float:
    """Velocity along one axis at the end of the part, without friction [m/s]."""
    return resonant_state(x, i, f, a, u, coefficients, local_array((6,)))


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: AxisBodyRecord) -> float:
    """Of both masses, the spring between them and that of the hand [J]."""
    table = plant.coefficients
    total = 0.0
    for i in range(3):
        anchor = ax if i == 0 else ay if i == 1 else az
        hand_strain = anchor - x[6 + i]
        coupling_strain = x[6 + i] - x[i]
        total += (
            0.5 * table[i, NEAR_MASS] * x[3 + i] ** 2 + 0.5 * table[i, FAR_MASS] * x[9 + i] ** 2
        )
        total += (
            0.5 * table[i, COUPLING_STIFFNESS] * coupling_strain * coupling_strain
            + 0.5 * table[i, HAND_STIFFNESS] * hand_strain * hand_strain
        )
    return total
