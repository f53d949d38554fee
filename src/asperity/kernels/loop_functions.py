"""Functions that loops call: rows of the arrays of points and results, and the friction anchor.

The anchor of a law with state sticks, and slips once its deflection would exceed a limit.
"""

import math

from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels, multiply_add
from asperity.kernels.probe_functions import Matrix3Rows, Vector3

KERNELS = Kernels(provides=EVERY_FUNCTION)


def drag_anchor(
    x: float, y: float, held: bool, ax: float, ay: float, max_deflection: float
) -> tuple[float, float, float, float]:
    """Return anchor and deflection [m] after the probe moved to (x, y).

    Independent of time: the anchor sticks until the deflection would exceed its limit.
    """
    if not held:
        return x, y, 0.0, 0.0
    dx = x - ax
    dy = y - ay
    length = math.sqrt(dx * dx + dy * dy)
    if length > max_deflection:
        dx *= max_deflection / length
        dy *= max_deflection / length
        ax = x - dx
        ay = y - dy
    return ax, ay, dx, dy


def clip_factor(
    dx: float, dy: float, dz: float, fx: float, fy: float, fz: float, max_deflection: float
) -> float:
    """Return the factor at most 1 that clips a deflection to max_deflection sin α.

    α is the angle between the deflection and the force (fx, fy, fz).
    """
    force = fx * fx + fy * fy + fz * fz
    if force == 0.0:
        return 0.0
    cx = dy * fz - dz * fy
    cy = dz * fx - dx * fz
    cz = dx * fy - dy * fx
    square = dx * dx + dy * dy + dz * dz
    limit = max_deflection * math.sqrt((cx * cx + cy * cy + cz * cz) / force)
    return limit / square if square > limit else 1.0


def drag_anchor_in_space(
    x: float,
    y: float,
    z: float,
    held: bool,
    ax: float,
    ay: float,
    az: float,
    fx: float,
    fy: float,
    fz: float,
    max_deflection: float,
) -> tuple[float, float, float, float, float, float]:
    """Return anchor and deflection [m] of a body that presses with a force (fx, fy, fz).

    The limit is max_deflection times the sine of the angle between deflection and force: whole
    along the surface, 0 across it.
    """
    if not held:
        return x, y, z, 0.0, 0.0, 0.0
    dx = x - ax
    dy = y - ay
    dz = z - az
    share = clip_factor(dx, dy, dz, fx, fy, fz, max_deflection)
    if share < 1.0:
        dx *= share
        dy *= share
        dz *= share
        ax = x - dx
        ay = y - dy
        az = z - dz
    return ax, ay, az, dx, dy, dz


def sliding_derivative(dx: float, dy: float, is_sliding: bool) -> tuple[float, float, float]:
    """Return xx, xy, yy of ∂d/∂p: I, or I - u uᵀ if dragged, u the direction of d."""
    square = dx * dx + dy * dy
    if is_sliding and square > 0.0:
        return 1.0 - dx * dx / square, 0.0 - dx * dy / square, 1.0 - dy * dy / square
    return 1.0, 0.0, 1.0


def load_point(points: FloatArray, i: int) -> Vector3:
    """Return x, y, z of a row of (n, 3).

    All three are used by adding zero times them: coordinates that only some points need would be
    gathered one by one.
    """
    x = points[i, 0]
    y = points[i, 1]
    return x, y, multiply_add(0.0, y, multiply_add(0.0, x, points[i, 2]))


def store_force(out: FloatArray, i: int, force: Vector3) -> None:
    """Write a row of (n, 3).

    The last before the middle: the compiler turns two adjacent zeros, as of a law with a vertical
    force, into a call that clears memory, and does not vectorize a loop with calls.
    """
    out[i, 0] = force[0]
    out[i, 2] = force[2]
    out[i, 1] = force[1]


def store_jacobian(
    force: FloatArray, jacobian: FloatArray, i: int, values: tuple[*Vector3, *Matrix3Rows]
) -> None:
    """Write a row of (n, 3) and a matrix of (n, 3, 3)."""
    for d in range(3):
        force[i, d] = values[d]
    for d in range(9):
        jacobian[i, d // 3, d % 3] = values[3 + d]
