"""The nearest point where all waves of a sum are parallel: a search along their direction.

It replaces ``foot`` of ``fourier``, whose arguments these are.
"""

import math

import numpy as np

from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.line_search import descend, judge, next_part
from asperity.contacts.nearest.line_within import line_within
from asperity.contacts.sampler import PASSED, SLACK
from asperity.contacts.sampler import LinePoint as Point
from asperity.textures.samplers.fourier import FourierArguments

KERNELS = Kernels(
    provides=("along", "foot", "foot_within", "search_line"),
    requires=("descend", "judge", "line_within", "next_part"),
    called=("foot",),
    shared=("search_line",),
)


def along(t: float, texture: FourierArguments) -> tuple[float, float, float]:
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


def foot(
    x: float, y: float, z: float, texture: FourierArguments
) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Downhill from the probe, then whatever can be nearer.
    """
    t = x * texture.ux + y * texture.uy
    best = descend(t, z, t, texture)
    best, _left = search_line(t, z, best, 1.0 - SLACK * EPS, np.inf, texture)
    x += (best[0] - t) * texture.ux
    y += (best[0] - t) * texture.uy
    return x, y, best[2], best[3] * texture.ux, best[3] * texture.uy


def foot_within(
    x: float, y: float, z: float, start_x: float, start_y: float, budget: float,
    texture: FourierArguments,
) -> tuple[float, float, float, float, float, float, float]:  # fmt: skip
    """Return the foot as far as a budget of looks finds it; see ``contacts.sampler``."""
    t = x * texture.ux + y * texture.uy
    start = start_x * texture.ux + start_y * texture.uy
    best, gap, looks = line_within(t, z, start, budget, texture)
    x += (best[0] - t) * texture.ux
    y += (best[0] - t) * texture.uy
    return x, y, best[2], best[3] * texture.ux, best[3] * texture.uy, gap, looks


def search_line(
    t: float, z: float, best: Point, keep: float, left: float, texture: FourierArguments
) -> tuple[Point, float]:
    """Return the best point after a search of all that can be nearer, and the looks left.

    Only an interval with the distance of the best as half-width, less what the heights leave over,
    can hold a nearer point. It is halved from the whole down.
    """
    gap = max(texture.low - z, z - texture.high, 0.0)
    reach = math.sqrt(max(best[1] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - t) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = 0
    side = 1.0
    while level <= 0 and left > 0.0:
        left -= PASSED
        half = reach * side
        centre = (2 * i + 1) * half - reach
        near = max(abs(centre) - half, 0.0)
        deeper = near * near + gap * gap < best[1] * keep
        # In an interval of several waves Taylor's formula says nothing.
        if deeper and half * texture.wave_number < 1.5:
            best, deeper, left = judge(
                t, z, t + centre, half, texture.bend, texture.twist, best, keep, left, texture
            )
            deeper = deeper and level > -48
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if u >= (2 * i + 1) * side else 0)
        else:
            level, side, i = next_part(level, side, i, 0, u)
    return best, left
