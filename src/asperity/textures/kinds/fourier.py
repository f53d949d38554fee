"""A sum of plane waves."""

from __future__ import annotations

import math
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.arguments import Argument
from asperity.core.cache import get_or_compute
from asperity.core.checks import FloatArray, check_array
from asperity.core.errors import ParameterError
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.kinds import kind_arguments
from asperity.textures.kinds.fourier_sampler import FourierArguments
from asperity.textures.plane_waves import PlaneWaves, check_curvature
from asperity.textures.texture import ExactHeight, Texture

# Side of the domain of an aperiodic sum, in longest wavelengths.
_APERIODIC_EXTENT_WAVES = 16
_CELL_LIMIT = 400_000
_MAX_REPR_WAVES = 8
# Greatest number of independent phases over which extremes are searched.
_MAX_PHASES_OF_HEIGHTS = 3


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
    constructor_arguments: ClassVar[tuple[Argument, ...]] = kind_arguments("fourier")

    def __init__(
        self, amplitudes: ArrayLike, wavevectors: ArrayLike, phases: ArrayLike | None = None
    ) -> None:
        self.amplitudes = check_array("amplitudes", amplitudes, (None,), "m").copy()
        count = len(self.amplitudes)
        if count == 0:
            raise ParameterError("amplitudes", "must name at least one wave")
        waves = np.asarray(wavevectors, dtype=object)
        if waves.ndim == 1 and len(waves) == count:
            wavevectors = [[k, 0.0] for k in waves]
        self.wavevectors = check_array("wavevectors", wavevectors, (count, 2), "rad/m").copy()
        if not self.wavevectors.any(axis=1).all():
            raise ParameterError("wavevectors", "must not contain a vector of length zero")
        with np.errstate(over="ignore"):
            curvature = float(np.abs(self.amplitudes) @ np.hypot(*self.wavevectors.T) ** 2)
        check_curvature("amplitudes", curvature, "wavevectors")
        if phases is None:
            phases = np.zeros(count)
        self.phases = check_array("phases", phases, (count,), "rad").copy()

    def __repr__(self) -> str:
        if len(self.amplitudes) > _MAX_REPR_WAVES:
            return f"<Fourier of {len(self.amplitudes)} waves>"
        return super().__repr__()

    def constructor_values(self) -> dict[str, Any]:
        """See :class:`Texture`; lists instead of arrays."""
        return {name: values.tolist() for name, values in super().constructor_values().items()}

    def _content(self) -> tuple[Any, ...]:
        return self.amplitudes, self.wavevectors, self.phases

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts import closest_search, distance_bounds
        from asperity.textures.kinds import fourier_sampler, sine

        return fourier_sampler, closest_search, distance_bounds, sine

    @cached_property
    def arguments(self) -> FourierArguments:
        """See :class:`Texture`."""
        length = np.hypot(*self.wavevectors.T)
        inflate = 1.0 + 1e-14 * len(length)
        third = inflate * float(np.abs(self.amplitudes) @ length**3)
        fourth = inflate * float(np.abs(self.amplitudes) @ length**4)
        kx = np.ascontiguousarray(self.wavevectors[:, 0])
        ky = np.ascontiguousarray(self.wavevectors[:, 1])
        low, high = self.extremes
        ux, uy = self._directions[0].tolist() if self._is_parallel else (1.0, 0.0)
        return FourierArguments(
            self.amplitudes,
            kx,
            ky,
            self.phases,
            self.bounds[1],
            third,
            low,
            high,
            float(length.max()),
            ux,
            uy,
            self._is_parallel,
            fourth,
        )

    @cached_property
    def _directions(self) -> FloatArray:
        directions: FloatArray = self.wavevectors / np.hypot(*self.wavevectors.T)[:, None]
        return directions

    @cached_property
    def _is_parallel(self) -> bool:
        first = self._directions[0]
        cross = first[0] * self._directions[:, 1] - first[1] * self._directions[:, 0]
        return bool(np.abs(cross).max() < 1e-14)

    @cached_property
    def waves(self) -> PlaneWaves:
        """The waves of the sum."""
        return PlaneWaves(self.amplitudes, self.wavevectors, self.phases)

    def exact_height(self) -> ExactHeight:
        """See :class:`Texture`."""
        from asperity.textures.exact_heights import exact_waves

        columns = (self.amplitudes, *self.wavevectors.T, self.phases)
        return exact_waves(list(zip(*columns, strict=True)))

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height [m], certified on the torus of independent phases."""
        return get_or_compute(
            "extremes",
            self.digest,
            lambda: (-self._supremum(-self.amplitudes), self._supremum(self.amplitudes)),
        )

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Σ |a k| and Σ |a| k²: triangle inequality."""
        length = np.hypot(*self.wavevectors.T)
        size = np.abs(self.amplitudes)
        inflate = 1.0 + 1e-14 * len(size)
        return float(size @ length) * inflate, float(size @ length**2) * inflate

    @cached_property
    def _periods(self) -> FloatArray | None:
        """Edge vectors of one period [m]; ``None`` for an aperiodic sum."""
        basis, _multiples = self.waves.lattice
        if len(basis) == 1:
            periods: FloatArray = 2.0 * math.pi * basis / np.sum(basis**2)
            return periods
        if len(basis) == 2 and not self._is_parallel:
            return np.ascontiguousarray(2.0 * math.pi * np.linalg.inv(basis).T)
        return None

    @cached_property
    def domain(self) -> Domain:
        """One period; for an aperiodic sum 16 of its longest waves in each direction."""
        if self._periods is not None:
            return Domain(np.zeros(2), self._periods, periodic=True, description="one period")
        spans = self._directions[:1] if self._is_parallel else np.eye(2)
        text = f"never repeats; {_APERIODIC_EXTENT_WAVES} of its longest waves"
        return Domain(np.zeros(2), self._aperiodic_side * spans, periodic=False, description=text)

    @property
    def _aperiodic_side(self) -> float:
        longest = 2.0 * math.pi / float(np.hypot(*self.wavevectors.T).min())
        return _APERIODIC_EXTENT_WAVES * longest

    def scan_line(self) -> ScanLine:
        """Along x if the sum is periodic there or aperiodic, else along its shortest period."""
        origin = np.zeros(2)
        if self._periods is None:
            direction = self._directions[0] if self._is_parallel else np.array([1.0, 0.0])
            return ScanLine(origin, direction, self._aperiodic_side, periodic=False)
        vector = self._periods[0]
        if len(self._periods) == 2:
            vector = self._period_along_x(self._periods)
        length = float(np.hypot(*vector))
        return ScanLine(origin, vector / length, length, periodic=True)

    def _period_along_x(self, periods: FloatArray) -> FloatArray:
        multiples = np.mgrid[-8:9, -8:9].reshape(2, -1).T
        multiples = multiples[multiples.any(axis=1)]
        vectors = multiples @ periods
        lengths = np.hypot(*vectors.T)
        along_x = (np.abs(vectors[:, 1]) < 1e-9 * lengths) & (vectors[:, 0] > 0.0)
        if along_x.any():
            vectors = vectors[along_x]
        return np.asarray(vectors[np.argmin(np.hypot(*vectors.T))])

    def _supremum(self, amplitudes: FloatArray) -> float:
        """Return sup Σ a_i sin(θ_i + phase_i) by branch and bound on the torus of phases."""
        total = float(np.abs(amplitudes).sum())
        _basis, multiples = self.waves.lattice
        rank = multiples.shape[1]
        if rank == len(amplitudes) or rank > _MAX_PHASES_OF_HEIGHTS:
            return total  # all phases are independent, or too many to search: an upper bound
        curvature = float(np.abs(amplitudes) @ (multiples**2).sum(axis=1))
        start = min(4 * int(np.abs(multiples).max()) + 4, int(_CELL_LIMIT ** (1.0 / rank)))
        half = math.pi / start
        ticks = half * (2.0 * np.arange(start) + 1.0)
        centres = np.stack(np.meshgrid(*[ticks] * rank, indexing="ij"), axis=-1).reshape(-1, rank)
        corners = np.stack(np.meshgrid(*[[-0.5, 0.5]] * rank, indexing="ij"), -1).reshape(-1, rank)
        best = -math.inf
        outer = total
        while True:
            angles = centres @ multiples.T + self.phases
            values = np.sin(angles) @ amplitudes
            slopes = np.abs((np.cos(angles) * amplitudes) @ multiples)
            upper = values + half * slopes.sum(axis=1) + 0.5 * curvature * rank * half * half
            best = max(best, float(values.max()))
            outer = min(outer, float(upper.max()))
            keep = upper > best + 1e-14 * total
            if outer - best <= 1e-13 * total or not keep.any() or half < 1e-9:
                return best
            centres = (centres[keep][:, None, :] + half * corners).reshape(-1, rank)
            half *= 0.5
            if len(centres) > _CELL_LIMIT:
                return outer  # an upper bound: too many cells are equally high
