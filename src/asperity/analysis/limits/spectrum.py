"""The waves that a texture is made of: amplitude against wavelength.

A sum of plane waves is taken wave by wave, exactly. A profile or a map is taken by its
periodogram, a map radially: every bin counts by its wavelength, whatever its direction. Bins of a
third of an octave are one wave, with the amplitude of the sinusoid of the same variance.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.textures.fourier import Fourier
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile
from asperity.textures.sinusoid import Sinusoid
from asperity.textures.texture import Texture

BANDS_PER_OCTAVE = 3
LEAST_SHARE = 1e-3
"""Bands with less of the variance of the heights, and of the force, are left out of the limits."""

# A sum of more waves than this is taken by bands.
_MOST_WAVES = 64
# Points of a texture that has no nodes of its own: along a profile, along each side of a map.
_LINE_POINTS, _SIDE_POINTS = 2**15, 1024
_POINTS_PER_WAVE = 8.0
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
class Spectrum:
    """The waves of a texture, the longest first.

    Attributes:
        waves: the waves.
        exact: whether they are the waves of a sum, not bands of a periodogram.
        description: how they were found, in words.
    """

    waves: tuple[Wave, ...]
    exact: bool
    description: str

    @property
    def wavelengths(self) -> FloatArray:
        """Wavelengths l [m], shape (n,)."""
        return np.array([wave.wavelength for wave in self.waves])

    @property
    def amplitudes(self) -> FloatArray:
        """Amplitudes a [m], shape (n,)."""
        return np.array([wave.amplitude for wave in self.waves])

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            "exact": self.exact,
            "description": self.description,
            "wavelengths": self.wavelengths.tolist(),
            "amplitudes": self.amplitudes.tolist(),
        }


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
    waves = _plane_waves(texture)
    if waves is not None and len(waves) <= _MOST_WAVES:
        return Spectrum(waves, True, "the waves of the sum")
    heights, spacing, repeats = samples(texture)
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
    """Return the waves of a sinusoid or a sum, those along one wave vector taken together."""
    if isinstance(texture, Sinusoid):
        k = 2.0 * math.pi / texture.period
        vector = (k * texture.direction[0], k * texture.direction[1])
        return (Wave(texture.period, texture.amplitude, 1.0, vector, texture.phase),)
    if not isinstance(texture, Fourier):
        return None
    summed: dict[tuple[float, float], complex] = {}
    for amplitude, (kx, ky), phase in zip(
        texture.amplitudes.tolist(), texture.wavevectors.tolist(), texture.phases.tolist(),
        strict=True,
    ):  # fmt: skip
        # a sin(-k·x + φ) is a sin(k·x + π - φ).
        turned = (kx, ky) < (0.0, 0.0)
        vector = (-kx + 0.0, -ky + 0.0) if turned else (kx + 0.0, ky + 0.0)
        angle = math.pi - phase if turned else phase
        phasor = amplitude * complex(math.cos(angle), math.sin(angle))
        summed[vector] = summed.get(vector, 0.0) + phasor
    least = 1e-12 * float(np.abs(texture.amplitudes).max())
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


def samples(texture: Texture) -> tuple[FloatArray, tuple[float, float], bool]:
    """Return heights on a grid of the texture's domain.

    The nodes of a profile or a map; for other kinds a grid of eight points per shortest wave.

    Returns:
        Heights [m], shape (ny, nx), (1, nx) for a profile; spacing (x, y) [m]; whether they
        repeat, so that no window is needed.
    """
    if isinstance(texture, HeightMap):
        return texture.heights, texture.pitch, texture.periodic
    if isinstance(texture, Profile):
        return texture.heights[None], (texture.pitch, texture.pitch), texture.periodic
    points, spacing, repeats = grid(texture)
    return texture.height(points.reshape(-1, 2)).reshape(points.shape[:2]), spacing, repeats


def grid(texture: Texture, most: int | None = None) -> tuple[FloatArray, tuple[float, float], bool]:
    """Return the points of :func:`samples`.

    Args:
        texture: any kind.
        most: points along each side; from the middle of a larger texture. All by default.

    Returns:
        Points [m], shape (ny, nx, 2), (1, nx, 2) for a profile; spacing (x, y) [m]; whether they
        are a whole period.
    """
    spans, repeats = _rectangle(texture)
    sides = np.hypot(*spans.T)
    counts = _counts(texture, sides)
    # A finite map has a node at both ends, a periodic one does not repeat its first.
    steps = sides / (counts if texture.domain.periodic else counts - 1)
    first = np.zeros_like(counts)
    if most is not None and counts.max() > most:
        repeats = False
        first = np.maximum((counts - most) // 2, 0)
        counts = np.minimum(counts, most)
    ticks = [
        (begin + np.arange(count)) * step / side
        for begin, count, step, side in zip(first, counts, steps, sides, strict=True)
    ]
    points = texture.domain.origin + np.stack(np.meshgrid(*ticks), axis=-1) @ spans
    points = points[None] if len(ticks) == 1 else points
    return points, (float(steps[0]), float(steps[-1])), repeats


def _rectangle(texture: Texture) -> tuple[FloatArray, bool]:
    """Return spans at right angles, and whether the texture repeats along them."""
    spans, periodic = texture.domain.spans, texture.domain.periodic
    if len(spans) == 1:
        return spans, periodic
    along = spans[0] / np.hypot(*spans[0])
    across = spans[1] - float(spans[1] @ along) * along
    skew = float(np.hypot(*(spans[1] - across)))
    square = skew < 1e-9 * float(np.hypot(*across))
    return np.array([spans[0], across]), periodic and square


def _counts(texture: Texture, sides: FloatArray) -> NDArray[np.intp]:
    """Return the number of points along each side."""
    if isinstance(texture, HeightMap | Profile):
        return np.array(texture.heights.shape[::-1], dtype=np.intp)
    most = _LINE_POINTS if len(sides) == 1 else _SIDE_POINTS
    if not isinstance(texture, Fourier):
        return np.full(len(sides), most, dtype=np.intp)
    shortest = 2.0 * math.pi / float(np.hypot(*texture.wavevectors.T).max())
    wanted = np.ceil(_POINTS_PER_WAVE * sides / shortest)
    return np.clip(wanted, 16, most).astype(np.intp)


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
    with np.errstate(divide="ignore", invalid="ignore"):
        wavelength = np.exp(-np.where(variances > 0.0, logs / variances, 0.0))
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
