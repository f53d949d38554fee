"""Sine and cosine for batches, without branches and calls, so that loops vectorize.

The angle is halved and reduced by m quarter turns, x/2 = m π/2 + t with |t| <= π/4 (Cody and
Waite); sin t and 2 cos t are polynomials, and sin x = ±2 sin t cos t, cos x = ±(1 - 2 sin² t), with
the sign of (-1)^m. Errors are at most 6e-16 for angles up to 1e6 turns, and results exceed
[-1, 1] by less than that; beyond, the error is that of an angle whose last two bits are lost. It is
less than the rounding error of a computed angle, k x + phase, from one turn on. All this holds
whether the processor rounds a product and a sum once or twice.
"""

from asperity.core.compiled import Kernels, multiply_add

KERNELS = Kernels(provides=("cosine", "sine"))

# Adding and subtracting this number rounds to an integer.
ROUNDING = 1.5 * 2.0**52
# 2/π, and π/2 in three parts: multiples of the first and the second up to 2^23 are exact.
INVERSE = 0.6366197723675814
PART_0 = 1.570796325802803
PART_1 = 9.920935791635221e-10
PART_2 = 5.170182981794105e-19
# Slightly more than π/4, for angles whose last bit is more than a turn.
LARGEST = 0.7854


def sine(angle: float) -> float:
    """Return sin angle."""
    _sign, s, c, _s = half_angle(angle)
    return s * c


def cosine(angle: float) -> float:
    """Return cos angle."""
    sign, s, _c, t = half_angle(angle)
    return multiply_add(-2.0 * s, t, sign)


def half_angle(angle: float) -> tuple[float, float, float, float]:
    """Return (-1)^m, (-1)^m sin t, 2 cos t and sin t.

    The polynomials interpolate at Chebyshev's nodes in t².
    """
    u = 0.5 * angle
    m = multiply_add(u, INVERSE, ROUNDING) - ROUNDING
    t = multiply_add(-m, PART_2, multiply_add(-m, PART_1, multiply_add(-m, PART_0, u)))
    t = min(max(t, -LARGEST), LARGEST)
    w = t * t
    s = 1.5918129014234338e-10
    s = multiply_add(s, w, -2.5051131841108444e-08)
    s = multiply_add(s, w, 2.755731610253375e-06)
    s = multiply_add(s, w, -1.9841269836758538e-04)
    s = multiply_add(s, w, 8.333333333330948e-03)
    s = multiply_add(s, w, -1.6666666666666666e-01)
    s = multiply_add(t, w * s, t)
    c = -2.2765264499921246e-11
    c = multiply_add(c, w, 4.175229253193285e-09)
    c = multiply_add(c, w, -5.51146345434362e-07)
    c = multiply_add(c, w, 4.960317459753133e-05)
    c = multiply_add(c, w, -2.7777777777774795e-03)
    c = multiply_add(c, w, 8.333333333333333e-02)
    half = multiply_add(0.5, m, ROUNDING) - ROUNDING
    sign = multiply_add(-4.0, abs(multiply_add(0.5, m, -half)), 1.0)
    return sign, sign * s, multiply_add(w * w, c, 2.0 - w), s
