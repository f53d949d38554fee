"""A sum of plane waves."""

from __future__ import annotations

import math
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array
from asperity.enclosures.cells import Cells
from asperity.errors import ParameterError
from asperity.kept import content_digest, is_shipped, kept
from asperity.textures.cells.lines import Pieces, wave_pieces
from asperity.textures.cells.waves import WaveCells
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.plane_waves import PlaneWaves, check_bend
from asperity.textures.samplers.fourier import FourierArguments
from asperity.textures.texture import ExactHeight, Texture

# How many of the longest waves stand for a sum that never repeats.
_WAVES_OF_AN_ENDLESS_SUM = 16
_CELL_LIMIT = 400_000
_SAID = 8  # waves that its repr lists
# Suprema are searched over at most this many independent phases.
_LARGEST_TORUS = 4
_LARGEST_TORUS_OF_HEIGHTS = 3


class Fourier(Texture):
    """h(x, y) = Σ a_i sin(k_i · (x, y) + phase_i).

    Args:
        amplitudes: a_i [m], shape (n,).
        wavevectors: k_i [rad/m], shape (n, 2); shape (n,) for a profile along x.
        phases: [rad], shape (n,); zeros by default.

    Raises:
        ParameterError: for shapes that do not match, values that are not finite, no wave at all,
            or a wave vector of length zero.

    Example:
        >>> texture = Fourier([1e-3, 0.5e-3], [[2000.0, 0.0], [4000.0, 0.0]])
        >>> texture.is_profile, round(float(texture.domain.spans[0, 0]) * 1e3, 6)
        (True, 3.141593)
    """

    kind: ClassVar[str] = "fourier"

    def __init__(
        self, amplitudes: ArrayLike, wavevectors: ArrayLike, phases: ArrayLike | None = None
    ) -> None:
        self.amplitudes = array("amplitudes", amplitudes, (None,), "m").copy()
        count = len(self.amplitudes)
        if count == 0:
            raise ParameterError("amplitudes", "must name at least one wave")
        waves = np.asarray(wavevectors, dtype=object)
        if waves.ndim == 1 and len(waves) == count:
            wavevectors = [[k, 0.0] for k in waves]
        self.wavevectors = array("wavevectors", wavevectors, (count, 2), "rad/m").copy()
        if not self.wavevectors.any(axis=1).all():
            raise ParameterError("wavevectors", "must not contain a vector of length zero")
        with np.errstate(over="ignore"):
            bend = float(np.abs(self.amplitudes) @ np.hypot(*self.wavevectors.T) ** 2)
        check_bend("amplitudes", bend, "wavevectors")
        given = np.zeros(count) if phases is None else phases
        self.phases = array("phases", given, (count,), "rad").copy()

    def __repr__(self) -> str:
        if len(self.amplitudes) > _SAID:
            return f"<Fourier of {len(self.amplitudes)} waves>"
        return (
            f"Fourier(amplitudes={self.amplitudes.tolist()}, "
            f"wavevectors={self.wavevectors.tolist()}, phases={self.phases.tolist()})"
        )

    @cached_property
    def content(self) -> str | None:
        """See :class:`Texture`; what it was made of."""
        if not is_shipped(type(self)):
            return None
        return content_digest(
            type(self).__qualname__, self.amplitudes, self.wavevectors, self.phases
        )

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.nearest import line_search, line_within, plane_search, plane_within
        from asperity.textures.samplers import fourier, fourier_line, sine

        if self._parallel:
            return fourier_line, fourier, line_search, line_within, sine
        return fourier, plane_search, plane_within, sine

    @cached_property
    def arguments(self) -> FourierArguments:
        """See :class:`Texture`."""
        length = np.hypot(*self.wavevectors.T)
        inflate = 1.0 + 1e-14 * len(length)
        twist = inflate * float(np.abs(self.amplitudes) @ length**3)
        shortest = float(length.max())
        kx, ky = (np.ascontiguousarray(column) for column in self.wavevectors.T)
        low, high = self.extremes
        ux, uy = self._directions[0].tolist()
        return FourierArguments(
            self.amplitudes, kx, ky, self.phases,
            self.bounds[1], twist, low, high, shortest, ux, uy,
        )  # fmt: skip

    @cached_property
    def _directions(self) -> FloatArray:
        directions: FloatArray = self.wavevectors / np.hypot(*self.wavevectors.T)[:, None]
        return directions

    @cached_property
    def _parallel(self) -> bool:
        first = self._directions[0]
        cross = first[0] * self._directions[:, 1] - first[1] * self._directions[:, 0]
        return bool(np.abs(cross).max() < 1e-14)

    @cached_property
    def waves(self) -> PlaneWaves:
        """The waves of the sum."""
        return PlaneWaves(self.amplitudes, self.wavevectors, self.phases)

    def exact_height(self) -> ExactHeight:
        """See :class:`Texture`."""
        from asperity.textures.exact import exact_waves

        columns = (self.amplitudes, *self.wavevectors.T, self.phases)
        return exact_waves(list(zip(*columns, strict=True)))

    def cells(self, extent: tuple[float, float] | None = None, margin: float = 0.0) -> Cells | None:
        """See :class:`Texture`; more than four independent phases need an extent."""
        cells = WaveCells(self.waves, extent, margin)
        return cells if cells.dimensions <= _LARGEST_TORUS else None

    def sampling_cells(self) -> Cells:
        """See :class:`Texture`; of an endless sum those of a rectangle of the plane."""
        width, depth = (float(side) for side in np.abs(self.domain.spans).sum(axis=0))
        return self.cells() or WaveCells(self.waves, (width, depth))

    def line_pieces(self, line: ScanLine, least: int) -> Pieces:
        """See :class:`Texture`."""
        return wave_pieces(self.waves, line, least)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height [m], certified on the torus of independent phases."""
        return kept("extremes", self.content, self._extremes)

    def _extremes(self) -> tuple[float, float]:
        return -self._supremum(-self.amplitudes), self._supremum(self.amplitudes)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Σ |a k| and Σ |a| k²: triangle inequality."""
        length = np.hypot(*self.wavevectors.T)
        size = np.abs(self.amplitudes)
        inflate = 1.0 + 1e-14 * len(size)
        return float(size @ length) * inflate, float(size @ length**2) * inflate

    @cached_property
    def _periods(self) -> FloatArray | None:
        """Edge vectors of one period [m], or nothing for a sum that never repeats."""
        basis, _multiples = self.waves.lattice
        if len(basis) == 1:
            periods: FloatArray = 2.0 * math.pi * basis / np.sum(basis**2)
            return periods
        if len(basis) == 2 and not self._parallel:
            return np.ascontiguousarray(2.0 * math.pi * np.linalg.inv(basis).T)
        return None

    @cached_property
    def domain(self) -> Domain:
        """One period; for a sum that never repeats, 16 of its longest waves in each direction."""
        if self._periods is not None:
            return Domain(np.zeros(2), self._periods, periodic=True, description="one period")
        side = self._endless_side
        spans = side * (self._directions[:1] if self._parallel else np.eye(2))
        text = f"never repeats; {_WAVES_OF_AN_ENDLESS_SUM} of its longest waves"
        return Domain(np.zeros(2), spans, periodic=False, description=text)

    @property
    def _endless_side(self) -> float:
        longest = 2.0 * math.pi / float(np.hypot(*self.wavevectors.T).min())
        return _WAVES_OF_AN_ENDLESS_SUM * longest

    def scan_line(self) -> ScanLine:
        """Along x where the sum repeats along x or never does, else along its shortest period."""
        origin = np.zeros(2)
        if self._periods is None:
            direction = self._directions[0] if self._parallel else np.array([1.0, 0.0])
            return ScanLine(origin, direction, self._endless_side, periodic=False)
        vector = self._periods[0]
        if len(self._periods) == 2:
            vector = self._period_along_x(self._periods)
        length = float(np.hypot(*vector))
        return ScanLine(origin, vector / length, length, periodic=True)

    def _period_along_x(self, periods: FloatArray) -> FloatArray:
        multiples = np.array(
            [[m, n] for m in range(-8, 9) for n in range(-8, 9) if (m, n) != (0, 0)]
        )
        vectors = multiples @ periods
        lengths = np.hypot(*vectors.T)
        along_x = (np.abs(vectors[:, 1]) < 1e-9 * lengths) & (vectors[:, 0] > 0.0)
        candidates = vectors[along_x] if along_x.any() else vectors
        return np.asarray(candidates[np.argmin(np.hypot(*candidates.T))])

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        return {
            "kind": self.kind,
            "amplitudes": self.amplitudes.tolist(),
            "wavevectors": self.wavevectors.tolist(),
            "phases": self.phases.tolist(),
        }

    def _supremum(self, amplitudes: FloatArray) -> float:
        """Return sup Σ a_i sin(θ_i + phase_i) by branch and bound on the torus of phases."""
        total = float(np.abs(amplitudes).sum())
        _basis, multiples = self.waves.lattice
        rank = multiples.shape[1]
        if rank == len(amplitudes) or rank > _LARGEST_TORUS_OF_HEIGHTS:
            return total  # every phase is free, or more are than can be searched: a safe bound
        bend = float(np.abs(amplitudes) @ (multiples**2).sum(axis=1))
        start = min(4 * int(np.abs(multiples).max()) + 4, int(_CELL_LIMIT ** (1.0 / rank)))
        half = math.pi / start
        ticks = half * (2.0 * np.arange(start) + 1.0)
        centres = np.stack(np.meshgrid(*[ticks] * rank, indexing="ij"), axis=-1).reshape(-1, rank)
        corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * rank, indexing="ij"), -1).reshape(-1, rank)
        best, outer = -math.inf, total
        while True:
            angles = centres @ multiples.T + self.phases
            values = np.sin(angles) @ amplitudes
            slopes = np.abs((np.cos(angles) * amplitudes) @ multiples)
            upper = values + half * slopes.sum(axis=1) + 0.5 * bend * rank * half * half
            best = max(best, float(values.max()))
            outer = min(outer, float(upper.max()))
            keep = upper > best + 1e-14 * total
            if outer - best <= 1e-13 * total or not keep.any() or half < 1e-9:
                return best
            centres = (centres[keep][:, None, :] + half * corners).reshape(-1, rank)
            half *= 0.5
            if len(centres) > _CELL_LIMIT:
                return outer  # a safe bound: too many cells are equally high
