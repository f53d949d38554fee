"""Rough surfaces: random periodic heights with a self-affine, band-limited power spectrum."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from asperity.core.arguments import Argument, check_integer
from asperity.core.checks import FloatArray, check_fraction, check_positive
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.textures.kinds import kind_arguments
from asperity.textures.spline.spline_texture import MIN_NODES, HeightMap, Profile, Spline

DEFAULT_HURST = 0.8
# Defaults: 32 shortest waves per side, sampled finely enough that the spline is their sum.
_WAVES_PER_SIDE = 32.0
_ROLLOFF_PER_SIDE = 4.0
_NODES_PER_WAVE = 8.0
_MAX_NODES = 2**24
# Phases are generated for a square of waves, even for a narrow map: seconds for this many.
_MAX_WAVES = 4096


class _SelfAffine(Spline):
    """Common part of rough maps and rough profiles."""

    def __init__(
        self,
        rms: float,
        size: Any,
        pitch: float | None = None,
        hurst: float = DEFAULT_HURST,
        rolloff: float | None = None,
        cutoff: float | None = None,
        seed: int = 0,
    ) -> None:
        self.rms = check_positive("rms", rms, "m")
        self.hurst = check_fraction("hurst", hurst)
        self.seed = check_integer("seed", seed)
        self.size = self._check_size(size)
        counts, pitches, spectrum = self._plan_grid(pitch, rolloff, cutoff)
        field = scale_to_rms(self._random_field(counts, spectrum), self.rms)
        super().__init__(field, pitches if self.axes > 1 else pitches[0], periodic=True)

    @abstractmethod
    def _check_size(self, size: Any) -> Any:
        """Return the checked size [m]."""

    @abstractmethod
    def _random_field(self, counts: tuple[int, ...], spectrum: SelfAffineSpectrum) -> FloatArray:
        """Return a random field with this spectrum, of any root mean square."""

    def _plan_grid(
        self, pitch: float | None, rolloff: float | None, cutoff: float | None
    ) -> tuple[tuple[int, ...], tuple[float, ...], SelfAffineSpectrum]:
        """Return the numbers of nodes along each axis, their distances [m], and the spectrum."""
        sides = tuple(np.atleast_1d(self.size).tolist())
        shortest = min(sides)
        if cutoff is None and pitch is None:
            cutoff = shortest / _WAVES_PER_SIDE
        elif cutoff is None:
            cutoff = _NODES_PER_WAVE * check_positive("pitch", pitch, "m")
        cutoff = check_positive("cutoff", cutoff, "m")
        if cutoff > shortest:
            raise ParameterError("cutoff", f"must be at most the period, {shortest:g} m", cutoff)
        pitch = cutoff / _NODES_PER_WAVE if pitch is None else check_positive("pitch", pitch, "m")
        if pitch > cutoff / MIN_NODES_PER_WAVE * (1.0 + 1e-9):
            limit = f"must be at most a quarter of the cut-off {cutoff:g} m"
            raise ParameterError("pitch", f"{limit}, or the spline cannot follow", pitch)
        if rolloff is None:
            rolloff = max(shortest / _ROLLOFF_PER_SIDE, cutoff)
        if check_positive("rolloff", rolloff, "m") < cutoff:
            raise ParameterError("rolloff", f"must be at least the cut-off, {cutoff:g} m", rolloff)
        # The tolerance allows for the rounding of a side that is a whole number of pitches.
        numbers = [side / pitch - 1e-9 * (side / pitch) for side in sides]
        if math.prod(numbers) > _MAX_NODES:
            reason = f"requires {math.prod(numbers):.3g} nodes, at most 2^24 are possible"
            raise ParameterError("size", f"{reason}: reduce it, or increase cut-off and pitch")
        counts = tuple(max(math.ceil(count), MIN_NODES) for count in numbers)
        require_memory(*counts)
        self.rolloff = float(rolloff)
        self.cutoff = cutoff
        # Power q^(-d-2H) is the square of the amplitude.
        band = SelfAffineSpectrum(0.5 * len(sides) + self.hurst, self.rolloff, self.cutoff)
        return counts, tuple(side / n for side, n in zip(sides, counts, strict=True)), band

    def constructor_values(self) -> dict[str, Any]:
        """See :class:`Texture`; one pitch for both axes."""
        return super().constructor_values() | {"pitch": max(self._pitches)}


class Noise(_SelfAffine, HeightMap):
    """A self-affine rough surface, isotropic and periodic, by its power spectrum.

    C(q) ∝ max(q, q_r)^(-2 - 2H) for q <= q_s, and 0 above, with q_r = 2π/rolloff and
    q_s = 2π/cutoff. The phases are random, the amplitudes are not: every seed has this spectrum.
    The phase of wave (m, n) depends on m, n and the seed only, so a finer pitch or a shorter
    cut-off adds detail to a surface without changing the rest (up to the rms).

    Args:
        rms: root mean square of the heights [m], exact over the nodes (their mean is zero).
        size: the period [m], one number or (L_x, L_y).
        pitch: maximum spacing of the nodes [m]; reduced so that each side has a whole number of
            nodes. At most a quarter of the cut-off; by default an eighth.
        hurst: Hurst exponent H, 0 to 1; towards 0 is rougher.
        rolloff: wavelength [m] beyond which the spectrum is flat; by default a quarter of the
            shorter side.
        cutoff: shortest wavelength [m]; by default 8 pitches, or a 32nd of the shorter side where
            no pitch is given either.
        seed: whole number; the same seed gives the same surface (to rounding, on any machine).

    Raises:
        ParameterError: for a value that cannot be used, a pitch too coarse for the cut-off, a
            cut-off longer than the roll-off or the shorter side, more than 2^24 nodes, or a side
            longer than 4096 cut-offs.

    Reference:
        Jacobs, Junge and Pastewka, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001: power spectra
        of self-affine surfaces with roll-off.

    Example:
        >>> rough = Noise(rms=20e-6, size=10e-3, seed=3)
        >>> rough.heights.shape, round(float(rough.heights.std()), 12)
        ((256, 256), 2e-05)
    """

    kind: ClassVar[str] = "noise"
    constructor_arguments: ClassVar[tuple[Argument, ...]] = kind_arguments("noise")

    def _check_size(self, size: Any) -> tuple[float, float]:
        pair = (size, size) if np.ndim(size) == 0 else tuple(size)
        if len(pair) != 2:
            raise ParameterError("size", "must be one number or (L_x, L_y) [m]", size)
        return check_positive("size", pair[0], "m"), check_positive("size", pair[1], "m")

    def _random_field(self, counts: tuple[int, ...], spectrum: SelfAffineSpectrum) -> FloatArray:
        if max(self.size) > _MAX_WAVES * self.cutoff:
            longest = f"must not be longer than {_MAX_WAVES} cut-offs of {self.cutoff:g} m"
            raise ParameterError("size", longest, self.size)
        return random_field((counts[1], counts[0]), self.size, spectrum, self.seed)


class NoiseProfile(_SelfAffine, Profile):
    """A self-affine rough profile, periodic, by its power spectrum.

    C(q) ∝ max(q, q_r)^(-1 - 2H) for q <= q_s, and 0 above: the spectrum of a straight cut through
    a :class:`Noise` of the same exponent between roll-off and cut-off.

    Args:
        rms: see :class:`Noise`.
        size: the period [m].
        pitch: see :class:`Noise`.
        hurst: see :class:`Noise`.
        rolloff: see :class:`Noise`.
        cutoff: see :class:`Noise`.
        seed: see :class:`Noise`.

    Raises:
        ParameterError: see :class:`Noise`.

    Example:
        >>> rough = NoiseProfile(rms=5e-6, size=10e-3, cutoff=0.1e-3)
        >>> rough.is_profile, len(rough.heights)
        (True, 800)
    """

    kind: ClassVar[str] = "noise-profile"
    constructor_arguments: ClassVar[tuple[Argument, ...]] = kind_arguments("noise", "noise-profile")

    def _check_size(self, size: Any) -> float:
        return check_positive("size", size, "m")

    def _random_field(self, counts: tuple[int, ...], spectrum: SelfAffineSpectrum) -> FloatArray:
        return random_profile(counts[0], self.size, spectrum, self.seed)


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
    columns = math.floor(size[0] / band.cutoff)
    rows = math.floor(size[1] / band.cutoff)
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
