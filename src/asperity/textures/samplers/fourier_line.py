"""The nearest point where all waves of a sum are parallel: a search along their direction.

It replaces ``foot`` of ``fourier``, whose arguments these are.
"""

import math

from asperity.compiled import Kernels
from asperity.contacts.nearest.line_search import descend, judge, next_part
from asperity.textures.samplers.fourier import FourierArguments

KERNELS = Kernels(
    provides=("along", "foot"),
    requires=("descend", "judge", "next_part"),
    called=("foot",),
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

    Downhill from the probe, a distance; only an interval of that half-width, less what the
    heights leave over, can hold a nearer point. It is halved from the whole down.
    """
    t = x * texture.ux + y * texture.uy
    best = descend(t, z, t, texture)
    gap = max(texture.low - z, z - texture.high, 0.0)
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
        if deeper and half * texture.wave_number < 1.5:
            best, deeper = judge(t, z, t + centre, half, texture.bend, texture.twist, best, texture)
            deeper = deeper and level > -48
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if u >= (2 * i + 1) * side else 0)
        else:
            level, side, i = next_part(level, side, i, 0, u)
    x += (best[0] - t) * texture.ux
    y += (best[0] - t) * texture.uy
    return x, y, best[2], best[3] * texture.ux, best[3] * texture.uy
