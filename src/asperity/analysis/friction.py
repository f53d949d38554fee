"""The characteristic numbers of law F on a sinusoid, certified.

With d along the slope and |d| = d_max the 3-D Jacobian reduces to [[a, b], [0, 1]] (up to a
transverse entry that is never greater), a = μD ((1 - m)/d_max + |∇m|), b = μ(1 - m), and both
numbers grow with a and with b. On an interval of the phase a and b are bounded by the ranges of
sine and |cosine|: branch and bound on one angle.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from asperity.analysis.bound import Bound
from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

_GAP = 1e-10
_START = 256
Number = Callable[[FloatArray, FloatArray], FloatArray]


def largest_singular_value(a: FloatArray, b: FloatArray) -> FloatArray:
    """‖[[a, b], [0, 1]]‖₂ = √((T + √(T² - 4a²))/2), T = 1 + a² + b²."""
    t = 1.0 + a * a + b * b
    # T² - 4a² as a product: no cancellation.
    root = np.sqrt(np.maximum((t - 2.0 * a) * (t + 2.0 * a), 0.0))
    result: FloatArray = np.sqrt(0.5 * (t + root))
    return result


def largest_symmetric_eigenvalue(a: FloatArray, b: FloatArray) -> FloatArray:
    """λ_max of the symmetric part of [[a, b], [0, 1]]."""
    result: FloatArray = 0.5 * (1.0 + a + np.hypot(1.0 - a, b))
    return result


def friction_number(surface: Surface, one_sided: bool) -> Bound:
    """Return q_F, or q⁺_F, over all phases, stick and slip states.

    Args:
        surface: law F on a :class:`Sinusoid`.
        one_sided: whether q⁺ is wanted.
    """
    assert isinstance(surface.texture, Sinusoid)
    number: Number = largest_symmetric_eigenvalue if one_sided else largest_singular_value
    depth, mu, d_max = surface.max_depth, surface.friction, surface.max_deflection
    swing = surface.modulation_depth
    steepness = math.pi * swing / surface.texture.period

    def entries(sine: FloatArray, cosine: FloatArray) -> tuple[FloatArray, FloatArray]:
        still = 0.5 * (1.0 - swing * sine)  # 1 - m
        return mu * depth * (still / d_max + steepness * np.abs(cosine)), mu * still

    # By symmetry the maximum is where sin <= 0 and cos >= 0: phase in [-π/2, 0].
    edges = np.linspace(-0.5 * math.pi, 0.0, _START + 1)
    low, high = edges[:-1], edges[1:]
    while True:
        middle = 0.5 * (low + high)
        values = number(*entries(np.sin(middle), np.cos(middle)))
        best = int(np.argmax(values))
        # sin and cos both increase on [-π/2, 0].
        upper = number(*entries(np.sin(low), np.cos(high)))
        keep = upper > values[best]
        if float(upper.max()) <= values[best] * (1.0 + _GAP):
            break
        low, high = (
            np.concatenate([low[keep], middle[keep]]),
            np.concatenate([middle[keep], high[keep]]),
        )
    at = _probe(surface, float(middle[best]))
    # One rounding unit per operation, a dozen of them, on top of the interval bound.
    bound = float(upper.max() * (1.0 + 16.0 * np.finfo(float).eps))
    note = f"|d| = d_max against the slope; interval bound with relative gap {_GAP:g}"
    return Bound(float(values[best]), bound, "certified", at, note)


def _probe(surface: Surface, phase: float) -> tuple[float, float, float]:
    """Return the probe position at a phase of the sinusoid, at full depth."""
    texture = surface.texture
    assert isinstance(texture, Sinusoid)
    along = (phase - texture.phase) * texture.period / (2.0 * math.pi)
    return (along * texture.direction[0], along * texture.direction[1], -surface.max_depth)
