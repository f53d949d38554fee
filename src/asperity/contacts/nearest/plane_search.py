"""Certified search for the nearest surface point, shared by the samplers of maps and waves.

Let φ(X, Y) = |(X, Y) - (x, y)|² + (h(X, Y) - z)² be the squared distance from the probe, with
p = ∇φ/2 and Q = Hess φ/2 = I + ∇h ∇hᵀ + (h - z) Hess h. A global minimum is a point with p = 0 and
no negative eigenvalue of Q. Over a box of half-diagonal r in which ‖Hess h‖ <= K and ‖D³h‖ <= T,
Q differs from its value at the centre by at most L r, L = 3 K max|∇h| + T max|h - z|: Taylor's
formula at the centre decides most boxes at once.

Boxes are quartered without a stack: the next one follows from the numbers of the last.

A search counts its looks: a look is one evaluation of the surface, of a sum of many waves several
(``look_cost``), or eight boxes of the pyramid that are passed. It drops boxes in which φ is nowhere
less than ``keep`` times the best, 1 less rounding for the nearest point itself, and ends early once
``left``, the looks that are left, is used up.
"""

import math

import numpy as np

from asperity.compiled import EPS, ROOT_EPS, Kernels
from asperity.contacts.sampler import PlanePoint as Point
from asperity.contacts.sampler import curvature

KERNELS = Kernels(
    provides=("descend", "eigenvalues", "go_down", "judge", "look_cost", "next_box"),
    requires=("curvature",),
    called=("judge", "newton_step"),
    shared=("go_down",),
)


def look_cost(texture: object) -> float:
    """Return 1: see ``contacts.sampler``; a kind that takes longer provides its own."""
    return 1.0


def eigenvalues(qxx: float, qxy: float, qyy: float) -> tuple[float, float]:
    """Return the smaller and the larger eigenvalue of a symmetric matrix."""
    mean = 0.5 * (qxx + qyy)
    half = 0.5 * (qxx - qyy)
    spread = math.sqrt(half * half + qxy * qxy)
    return mean - spread, mean + spread


def newton_step(
    px: float, py: float, qxx: float, qxy: float, qyy: float
) -> tuple[float, float, bool]:
    """Return a step down φ, Newton's where φ is convex, and whether it is."""
    low, high = eigenvalues(qxx, qxy, qyy)
    convex = low > 0.07 * ROOT_EPS * high
    if not convex:
        # Raised so far that the steepest fall keeps its size, and nothing is flat.
        shift = max(abs(low), 0.05 * abs(high), 0.07 * ROOT_EPS) - low
        qxx += shift
        qyy += shift
    det = qxx * qyy - qxy * qxy
    return (qxy * py - qyy * px) / det, (qxy * px - qxx * py) / det, convex


def descend(x: float, y: float, z: float, fx: float, fy: float, texture: object) -> Point:
    """Return a local minimum of φ downhill from a start, to rounding."""
    return go_down(x, y, z, fx, fy, np.inf, texture)[0]


def go_down(
    x: float, y: float, z: float, fx: float, fy: float, left: float, texture: object
) -> tuple[Point, float]:
    """Return a local minimum of φ downhill from a start, to rounding, and the looks left.

    If none are left it is the lowest point on the way; one look is always taken.
    """
    best = (fx, fy, np.inf, 0.0, 0.0, 0.0)
    sx = sy = last = 0.0
    close = False
    cost = look_cost(texture)
    for _ in range(200):
        left -= cost
        h, hx, hy, hxx, hxy, hyy = curvature(fx, fy, texture)
        gap = h - z
        dx = fx - x
        dy = fy - y
        new = dx * dx + dy * dy + gap * gap
        rounding = 2.0 * EPS * EPS * (fx * fx + fy * fy + h * h + z * z)
        if new <= best[2] or close:
            best = (fx, fy, new, h, hx, hy)
            sx, sy, convex = newton_step(
                dx + gap * hx, dy + gap * hy,
                1.0 + hx * hx + gap * hxx, hx * hy + gap * hxy, 1.0 + hy * hy + gap * hyy,
            )  # fmt: skip
            size = sx * sx + sy * sy
            if size <= 0.5 * EPS * new + rounding:
                h += hx * sx + hy * sy
                hx += hxx * sx + hxy * sy
                hy += hxy * sx + hyy * sy
                return (fx + sx, fy + sy, new, h, hx, hy), left
            # φ alone resolves half the digits: from here on the steps must shrink instead.
            if close and size >= 0.6 * last:
                break
            close = convex and size <= 1e-6 * new
            last = size
        else:
            sx *= 0.5
            sy *= 0.5
            if sx * sx + sy * sy <= 4e-5 * EPS * best[2] + rounding:
                break
        if left <= 0.0:
            break
        fx = best[0] + sx
        fy = best[1] + sy
    return best, left


def remainders(
    r: float, gap: float, steep: float, bent: float, bend: float, twist: float
) -> tuple[float, float]:
    """Return how far Q can be from its value at r = 0, and h from its tangent plane [m].

    From h - z, |∇h| and ‖Hess h‖ there and K and T all over.
    """
    bend = min(bend, bent + twist * r)
    steep += bend * r
    change = (3.0 * steep * bend + (abs(gap) + steep * r) * twist) * r
    return change, (0.5 * bent + twist * r / 6.0) * r * r


def clearance(
    away: tuple[float, float, float], hx: float, hy: float, r: float, lift: float
) -> float:
    """Return a lower bound of √φ: the distance of a piece of the tangent plane, less the lift.

    The middle of the piece is away from the probe, its half-width at most r seen from above.
    """
    dx, dy, gap = away
    square = 1.0 + hx * hx + hy * hy
    normal = gap - hx * dx - hy * dy
    straight = normal * normal / square
    aside = math.sqrt(max(dx * dx + dy * dy + gap * gap - straight, 0.0)) - r * math.sqrt(square)
    aside = max(aside, 0.0)
    return max(math.sqrt(straight + aside * aside) - lift, 0.0)


def hopeless(
    away: tuple[float, float, float], hx: float, hy: float, q: tuple[float, float, float],
    low: float, change: float, lift: float, a: float, b: float, enough: float,
) -> bool:  # fmt: skip
    """Return whether no point of a box with half-widths a, b is a minimum with φ < enough.

    From what is known at its centre; the small numbers leave room for rounding.
    """
    dx, dy, gap = away
    qxx, qxy, qyy = q
    px = dx + gap * hx
    py = dy + gap * hy
    r = math.sqrt(a * a + b * b)
    margin = 1e-6 * (abs(qxx) + abs(qyy))
    # Nowhere convex, so without a minimum; or too far by Taylor's formula.
    bound = dx * dx + dy * dy + gap * gap - 2.0 * (abs(px) * a + abs(py) * b)
    if low + change < -margin or bound + (min(low, 0.0) - change / 3.0) * r * r >= enough:
        return True
    # Too steep at the centre to become level in the box; or too far by the tangent plane.
    fall = math.sqrt(px * px + py * py)
    turn = abs(qxx * px + qxy * py) * a + abs(qxy * px + qyy * py) * b
    if fall * (fall - (0.5 * change + margin) * r) > turn:
        return True
    clear = clearance(away, hx, hy, r, lift)
    return clear * clear >= enough


def judge(
    x: float, y: float, z: float, cx: float, cy: float, a: float, b: float,
    bend: float, twist: float, best: Point, keep: float, left: float, texture: object,
) -> tuple[Point, bool, float]:  # fmt: skip
    """Return the best point after a look at one box, whether its parts need one, and looks left.

    The box is (cx, cy) ± (a, b) [m], with K = bend [1/m] and T = twist [1/m²].
    """
    left -= look_cost(texture)
    h, hx, hy, hxx, hxy, hyy = curvature(cx, cy, texture)
    gap = h - z
    away = (cx - x, cy - y, gap)
    q = (1.0 + hx * hx + gap * hxx, hx * hy + gap * hxy, 1.0 + hy * hy + gap * hyy)
    low, _high = eigenvalues(q[0], q[1], q[2])
    r = math.sqrt(a * a + b * b)
    bent = math.sqrt(hxx * hxx + 2.0 * hxy * hxy + hyy * hyy)
    change, lift = remainders(r, gap, math.sqrt(hx * hx + hy * hy), bent, bend, twist)
    if hopeless(away, hx, hy, q, low, change, lift, a, b, best[2] * keep):
        return best, False, left
    if low <= change:
        return best, True, left
    det = q[0] * q[2] - q[1] * q[1]
    sx = (q[1] * (away[1] + gap * hy) - q[2] * (away[0] + gap * hx)) / det
    sy = (q[1] * (away[0] + gap * hx) - q[0] * (away[1] + gap * hy)) / det
    # Convex in the box: the only minimum is where Newton's method leads, or not in the box.
    error = 1e-6 * r + 0.5 * change * r / low
    # Nor is it dropped where it is on the border itself, as on the mirror lines of a finite map.
    if abs(sx) > a + error or abs(sy) > b + error:
        return best, False, left
    known = abs(best[0] - cx) <= a and abs(best[1] - cy) <= b
    start_x = best[0] if known else cx + sx
    start_y = best[1] if known else cy + sy
    found, left = go_down(x, y, z, start_x, start_y, left, texture)
    wide = 1.0 + 0.07 * ROOT_EPS
    outside = abs(found[0] - cx) > a * wide or abs(found[1] - cy) > b * wide
    return (found if found[2] < best[2] else best), outside, left


def next_box(
    level: int, side: float, i: int, j: int, top: int, u: float, v: float
) -> tuple[int, float, int, int]:
    """Return the box after box (i, j) of a level and all its parts; a level above top at the end.

    Boxes of a level have equal sides, twice as long as those of the level below. Of the four
    parts of a box the one nearest to (u, v) comes first.
    """
    while level < top:
        half_i = i >> 1
        half_j = j >> 1
        near_i = 1 if v >= (2 * half_i + 1) * side else 0
        near_j = 1 if u >= (2 * half_j + 1) * side else 0
        k = 2 * ((i & 1) ^ near_i) + ((j & 1) ^ near_j)
        if k < 3:
            k += 1
            return level, side, 2 * half_i + ((k >> 1) ^ near_i), 2 * half_j + ((k & 1) ^ near_j)
        level += 1
        side *= 2.0
        i = half_i
        j = half_j
    return top + 1, side, i, j
