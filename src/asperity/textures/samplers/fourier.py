"""h = Σ a_i sin(k_i · (x, y) + phase_i)."""

import math
from typing import NamedTuple

import numpy as np

from asperity.checks import FloatArray
from asperity.compiled import EPS, Kernels
from asperity.contacts.nearest.plane_search import descend, judge, next_box
from asperity.contacts.sampler import PASSED, SLACK
from asperity.contacts.sampler import PlanePoint as Point
from asperity.textures.samplers.sine import cosine, sine

KERNELS = Kernels(
    provides=("curvature", "foot", "height", "look_cost", "search_plane", "slope"),
    requires=("cosine", "descend", "judge", "next_box", "sine"),
    called=("foot",),
    shared=("search_plane",),
)


# Looks that a wave takes, by its time.
WAVE = 0.4


class FourierArguments(NamedTuple):
    """What the functions below receive of a sum of waves.

    Attributes:
        amplitudes: a_i [m].
        kx: wave vectors [rad/m].
        ky: likewise.
        phases: [rad].
        bend: bound of the second derivatives [1/m].
        twist: bound of the third derivatives [1/m²].
        low: least height [m].
        high: greatest height [m].
        wave_number: the greatest [rad/m].
        ux: direction of the first wave.
        uy: likewise.
    """

    amplitudes: FloatArray
    kx: FloatArray
    ky: FloatArray
    phases: FloatArray
    bend: float
    twist: float
    low: float
    high: float
    wave_number: float
    ux: float
    uy: float


def look_cost(texture: FourierArguments) -> float:
    """Return the looks that all waves take; two need no more than a map."""
    return max(1.0, WAVE * texture.amplitudes.size)


def height(x: float, y: float, texture: FourierArguments) -> float:
    """Return h [m]."""
    h = 0.0
    for i in range(texture.amplitudes.size):
        angle = texture.kx[i] * x + texture.ky[i] * y + texture.phases[i]
        h += texture.amplitudes[i] * sine(angle)
    return h


def slope(x: float, y: float, texture: FourierArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    h = hx = hy = 0.0
    for i in range(texture.amplitudes.size):
        angle = texture.kx[i] * x + texture.ky[i] * y + texture.phases[i]
        c = texture.amplitudes[i] * cosine(angle)
        h += texture.amplitudes[i] * sine(angle)
        hx += texture.kx[i] * c
        hy += texture.ky[i] * c
    return h, hx, hy


def curvature(
    x: float, y: float, texture: FourierArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    h = hx = hy = hxx = hxy = hyy = 0.0
    for i in range(texture.amplitudes.size):
        angle = texture.kx[i] * x + texture.ky[i] * y + texture.phases[i]
        s = texture.amplitudes[i] * sine(angle)
        c = texture.amplitudes[i] * cosine(angle)
        h += s
        hx += texture.kx[i] * c
        hy += texture.ky[i] * c
        hxx -= texture.kx[i] * texture.kx[i] * s
        hxy -= texture.kx[i] * texture.ky[i] * s
        hyy -= texture.ky[i] * texture.ky[i] * s
    return h, hx, hy, hxx, hxy, hyy


def foot(
    x: float, y: float, z: float, texture: FourierArguments
) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Downhill from the probe, then whatever can be nearer.
    """
    best = descend(x, y, z, x, y, texture)
    best, _left = search_plane(x, y, z, best, 1.0 - SLACK * EPS, np.inf, texture)
    return best[0], best[1], best[3], best[4], best[5]


def search_plane(
    x: float, y: float, z: float, best: Point, keep: float, left: float, texture: FourierArguments
) -> tuple[Point, float]:
    """Return the best point after a search of all that can be nearer, and the looks left.

    Only a square with the distance of the best as half-width, less what the heights leave over, can
    hold a nearer point. It is quartered from the whole down.
    """
    gap = max(texture.low - z, z - texture.high, 0.0)
    reach = math.sqrt(max(best[2] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - x) / max(reach, 1e-300)
    v = 0.5 + 0.5 * (best[1] - y) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = j = 0
    side = 1.0
    while level <= 0 and left > 0.0:
        left -= PASSED
        half = reach * side
        cx = (2 * j + 1) * half - reach
        cy = (2 * i + 1) * half - reach
        near_x = max(abs(cx) - half, 0.0)
        near_y = max(abs(cy) - half, 0.0)
        deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * keep
        # In a box of several waves Taylor's formula says nothing.
        if deeper and half * texture.wave_number < 1.5:
            best, deeper, left = judge(
                x, y, z, x + cx, y + cy, half, half, texture.bend, texture.twist,
                best, keep, left, texture,
            )  # fmt: skip
            deeper = deeper and level > -48
        if deeper:
            level -= 1
            side *= 0.5
            i = 2 * i + (1 if v >= (2 * i + 1) * side else 0)
            j = 2 * j + (1 if u >= (2 * j + 1) * side else 0)
        else:
            level, side, i, j = next_box(level, side, i, j, 0, u, v)
    return best, left
