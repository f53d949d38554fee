"""The anchor of a law with state, and how its deflection follows the probe."""

import math

from asperity.compiled import Kernels

KERNELS = Kernels(provides=("drag_anchor", "sliding_derivative"))


def drag_anchor(
    x: float, y: float, held: bool, ax: float, ay: float, max_deflection: float
) -> tuple[float, float, float, float]:
    """Return anchor and deflection [m] after the probe moved to (x, y): stick and slip.

    Independent of time: the anchor stays until the deflection would get too long.
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


def sliding_derivative(dx: float, dy: float, slides: bool) -> tuple[float, float, float]:
    """Return the derivative of the deflection by the probe, xx, xy, yy: I, or I - u uᵀ if dragged.

    u is the direction of the deflection.
    """
    square = dx * dx + dy * dy
    if slides and square > 0.0:
        return 1.0 - dx * dx / square, 0.0 - dx * dy / square, 1.0 - dy * dy / square
    return 1.0, 0.0, 1.0
