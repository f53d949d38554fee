"""h = Σ a_i sin(k_i · (x, y) + phase_i)."""

import math
from typing import NamedTuple

from asperity.contacts.closest.plane_search import evaluate_box, next_box
from asperity.contacts.sampler_interface import PRUNED_BOX_COST, Derivatives
from asperity.contacts.sampler_interface import PlanePoint as Point
from asperity.core.checks import FloatArray
from asperity.core.compiled import EVERY_FUNCTION, Kernels
from asperity.textures.kinds.sine import cosine, sine

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("search_plane",))


# Cost of a wave, in evaluations.
WAVE_COST = 0.4


class FourierArguments(NamedTuple):
    """Record of a sum of waves passed to the functions below.

    Attributes:
        amplitudes: a_i [m].
        kx: wave vectors [rad/m].
        ky: likewise.
        phases: [rad].
        hessian_bound: bound of the second derivatives [1/m].
        third_derivative_bound: bound of the third derivatives [1/m²].
        min_height: least height [m].
        max_height: greatest height [m].
        wave_number: the greatest one [rad/m].
        ux: direction of the first wave.
        uy: likewise.
    """

    amplitudes: FloatArray
    kx: FloatArray
    ky: FloatArray
    phases: FloatArray
    hessian_bound: float
    third_derivative_bound: float
    min_height: float
    max_height: float
    wave_number: float
    ux: float
    uy: float


def evaluation_cost(texture: FourierArguments) -> float:
    """Return the cost of all waves, in evaluations; two cost no more than a map."""
    return max(1.0, WAVE_COST * texture.amplitudes.size)


def sample_height(x: float, y: float, texture: FourierArguments) -> float:
    """Return h [m]."""
    h = 0.0
    for i in range(texture.amplitudes.size):
        angle = texture.kx[i] * x + texture.ky[i] * y + texture.phases[i]
        h += texture.amplitudes[i] * sine(angle)
    return h


def sample_gradient(x: float, y: float, texture: FourierArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    h = hx = hy = 0.0
    for i in range(texture.amplitudes.size):
        angle = texture.kx[i] * x + texture.ky[i] * y + texture.phases[i]
        c = texture.amplitudes[i] * cosine(angle)
        h += texture.amplitudes[i] * sine(angle)
        hx += texture.kx[i] * c
        hy += texture.ky[i] * c
    return h, hx, hy


def sample_hessian(x: float, y: float, texture: FourierArguments) -> Derivatives:
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


def search_plane(
    x: float, y: float, z: float, best: Point, pruning_factor: float, budget: float,
    texture: FourierArguments,
) -> tuple[Point, float]:  # fmt: skip
    """Return the best point after a search of all that may be closer, and the remaining budget.

    A closer point lies in a square around the probe, whose half-width follows from the distance of
    the best point and the extremes of the height. The square is divided into quarters.
    """
    gap = max(texture.min_height - z, z - texture.max_height, 0.0)
    reach = math.sqrt(max(best[2] - gap * gap, 0.0))
    u = 0.5 + 0.5 * (best[0] - x) / max(reach, 1e-300)
    v = 0.5 + 0.5 * (best[1] - y) / max(reach, 1e-300)
    level = 0 if reach > 0.0 else 1
    i = j = 0
    side = 1.0
    while level <= 0 and budget > 0.0:
        budget -= PRUNED_BOX_COST
        half = reach * side
        cx = (2 * j + 1) * half - reach
        cy = (2 * i + 1) * half - reach
        near_x = max(abs(cx) - half, 0.0)
        near_y = max(abs(cy) - half, 0.0)
        deeper = near_x * near_x + near_y * near_y + gap * gap < best[2] * pruning_factor
        # Taylor's formula cannot decide a box of several waves.
        if deeper and half * texture.wave_number < 1.5:
            best, deeper, budget = evaluate_box(
                x, y, z, x + cx, y + cy, half, half,
                texture.hessian_bound, texture.third_derivative_bound,
                best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -48
        level, side, i, j = next_box(deeper, level, side, i, j, 0, u, v)
    return best, budget
