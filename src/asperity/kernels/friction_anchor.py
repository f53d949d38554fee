"""The friction anchor of a law with state: stick and slip."""

import math

from asperity.core.compiled import Kernels

KERNELS = Kernels(provides=("drag_anchor", "sliding_derivative"))


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


def sliding_derivative(dx: float, dy: float, is_sliding: bool) -> tuple[float, float, float]:
    """Return xx, xy, yy of ∂d/∂p: I, or I - u uᵀ if dragged, u the direction of d."""
    square = dx * dx + dy * dy
    if is_sliding and square > 0.0:
        return 1.0 - dx * dx / square, 0.0 - dx * dy / square, 1.0 - dy * dy / square
    return 1.0, 0.0, 1.0
