"""h = A sin(k_x x + k_y y + phase), with closest points and split god-objects in closed form.

The split god-object below a sinusoid is one root on one flank. Let u be the phase of the probe from
the nearest crest, ψ that of a closest point, κ the wave number and R = 1/(κ² A) the radius of
curvature at the crest. Every point with two closest points lies directly below a crest. Where the
god-object is split, y (``split_solver``) is such a point and its closest points are ±ψ, so
p = (1 - μ) y + μ z̄ leaves one equation, independent of u,

    (1 - μ) ψ - κ² A sin ψ (A cos ψ - z) = 0,

which is the condition of a closest point with its first term scaled, and has the same single root:
it exists more than (1 - μ) R below the crest, and the god-object is split if it exceeds |u|/μ. The
force is then k (c u/κ, A cos ψ - z), otherwise that of law D.
"""

import math
from typing import NamedTuple

from asperity.contacts.sampler_interface import ClosestPoint, Derivatives
from asperity.core.compiled import EPS, EVERY_FUNCTION, FloatArray, Kernels
from asperity.textures.kinds.sine import cosine, sine

KERNELS = Kernels(provides=EVERY_FUNCTION)


class SinusoidArguments(NamedTuple):
    """Record of a sinusoid passed to the functions below.

    Attributes:
        amplitude: A [m], positive.
        kx: wave vector [rad/m].
        ky: likewise.
        phase: [rad].
    """

    amplitude: float
    kx: float
    ky: float
    phase: float


def sample_height(x: float, y: float, texture: SinusoidArguments) -> float:
    """Return h [m]."""
    return texture.amplitude * sine(texture.kx * x + texture.ky * y + texture.phase)


def sample_gradient(x: float, y: float, texture: SinusoidArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    c = texture.amplitude * cosine(angle)
    return texture.amplitude * sine(angle), texture.kx * c, texture.ky * c


def sample_hessian(x: float, y: float, texture: SinusoidArguments) -> Derivatives:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    h = texture.amplitude * sine(angle)
    c = texture.amplitude * cosine(angle)
    kx = texture.kx
    ky = texture.ky
    return h, kx * c, ky * c, -kx * kx * h, -kx * ky * h, -ky * ky * h


def closest_point(x: float, y: float, z: float, texture: SinusoidArguments) -> ClosestPoint:
    """Return X, Y of the globally closest surface point, and h, h_x, h_y there.

    Let ψ be the phase angle from the crest on the probe's side (for a probe outside the body,
    reflect the problem). The closest point of a probe at angle u in [0, π] lies on the same
    monotone flank, in [u, π]: the flanks beyond the trough and beyond the crest are mirror images
    and farther away, and the surface descends from the probe towards the closest point. There

        F(ψ) = (ψ - u) - k² A sin ψ (A cos ψ - z)

    changes sign exactly once: it is convex from u to the inflection π/2 with F(u) <= 0, and
    increasing from there on while the surface is above the probe.
    """
    amplitude = texture.amplitude
    kx = texture.kx
    ky = texture.ky
    k2 = kx * kx + ky * ky
    angle = kx * x + ky * y + texture.phase
    depth = amplitude * math.sin(angle) - z
    over = 1.0
    if depth < 0.0:
        angle += math.pi
        over = -1.0
    turns = angle / (2.0 * math.pi) - 0.25
    u = 2.0 * math.pi * (turns - math.floor(turns + 0.5))  # angle from the nearest crest
    side = 1.0 if u >= 0.0 else -1.0
    u = abs(u)
    high = min(math.pi, u + math.sqrt(k2) * abs(depth))
    psi, c, s = flank_root(1.0, u, high, over * z, amplitude, k2 * amplitude)
    shift = side * (psi - u) / k2
    rate = -over * side * amplitude * s
    return x + kx * shift, y + ky * shift, over * amplitude * c, kx * rate, ky * rate


def flank_root(
    phase_weight: float, u: float, high: float, z: float, amplitude: float, peak_curvature: float
) -> tuple[float, float, float]:
    """Return the root ψ of w ψ - u - κ² A sin ψ (A cos ψ - z) on a flank, cos ψ and sin ψ.

    Args:
        phase_weight: w, 1 for the closest point of a probe; 1 - μ, with u = 0, for the atoms of a
            split god-object.
        u: phase from the crest, in [0, π]; a lower bound of the root.
        high: an upper bound of the root.
        z: height of the probe, below the surface [m].
        amplitude: A [m].
        peak_curvature: κ² A [1/m].
    """
    low = u
    middle = 0.5 * math.pi
    if low < middle < high:
        if phase_weight * middle - u + peak_curvature * z <= 0.0:
            low = middle
        else:
            high = middle
    # From the right end, where Newton's iteration decreases monotonically to the root of a convex
    # function. Halley's is faster, and sometimes overshoots.
    psi = high
    c = s = 0.0
    third = peak_curvature * (8.0 * amplitude + abs(z)) / 6.0  # bound of the third derivative / 6
    for _ in range(100):
        s = math.sin(psi)
        c = math.cos(psi)
        gap = amplitude * c - z
        value = phase_weight * psi - u - peak_curvature * s * gap
        if value == 0.0:
            break
        if value > 0.0:
            high = psi
        else:
            low = psi
        rate = phase_weight + peak_curvature * (amplitude * s * s - c * gap)
        curve = 0.5 * peak_curvature * s * (4.0 * amplitude * c - z)
        square = rate * rate
        over = square - value * curve
        step = -value * rate / over
        size = abs(step)
        if size <= min(1e-4, 0.25 * psi) and rate > 0.0 and over > 0.5 * square:
            error = size * size * size * (curve * curve + third * rate)
            if error <= EPS * psi * square:
                # The remaining error is below rounding; update sine and cosine by polynomials.
                psi = min(max(psi + step, low), high)
                half = 0.5 * step
                turned = c - step * (s + half * (c - step * s / 3.0))
                return psi, turned, s + step * (c - half * (s + step * c / 3.0))
        new = psi + step
        if rate > 0.0 and (new < low or new > high):
            new = psi - value / rate
        if not (rate > 0.0 and low <= new <= high):
            new = 0.5 * (low + high)
        if new == psi:
            break
        psi = new
    return psi, c, s


def split_phase(x: float, y: float, texture: SinusoidArguments) -> float:
    """Return the phase from the nearest crest, in [-π, π]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    turns = angle / (2.0 * math.pi) - 0.25
    return 2.0 * math.pi * (turns - math.floor(turns + 0.5))


def split_closest_point(
    u: float, z: float, continuity: float, amplitude: float, peak_curvature: float
) -> tuple[bool, float, float, float]:
    """Return whether the god-object is split at |u|; phase ψ of its atoms, cos ψ, sin ψ."""
    mu = 1.0 / (1.0 + continuity)
    share = continuity * mu
    # No closest point is beyond the trough; nothing is split above this height.
    if u < mu * math.pi and peak_curvature * (amplitude - z) > share:
        psi, c, s = flank_root(share, 0.0, math.pi, z, amplitude, peak_curvature)
        if u < mu * psi:
            return True, psi, c, s
    psi, c, s = flank_root(1.0, u, math.pi, z, amplitude, peak_curvature)
    return False, psi, c, s


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    amplitude = texture.amplitude
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    u = split_phase(x, y, texture)
    split, psi, c, _s = split_closest_point(abs(u), z, continuity, amplitude, k2 * amplitude)
    shift = continuity * u if split else math.copysign(psi - abs(u), u)
    return texture.kx * shift / k2, texture.ky * shift / k2, amplitude * c - z


def split_contact_energy(
    x: float,
    y: float,
    z: float,
    continuity: float,
    warm_start: FloatArray,
    texture: SinusoidArguments,
) -> tuple[float, float, float, float]:
    """Return z̄ - p [m] and U [m²]; the closed form needs no warm start."""
    amplitude = texture.amplitude
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    u = split_phase(x, y, texture)
    split, psi, c, _s = split_closest_point(abs(u), z, continuity, amplitude, k2 * amplitude)
    shift = continuity * u if split else math.copysign(psi - abs(u), u)
    spread = split_spread(split, u, psi, continuity)
    gap = amplitude * c - z
    energy = 0.5 * ((shift * shift + spread) / k2 + gap * gap)
    return texture.kx * shift / k2, texture.ky * shift / k2, gap, energy


def split_spread(split: bool, u: float, psi: float, continuity: float) -> float:
    """Return c/(1 + c) times the variance of the phases ±ψ of the atoms about (1 + c) u."""
    if not split:
        return 0.0
    mean = (1.0 + continuity) * u
    return continuity / (1.0 + continuity) * (psi - mean) * (psi + mean)


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and its derivative by p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz."""
    amplitude = texture.amplitude
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    wave = math.sqrt(k2)
    u = split_phase(x, y, texture)
    split, psi, c, s = split_closest_point(abs(u), z, continuity, amplitude, k2 * amplitude)
    gap = amplitude * c - z
    if split:
        share = continuity / (1.0 + continuity)
        shift = continuity * u
        rate = share + k2 * amplitude * (amplitude * s * s - c * gap)
        along = continuity
        mixed = 0.0
        upward = amplitude * k2 * amplitude * s * s / rate - 1.0
    else:
        shift = math.copysign(psi - abs(u), u)
        slope = -amplitude * wave * math.copysign(s, u)
        q = 1.0 + slope * slope - gap * amplitude * k2 * c
        # At the crest's centre of curvature q is zero and the stiffness of law D unbounded, but the
        # god-object is split before the probe gets that deep.
        along = 1.0 / q - 1.0
        mixed = slope / q
        upward = slope * slope / q - 1.0
    ex = texture.kx / wave
    ey = texture.ky / wave
    return (
        texture.kx * shift / k2,
        texture.ky * shift / k2,
        gap,
        ex * ex * along,
        ex * ey * along,
        ex * mixed,
        ey * ey * along,
        ey * mixed,
        upward,
    )


def split_energy(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, int, float]:
    """Return U [m²], the number of atoms, and the gap between U and the dual's lower bound [m²].

    The lower bound uses the globally closest point of y from the sampler's own search.
    """
    amplitude = texture.amplitude
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    share = continuity / (1.0 + continuity)
    u = split_phase(x, y, texture)
    split, psi, c, _s = split_closest_point(abs(u), z, continuity, amplitude, k2 * amplitude)
    angle = psi if split else math.copysign(psi, u)
    shift = continuity * u if split else angle - u
    h = amplitude * c
    # Variance of the atoms ±ψ around their mean (1 + c) u.
    mean = (1.0 + continuity) * u
    spread = (psi - mean) * (psi + mean) / k2 if split else 0.0
    value = 0.5 * (shift * shift / k2 + (h - z) * (h - z) + share * spread)
    far = u - shift / continuity
    far_x = x - texture.kx * (shift / continuity) / k2
    far_y = y - texture.ky * (shift / continuity) / k2
    far_z = z - (h - z) / continuity
    near_x, near_y, _h, _hx, _hy = closest_point(far_x, far_y, far_z, texture)
    near = far + texture.kx * (near_x - far_x) + texture.ky * (near_y - far_y)
    near_h = texture.amplitude * math.sin(texture.kx * near_x + texture.ky * near_y + texture.phase)
    # Products of sums and differences: squares would cancel.
    gap = (angle - near) * (angle + near - 2.0 * far) / k2 + (h - near_h) * (
        h + near_h - 2.0 * far_z
    )
    return value, 2 if split else 1, max(0.5 * share * gap, 0.0)
