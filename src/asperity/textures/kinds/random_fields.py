"""Random and band-limited fields on a periodic grid, for synthetic surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.core.checks import FloatArray

MIN_NODES_PER_WAVE = 4.0
"""Nodes per shortest wave below which the spline no longer represents it.

At 4 nodes the cubic spline through a sinusoid follows its height to 2.8 %, its slope to 5 % and its
second derivative to 22 % of their amplitudes; at 8 nodes to 0.12 %, 0.44 % and 5.2 % (measured).
"""


@dataclass(frozen=True)
class SelfAffineSpectrum:
    """An isotropic power spectrum on a period: a power law between roll-off and cut-off.

    The amplitude of a wave is q^(-decay) for wave numbers from 2π/rolloff to 2π/cutoff, constant
    below, and exactly zero above.

    Attributes:
        decay: half of the exponent of the power spectral density.
        rolloff: wavelength [m] beyond which the spectrum is flat.
        cutoff: shortest wavelength [m].
    """

    decay: float
    rolloff: float
    cutoff: float


def random_field(
    shape: tuple[int, int], size: tuple[float, float], band: SelfAffineSpectrum, seed: int
) -> FloatArray:
    """Return h = Σ a(q) cos(q · (x, y) + phase) at the nodes of a periodic grid.

    The amplitudes are those of the band, the phases uniform. The phase of wave (m, n), with
    q = 2π (m/L_x, n/L_y), depends on m, n and the seed only, not on pitch, cut-off or size. The
    root mean square is not normalised.

    Args:
        shape: nodes (ny, nx).
        size: (L_x, L_y) [m].
        band: the spectrum, with a cut-off of at least two nodes along both axes.
        seed: seed of the phases.
    """
    ny, nx = shape
    columns, rows = (math.floor(side / band.cutoff) for side in size)
    spectrum = np.zeros(shape, dtype=np.complex128)
    rng = np.random.default_rng(seed)
    for shell in range(1, max(columns, rows) + 1):
        m, n = _half_shell(shell)
        phase = 2.0 * np.pi * rng.random(len(m))
        inside = (np.abs(m) <= columns) & (n <= rows)
        m, n, phase = m[inside], n[inside], phase[inside]
        spectrum[n, m] = _amplitude(np.hypot(m / size[0], n / size[1]), band) * np.exp(1j * phase)
    return np.ascontiguousarray(np.fft.ifft2(spectrum).real) * (nx * ny)


def random_profile(count: int, size: float, band: SelfAffineSpectrum, seed: int) -> FloatArray:
    """Return a random profile; the phase of wave m depends on m and the seed only."""
    m = np.arange(1, math.floor(size / band.cutoff) + 1)
    phase = 2.0 * np.pi * np.random.default_rng(seed).random(len(m))
    spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
    spectrum[m] = _amplitude(m / size, band) * np.exp(1j * phase)
    return np.fft.irfft(spectrum, count) * (0.5 * count)


def _amplitude(frequency: FloatArray, band: SelfAffineSpectrum) -> FloatArray:
    """Return the amplitudes of waves of these frequencies [1/m]."""
    amplitude = np.maximum(frequency * band.rolloff, 1.0) ** -band.decay
    # The tolerance includes a wave of exactly the cut-off despite rounding.
    amplitude[frequency * band.cutoff > 1.0 + 1e-12] = 0.0
    return np.asarray(amplitude)


def _half_shell(shell: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the waves (m, n) with max(|m|, |n|) = shell, one of each pair (m, n), (-m, -n)."""
    side = np.arange(1, shell)
    m = np.r_[-shell : shell + 1, 0 * side - shell, 0 * side + shell, shell]
    n = np.r_[np.full(2 * shell + 1, shell), side, side, 0]
    return m, n


def scale_to_rms(field: FloatArray, rms: float) -> FloatArray:
    """Return the field scaled to a root mean square over its nodes; the field is not zero."""
    return np.asarray(field * (rms / math.sqrt(float(np.mean(field**2)))))


def low_pass(heights: FloatArray, nodes: float = MIN_NODES_PER_WAVE) -> FloatArray:
    """Return periodic heights without waves shorter than a number of nodes.

    Transfer function cos²(π q/(2 q_s)) up to q_s = 2π/(nodes · pitch), exactly zero above; one half
    at twice the shortest wavelength. Its step response overshoots by less than 1 %; a sharp cut-off
    would overshoot by 9 %.

    Args:
        heights: [m], shape (ny, nx), one period.
        nodes: shortest wavelength in nodes; at least 2.
    """
    ny, nx = heights.shape
    rho = nodes * np.hypot(np.fft.fftfreq(ny)[:, None], np.fft.rfftfreq(nx)[None, :])
    transfer = np.where(rho < 1.0, np.cos(0.5 * np.pi * np.minimum(rho, 1.0)) ** 2, 0.0)
    return np.ascontiguousarray(np.fft.irfft2(np.fft.rfft2(heights) * transfer, s=heights.shape))
