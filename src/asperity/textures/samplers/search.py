"""Branch and bound for the nearest surface point, shared by the samplers that need it.

``curvature`` is the sampler's own; the fused module binds it. φ(X, Y) = |(X, Y) - (x, y)|² +
(h(X, Y) - z)² is the squared distance from the probe.
"""

import math
from typing import Any

import numpy as np


def curvature(x: float, y: float, *texture: Any) -> tuple[float, ...]:
    """Stand in for the sampler's own function, which replaces this one."""
    raise AssertionError


# fused from here


def newton_step(
    dx: float, dy: float, gap: float, hx: float, hy: float, hxx: float, hxy: float, hyy: float
) -> tuple[float, float, bool]:
    """Return the Newton step of φ/2 and whether φ is convex here."""
    px = dx + gap * hx
    py = dy + gap * hy
    qxx = 1.0 + hx * hx + gap * hxx
    qxy = hx * hy + gap * hxy
    qyy = 1.0 + hy * hy + gap * hyy
    det = qxx * qyy - qxy * qxy
    if det <= 0.0 or qxx + qyy <= 0.0:
        return -px, -py, False
    return (qxy * py - qyy * px) / det, (qxy * px - qxx * py) / det, True


def descend(
    x: float, y: float, z: float, start_x: float, start_y: float, texture: Any
) -> tuple[float, float, float]:
    """Return a local minimum of φ near the start, to rounding, and φ there."""
    fx = start_x
    fy = start_y
    h, hx, hy, hxx, hxy, hyy = curvature(fx, fy, *texture)
    gap = h - z
    value = (fx - x) * (fx - x) + (fy - y) * (fy - y) + gap * gap
    # Downhill, with halved steps while φ does not fall.
    for _ in range(60):
        sx, sy, _convex = newton_step(fx - x, fy - y, gap, hx, hy, hxx, hxy, hyy)
        scale = 1.0
        fell = False
        for _halving in range(30):
            tx = fx + scale * sx
            ty = fy + scale * sy
            h, hx, hy, hxx, hxy, hyy = curvature(tx, ty, *texture)
            new_gap = h - z
            new = (tx - x) * (tx - x) + (ty - y) * (ty - y) + new_gap * new_gap
            if new < value:
                fell = True
                break
            scale *= 0.5
            if scale * (abs(sx) + abs(sy)) < 1e-9 * math.sqrt(value):
                break
        if not fell:
            break
        drop = value - new
        fx = tx
        fy = ty
        gap = new_gap
        value = new
        if drop <= 1e-15 * value:
            break
    return polish(x, y, z, fx, fy, value, texture)


def polish(
    x: float, y: float, z: float, fx: float, fy: float, value: float, texture: Any
) -> tuple[float, float, float]:
    """Return the minimum after Newton steps that shrink: φ alone resolves half the digits."""
    last = np.inf
    for _ in range(12):
        h, hx, hy, hxx, hxy, hyy = curvature(fx, fy, *texture)
        gap = h - z
        sx, sy, convex = newton_step(fx - x, fy - y, gap, hx, hy, hxx, hxy, hyy)
        size = sx * sx + sy * sy
        if not convex or size >= 0.25 * last or size > 1e-8 * value:
            break
        fx += sx
        fy += sy
        last = size
    h = curvature(fx, fy, *texture)[0]
    return fx, fy, (fx - x) * (fx - x) + (fy - y) * (fy - y) + (h - z) * (h - z)


def box_bound(
    t1: float, t2: float, half1: float, half2: float, gap: float, p1: float, p2: float,
    slope_bound: float, curvature_bound: float,
) -> float:  # fmt: skip
    """Return a lower bound of φ over a box, from values at its centre.

    Two bounds: the distance to the box with the least height gap that the slope bound allows,
    and the tangent plane less half the curvature bound, -∇²φ <= 2(|h - z| K - 1).
    """
    near1 = max(abs(t1) - half1, 0.0)
    near2 = max(abs(t2) - half2, 0.0)
    radius = math.sqrt(half1 * half1 + half2 * half2)
    gap_low = max(abs(gap) - slope_bound * radius, 0.0)
    first = near1 * near1 + near2 * near2 + gap_low * gap_low
    gap_high = abs(gap) + slope_bound * radius
    concavity = max(gap_high * curvature_bound - 1.0, 0.0)
    value = t1 * t1 + t2 * t2 + gap * gap
    second = value - 2.0 * (abs(p1) * half1 + abs(p2) * half2) - concavity * radius * radius
    return max(first, second)


def search_box(
    x: float, y: float, z: float, box: tuple[float, float, float, float],
    frame: tuple[float, float, float, float, float],
    best_x: float, best_y: float, best: float, texture: Any,
) -> tuple[float, float, float]:  # fmt: skip
    """Return the nearest point in a box if it is nearer than the best so far.

    Args:
        x: probe.
        y: probe.
        z: probe [m].
        box: centre relative to the probe and half-widths along the axes of the frame [m].
        frame: cosine and sine of the first axis, slope bound, curvature bound [1/m] in the box,
            and the half-width at which a box is handed to Newton's method [m].
        best_x: best point so far.
        best_y: best point so far.
        best: φ there [m²].
        texture: the arguments of the sampler.
    """
    cosine, sine, slope_bound, curvature_bound, terminal = frame
    stack = np.empty((128, 4))
    stack[0, 0] = box[0]
    stack[0, 1] = box[1]
    stack[0, 2] = box[2]
    stack[0, 3] = box[3]
    count = 1
    while count > 0:
        count -= 1
        t1 = stack[count, 0]
        t2 = stack[count, 1]
        half1 = stack[count, 2]
        half2 = stack[count, 3]
        cx = x + cosine * t1 - sine * t2
        cy = y + sine * t1 + cosine * t2
        h, hx, hy, hxx, hxy, hyy = curvature(cx, cy, *texture)
        gap = h - z
        p1 = t1 + gap * (cosine * hx + sine * hy)
        p2 = t2 + gap * (cosine * hy - sine * hx)
        bound = box_bound(t1, t2, half1, half2, gap, p1, p2, slope_bound, curvature_bound)
        if bound >= best * (1.0 - 1e-14):
            continue
        if max(half1, half2) <= terminal or count > 124:
            fx, fy, value = descend(x, y, z, cx, cy, texture)
            if value < best:
                best_x = fx
                best_y = fy
                best = value
            continue
        # Halve the longer side; the half nearer to lower φ is searched first.
        if half1 >= half2:
            half1 *= 0.5
            step1 = half1 if p1 > 0.0 else -half1
            step2 = 0.0
        else:
            half2 *= 0.5
            step1 = 0.0
            step2 = half2 if p2 > 0.0 else -half2
        for sign in (1.0, -1.0):
            stack[count, 0] = t1 + sign * step1
            stack[count, 1] = t2 + sign * step2
            stack[count, 2] = half1
            stack[count, 3] = half2
            count += 1
    return best_x, best_y, best
