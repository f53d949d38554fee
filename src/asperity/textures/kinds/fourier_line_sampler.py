"""Closest point of a sum of parallel waves: a search along their direction.

It replaces ``closest_point`` of ``fourier_sampler`` and takes the same record.
"""

import math

import numpy as np

from asperity.contacts.closest.line_search import (
    descend,
    evaluate_box,
    next_interval,
    search_line_within_budget,
)
from asperity.contacts.sampler_interface import PRUNED_BOX_COST, ROUNDING_SLACK, ClosestPoint
from asperity.contacts.sampler_interface import LinePoint as Point
from asperity.core.compiled import EPS, EVERY_FUNCTION, Kernels
from asperity.textures.kinds.fourier_sampler import FourierArguments

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("closest_point", "search_line"))


def sample_profile(t: float, texture: FourierArguments) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m] at the distance t along the direction [m]."""
    h = h1 = h2 = 0.0
    for i in range(texture.amplitudes.size):
        k = texture.kx[i] * texture.ux + texture.ky[i] * texture.uy
        angle = k * t + texture.phases[i]
        s = texture.amplitudes[i] * math.sin(angle)
        h += s
        h1 += k * texture.amplitudes[i] * math.cos(angle)
        h2 -= k * k * s
    return h, h1, h2


def closest_point(x: float, y: float, z: float, texture: FourierArguments) -> ClosestPoint:
    """Return X, Y of the globally closest surface point, and h, h_x, h_y there.

    Descend from the probe, then search everything that may be closer.
    """
    t = x * texture.ux + y * texture.uy
    best = descend(t, z, t, texture)
    best, _budget = search_line(t, z, best, 1.0 - ROUNDING_SLACK * EPS, np.inf, texture)
    return on_plane(x, y, t, best, texture)


def closest_point_within_budget(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float,
    texture: FourierArguments,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return the closest point found within a budget; see ``contacts.sampler_interface``."""
    t = x * texture.ux + y * texture.uy
    start = start_x * texture.ux + start_y * texture.uy
    best, gap, evaluations = search_line_within_budget(t, z, start, budget, texture)
    x, y, h, hx, hy = on_plane(x, y, t, best, texture)
    return x, y, h, hx, hy, gap, evaluations


def on_plane(x: float, y: float, t: float, best: Point, texture: FourierArguments) -> ClosestPoint:
    """Return X, Y, h, h_x, h_y of a point on the line through the probe, which is at t."""
    x += (best[0] - t) * texture.ux
    y += (best[0] - t) * texture.uy
    return x, y, best[2], best[3] * texture.ux, best[3] * texture.uy


def search_line(
    t: float, z: float, best: Point, pruning_factor: float, budget: float, texture: FourierArguments
) -> tuple[Point, float]:
    """Return the best point after a search of all that may be closer, and the remaining budget.

    A closer point lies in an interval around the probe, whose half-width follows from the distance
    of the best point and the extremes of the height. The interval is divided into halves.
    """
    gap = max(texture.min_height - z, z - texture.max_height, 0.0)
    reach = math.sqrt(max(best[1] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - t) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = 0
    side = 1.0
    while level <= 0 and budget > 0.0:
        budget -= PRUNED_BOX_COST
        half = reach * side
        centre = (2 * i + 1) * half - reach
        near = max(abs(centre) - half, 0.0)
        deeper = near * near + gap * gap < best[1] * pruning_factor
        # Taylor's formula cannot decide an interval of several waves.
        if deeper and half * texture.wave_number < 1.5:
            best, deeper, budget = evaluate_box(
                t, z, t + centre, half, texture.hessian_bound, texture.third_derivative_bound,
                best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -48
        level, side, i = next_interval(deeper, level, side, i, 0, u)
    return best, budget
