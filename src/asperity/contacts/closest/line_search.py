"""Certified search for the closest point of a profile; see ``plane_search``.

In one dimension: φ(X) = (X - x)² + (h(X) - z)², p = φ'/2, Q = φ''/2 = 1 + h'² + (h - z) h''. Over
an interval of half-width r in which |h''| <= K and |h'''| <= T, Q changes by at most L r from its
value at the centre, L = 3 K max|h'| + T max|h - z|.
"""

import math

import numpy as np

from asperity.contacts.sampler_interface import ROUNDING_SLACK, sample_profile, search_line
from asperity.contacts.sampler_interface import LinePoint as Point
from asperity.core.compiled import EPS, EVERY_FUNCTION, SQRT_EPS, Kernels

KERNELS = Kernels(
    provides=EVERY_FUNCTION, shared=("descend_within_budget", "search_line_within_budget")
)


def evaluation_cost(texture: object) -> float:
    """Return 1; a texture kind that takes longer provides its own cost."""
    return 1.0


def descend(x: float, z: float, start: float, texture: object) -> Point:
    """Return a local minimum of φ downhill from a start, to rounding."""
    return descend_within_budget(x, z, start, np.inf, texture)[0]


def descend_within_budget(
    x: float, z: float, start: float, evaluations_left: float, texture: object
) -> tuple[Point, float]:
    """Return a local minimum of φ downhill from a start, to rounding, and the evaluations left.

    If none are left it is the lowest point so far; the surface is evaluated at least once.
    """
    best = (start, np.inf, 0.0, 0.0)
    at = start
    step = last = 0.0
    close = False
    cost = evaluation_cost(texture)
    for _ in range(200):
        evaluations_left -= cost
        h, h1, h2 = sample_profile(at, texture)
        gap = h - z
        new = (at - x) * (at - x) + gap * gap
        rounding = 2.0 * EPS * EPS * (at * at + h * h + z * z)
        if new <= best[1] or close:
            best = (at, new, h, h1)
            square = 1.0 + h1 * h1
            q = square + gap * h2
            convex = q > 0.07 * SQRT_EPS * square
            step = -(at - x + gap * h1) / (q if convex else max(abs(q), 0.05 * square))
            size = step * step
            if size <= 0.5 * EPS * new + rounding:
                return (at + step, new, h + h1 * step, h1 + h2 * step), evaluations_left
            # φ resolves only half the digits: from here on the steps must shrink instead.
            if close and size >= 0.6 * last:
                break
            close = convex and size <= 1e-6 * new
            last = size
        else:
            step *= 0.5
            if step * step <= 4e-5 * EPS * best[1] + rounding:
                break
        if evaluations_left <= 0.0:
            break
        at = best[0] + step
    return best, evaluations_left


def evaluate_box(
    x: float,
    z: float,
    centre: float,
    r: float,
    k: float,
    t: float,
    best: Point,
    pruning_factor: float,
    evaluations_left: float,
    texture: object,
) -> tuple[Point, bool, float]:
    """Evaluate one interval: return the best point, whether to halve it, and evaluations left.

    The interval is centre ± r [m], with bounds K [1/m] and T [1/m²].
    """
    evaluations_left -= evaluation_cost(texture)
    h, h1, h2 = sample_profile(centre, texture)
    gap = h - z
    offset = centre - x
    p = offset + gap * h1
    q = 1.0 + h1 * h1 + gap * h2
    k = min(k, abs(h2) + t * r)
    slope = abs(h1) + k * r
    change = (3.0 * slope * k + (abs(gap) + slope * r) * t) * r
    # Nowhere convex, so without a minimum; or too far. The factors leave room for rounding.
    bound = offset * offset + gap * gap - 2.0 * abs(p) * r + (min(q, 0.0) - change / 3.0) * r * r
    if q + change < -1e-6 * (1.0 + abs(q)) or bound >= best[1] * pruning_factor:
        return best, False, evaluations_left
    # φ is too steep at the centre to be stationary in the interval.
    if abs(p) > (abs(q) * (1.0 + 1e-6) + 0.5 * change + 1e-6) * r:
        return best, False, evaluations_left
    if q <= change:
        return best, True, evaluations_left
    start = best[0] if abs(best[0] - centre) <= r else centre - p / q
    found, evaluations_left = descend_within_budget(x, z, start, evaluations_left, texture)
    # Convex throughout the interval: a minimum in it is the only one.
    outside = abs(found[0] - centre) > r * (1.0 + 0.07 * SQRT_EPS)
    return (found if found[1] < best[1] else best), outside, evaluations_left


def next_interval(
    deeper: bool, level: int, side: float, i: int, top: int, u: float
) -> tuple[int, float, int]:
    """Return the interval to visit after interval i of a level; a level above top at the end.

    That is its first half if ``deeper``, else the interval after it and its parts. Intervals of a
    level are twice as long as those of the level below. Of two halves the one closer to u comes
    first.
    """
    if deeper:
        side *= 0.5
        return level - 1, side, 2 * i + (1 if u >= (2 * i + 1) * side else 0)
    while level < top:
        half = i >> 1
        near = 1 if u >= (2 * half + 1) * side else 0
        if (i & 1) == near:
            return level, side, 2 * half + 1 - near
        level += 1
        side *= 2.0
        i = half
    return top + 1, side, i


def search_line_within_budget(
    x: float, z: float, start: float, budget: float, texture: object
) -> tuple[Point, float, float]:
    """Return the closest point found, its error bound [m] and the evaluations used.

    See ``plane_budget``.
    """
    best, left = descend_within_budget(x, z, start, 0.75 * budget, texture)
    best, left = search_line(x, z, best, 1.0 - ROUNDING_SLACK * EPS, left, texture)
    share = 0.0 if left > 0.0 else 1.0
    left += 0.25 * budget
    # At most as many passes as there are digits; none after a complete search.
    while left > 0.0 and share > 4.0 * EPS:
        factor = 1.0 - 0.25 * share
        best, left = search_line(x, z, best, factor * factor, left, texture)
        if left > 0.0:
            share *= 0.25
    return best, share * math.sqrt(best[1]), budget - left
