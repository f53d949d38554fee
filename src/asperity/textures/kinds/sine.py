"""Sine and cosine of the system library, for single points in a loop or a simulation."""

import math

from asperity.core.compiled import EPS, Kernels

KERNELS = Kernels(provides=("cosine", "sine", "sine_and_cosine"))

# 2/π, and π/2 in three parts; see :mod:`asperity.kernels.batch_sine`.
INVERSE = 0.6366197723675814
PART_0 = 1.570796325802803
PART_1 = 9.920935791635221e-10
PART_2 = 5.170182981794105e-19


def sine(angle: float) -> float:
    """Return sin angle."""
    return math.sin(angle)


def cosine(angle: float) -> float:
    """Return cos angle."""
    return math.cos(angle)


def sine_and_cosine(angle: float) -> tuple[float, float]:
    """Return sin angle and cos angle, for bounds: without calls, so that loops vectorize.

    The method is that of :mod:`asperity.kernels.batch_sine`, without fused operations: the exported
    C code prunes the same boxes. Errors are at most 1e-15 for angles up to 1e6 turns.
    """
    u = 0.5 * angle
    m = (u * INVERSE + 1.5 / EPS) - 1.5 / EPS
    t = u - m * PART_0 - m * PART_1 - m * PART_2
    t = min(max(t, -0.7854), 0.7854)
    w = t * t
    s = 1.5918129014234338e-10 * w - 2.5051131841108444e-08
    s = ((s * w + 2.755731610253375e-06) * w - 1.9841269836758538e-04) * w
    s = t + t * w * ((s + 8.333333333330948e-03) * w - 1.6666666666666666e-01)
    c = -2.2765264499921246e-11 * w + 4.175229253193285e-09
    c = ((c * w - 5.51146345434362e-07) * w + 4.960317459753133e-05) * w
    c = 2.0 - w + w * w * ((c - 2.7777777777774795e-03) * w + 8.333333333333333e-02)
    half = (0.5 * m + 1.5 / EPS) - 1.5 / EPS
    sign = 1.0 - 4.0 * abs(0.5 * m - half)
    return sign * s * c, sign * (1.0 - 2.0 * s * s)
