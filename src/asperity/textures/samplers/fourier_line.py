"""The nearest point where all waves of a sum are parallel: a search along their direction.

It replaces ``foot`` of ``fourier``, whose arguments these are.
"""

import math
from typing import Any

import numpy as np

from asperity.contacts.nearest.line_search import descend, judge, next_part

FloatArray = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def along(t: float, texture: Any) -> tuple[float, float, float]:
    """Return h [m], h' [1], h'' [1/m] at the distance t along the direction [m]."""
    a, kx, ky, phase, bounds = texture
    h = h1 = h2 = 0.0
    for i in range(a.size):
        k = kx[i] * bounds[5] + ky[i] * bounds[6]
        angle = k * t + phase[i]
        s = a[i] * math.sin(angle)
        h += s
        h1 += k * a[i] * math.cos(angle)
        h2 -= k * k * s
    return h, h1, h2


def foot(
    x: float, y: float, z: float, a: FloatArray, kx: FloatArray, ky: FloatArray,
    phase: FloatArray, bounds: FloatArray,
) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Downhill from the probe, a distance; only an interval of that half-width, less what the
    heights leave over, can hold a nearer point. It is halved from the whole down.
    """
    texture = (a, kx, ky, phase, bounds)
    t = x * bounds[5] + y * bounds[6]
    best = descend(t, z, t, texture)
    gap = max(bounds[2] - z, z - bounds[3], 0.0)
    reach = math.sqrt(max(best[1] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - t) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = 0
    side = 1.0
    while level <= 0:
        half = reach * side
        centre = (2 * i + 1) * half - reach
        near = max(abs(centre) - half, 0.0)
        deeper = near * near + gap * gap < best[1] * (1.0 - 1e-13)
        # In an interval of several waves Taylor's formula says nothing.
        if deeper and half * bounds[4] < 1.5:
            best, deeper = judge(t, z, t + centre, half, bounds[0], bounds[1], best, texture)
            deeper = deeper and level > -48
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if u >= (2 * i + 1) * side else 0)
        else:
            level, side, i = next_part(level, side, i, 0, u)
    x += (best[0] - t) * bounds[5]
    y += (best[0] - t) * bounds[6]
    return x, y, best[2], best[3] * bounds[5], best[3] * bounds[6]
