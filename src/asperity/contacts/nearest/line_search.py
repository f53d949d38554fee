"""Certified search for the nearest point of a profile; see ``plane_search``.

In one dimension: φ(X) = (X - x)² + (h(X) - z)², p = φ'/2, Q = φ''/2 = 1 + h'² + (h - z) h''. Over
an interval of half-width r in which |h''| <= K and |h'''| <= T, Q changes by at most L r from its
value at the centre, L = 3 K max|h'| + T max|h - z|.
"""

import numpy as np

from asperity.compiled import Kernels
from asperity.contacts.sampler import along

KERNELS = Kernels(
    provides=("descend", "judge", "next_part"),
    requires=("along",),
    called=("descend", "judge"),
)

# A point of the profile: X, φ, h, h'.
Point = tuple[float, float, float, float]


def descend(x: float, z: float, start: float, texture: object) -> Point:
    """Return a local minimum of φ downhill from a start, to rounding."""
    best = (start, np.inf, 0.0, 0.0)
    at = start
    step = last = 0.0
    close = False
    for _ in range(200):
        h, h1, h2 = along(at, texture)
        gap = h - z
        new = (at - x) * (at - x) + gap * gap
        rounding = 1e-31 * (at * at + h * h + z * z)
        if new <= best[1] or close:
            best = (at, new, h, h1)
            square = 1.0 + h1 * h1
            q = square + gap * h2
            convex = q > 1e-9 * square
            step = -(at - x + gap * h1) / (q if convex else max(abs(q), 0.05 * square))
            size = step * step
            if size <= 1e-16 * new + rounding:
                return at + step, new, h + h1 * step, h1 + h2 * step
            # φ alone resolves half the digits: from here on the steps must shrink instead.
            if close and size >= 0.6 * last:
                break
            close = convex and size <= 1e-6 * new
            last = size
        else:
            step *= 0.5
            if step * step <= 1e-20 * best[1] + rounding:
                break
        at = best[0] + step
    return best


def judge(
    x: float, z: float, centre: float, r: float, bend: float, twist: float,
    best: Point, texture: object,
) -> tuple[Point, bool]:  # fmt: skip
    """Return the best point after a look at one interval, and whether its halves need a look."""
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
    if q + change < -1e-6 * (1.0 + abs(q)) or bound >= best[1] * (1.0 - 1e-13):
        return best, False
    # The slope of φ at the centre is too great to vanish in the interval.
    if abs(p) > (abs(q) * (1.0 + 1e-6) + 0.5 * change + 1e-6) * r:
        return best, False
    if q <= change:
        return best, True
    start = best[0] if abs(best[0] - centre) <= r else centre - p / q
    found = descend(x, z, start, texture)
    # Convex throughout the interval: a minimum in it is the only one.
    wide = abs(found[0] - centre) > r * (1.0 + 1e-9)
    if found[1] < best[1]:
        return found, wide
    return best, wide


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
