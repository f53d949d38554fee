"""Certified search for the nearest point of a profile; see ``plane_search``, also for its looks.

In one dimension: φ(X) = (X - x)² + (h(X) - z)², p = φ'/2, Q = φ''/2 = 1 + h'² + (h - z) h''. Over
an interval of half-width r in which |h''| <= K and |h'''| <= T, Q changes by at most L r from its
value at the centre, L = 3 K max|h'| + T max|h - z|.
"""

import numpy as np

from asperity.compiled import EPS, ROOT_EPS, Kernels
from asperity.contacts.sampler import LinePoint as Point
from asperity.contacts.sampler import along

KERNELS = Kernels(
    provides=("descend", "go_down", "judge", "look_cost", "next_part"),
    requires=("along",),
    called=("judge",),
    shared=("go_down",),
)


def look_cost(texture: object) -> float:
    """Return 1: see ``contacts.sampler``; a kind that takes longer provides its own."""
    return 1.0


def descend(x: float, z: float, start: float, texture: object) -> Point:
    """Return a local minimum of φ downhill from a start, to rounding."""
    return go_down(x, z, start, np.inf, texture)[0]


def go_down(x: float, z: float, start: float, left: float, texture: object) -> tuple[Point, float]:
    """Return a local minimum of φ downhill from a start, to rounding, and the looks left.

    If none are left it is the lowest point on the way; one look is always taken.
    """
    best = (start, np.inf, 0.0, 0.0)
    at = start
    step = last = 0.0
    close = False
    cost = look_cost(texture)
    for _ in range(200):
        left -= cost
        h, h1, h2 = along(at, texture)
        gap = h - z
        new = (at - x) * (at - x) + gap * gap
        rounding = 2.0 * EPS * EPS * (at * at + h * h + z * z)
        if new <= best[1] or close:
            best = (at, new, h, h1)
            square = 1.0 + h1 * h1
            q = square + gap * h2
            convex = q > 0.07 * ROOT_EPS * square
            step = -(at - x + gap * h1) / (q if convex else max(abs(q), 0.05 * square))
            size = step * step
            if size <= 0.5 * EPS * new + rounding:
                return (at + step, new, h + h1 * step, h1 + h2 * step), left
            # φ alone resolves half the digits: from here on the steps must shrink instead.
            if close and size >= 0.6 * last:
                break
            close = convex and size <= 1e-6 * new
            last = size
        else:
            step *= 0.5
            if step * step <= 4e-5 * EPS * best[1] + rounding:
                break
        if left <= 0.0:
            break
        at = best[0] + step
    return best, left


def judge(
    x: float, z: float, centre: float, r: float, bend: float, twist: float,
    best: Point, keep: float, left: float, texture: object,
) -> tuple[Point, bool, float]:  # fmt: skip
    """Return the best point after a look at one interval, whether its halves need one, looks left.

    The interval is centre ± r [m], with K = bend [1/m] and T = twist [1/m²].
    """
    left -= look_cost(texture)
    h, h1, h2 = along(centre, texture)
    gap = h - z
    away = centre - x
    p = away + gap * h1
    q = 1.0 + h1 * h1 + gap * h2
    bend = min(bend, abs(h2) + twist * r)
    steep = abs(h1) + bend * r
    change = (3.0 * steep * bend + (abs(gap) + steep * r) * twist) * r
    # Nowhere convex: no minimum. Or too far. The factors leave room for rounding.
    bound = away * away + gap * gap - 2.0 * abs(p) * r + (min(q, 0.0) - change / 3.0) * r * r
    if q + change < -1e-6 * (1.0 + abs(q)) or bound >= best[1] * keep:
        return best, False, left
    # The slope of φ at the centre is too great to vanish in the interval.
    if abs(p) > (abs(q) * (1.0 + 1e-6) + 0.5 * change + 1e-6) * r:
        return best, False, left
    if q <= change:
        return best, True, left
    start = best[0] if abs(best[0] - centre) <= r else centre - p / q
    found, left = go_down(x, z, start, left, texture)
    # Convex throughout the interval: a minimum in it is the only one.
    wide = abs(found[0] - centre) > r * (1.0 + 0.07 * ROOT_EPS)
    return (found if found[1] < best[1] else best), wide, left


def next_part(level: int, side: float, i: int, top: int, u: float) -> tuple[int, float, int]:
    """Return the interval after interval i of a level and all its parts; above top at the end.

    Those of a level are equally long, twice as long as those of the level below. Of two halves
    the one nearer to u comes first.
    """
    while level < top:
        half = i >> 1
        near = 1 if u >= (2 * half + 1) * side else 0
        if (i & 1) == near:
            return level, side, 2 * half + 1 - near
        level += 1
        side *= 2.0
        i = half
    return top + 1, side, i
