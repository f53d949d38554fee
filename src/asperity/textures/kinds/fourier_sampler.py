"""h = Σ a_i sin(k_i · (x, y) + phase_i)."""

import math
from typing import NamedTuple

from asperity.contacts.closest.plane_search import next_box, search_box
from asperity.contacts.sampler_interface import PRUNED_BOX_COST, Derivatives
from asperity.contacts.sampler_interface import PlanePoint as Point
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels, local_array
from asperity.textures.kinds.sine import cosine, sine, sine_and_cosine

KERNELS = Kernels(provides=EVERY_FUNCTION, shared=("search_plane",), iterates=True)


# Cost of a wave, in evaluations; of a box, and of a wave in its expansion.
WAVE_COST = 0.4
BOX_COST = 1.0
BOX_WAVE_COST = 0.1


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
        fourth_derivative_bound: bound of the fourth derivatives [1/m³]; without one, as in earlier
            recordings, a number that prunes nothing.
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
    fourth_derivative_bound: float = 1e300


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


def expand_waves(
    x: float, y: float, z: float, r: float, texture: FourierArguments
) -> tuple[Derivatives, tuple[float, float, float]]:
    """Return height and derivatives at the centre of a box of half-diagonal r, and remainders.

    The remainders are those of ``search_box``, from the third derivatives at the centre and
    a bound of the fourth ones: waves of several directions add up to less than their sizes.
    """
    h = hx = hy = hxx = hxy = hyy = xxx = xxy = xyy = yyy = 0.0
    s = local_array((16,))
    c = local_array((16,))
    for first in range(0, texture.amplitudes.size, 16):
        count = min(texture.amplitudes.size - first, 16)
        for i in range(count):  # without sums, so that the loop vectorizes
            k = first + i
            angle = texture.kx[k] * x + texture.ky[k] * y + texture.phases[k]
            sx, cx = sine_and_cosine(angle)
            s[i] = texture.amplitudes[k] * sx
            c[i] = texture.amplitudes[k] * cx
        for i in range(count):
            kx = texture.kx[first + i]
            ky = texture.ky[first + i]
            cx = kx * c[i]
            cy = ky * c[i]
            sx = kx * s[i]
            sy = ky * s[i]
            h += s[i]
            hx += cx
            hy += cy
            hxx -= kx * sx
            hxy -= kx * sy
            hyy -= ky * sy
            xxx -= kx * kx * cx
            xxy -= kx * kx * cy
            xyy -= ky * ky * cx
            yyy -= ky * ky * cy
    gap = h - z
    third = math.sqrt(xxx * xxx + 3.0 * (xxy * xxy + xyy * xyy) + yyy * yyy)
    third = min(texture.third_derivative_bound, third + texture.fourth_derivative_bound * r)
    norm = math.sqrt(hxx * hxx + 2.0 * hxy * hxy + hyy * hyy)
    hessian = min(texture.hessian_bound, norm + third * r)
    slope = math.sqrt(hx * hx + hy * hy) + hessian * r
    xxx = 3.0 * hx * hxx + gap * xxx
    xxy = 2.0 * hx * hxy + hy * hxx + gap * xxy
    xyy = 2.0 * hy * hxy + hx * hyy + gap * xyy
    yyy = 3.0 * hy * hyy + gap * yyy
    change = math.sqrt(xxx * xxx + 3.0 * (xxy * xxy + xyy * xyy) + yyy * yyy)
    rate = (abs(gap) + slope * r) * texture.fourth_derivative_bound
    rate += 4.0 * slope * third + 3.0 * hessian * hessian
    tangent_error = (0.5 * norm + third * r / 6.0) * r * r
    return (h, hx, hy, hxx, hxy, hyy), ((change + 0.5 * rate * r) * r, tangent_error, third)


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
            budget -= BOX_COST + BOX_WAVE_COST * texture.amplitudes.size
            r = math.sqrt(2.0) * half
            derivatives, remainders = expand_waves(x + cx, y + cy, z, r, texture)
            best, deeper, budget = search_box(
                (x, y, z), x + cx, y + cy, half, half, derivatives, remainders,
                best, pruning_factor, budget, texture,
            )  # fmt: skip
            deeper = deeper and level > -48
        level, side, i, j = next_box(deeper, level, side, i, j, 0, u, v)
    return best, budget
