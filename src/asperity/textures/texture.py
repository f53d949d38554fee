"""What every texture offers: heights, derivatives, nearest points, extremes and a domain."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, array


@dataclass(frozen=True)
class Domain:
    """The region of the plane that stands for the whole texture.

    Attributes:
        origin: one corner [m], shape (2,).
        spans: edge vectors [m], shape (1, 2) for a profile, (2, 2) for a map.
        periodic: whether the texture repeats along every span.
        description: in words, for tables.
    """

    origin: FloatArray
    spans: FloatArray
    periodic: bool
    description: str

    def points(self, fractions: FloatArray) -> FloatArray:
        """Return the points (n, 2) [m] at fractions (n, d) of the spans."""
        return np.ascontiguousarray(self.origin + fractions @ self.spans)


@dataclass(frozen=True)
class ScanLine:
    """A straight line over the texture.

    Attributes:
        start: first point [m], shape (2,).
        direction: unit vector, shape (2,).
        length: one period, or the extent [m].
        periodic: whether the texture repeats after the length.
    """

    start: FloatArray
    direction: FloatArray
    length: float
    periodic: bool

    def points(self, count: int) -> FloatArray:
        """Return points (count, 2) [m], in the middle of equal steps."""
        steps = (np.arange(count) + 0.5) * (self.length / count)
        return np.ascontiguousarray(self.start + steps[:, None] * self.direction)


class Texture(ABC):
    """A height function h(x, y) [m], twice continuously differentiable.

    A texture kind names its sampler (scalar functions that are compiled together with a law) and
    the arguments that it takes, and knows its certified extremes and bounds.
    """

    kind: ClassVar[str]

    @property
    @abstractmethod
    def sampler(self) -> tuple[ModuleType, ...]:
        """The modules whose scalar functions evaluate this kind."""

    @property
    @abstractmethod
    def arguments(self) -> tuple[Any, ...]:
        """The arguments that the sampler's functions take after the position."""

    @cached_property
    @abstractmethod
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height [m] over the whole texture, certified to rounding."""

    @cached_property
    @abstractmethod
    def bounds(self) -> tuple[float, float]:
        """Proved bounds M >= |∇h| [1] and K >= ‖Hess h‖₂ [1/m] over the whole texture."""

    @cached_property
    @abstractmethod
    def domain(self) -> Domain:
        """One period or the whole extent."""

    @abstractmethod
    def scan_line(self) -> ScanLine:
        """The straight line along which the texture is scanned unless told otherwise."""

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """The texture in words and numbers, SI units, for reports."""

    @cached_property
    def _loops(self) -> ModuleType:
        from asperity.kernels.fuse import fuse_sampler

        return fuse_sampler(self.sampler)

    @property
    def is_profile(self) -> bool:
        """Whether the height varies along one direction only."""
        return bool(self.domain.spans.shape[0] == 1)

    @property
    def peak_to_valley(self) -> float:
        """Difference of the certified extremes [m]."""
        low, high = self.extremes
        return high - low

    def height(self, xy: ArrayLike) -> FloatArray:
        """Return the height h(x, y).

        Args:
            xy: points [m], shape (n, 2).

        Returns:
            Heights [m], shape (n,).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        return self._sample("height_batch", xy, 1)[:, 0]

    def gradient(self, xy: ArrayLike) -> FloatArray:
        """Return the slopes (h_x, h_y) [1], shape (n, 2); see :meth:`height`."""
        return np.ascontiguousarray(self._sample("slope_batch", xy, 3)[:, 1:])

    def hessian(self, xy: ArrayLike) -> FloatArray:
        """Return the Hessian of h [1/m], shape (n, 2, 2); see :meth:`height`."""
        values = self._sample("curvature_batch", xy, 6)
        return values[:, [3, 4, 4, 5]].reshape(-1, 2, 2)

    def derivatives(self, xy: ArrayLike) -> FloatArray:
        """Return h, h_x, h_y, h_xx, h_xy, h_yy in SI units, shape (n, 6); see :meth:`height`."""
        return self._sample("curvature_batch", xy, 6)

    def nearest(self, points: ArrayLike) -> FloatArray:
        """Return the globally nearest surface point of each probe point (the god-object).

        p_h = argmin |p - (X, Y, h(X, Y))|. At a tie one of the nearest points, always the same.

        Args:
            points: probe points [m], shape (n, 3).

        Returns:
            Surface points [m], shape (n, 3).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = array("points", points, (None, 3), "m")
        feet = np.empty((len(probes), 2))
        self._loops.nearest_batch(probes, feet, self.arguments)
        return np.column_stack([feet, self.height(feet)])

    def _sample(self, loop: str, xy: ArrayLike, width: int) -> FloatArray:
        points = array("xy", xy, (None, 2), "m")
        out = np.empty((len(points), width))
        getattr(self._loops, loop)(points, out, self.arguments)
        return out
