"""Descents and lower bounds of the squared distance of a surface from the probe.

Let φ(X, Y) = |(X, Y) - (x, y)|² + (h(X, Y) - z)² be the squared distance from the probe, with
p = ∇φ/2 and Q = Hess φ/2 = I + ∇h ∇hᵀ + (h - z) Hess h. A global minimum is a point with p = 0 and
no negative eigenvalue of Q. Over a box of half-diagonal r in which ‖Hess h‖ <= K and ‖D³h‖ <= T,
Q differs from its value at the centre by at most L r, L = 3 K max|∇h| + T max|h - z|: Taylor's
formula at the centre decides most boxes.
"""

import math

import numpy as np

from asperity.contacts.sampler_interface import Derivatives, Point, evaluation_cost, sample_hessian
from asperity.core.compiled import EPS, EVERY_FUNCTION, SQRT_EPS, Kernels

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("descend_within_budget",), iterates=True)


def descend(x: float, y: float, z: float, start_x: float, start_y: float, texture: object) -> Point:
    """Return a local minimum of φ downhill from a start, to rounding."""
    return descend_within_budget(x, y, z, start_x, start_y, np.inf, texture)[0]


def descend_within_budget(
    x: float, y: float, z: float, fx: float, fy: float, evaluations_left: float, texture: object
) -> tuple[Point, float]:
    """Return a local minimum of φ downhill from a start, to rounding, and the evaluations left.

    If none are left it is the lowest point so far; the surface is evaluated at least once.
    """
    best = (fx, fy, np.inf, 0.0, 0.0, 0.0)
    sx = sy = last = 0.0
    close = False
    cost = evaluation_cost(texture)
    for _ in range(200):
        evaluations_left -= cost
        h, hx, hy, hxx, hxy, hyy = sample_hessian(fx, fy, texture)
        gap = h - z
        dx = fx - x
        dy = fy - y
        new = dx * dx + dy * dy + gap * gap
        rounding = 2.0 * EPS * EPS * (fx * fx + fy * fy + h * h + z * z)
        if new <= best[2] or close:
            best = (fx, fy, new, h, hx, hy)
            sx, sy, convex = newton_step(
                dx + gap * hx,
                dy + gap * hy,
                1.0 + hx * hx + gap * hxx,
                hx * hy + gap * hxy,
                1.0 + hy * hy + gap * hyy,
            )
            size = sx * sx + sy * sy
            if size <= 0.5 * EPS * new + rounding:
                h += hx * sx + hy * sy
                hx += hxx * sx + hxy * sy
                hy += hxy * sx + hyy * sy
                return (fx + sx, fy + sy, new, h, hx, hy), evaluations_left
            # φ resolves only half the digits: from here on the steps must shrink instead.
            if close and size >= 0.6 * last:
                break
            close = convex and size <= 1e-6 * new
            last = size
        else:
            sx *= 0.5
            sy *= 0.5
            if sx * sx + sy * sy <= 4e-5 * EPS * best[2] + rounding:
                break
        if evaluations_left <= 0.0:
            break
        fx = best[0] + sx
        fy = best[1] + sy
    return best, evaluations_left


def newton_step(
    px: float, py: float, qxx: float, qxy: float, qyy: float
) -> tuple[float, float, bool]:
    """Return a descent step of φ, Newton's where φ is convex, and whether φ is convex."""
    low, high = symmetric_eigenvalues(qxx, qxy, qyy)
    convex = low > 0.07 * SQRT_EPS * high
    if not convex:
        # Shifted so that the step in the steepest direction keeps its size and none is flat.
        shift = max(abs(low), 0.05 * abs(high), 0.07 * SQRT_EPS) - low
        qxx += shift
        qyy += shift
    det = qxx * qyy - qxy * qxy
    return (qxy * py - qyy * px) / det, (qxy * px - qxx * py) / det, convex


def symmetric_eigenvalues(qxx: float, qxy: float, qyy: float) -> tuple[float, float]:
    """Return the smaller and the larger eigenvalue of a symmetric matrix."""
    mean = 0.5 * (qxx + qyy)
    half = 0.5 * (qxx - qyy)
    spread = math.sqrt(half * half + qxy * qxy)
    return mean - spread, mean + spread


def can_prune(
    offset: tuple[float, float, float],
    hx: float,
    hy: float,
    q: tuple[float, float, float],
    smallest_eigenvalue: float,
    hessian_change: float,
    tangent_error: float,
    a: float,
    b: float,
    threshold: float,
) -> bool:
    """Return whether no point of a box with half-widths a, b is a minimum with φ < threshold.

    Decided from values at the centre of the box; the small numbers leave room for rounding.
    """
    dx, dy, gap = offset
    qxx, qxy, qyy = q
    px = dx + gap * hx
    py = dy + gap * hy
    r = math.sqrt(a * a + b * b)
    margin = 1e-6 * (abs(qxx) + abs(qyy))
    # Nowhere convex, so without a minimum; or too far by Taylor's formula.
    if smallest_eigenvalue + hessian_change < -margin:
        return True
    rest = hessian_change / 3.0
    bound = dx * dx + dy * dy + gap * gap
    bound += min_quadratic(px, py, qxx - rest, qxy, qyy - rest, a, b)
    if bound - 16.0 * EPS * (abs(px) * a + abs(py) * b + 1e6 * margin * r * r) >= threshold:
        return True
    # φ is too steep at the centre to be stationary in the box; or too far by the tangent plane.
    fall = math.sqrt(px * px + py * py)
    turn = abs(qxx * px + qxy * py) * a + abs(qxy * px + qyy * py) * b
    if fall * (fall - (0.5 * hessian_change + margin) * r) > turn:
        return True
    clear = distance_lower_bound(offset, hx, hy, r, tangent_error)
    return clear * clear >= threshold


def taylor_remainders(
    r: float, gap: float, slope: float, hessian_norm: float, k: float, t: float
) -> tuple[float, float]:
    """Return how far Q can be from its value at r = 0, and h from its tangent plane [m].

    From h - z, |∇h| and ‖Hess h‖ at r = 0 and the bounds K and T everywhere.
    """
    k = min(k, hessian_norm + t * r)
    slope += k * r
    change = (3.0 * slope * k + (abs(gap) + slope * r) * t) * r
    return change, (0.5 * hessian_norm + t * r / 6.0) * r * r


def min_quadratic(
    px: float, py: float, qxx: float, qxy: float, qyy: float, a: float, b: float
) -> float:
    """Return the minimum of 2 p · d + d · Q d over |d_x| <= a, |d_y| <= b.

    It is on the border, or where the gradient is zero.
    """
    det = qxx * qyy - qxy * qxy
    if det > 0.0 and qxx > 0.0:
        sx = qxy * py - qyy * px
        sy = qxy * px - qxx * py
        if abs(sx) <= a * det and abs(sy) <= b * det:
            return (px * sx + py * sy) / det
    return min(
        (qxx * a - 2.0 * px) * a + min_parabola(py - qxy * a, qyy, b),
        (qxx * a + 2.0 * px) * a + min_parabola(py + qxy * a, qyy, b),
        (qyy * b - 2.0 * py) * b + min_parabola(px - qxy * b, qxx, a),
        (qyy * b + 2.0 * py) * b + min_parabola(px + qxy * b, qxx, a),
    )


def min_parabola(p: float, q: float, a: float) -> float:
    """Return the minimum of 2 p s + q s² over |s| <= a."""
    p = abs(p)
    return -p * p / q if q * a > p else (q * a - 2.0 * p) * a


def distance_lower_bound(
    offset: tuple[float, float, float], hx: float, hy: float, r: float, tangent_error: float
) -> float:
    """Return a lower bound of √φ: the distance of a piece of the tangent plane, less its error.

    The centre of the piece is at the offset from the probe, its lateral half-width at most r.
    """
    dx, dy, gap = offset
    square = 1.0 + hx * hx + hy * hy
    normal = gap - hx * dx - hy * dy
    straight = normal * normal / square
    aside = math.sqrt(max(dx * dx + dy * dy + gap * gap - straight, 0.0)) - r * math.sqrt(square)
    aside = max(aside, 0.0)
    return max(math.sqrt(straight + aside * aside) - tangent_error, 0.0)


def supporting_bound(
    offset: tuple[float, float, float], derivatives: Derivatives, t: float, a: float, b: float
) -> float:
    """Return a lower bound of φ in a box with half-widths a, b from the derivatives at its centre.

    For every g, (h - z)² >= 2 g (h - z) - g². With this, φ is bounded without products of slopes
    and curvatures, which makes the bound sharp on steep surfaces. Here g is the height above the
    probe of the point of the tangent plane that is closest to it.
    """
    dx, dy, gap = offset
    _h, hx, hy, hxx, hxy, hyy = derivatives
    g = (gap - hx * dx - hy * dy) / (1.0 + hx * hx + hy * hy)
    px = dx + g * hx
    py = dy + g * hy
    r = math.sqrt(a * a + b * b)
    rest = abs(g) * t * r / 3.0
    xx = g * hxx
    yy = g * hyy
    least = min_quadratic(px, py, 1.0 + xx - rest, g * hxy, 1.0 + yy - rest, a, b)
    size = dx * dx + dy * dy + abs(g) * (abs(g) + 2.0 * abs(gap))
    size += abs(px) * a + abs(py) * b + (1.0 + abs(xx) + abs(yy)) * r * r
    return dx * dx + dy * dy + g * (2.0 * gap - g) + least - 16.0 * EPS * size


def min_increase(start: float, least: float, rate: float, r: float) -> float:
    """Return a lower bound of the increase over a length r of a function with zero initial slope.

    Its second derivative starts at ``start``, decreases at most at ``rate`` and is never below
    ``least``.
    """
    t = min(max((start - least) / max(rate, 1e-300), 0.0), r)
    rest = r - t
    return t * (start * (r - 0.5 * t) - rate * t * (0.5 * r - t / 3.0)) + 0.5 * least * rest * rest
