"""The spectrum of a texture: its waves, or third-octave bands of its heights.

A sum of plane waves is decomposed exactly, wave by wave. A profile or a map is decomposed by its
periodogram, a map radially: every bin counts by its wavelength in any direction. The bins of a
third of an octave form one wave, with the amplitude of the sinusoid of the same variance. Heights
that do not repeat are windowed, and the waves scaled to carry the variance of the heights.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from asperity.analysis.energy.straight_scan import parallel_line_points
from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray
from asperity.core.display import Text
from asperity.core.files import OMITTED, Serializable, content_digest, written
from asperity.textures.plane_waves import PlaneWaves
from asperity.textures.texture import Texture

BANDS_PER_OCTAVE = 3
MIN_SHARE = 1e-3
"""Bands with a smaller share of the variance of heights and of force are insignificant."""

# A sum of more waves than this is decomposed into bands.
_MAX_WAVES = 64
# Rounding of the transform, as a share of the variance.
_TRANSFORM_ROUNDING = 1e-18
# Samples per shortest wave along the lines that a tip traces, and of a line at most; one of so many
# lines of a map; points across what a ball can touch; least share of variance of a band with waves.
_TIP_SAMPLES = 16
_MAX_TIP_SAMPLES = 1024
_TIP_LINE_STEP = 4
_TIP_GRID = 33
_LEAST_TIP_SHARE = 1e-4
# Rows of a map processed at once, to bound the memory.
_ROWS_PER_BLOCK = 512


@dataclass(frozen=True)
class Wave:
    """One wave of a texture, or all within a third of an octave.

    Attributes:
        wavelength: l [m]; of a band the mean, by variance, of the logarithms.
        amplitude: a [m]; of a band that of the sinusoid of the same variance.
        share: share of the variance of the heights.
        vector: (k_x, k_y) [rad/m]; ``None`` for a band.
        phase: [rad], of a sin(k·x + phase); 0 for a band.
    """

    wavelength: float
    amplitude: float
    share: float
    vector: tuple[float, float] | None = None
    phase: float = 0.0


@dataclass(frozen=True)
class Spectrum(Serializable):
    """The waves of a texture, the longest first.

    Attributes:
        waves: the waves.
        exact: whether they are the waves of a sum, not bands of a periodogram.
        is_radial: whether bands are those of a map.
        is_windowed: whether the heights do not repeat, and were windowed (Hann); the amplitudes are
            scaled to the variance of the heights.
    """

    waves: tuple[Wave, ...] = field(metadata=OMITTED)
    exact: bool
    is_radial: bool = field(default=False, metadata=OMITTED)
    is_windowed: bool = field(default=False, metadata=OMITTED)
    description = Text[str]("The method, in words.")

    def __repr__(self) -> str:
        return f"<Spectrum of {len(self.waves)} waves: {self.description}>"

    @property
    @written
    def wavelengths(self) -> FloatArray:
        """Wavelengths l [m], shape (n,)."""
        return np.array([wave.wavelength for wave in self.waves])

    @property
    @written
    def amplitudes(self) -> FloatArray:
        """Amplitudes a [m], shape (n,)."""
        return np.array([wave.amplitude for wave in self.waves])

    @property
    def shares(self) -> FloatArray:
        """Shares of the variance of the heights, shape (n,)."""
        return np.array([wave.share for wave in self.waves])


@dataclass(frozen=True)
class Bands:
    """Variance by third of an octave.

    Attributes:
        number: numbers of the bands, floor(3 log₂ f) with f in waves per metre, shape (n,),
            ascending.
        variance: variances of the bands, shape (n,).
        wavelength: means, by variance, of the logarithms [m], shape (n,).
    """

    number: FloatArray
    variance: FloatArray
    wavelength: FloatArray


def compute_spectrum(texture: Texture) -> Spectrum:
    """Return the waves of a texture.

    Args:
        texture: a texture of any kind; a flat one has no waves.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> spectrum = compute_spectrum(Sinusoid(amplitude=4e-4, period=1e-3))
        >>> spectrum.wavelengths, spectrum.amplitudes
        (array([0.001]), array([0.0004]))
    """
    return get_or_compute("spectrum", texture.digest, lambda: _compute_spectrum(texture))


def _compute_spectrum(texture: Texture) -> Spectrum:
    plane_waves = _plane_waves(texture)
    if plane_waves is not None and len(plane_waves) <= _MAX_WAVES:
        return Spectrum(plane_waves, exact=True)
    heights, spacing, repeats = texture.samples()
    bands = band_variances(heights[None], spacing, repeats)
    # A window weighs the middle most: it decides the shares, not the variance.
    total = float(np.var(heights))
    # The variance of a constant height is rounding.
    if total <= 1e-24 * float(np.max(np.abs(heights)) ** 2):
        return Spectrum((), exact=False)
    waves = []
    for length, share in zip(bands.wavelength, bands.variance / bands.variance.sum(), strict=True):
        if share > _TRANSFORM_ROUNDING:
            waves.append(Wave(float(length), math.sqrt(2.0 * share * total), float(share)))
    return Spectrum(tuple(waves), False, not texture.is_profile, not repeats)


def _plane_waves(texture: Texture) -> tuple[Wave, ...] | None:
    """Return the waves of a texture that is one wave or a sum of them."""
    wave = texture.single_wave
    if wave is not None:
        k = 2.0 * math.pi / wave.period
        vector = (k * wave.direction[0], k * wave.direction[1])
        return (Wave(wave.period, wave.amplitude, 1.0, vector, wave.phase),)
    return None if texture.waves is None else _merge_waves(texture.waves)


def _merge_waves(plane_waves: PlaneWaves) -> tuple[Wave, ...]:
    """Return the waves of a sum, merged by wave vector."""
    summed: dict[tuple[float, float], complex] = {}
    for amplitude, (kx, ky), phase in zip(
        plane_waves.amplitudes.tolist(),
        plane_waves.wavevectors.tolist(),
        plane_waves.phases.tolist(),
        strict=True,
    ):
        # a sin(-k·x + φ) is a sin(k·x + π - φ).
        is_reversed = (kx, ky) < (0.0, 0.0)
        vector = (-kx, -ky) if is_reversed else (kx, ky)
        angle = math.pi - phase if is_reversed else phase
        phasor = amplitude * complex(math.cos(angle), math.sin(angle))
        summed[vector] = summed.get(vector, 0.0) + phasor
    least = 1e-12 * float(np.abs(plane_waves.amplitudes).max())
    phasors = {vector: phasor for vector, phasor in summed.items() if abs(phasor) > least}
    total = sum(abs(phasor) ** 2 for phasor in phasors.values())
    waves = [
        Wave(
            2.0 * math.pi / math.hypot(*vector),
            abs(phasor),
            abs(phasor) ** 2 / total,
            vector,
            math.atan2(phasor.imag, phasor.real),
        )
        for vector, phasor in phasors.items()
    ]
    return tuple(sorted(waves, key=lambda wave: -wave.wavelength))


def band_variances(values: FloatArray, spacing: tuple[float, float], is_periodic: bool) -> Bands:
    """Return the variance of values on a grid by wavelength, in third-octave bands.

    Args:
        values: shape (components, ny, nx); the variances of the components are added.
        spacing: of the points along x and y [m].
        is_periodic: whether the values repeat; else they are windowed (Hann).
    """
    import scipy.fft

    _components, ny, nx = values.shape
    across = _hann_window(ny, is_periodic)
    along = _hann_window(nx, is_periodic)
    power = float(across @ across) * float(along @ along) * nx * ny
    fx = np.fft.rfftfreq(nx, spacing[0])
    fy = np.fft.fftfreq(ny, spacing[1])
    twice = np.full(len(fx), 2.0)
    twice[0] = 1.0
    if nx % 2 == 0:
        twice[-1] = 1.0
    sums: dict[int, list[float]] = {}
    for component in values:
        level = float(across @ component @ along) / float(across.sum() * along.sum())
        windowed = (component - level) * along
        windowed *= across[:, None]
        transform = scipy.fft.rfft2(windowed, overwrite_x=True)
        for first in range(0, ny, _ROWS_PER_BLOCK):
            part = slice(first, first + _ROWS_PER_BLOCK)
            variance = twice * np.abs(transform[part]) ** 2 / power
            _add_to_bands(sums, np.hypot(fx, fy[part, None]), variance)
    numbers = sorted(sums)
    variances = np.array([sums[number][0] for number in numbers])
    logs = np.array([sums[number][1] for number in numbers])
    # A band without variance has no logarithms either, and no wavelength.
    wavelength = np.exp(-logs / np.maximum(variances, np.finfo(float).tiny))
    return Bands(np.array(numbers, dtype=float), variances, wavelength)


def tip_gain(texture: Texture, radius: float, band: tuple[float, float]) -> float | None:
    """Return the RMS of the waves that a ball traces over that of the height, within a band.

    The ball of radius R that rests on the surface has its lowest point at the greatest of
    h(p + d) - R + √(R² - |d|²). The surface is sampled along lines of a scan, and around them no
    farther than the ball can touch.

    Args:
        texture: a texture.
        radius: R [m].
        band: shortest and longest wavelength [m].

    Returns:
        The gain [1]; ``None`` where the lines have no such waves, or are too short for them.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave = Sinusoid(amplitude=4e-6, period=1e-3)  # a trough has a radius of 6.3 mm
        >>> [round(tip_gain(wave, radius, (9e-4, 1.1e-3)), 2) for radius in (1e-3, 20e-3)]
        [1.0, 0.48]
    """
    content = texture.digest and content_digest(texture.digest, radius, *band)
    return get_or_compute("tip gain", content, lambda: _compute_tip_gain(texture, radius, band))


def _compute_tip_gain(texture: Texture, radius: float, band: tuple[float, float]) -> float | None:
    line = texture.scan_line()
    count = min(max(math.ceil(_TIP_SAMPLES * line.length / band[0]), 64), _MAX_TIP_SAMPLES)
    points = parallel_line_points(texture, line, count)[::_TIP_LINE_STEP]
    heights = texture.height(points.reshape(-1, 2)).reshape(points.shape[:2])
    lost = min(texture.peak_to_valley, radius)
    reach = math.sqrt(lost * (2.0 * radius - lost))
    traced = heights
    side = np.linspace(-reach, reach, _TIP_GRID)
    for dx, dy in np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2):
        if math.hypot(dx, dy) <= reach:
            around = texture.height((points + np.array([dx, dy])).reshape(-1, 2)).reshape(
                heights.shape
            )
            drop = radius - math.sqrt(radius**2 - dx**2 - dy**2)
            traced = np.maximum(traced, around - drop)
    variances = []
    for values in (heights, traced):
        bands = band_variances(values[:, None], (line.length / count, 1.0), line.periodic)
        within = (bands.wavelength >= band[0]) & (bands.wavelength <= band[1])
        variances.append(float(bands.variance[within].sum()))
    is_short = not line.periodic and line.length < 2.0 * band[1]
    if is_short or not variances[0] > _LEAST_TIP_SHARE * float(np.var(heights)):
        return None
    return math.sqrt(variances[1] / variances[0])


def _add_to_bands(
    sums: dict[int, list[float]], frequency: FloatArray, variance: FloatArray
) -> None:
    """Add the variance of bins, and its product with ln f, to their bands."""
    moving = frequency > 0.0
    f = frequency[moving]
    v = variance[moving]
    number = np.floor(BANDS_PER_OCTAVE * np.log2(f)).astype(int)
    lowest = int(number.min(initial=0))
    totals = np.bincount(number - lowest, weights=v)
    logs = np.bincount(number - lowest, weights=v * np.log(f))
    for index in np.flatnonzero(np.bincount(number - lowest)):
        entry = sums.setdefault(int(index) + lowest, [0.0, 0.0])
        entry[0] += float(totals[index])
        entry[1] += float(logs[index])


def _hann_window(count: int, is_periodic: bool) -> FloatArray:
    """Return a window whose transform of a wave with whole periods has three bins."""
    if is_periodic or count == 1:
        return np.ones(count)
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * math.pi * (np.arange(count) + 0.5) / count))
