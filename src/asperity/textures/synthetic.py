"""Scale, filter and magnify synthetic textures.

Sums of waves remain exact sums of waves: each amplitude is multiplied by the transfer of the
filters. Other textures become the spline through their nodes, or through samples.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from asperity.core.arguments import document_arguments
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.measured import filters
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.measured.lengths import format_length
from asperity.measured.preparation import describe_magnification, magnification_factors
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.plane_waves import PlaneWaves
from asperity.textures.spline.spline_texture import fit_spline
from asperity.textures.texture import Texture


@document_arguments(SYNTHETIC_ARGUMENTS)
def prepare_texture(  # noqa: D417 - the others are described where they are declared
    texture: Texture,
    *,
    height_range: float | None = None,
    s_cutoff: float | None = None,
    l_cutoff: float | None = None,
    magnify: float = 1.0,
    magnify_height: float | None = None,
) -> Texture:
    """Return a texture prepared like a measured surface.

    The steps are, in this order: scale, filter (S, then L), magnify. Only the
    requested ones are done; the ``preparation`` of the result lists them.

    Args:
        texture: any texture; it is not changed.
        {arguments}

    Raises:
        ParameterError: for an argument that cannot be used.

    Example:
        >>> half = prepare_texture(Sinusoid(1e-3, 2e-3), s_cutoff=2e-3, magnify=3)
        >>> round(half.amplitude, 9), half.period, half.preparation[-1]
        (0.0015, 0.006, 'magnified 3 times laterally and in height')
    """
    lateral, vertical = magnification_factors(magnify, magnify_height)
    steps = [*texture.preparation]
    scale = 1.0
    if height_range is not None:
        before = format_length(texture.peak_to_valley)
        after = format_length(height_range)
        steps.append(f"heights scaled from {before} to {after} peak to valley")
        scale = _height_scale(texture, height_range)
    prepared: Texture
    if texture.waves is not None:
        amplitudes = _filter_amplitudes(texture.waves, scale * vertical, s_cutoff, l_cutoff)
        prepared = _scaled_waves(texture, texture.waves, amplitudes, lateral)
        steps += _filter_steps(s_cutoff, l_cutoff)
    else:
        if not texture.preparation:
            steps.insert(0, f"made from {texture!r}")
        heights, pitch, periodic = _sample(texture)
        heights = _filter_heights(scale * heights, pitch, periodic, s_cutoff, l_cutoff)
        steps += _filter_steps(s_cutoff, l_cutoff)
        grown = heights * vertical
        spacing = tuple(step * lateral for step in pitch)
        mask = texture.filled_mask
        prepared = fit_spline(grown, spacing, periodic=periodic, filled_mask=mask)
    if not lateral == vertical == 1.0:
        steps.append(describe_magnification(lateral, vertical))
    prepared.preparation = tuple(steps)
    return prepared


def _height_scale(texture: Texture, height_range: float) -> float:
    height = check_positive("height_range", height_range, "m")
    if texture.peak_to_valley == 0.0:
        raise ParameterError("height_range", "cannot be reached: the surface is flat")
    return height / texture.peak_to_valley


def _filter_amplitudes(
    waves: PlaneWaves, factor: float, s_cutoff: float | None, l_cutoff: float | None
) -> FloatArray:
    """Return the amplitudes times a factor and the transfer of the filters."""
    numbers = np.hypot(*waves.wavevectors.T)
    amplitudes = waves.amplitudes * factor
    for name, length in (("s_cutoff", s_cutoff), ("l_cutoff", l_cutoff)):
        if length is not None:
            short = filters.ALPHA * check_positive(name, length, "m") * numbers / (2.0 * math.pi)
            transfer = np.exp(-math.pi * short**2)
            amplitudes = amplitudes * (transfer if name == "s_cutoff" else 1.0 - transfer)
    return amplitudes


def _scaled_waves(
    texture: Texture, waves: PlaneWaves, amplitudes: FloatArray, lateral: float
) -> Texture:
    one = texture.single_wave
    if one is not None:
        return Sinusoid(float(amplitudes[0]), one.period * lateral, one.phase, one.direction)
    return Fourier(amplitudes, waves.wavevectors / lateral, waves.phases)


def _sample(texture: Texture) -> tuple[FloatArray, tuple[float, ...], bool]:
    """Return heights, (n,) or (ny, nx), pitch and whether they are periodic."""
    nodes, spacing, periodic = texture.samples()
    if abs(float(texture.domain.spans[0] @ (0.0, 1.0))) > 0.0:
        raise ParameterError("texture", "must have its period along x to be sampled")
    heights = np.array(nodes[0] if texture.is_profile else nodes)
    return heights, spacing[: heights.ndim], periodic


def _filter_heights(
    heights: FloatArray,
    pitch: tuple[float, ...],
    periodic: bool,
    s_cutoff: float | None,
    l_cutoff: float | None,
) -> FloatArray:
    if s_cutoff is not None or l_cutoff is not None:
        # Checks the cut-offs; the first node of the next period is one pitch from the last one.
        shape = tuple(count + periodic for count in heights.shape)
        filters.find_cutoffs(shape, pitch, s_cutoff, l_cutoff)
    if s_cutoff is not None:
        heights = filters.gaussian_filter(heights, pitch, s_cutoff, periodic=periodic)
    if l_cutoff is not None:
        heights = heights - filters.gaussian_filter(heights, pitch, l_cutoff, periodic=periodic)
    return heights


def _filter_steps(s_cutoff: float | None, l_cutoff: float | None) -> Iterator[str]:
    if s_cutoff is not None:
        yield f"filtered: Gaussian S-filter, cut-off {format_length(s_cutoff)}"
    if l_cutoff is not None:
        yield f"waviness removed: Gaussian L-filter, cut-off {format_length(l_cutoff)}"


Patch = tuple[FloatArray, tuple[float, float]]
"""Heights [m], (ny, nx), of one period of a synthetic surface, and the pitch (p_x, p_y) [m]."""
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
        m = m[inside]
        n = n[inside]
        phase = phase[inside]
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


def rough_field(
    shape: tuple[int, int],
    size: tuple[float, float],
    band: SelfAffineSpectrum,
    rms: float,
    seed: int,
) -> FloatArray:
    """Return a :func:`random_field` scaled to a root mean square."""
    return scale_to_rms(random_field(shape, size, band, seed), rms)


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
