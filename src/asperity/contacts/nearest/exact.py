"""The god-object in many digits."""

from __future__ import annotations

from typing import Any

import mpmath

from asperity.contacts.contact import ExactHeight, HeightField


def exact_nearest(texture: HeightField, h: ExactHeight, p: list[Any]) -> tuple[Any, Any, Any]:
    """Return the distance to the surface, negative outside, and the foot (X, Y), in mpmath.

    Solves (X - x) + (h - z) h_x = 0, (Y - y) + (h - z) h_y = 0 from the double-precision foot.
    """
    start = texture.nearest([[float(c) for c in p]])[0]
    fx, fy = mpmath.mpf(start[0]), mpmath.mpf(start[1])
    for _ in range(60):
        gap, hx, hy = h(fx, fy, 0, 0) - p[2], h(fx, fy, 1, 0), h(fx, fy, 0, 1)
        hxx, hxy, hyy = h(fx, fy, 2, 0), h(fx, fy, 1, 1), h(fx, fy, 0, 2)
        a, b = fx - p[0] + gap * hx, fy - p[1] + gap * hy
        qxx, qxy, qyy = 1 + hx * hx + gap * hxx, hx * hy + gap * hxy, 1 + hy * hy + gap * hyy
        det = qxx * qyy - qxy * qxy
        sx, sy = (qxy * b - qyy * a) / det, (qxy * a - qxx * b) / det
        fx, fy = fx + sx, fy + sy
        if abs(sx) + abs(sy) <= mpmath.eps * (abs(fx) + abs(fy) + abs(gap)):
            break
    away = [fx - p[0], fy - p[1], h(fx, fy, 0, 0) - p[2]]
    distance = mpmath.sqrt(sum(part**2 for part in away))
    return (distance if h(p[0], p[1], 0, 0) > p[2] else -distance), fx, fy
