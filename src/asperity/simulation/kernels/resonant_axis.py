"""One axis of a body with a resonance, in the place of the rigid one of ``axis_body``.

There are two masses: with e = p - a, w = p' - u and the same (r, s) for the mass that hangs on a
spring and carries the hand, the changes of (e, w, r, s) are linear in themselves, F = f - b u and
the constant force g of the hand.
"""

from asperity.core.compiled import FloatArray, Kernels, local_array
from asperity.simulation.kernels.axis_body import AxisBodyRecord

KERNELS = Kernels(provides=("advance_axis", "final_velocity", "stored_energy"))


# Columns of an axis after 24 of the changes and 21 of the loss: damping of the device, both masses,
# the stiffness between them, stiffness and constant force of the hand, and the duration of a part.
DEVICE_DAMPING, NEAR_MASS, FAR_MASS, COUPLING_STIFFNESS = 45, 46, 47, 48
HAND_STIFFNESS, HAND_FORCE, SUBSTEP = 49, 50, 51


def resonant_state(
    x: FloatArray, i: int, f: float, a: float, u: float, coefficients: FloatArray, z: FloatArray
) -> float:
    """Write z = (e, w, r, s, F, g) of one axis; return p' at the end of the part [m/s]."""
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
    """Move along one axis; return the displacement [m], loss and work of the hand [J].

    Columns: 0-23 the changes, 24-44 the upper triangle of the loss by rows, then those named above.
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
    """Return the velocity along one axis at the end of the part, without friction [m/s]."""
    return resonant_state(x, i, f, a, u, coefficients, local_array((6,)))


def stored_energy(x: FloatArray, ax: float, ay: float, az: float, plant: AxisBodyRecord) -> float:
    """Return the energy of both masses, of the spring between them and of the hand [J]."""
    table = plant.coefficients
    total = 0.0
    for i in range(3):
        anchor = ax if i == 0 else ay if i == 1 else az
        hand_strain = anchor - x[6 + i]
        coupling_strain = x[6 + i] - x[i]
        total += table[i, NEAR_MASS] * x[3 + i] ** 2 + table[i, FAR_MASS] * x[9 + i] ** 2
        total += table[i, COUPLING_STIFFNESS] * coupling_strain * coupling_strain
        total += table[i, HAND_STIFFNESS] * hand_strain * hand_strain
    return 0.5 * total
