"""Characteristic numbers in closed form, for h = A sin(2πx/l) and depths in [0, D].

G₁ = 2πA/l is the greatest slope, y = 4π²AD/l² the greatest curvature times the depth. All are
proved in docs/theory/numbers.md; the tests compare them with the symbolic definition.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from asperity.textures.plane_waves import SingleWave

WaveFormula = Callable[[SingleWave, float], float]
# More bisections than double precision allows.
_MAX_ITERATIONS = 200


def _max_slope(wave: SingleWave) -> float:
    return 2.0 * math.pi * wave.amplitude / wave.period


def _max_curvature_depth(wave: SingleWave, depth: float) -> float:
    return 4.0 * math.pi**2 * wave.amplitude * depth / wave.period**2


def q_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """q_A = √(1 + G₁²); the paper's (10)."""
    return math.hypot(1.0, _max_slope(wave))


def q_b(wave: SingleWave, depth: float) -> float:
    """q_B = max(√(1 + G₁²), y)."""
    return max(math.hypot(1.0, _max_slope(wave)), _max_curvature_depth(wave, depth))


def q_c(wave: SingleWave, depth: float) -> float:
    """q_C = max(y, λ) with λ the feasible root of the cubic, if there is one.

    λ³ - (1 + G₁² + E²/4) λ² + (E²/2) λ - E²/4 = 0 with E = 2πD/l; a root is feasible if λ > 1 and
    E (λ - 1) <= 2 G₁ λ. Without one, y = G₁ E > 1 + 2 G₁².
    """
    return max(_max_curvature_depth(wave, depth), _feasible_root(wave, depth))


def _feasible_root(wave: SingleWave, depth: float) -> float:
    """Return the feasible root, 0 for none, by t = 1/λ: (E²/4) t (1 - t)² + (1 + G₁²) t = 1.

    Feasible are t >= 1 - 2 G₁/E. Where the left side is stationary there, it exceeds 1, so it
    crosses 1 at most once before it reaches 1 + G₁² at t = 1.
    """
    g = _max_slope(wave)
    e = 2.0 * math.pi * depth / wave.period
    quarter = e * e / 4.0
    rate = 1.0 + g * g
    low = max(1.0 - 2.0 * g / e, 0.0)
    high = 1.0
    if (quarter * (1.0 - low) ** 2 + rate) * low > 1.0:
        return 0.0
    t = max(1.0 / rate, low)
    for _ in range(_MAX_ITERATIONS):
        off = (quarter * (1.0 - t) ** 2 + rate) * t - 1.0
        low, high = (t, high) if off <= 0.0 else (low, t)
        slope = quarter * (1.0 - t) * (1.0 - 3.0 * t) + rate
        step = t - off / slope if slope > 0.0 else low
        step = step if low < step < high else 0.5 * (low + high)
        if abs(step - t) <= 1e-16 * t:
            break
        t = step
    return 1.0 / t


def q_d(wave: SingleWave, depth: float) -> float:
    """q_D = 1 if y <= 1/2, y/(1 - y) if y < 1, infinite from y = 1 on."""
    y = _max_curvature_depth(wave, depth)
    if y >= 1.0:
        return math.inf
    return max(1.0, y / (1.0 - y))


def q_g(wave: SingleWave, depth: float) -> float:
    """q_G = max(1, y)."""
    return max(1.0, _max_curvature_depth(wave, depth))


def one_sided_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """q⁺_A = (1 + √(1 + G₁²))/2: the symmetric part of e_z wᵀ has that eigenvalue."""
    return 0.5 * (1.0 + math.hypot(1.0, _max_slope(wave)))


def phase_steepest(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Return the phase where the flank is steepest."""
    return 0.0


def phase_trough(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Return the phase of the trough."""
    return -0.5 * math.pi


def phase_b(wave: SingleWave, depth: float) -> float:
    """Return the phase at which q_B is attained: on the flank or in the trough."""
    steep = math.hypot(1.0, _max_slope(wave)) >= _max_curvature_depth(wave, depth)
    return phase_steepest(wave, depth) if steep else phase_trough(wave, depth)


def phase_c(wave: SingleWave, depth: float) -> float:
    """sin(phase) = -E (λ - 1)/(2 G₁ λ): there λ is stationary along the profile."""
    root = _feasible_root(wave, depth)
    if root <= _max_curvature_depth(wave, depth):
        return phase_trough(wave, depth)
    e = 2.0 * math.pi * depth / wave.period
    return math.asin(max(-1.0, -0.5 * e * (root - 1.0) / (root * _max_slope(wave))))


def curl_a(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Sup |curl f_A|/k = G₁: the curl of k δ e_z has the length of k ∇h."""
    return _max_slope(wave)


def curl_e(wave: SingleWave, depth: float) -> float:  # noqa: ARG001 - one signature for all
    """Sup |curl f_E|/k = G₁/√(1 + G₁²): the curl of k δₙ e_z has the length of k (n_x, n_y)."""
    return _max_slope(wave) / math.hypot(1.0, _max_slope(wave))
