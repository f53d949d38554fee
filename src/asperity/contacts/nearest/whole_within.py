"""The nearest surface point of a texture kind whose search knows no budget: found as it is."""

from asperity.compiled import Kernels
from asperity.contacts.sampler import foot

KERNELS = Kernels(provides=("foot_within", "look_cost"), requires=("foot",))


def foot_within(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float, texture: object
) -> tuple[float, float, float, float, float, float, float]:
    """Return the foot itself; see ``contacts.sampler``."""
    fx, fy, h, hx, hy = foot(x, y, z, texture)
    return fx, fy, h, hx, hy, 0.0, 1.0


def look_cost(texture: object) -> float:
    """Return 1: see ``contacts.sampler``; a kind that takes longer provides its own."""
    return 1.0
