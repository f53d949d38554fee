"""Sine and cosine of the system library, for single points in a loop or a simulation."""

import math

from asperity.core.compiled import Kernels

KERNELS = Kernels(provides=("cosine", "sine"))


def sine(angle: float) -> float:
    """Return sin angle."""
    return math.sin(angle)


def cosine(angle: float) -> float:
    """Return cos angle."""
    return math.cos(angle)
