"""The waves that a texture is made of: amplitude against wavelength.

A sum of plane waves is taken wave by wave, exactly. A profile or a map is taken by its
periodogram, a map radially: every bin counts by its wavelength, whatever its direction. Bins of a
third of an octave are one wave, with the amplitude of the sinusoid of the same variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record
from asperity.kept import kept
from asperity.textures.plane_waves import PlaneWaves
from asperity.textures.texture import Texture

BANDS_PER_OCTAVE = 3
LEAST_SHARE = 1e-3
"""Bands with less of the variance of the heights, and of the force, are left out of the limits."""

# A sum of more waves than this is taken by bands.
_MOST_WAVES = 64
# What is less than this of the variance is the rounding of the transform.
_ROUNDING = 1e-18
# Rows of a map that are counted at once: what bounds the memory.
_ROWS = 512


@dataclass(frozen=True)
class Wave:
    """One wave of a texture, or all within a third of an octave.

    Attributes:
        wavelength: l [m]; of a band the mean, by variance, of the logarithms.
        amplitude: a [m]; of a band that of the sinusoid of the same variance.
        share: of the variance of the heights.
        vector: (k_x, k_y) [rad/m]; ``None`` for a band.
        phase: [rad], of a sin(k·x + phase); 0 for a band.
    """

    wavelength: float
    amplitude: float
    share: float
    vector: tuple[float, float] | None = None
    phase: float = 0.0


@dataclass(frozen=True)
class Spectrum(Record):
    """The waves of a texture, the longest first.

    Attributes:
        waves: the waves.
        exact: whether they are the waves of a sum, not bands of a periodogram.
        description: how they were found, in words.
    """

    written = "exact description wavelengths amplitudes"

    waves: tuple[Wave, ...]
    exact: bool
    description: str

    def __repr__(self) -> str:
        return f"<Spectrum of {len(self.waves)} waves: {self.description}>"

    @property
    def wavelengths(self) -> FloatArray:
        """Wavelengths l [m], shape (n,)."""
        return np.array([wave.wavelength for wave in self.waves])

    @property
    def amplitudes(self) -> FloatArray:
        """Amplitudes a [m], shape (n,)."""
        return np.array([wave.amplitude for wave in self.waves])


@dataclass(frozen=True)
class Bands:
    """Variance by third of an octave.

    Attributes:
        number: of the band, floor(3 log₂ f) with f in waves per metre, shape (n,), ascending.
        variance: in it, shape (n,).
        wavelength: mean, by variance, of the logarithms [m], shape (n,).
    """

    number: FloatArray
    variance: FloatArray
    wavelength: FloatArray


def spectrum(texture: Texture) -> Spectrum:
    """Return the waves of a texture.

    Args:
        texture: any kind; a flat one has no waves.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> [(wave.wavelength, wave.amplitude) for wave in spectrum(Sinusoid(4e-4, 1e-3)).waves]
        [(0.001, 0.0004)]
    """
    return kept("spectrum", texture.content, lambda: _spectrum(texture))


def _spectrum(texture: Texture) -> Spectrum:
    waves = _plane_waves(texture)
    if waves is not None and len(waves) <= _MOST_WAVES:
        return Spectrum(waves, True, "the waves of the sum")
    heights, spacing, repeats = texture.samples()
    found = banded(heights[None], spacing, repeats)
    total = float(found.variance.sum())
    # What is left of a constant height is rounding.
    if total <= 1e-24 * float(np.max(np.abs(heights)) ** 2):
        return Spectrum((), False, "flat")
    words = "third-octave bands of the periodogram" + ("" if texture.is_profile else ", radially")
    words += "" if repeats else ", Hann window"
    bands = zip(found.wavelength, found.variance, strict=True)
    return Spectrum(
        tuple(
            Wave(float(length), math.sqrt(2.0 * variance), float(variance) / total)
            for length, variance in bands
            if variance > _ROUNDING * total
        ),
        False,
        words,
    )


def _plane_waves(texture: Texture) -> tuple[Wave, ...] | None:
    """Return the waves of a texture that is one wave or a sum of them."""
    wave = texture.single_wave
    if wave is not None:
        k = 2.0 * math.pi / wave.period
        vector = (k * wave.direction[0], k * wave.direction[1])
        return (Wave(wave.period, wave.amplitude, 1.0, vector, wave.phase),)
    return None if texture.waves is None else _taken_together(texture.waves)


def _taken_together(given: PlaneWaves) -> tuple[Wave, ...]:
    """Return the waves of a sum, those along one wave vector as one."""
    summed: dict[tuple[float, float], complex] = {}
    for amplitude, (kx, ky), phase in zip(
        given.amplitudes.tolist(), given.wavevectors.tolist(), given.phases.tolist(), strict=True,
    ):  # fmt: skip
        # a sin(-k·x + φ) is a sin(k·x + π - φ).
        turned = (kx, ky) < (0.0, 0.0)
        vector = (-kx, -ky) if turned else (kx, ky)
        angle = math.pi - phase if turned else phase
        phasor = amplitude * complex(math.cos(angle), math.sin(angle))
        summed[vector] = summed.get(vector, 0.0) + phasor
    least = 1e-12 * float(np.abs(given.amplitudes).max())
    kept = {vector: phasor for vector, phasor in summed.items() if abs(phasor) > least}
    total = sum(abs(phasor) ** 2 for phasor in kept.values())
    waves = [
        Wave(
            2.0 * math.pi / math.hypot(*vector),
            abs(phasor),
            abs(phasor) ** 2 / total,
            vector,
            math.atan2(phasor.imag, phasor.real),
        )
        for vector, phasor in kept.items()
    ]
    return tuple(sorted(waves, key=lambda wave: -wave.wavelength))


def banded(values: FloatArray, spacing: tuple[float, float], repeats: bool) -> Bands:
    """Return the variance of values on a grid by wavelength, in third-octave bands.

    Args:
        values: shape (components, ny, nx); the variances of the components are added.
        spacing: of the points along x and y [m].
        repeats: whether the values repeat; else they are windowed (Hann).
    """
    import scipy.fft

    _components, ny, nx = values.shape
    across, along = _hann(ny, repeats), _hann(nx, repeats)
    power = float(across @ across) * float(along @ along) * nx * ny
    fx, fy = np.fft.rfftfreq(nx, spacing[0]), np.fft.fftfreq(ny, spacing[1])
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
        for first in range(0, ny, _ROWS):
            part = slice(first, first + _ROWS)
            variance = twice * np.abs(transform[part]) ** 2 / power
            _count(sums, np.hypot(fx, fy[part, None]), variance)
    numbers = sorted(sums)
    variances = np.array([sums[number][0] for number in numbers])
    logs = np.array([sums[number][1] for number in numbers])
    # A band without variance has no logarithms either, and no wavelength of its own.
    wavelength = np.exp(-logs / np.maximum(variances, np.finfo(float).tiny))
    return Bands(np.array(numbers, dtype=float), variances, wavelength)


def _count(sums: dict[int, list[float]], frequency: FloatArray, variance: FloatArray) -> None:
    """Add the variance of bins, and its product with ln f, to their bands."""
    moving = frequency > 0.0
    f, v = frequency[moving], variance[moving]
    number = np.floor(BANDS_PER_OCTAVE * np.log2(f)).astype(int)
    lowest = int(number.min(initial=0))
    totals = np.bincount(number - lowest, weights=v)
    logs = np.bincount(number - lowest, weights=v * np.log(f))
    for index in np.flatnonzero(np.bincount(number - lowest)):
        entry = sums.setdefault(int(index) + lowest, [0.0, 0.0])
        entry[0] += float(totals[index])
        entry[1] += float(logs[index])


def _hann(count: int, repeats: bool) -> FloatArray:
    """Return a window that a wave with a whole number of periods sees as three bins."""
    if repeats or count == 1:
        return np.ones(count)
    return np.asarray(0.5 - 0.5 * np.cos(2.0 * math.pi * (np.arange(count) + 0.5) / count))
