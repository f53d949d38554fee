"""The split god-object below a sinusoid, in closed form: one root on one flank.

Let u be the phase of the probe from the nearest crest, ψ that of a foot, κ the wave number and
R = 1/(κ² A) the radius of the crest. Every point that has two nearest points lies straight below
a crest. Where the god-object is split, y (``solver.py``) is such a point and its feet are ±ψ, so
p = (1 - μ) y + μ z̄ leaves one equation that does not know u,

    (1 - μ) ψ - κ² A sin ψ (A cos ψ - z) = 0,

the condition of a foot with its first term scaled, and with the same single root: there is one
below the crest by more than (1 - μ) R, and the god-object is split if it exceeds |u|/μ. The force
is then k (c u/κ, A cos ψ - z), else law D's.
"""

import math

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.textures.samplers.sinusoid import SinusoidArguments, flank_root, foot

KERNELS = Kernels(
    provides=("split_again", "split_contact", "split_derivative", "split_energy"),
    requires=("flank_root", "foot"),
)


def split_phase(x: float, y: float, texture: SinusoidArguments) -> float:
    """Return the phase from the nearest crest, in [-π, π]."""
    angle = texture.kx * x + texture.ky * y + texture.phase
    turns = angle / (2.0 * math.pi) - (0.25 if texture.amplitude >= 0.0 else 0.75)
    return 2.0 * math.pi * (turns - math.floor(turns + 0.5))


def split_foot(
    u: float, z: float, continuity: float, amplitude: float, bend: float
) -> tuple[bool, float, float, float]:
    """Return whether the god-object is split at |u|; phase ψ of its feet or foot, cos ψ, sin ψ."""
    mu = 1.0 / (1.0 + continuity)
    share = continuity * mu
    # No foot is farther from the crest than the trough; none is split above this height.
    if u < mu * math.pi and bend * (amplitude - z) > share:
        psi, c, s = flank_root(share, 0.0, math.pi, z, amplitude, bend)
        if u < mu * psi:
            return True, psi, c, s
    psi, c, s = flank_root(1.0, u, math.pi, z, amplitude, bend)
    return False, psi, c, s


def split_contact(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, float, float]:
    """Return z̄ - p, from the probe to the mean of the split god-object [m]."""
    amplitude = abs(texture.amplitude)
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    u = split_phase(x, y, texture)
    split, psi, c, _s = split_foot(abs(u), z, continuity, amplitude, k2 * amplitude)
    shift = continuity * u if split else math.copysign(psi - abs(u), u)
    return texture.kx * shift / k2, texture.ky * shift / k2, amplitude * c - z


def split_again(
    x: float, y: float, z: float, continuity: float, memory: FloatArray, texture: SinusoidArguments
) -> tuple[float, float, float]:
    """Return the same tick after tick: nothing needs to be remembered."""
    return split_contact(x, y, z, continuity, texture)


def split_derivative(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """Return z̄ - p [m] and its derivative by p as m_xx, m_xy, m_xz, m_yy, m_yz, m_zz."""
    amplitude = abs(texture.amplitude)
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    wave = math.sqrt(k2)
    u = split_phase(x, y, texture)
    split, psi, c, s = split_foot(abs(u), z, continuity, amplitude, k2 * amplitude)
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
        # At the crest's centre of curvature q is zero: the stiffness of law D is unbounded there,
        # but the god-object is split before the probe comes so deep.
        along = 1.0 / q - 1.0
        mixed = slope / q
        upward = slope * slope / q - 1.0
    ex = texture.kx / wave
    ey = texture.ky / wave
    return (
        texture.kx * shift / k2, texture.ky * shift / k2, gap,
        ex * ex * along, ex * ey * along, ex * mixed, ey * ey * along, ey * mixed, upward,
    )  # fmt: skip


def split_energy(
    x: float, y: float, z: float, continuity: float, texture: SinusoidArguments
) -> tuple[float, int, float]:
    """Return U [m²], the number of atoms, and the gap between U and the dual's lower bound [m²].

    The lower bound takes the globally nearest point of y from the sampler's own search.
    """
    amplitude = abs(texture.amplitude)
    k2 = texture.kx * texture.kx + texture.ky * texture.ky
    share = continuity / (1.0 + continuity)
    u = split_phase(x, y, texture)
    split, psi, c, _s = split_foot(abs(u), z, continuity, amplitude, k2 * amplitude)
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
    near_x, near_y, _h, _hx, _hy = foot(far_x, far_y, far_z, texture)
    near = far + texture.kx * (near_x - far_x) + texture.ky * (near_y - far_y)
    near_h = texture.amplitude * math.sin(texture.kx * near_x + texture.ky * near_y + texture.phase)
    # Products of sums and differences: squares would cancel.
    gap = (angle - near) * (angle + near - 2.0 * far) / k2 + (h - near_h) * (
        h + near_h - 2.0 * far_z
    )
    return value, 2 if split else 1, max(0.5 * share * gap, 0.0)
