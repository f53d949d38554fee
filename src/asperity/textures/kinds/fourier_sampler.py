"""h = Σ a_i sin(k_i · (x, y) + phase_i)."""

import math
from typing import NamedTuple

from asperity.contacts.sampler_interface import DIVIDE, EXPAND, Bounds, Box, Derivatives, Frame
from asperity.core.compiled import EVERY_FUNCTION, FloatArray, Kernels, local_array
from asperity.textures.kinds.sine import cosine, sine, sine_and_cosine

KERNELS = Kernels(provides=EVERY_FUNCTION)


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
        ux: direction of the boxes of a search: that of parallel waves, else the x axis.
        uy: likewise.
        parallel: whether all waves have this direction.
        fourth_derivative_bound: bound of the fourth derivatives [1/m³].
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
    parallel: bool
    fourth_derivative_bound: float


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


def search_frame(x: float, y: float, texture: FourierArguments) -> Frame:
    """Return metres from the probe, along parallel waves or along x and y."""
    return x, y, texture.ux, texture.uy, 1.0, 0.0 if texture.parallel else 1.0


def search_region(x: float, y: float, z: float, square: float, texture: FourierArguments) -> Box:
    """Return the square within the lateral reach of a ball, from the extremes of the height."""
    gap = max(texture.min_height - z, z - texture.max_height, 0.0)
    reach = math.sqrt(max(square - gap * gap, 0.0))
    return -reach, reach, -reach, reach


def enclose_box(box: Box, texture: FourierArguments) -> Bounds:
    """Return bounds everywhere; Taylor's formula cannot decide a box of several waves."""
    hessian = texture.hessian_bound
    half = 0.5 * (box[1] - box[0])
    effort = EXPAND if half * texture.wave_number < 1.5 else DIVIDE
    third = texture.third_derivative_bound
    return texture.min_height, texture.max_height, hessian, third, hessian, effort


def expand_box(
    x: float, y: float, z: float, r: float, bounds: Bounds, left: float, texture: FourierArguments
) -> tuple[Derivatives, tuple[float, float, float], float]:
    """Return the derivatives along the axes of the box, and sharp remainders."""
    left -= BOX_COST + BOX_WAVE_COST * texture.amplitudes.size
    derivatives, remainders = expand_waves(x, y, z, r, texture)
    if texture.parallel:
        h, hx, hy, hxx, _hxy, hyy = derivatives
        slope = hx * texture.ux + hy * texture.uy
        derivatives = (h, slope, 0.0, hxx + hyy, 0.0, 0.0)
    return derivatives, remainders, left


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
