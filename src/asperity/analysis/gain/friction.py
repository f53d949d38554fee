"""Law F reduced to two entries.

With α = μ δ₀ (1 - m)/d_max, β = μ δ₀ |d| |∇m|/d_max, γ = μ (1 - m) |d|/d_max and unit vectors e of
-d and e' of ∇m, minus the Jacobian maps (a, c) to (α S a + (β e' · a + γ c) e, c), S being the
identity while the anchor sticks and a projection while it is dragged. Its first part is at most
(α + β)|a| + γ|c| long, so its norm is at most that of [[α + β, γ], [0, 1]], which is attained
where the anchor sticks, e = e' and |d| = d_max: the deflection against the slope of m. The
same holds for the symmetric part. In the depth all entries grow.
"""

from __future__ import annotations

import numpy as np

from asperity.checks import FloatArray


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
