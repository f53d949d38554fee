"""h = A sin(k_x x + k_y y + phase)."""

import math
from typing import NamedTuple

from asperity.compiled import EPS, Kernels
from asperity.textures.samplers.sine import cosine, sine

KERNELS = Kernels(
    provides=("curvature", "flank_root", "foot", "height", "slope"),
    requires=("cosine", "sine"),
    called=("foot",),
)


class SinusoidArguments(NamedTuple):
    """What the functions below receive of a sinusoid.

    Attributes:
        amplitude: A [m].
        kx: wave vector [rad/m].
        ky: likewise.
        phase: [rad].
    """

    amplitude: float
    kx: float
    ky: float
    phase: float


def height(x: float, y: float, texture: SinusoidArguments) -> float:
    """Return h [m]."""
    return texture.amplitude * sine(texture.kx * x + texture.ky * y + texture.phase)


def slope(x: float, y: float, texture: SinusoidArguments) -> tuple[float, float, float]:
    """Return h [m], h_x, h_y [1]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    c = texture.amplitude * cosine(angle)
    return texture.amplitude * sine(angle), texture.kx * c, texture.ky * c


def curvature(
    x: float, y: float, texture: SinusoidArguments
) -> tuple[float, float, float, float, float, float]:
    """Return h [m], h_x, h_y [1], h_xx, h_xy, h_yy [1/m]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    h = texture.amplitude * sine(angle)
    c = texture.amplitude * cosine(angle)
    kx = texture.kx
    ky = texture.ky
    return h, kx * c, ky * c, -kx * kx * h, -kx * ky * h, -ky * ky * h


def foot(
    x: float, y: float, z: float, texture: SinusoidArguments
) -> tuple[float, float, float, float, float]:
    """Return X, Y of the globally nearest surface point, and h, h_x, h_y there.

    Let ψ be the phase angle from the crest on the probe's side (for a probe outside the body,
    turn the picture over). The foot of a probe at angle u in [0, π] lies on the same monotone
    flank, in [u, π]: the flank beyond the trough and the one beyond the crest are mirror images
    and farther away, and at the foot the surface falls in the direction of the foot. There

        F(ψ) = (ψ - u) - k² A sin ψ (A cos ψ - z)

    changes sign exactly once: it is convex from u to the inflection π/2 with F(u) <= 0, and
    increasing from there on while the surface is above the probe.
    """
    amplitude = abs(texture.amplitude)
    if amplitude == 0.0:
        return x, y, 0.0, 0.0, 0.0
    kx = texture.kx
    ky = texture.ky
    k2 = kx * kx + ky * ky
    angle = kx * x + ky * y + texture.phase
    depth = texture.amplitude * math.sin(angle) - z
    if texture.amplitude < 0.0:
        angle += math.pi
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
    share: float, u: float, high: float, z: float, amplitude: float, bend: float
) -> tuple[float, float, float]:
    """Return the root ψ of share ψ - u - κ² A sin ψ (A cos ψ - z) on a flank, cos ψ and sin ψ.

    Args:
        share: 1 for the foot of a probe; 1 - μ, with u = 0, for feet of a split god-object.
        u: phase from the crest, in [0, π]; the root is not less.
        high: the root is not more.
        z: height of the probe, below the surface [m].
        amplitude: A [m].
        bend: κ² A [1/m].
    """
    low = u
    middle = 0.5 * math.pi
    if low < middle < high:
        if share * middle - u + bend * z <= 0.0:
            low = middle
        else:
            high = middle
    # From the right end: there Newton falls monotonically to the root of a convex function. Halley
    # is quicker, and sometimes falls too far.
    psi = high
    c = s = 0.0
    third = bend * (8.0 * amplitude + abs(z)) / 6.0  # no third derivative is greater, over 6
    for _ in range(100):
        s = math.sin(psi)
        c = math.cos(psi)
        gap = amplitude * c - z
        value = share * psi - u - bend * s * gap
        if value == 0.0:
            break
        if value > 0.0:
            high = psi
        else:
            low = psi
        rate = share + bend * (amplitude * s * s - c * gap)
        curve = 0.5 * bend * s * (4.0 * amplitude * c - z)
        square = rate * rate
        over = square - value * curve
        step = -value * rate / over
        size = abs(step)
        if size <= min(1e-4, 0.25 * psi) and rate > 0.0 and over > 0.5 * square:
            left = size * size * size * (curve * curve + third * rate)
            if left <= EPS * psi * square:
                # The error left is below rounding. Sine and cosine go along, as polynomials.
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
