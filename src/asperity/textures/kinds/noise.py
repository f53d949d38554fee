"""Rough surfaces: band-limited, self-affine, periodic noise."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np

from asperity.core.arguments import Argument, check_integer
from asperity.core.checks import FloatArray, check_fraction, check_positive
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.textures.kinds.kind_tables import kind_arguments
from asperity.textures.spline.spline_texture import MIN_NODES, HeightMap, Profile, Spline
from asperity.textures.synthetic import (
    MIN_NODES_PER_WAVE,
    SelfAffineSpectrum,
    random_field,
    random_profile,
    scale_to_rms,
)

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
        rolloff = max(shortest / _ROLLOFF_PER_SIDE, cutoff) if rolloff is None else rolloff
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
