"""Bounds of ‖J‖/k from |∇h| <= M and ‖Hess h‖ <= K alone, D being the depth (MATH section 4)."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.gain.friction import largest_singular_value
from asperity.surface import Surface


def _slope_and_bend(surface: Surface) -> tuple[float, float]:
    """Return M and D K."""
    slope, bend = surface.texture.bounds
    return slope, bend * surface.max_depth


def most_a(surface: Surface) -> float:
    """q_A <= √(1 + M²)."""
    return math.hypot(1.0, _slope_and_bend(surface)[0])


def most_b(surface: Surface) -> float:
    """q_B <= √(1 + M²) + DK."""
    slope, bend = _slope_and_bend(surface)
    return math.hypot(1.0, slope) + bend


def most_c(surface: Surface) -> float:
    """q_C <= 1 + M² + DK."""
    slope, bend = _slope_and_bend(surface)
    return 1.0 + slope * slope + bend


def most_f(surface: Surface) -> float:
    """q_F: that of the greatest entries, see ``friction.py``."""
    swing, friction = surface.parameter("modulation_depth"), surface.parameter("friction")
    low, high = surface.texture.extremes
    steep = swing * surface.texture.bounds[0] / max(high - low, 1e-300)
    still = 0.5 * (1.0 + swing)
    a = friction * surface.max_depth * (still / surface.parameter("max_deflection") + steep)
    return float(largest_singular_value(np.array([a]), np.array([friction * still]))[0])


def most_g(surface: Surface) -> float:
    """q_G <= max(1, DK)."""
    return max(1.0, _slope_and_bend(surface)[1])
