"""Rough surfaces: band-limited, self-affine, periodic noise."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from asperity.arguments import SEED, Argument, whole
from asperity.checks import fraction, positive
from asperity.errors import ParameterError
from asperity.memory import reserve
from asperity.textures.heightmap import HeightMap
from asperity.textures.profile import Profile
from asperity.textures.spline import LEAST_NODES, Spline
from asperity.textures.texture import Kind
from asperity.textures.waves import LEAST_NODES_PER_WAVE, Band, random_field, random_line, with_rms

DEFAULT_HURST = 0.8
# Unless given: a texture of thirty waves, sampled so finely that the spline is the sum of them.
_WAVES_PER_SIDE = 32.0
_ROLLOFF_PER_SIDE = 4.0
_NODES_PER_WAVE = 8.0
_MOST_NODES = 2**24
# The phases of a square of waves are drawn, however narrow the map: seconds at this many.
_MOST_WAVES = 4096


class _SelfAffine(Spline):
    """What a rough map and a rough profile have in common."""

    rms: float
    hurst: float
    seed: int
    size: float | tuple[float, float]

    def _plan(
        self,
        sides: tuple[float, ...],
        pitch: float | None,
        rolloff: float | None,
        cutoff: float | None,
    ) -> tuple[tuple[int, ...], tuple[float, ...], Band]:
        """Return how many nodes along each axis, their distances [m], and the spectrum."""
        shortest = min(sides)
        if cutoff is None and pitch is None:
            cutoff = shortest / _WAVES_PER_SIDE
        elif cutoff is None:
            cutoff = _NODES_PER_WAVE * positive("pitch", pitch, "m")
        cutoff = positive("cutoff", cutoff, "m")
        if cutoff > shortest:
            raise ParameterError("cutoff", f"must be at most the period, {shortest:g} m", cutoff)
        pitch = cutoff / _NODES_PER_WAVE if pitch is None else positive("pitch", pitch, "m")
        if pitch > cutoff / LEAST_NODES_PER_WAVE * (1.0 + 1e-9):
            raise ParameterError("pitch", f"must be at most a quarter of the cut-off {cutoff:g} m, "
                                 "or the spline cannot follow", pitch)  # fmt: skip
        rolloff = max(shortest / _ROLLOFF_PER_SIDE, cutoff) if rolloff is None else rolloff
        if positive("rolloff", rolloff, "m") < cutoff:
            raise ParameterError("rolloff", f"must be at least the cut-off, {cutoff:g} m", rolloff)
        # The tiny share forgives the rounding of a side that is a whole number of pitches.
        wanted = [side / pitch - 1e-9 * (side / pitch) for side in sides]
        if math.prod(wanted) > _MOST_NODES:
            short = f"asks for {math.prod(wanted):.3g} nodes, at most 2^24 can be used"
            advice = "give a smaller size, or a longer cut-off and pitch"
            raise ParameterError("size", f"{short}: {advice}")
        counts = tuple(max(math.ceil(count), LEAST_NODES) for count in wanted)
        reserve(*counts)
        self.rolloff, self.cutoff = float(rolloff), cutoff
        # Power q^(-d-2H) is the square of the amplitude.
        band = Band(0.5 * len(sides) + self.hurst, self.rolloff, self.cutoff)
        return counts, tuple(side / n for side, n in zip(sides, counts, strict=True)), band

    def __repr__(self) -> str:
        return (
            f"{type(self).__name__}(rms={self.rms!r}, size={self.size!r}, "
            f"pitch={max(self._pitches)!r}, hurst={self.hurst!r}, rolloff={self.rolloff!r}, "
            f"cutoff={self.cutoff!r}, seed={self.seed})"
        )

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        own = {
            "kind": self.kind,
            "rms": self.rms,
            "size": np.array(self.size).tolist(),
            "hurst": self.hurst,
            "rolloff": self.rolloff,
            "cutoff": self.cutoff,
            "seed": self.seed,
        }
        return own | super().describe()


class Noise(_SelfAffine, HeightMap):
    """A self-affine rough surface, isotropic and periodic, by its power spectrum.

    C(q) ∝ max(q, q_r)^(-2 - 2H) for q <= q_s, and 0 above, with q_r = 2π/rolloff and
    q_s = 2π/cutoff. The phases are random, the amplitudes are not: every seed has this spectrum.
    The phase of wave (m, n) depends on m, n and the seed only, so a finer pitch or a shorter
    cut-off adds to a surface without changing what is there (but for the rms).

    Args:
        rms: root mean square of the heights [m], exact over the nodes (their mean is zero).
        size: the period [m], one number or (L_x, L_y).
        pitch: greatest distance of the nodes [m]; made smaller so that each side has a whole
            number of nodes. At most a quarter of the cut-off; by default an eighth.
        hurst: Hurst exponent H, 0 to 1; towards 0 is rougher.
        rolloff: wavelength [m] beyond which the spectrum is flat; by default a quarter of the
            shorter side.
        cutoff: shortest wavelength [m]; by default 8 pitches, or a 32nd of the shorter side where
            no pitch is given either.
        seed: whole number; the same seed makes the same surface (to rounding, on any machine).

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

    def __init__(
        self,
        rms: float,
        size: float | Sequence[float],
        pitch: float | None = None,
        hurst: float = DEFAULT_HURST,
        rolloff: float | None = None,
        cutoff: float | None = None,
        seed: int = 0,
    ) -> None:
        self.rms, self.hurst = positive("rms", rms, "m"), fraction("hurst", hurst)
        self.seed = whole("seed", seed)
        self.size = _pair(size)
        counts, pitches, band = self._plan(self.size, pitch, rolloff, cutoff)
        if max(self.size) > _MOST_WAVES * self.cutoff:
            longest = f"must not be longer than {_MOST_WAVES} cut-offs of {self.cutoff:g} m"
            raise ParameterError("size", longest, size)
        field = random_field((counts[1], counts[0]), self.size, band, self.seed)
        super().__init__(with_rms(field, self.rms), pitches, periodic=True)


class NoiseProfile(_SelfAffine, Profile):
    """A self-affine rough profile, periodic, by its power spectrum.

    C(q) ∝ max(q, q_r)^(-1 - 2H) for q <= q_s, and 0 above: what a straight cut through a
    :class:`Noise` of the same exponent tends to between roll-off and cut-off.

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

    def __init__(
        self,
        rms: float,
        size: float,
        pitch: float | None = None,
        hurst: float = DEFAULT_HURST,
        rolloff: float | None = None,
        cutoff: float | None = None,
        seed: int = 0,
    ) -> None:
        self.rms, self.hurst = positive("rms", rms, "m"), fraction("hurst", hurst)
        self.seed = whole("seed", seed)
        self.size = positive("size", size, "m")
        counts, pitches, band = self._plan((self.size,), pitch, rolloff, cutoff)
        field = random_line(counts[0], self.size, band, self.seed)
        super().__init__(with_rms(field, self.rms), pitches[0], periodic=True)


def _pair(size: float | Sequence[float]) -> tuple[float, float]:
    both = (size, size) if np.ndim(size) == 0 else tuple(size)  # type: ignore[arg-type]  # narrowed by ndim
    if len(both) != 2:
        raise ParameterError("size", "must be one number or (L_x, L_y) [m]", size)
    return positive("size", both[0], "m"), positive("size", both[1], "m")


def _arguments(size: Argument) -> tuple[Argument, ...]:
    return (
        Argument("rms", "root mean square height", "m", required=True),
        size,
        Argument("pitch", "greatest distance of the nodes", "m", default_words="cutoff/8"),
        Argument("hurst", "Hurst exponent", default=DEFAULT_HURST, high=1.0),
        Argument("rolloff", "flat spectrum beyond this wavelength", "m", default_words="size/4"),
        Argument("cutoff", "shortest wavelength", "m", default_words="size/32"),
        SEED,
    )


NOISE = Kind(
    "noise",
    "rough surface: self-affine, isotropic, band-limited",
    Noise,
    _arguments(Argument("size", "period along x and y", "m", form="pair", required=True)),
    example={"rms": 20e-6, "size": 10e-3},
)
NOISE_PROFILE = Kind(
    "noise-profile",
    "rough profile: the same along x only",
    NoiseProfile,
    _arguments(Argument("size", "period", "m", required=True)),
    example={"rms": 20e-6, "size": 10e-3},
)
