"""Fallback for a texture kind whose search for the closest point has no evaluation budget."""

from asperity.contacts.sampler_interface import closest_point
from asperity.core.compiled import Kernels

KERNELS = Kernels(provides=("closest_point_within_budget", "evaluation_cost"))


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the exact closest point; see ``sampler_interface``."""
    fx, fy, h, hx, hy = closest_point(x, y, z, texture)
    return fx, fy, h, hx, hy, 0.0, 1.0


def evaluation_cost(texture: object) -> float:
    """Return 1; a texture kind that takes longer provides its own cost."""
    return 1.0
