"""Sine and cosine of batches: without branches and calls, so that many points go at once.

The angle is halved and freed of m quarter turns, x/2 = m π/2 + t with |t| <= π/4 (Cody and Waite);
sin t and cos t are polynomials, and sin x = ±2 sin t cos t, cos x = ±(1 - 2 sin² t), the sign that
of (-1)^m. Errors are at most 6e-16 for angles up to 1e6 turns, and results within [-1, 1] by less
than that; beyond, the error is that of an angle whose last two bits are lost. It is nothing to
the rounding of an angle that was computed, k x + phase, which is larger from one turn on.
"""

from asperity.compiled import Kernels

KERNELS = Kernels(provides=("cosine", "sine"))

# A number added and taken away again: what is left is rounded to an integer.
ROUNDING = 1.5 * 2.0**52
# 2/π, and π/2 in three parts: multiples of the first and the second up to 2^23 are exact.
INVERSE = 0.6366197723675814
PART_0 = 1.570796325802803
PART_1 = 9.920935791635221e-10
PART_2 = 5.170182981794105e-19
# A little more than π/4: for angles whose last bit is more than a turn.
LARGEST = 0.7854


def sine(angle: float) -> float:
    """Return sin angle."""
    sign, s, c = half_angle(angle)
    return sign * (2.0 * s * c)


def cosine(angle: float) -> float:
    """Return cos angle."""
    sign, s, _c = half_angle(angle)
    return sign * (1.0 - 2.0 * s * s)


def half_angle(angle: float) -> tuple[float, float, float]:
    """Return (-1)^m, sin t and cos t; the polynomials interpolate at Chebyshev's nodes in t²."""
    u = 0.5 * angle
    m = (u * INVERSE + ROUNDING) - ROUNDING
    t = ((u - m * PART_0) - m * PART_1) - m * PART_2
    t = min(max(t, -LARGEST), LARGEST)
    w = t * t
    s = 1.5918129014234338e-10
    s = s * w - 2.5051131841108444e-08
    s = s * w + 2.755731610253375e-06
    s = s * w - 1.9841269836758538e-04
    s = s * w + 8.333333333330948e-03
    s = s * w - 1.6666666666666666e-01
    c = -1.1382632249960623e-11
    c = c * w + 2.0876146265966424e-09
    c = c * w - 2.75573172717181e-07
    c = c * w + 2.4801587298765665e-05
    c = c * w - 1.3888888888887398e-03
    c = c * w + 4.1666666666666664e-02
    half = 0.5 * m
    odd = abs(half - ((half + ROUNDING) - ROUNDING))
    return 1.0 - 4.0 * odd, t + t * (w * s), 1.0 - 0.5 * w + w * w * c
