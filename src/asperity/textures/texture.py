"""What every texture offers: heights, derivatives, nearest points, extremes and a domain.

A kind of texture that can be asked for by name, as data.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from asperity.arguments import Argument
from asperity.checks import FloatArray, Points
from asperity.checks import points as read_points
from asperity.contacts.contact import ExactHeight
from asperity.display import Plotted
from asperity.enclosures.cells import Cells
from asperity.measured.history import Stage
from asperity.textures.cells.bounded import BoundedCells, DerivativeBounds
from asperity.textures.cells.lines import Pieces, equal_pieces
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.plane_waves import PlaneWaves, SingleWave

__all__ = ["Domain", "ExactHeight", "Kind", "ScanLine", "Texture"]

# Points of a grid that shows a texture whose waves are not known: along a profile, along each
# side of a map; fewer where the shortest wave is long.
_LINE_POINTS, _SIDE_POINTS, _POINTS_PER_WAVE = 2**15, 1024, 8.0
# Samples along a profile, along each side of a map, and where the shortest wave is known.
_PROFILE_SAMPLES, _SIDE_SAMPLES, _SAMPLES_PER_WAVE = 4096, 512, 24
_LEAST_SAMPLES, _MOST_SAMPLES = 64, 1000


@dataclass(frozen=True, eq=False)
class TexturePart:
    """A texture without form and waviness.

    Attributes:
        texture: what is left.
        nesting: the wavelength from which on waves were taken away as waviness [m]; ``None`` if
            nothing was.
        form: range of the form that was taken away [m].
        waviness: range of the waviness [m].
    """

    texture: Texture
    nesting: float | None = None
    form: float = 0.0
    waviness: float = 0.0


class Texture(Plotted, ABC):
    """A height function h(x, y) [m], twice continuously differentiable.

    A texture kind names its sampler (scalar functions that are compiled together with a law) and
    the arguments that it takes, and knows its certified extremes and bounds. That is all a kind
    of your own must give: what :attr:`twist` and the methods after it answer follows, right if
    slow, and a kind that can do better overrides them.

    Attributes:
        kind: its name.
        sample_offset: where in its cell a sample lies: 0 at the nodes of a spline, where second
            derivatives are extreme.
        preparation: what was done to measured heights, in words, for reports.
        filled: where heights were missing and have been interpolated; ``None`` for nowhere.
        history: surface parameters as read and after each step of the preparation.
    """

    kind: ClassVar[str]
    sample_offset: ClassVar[float] = 0.5
    preparation: tuple[str, ...] = ()
    filled: NDArray[np.bool_] | None = None
    history: tuple[Stage, ...] = ()

    def __getstate__(self) -> dict[str, Any]:
        """Return what another process needs: compiled loops are its own."""
        return {name: value for name, value in vars(self).items() if name != "_loops"}

    @property
    @abstractmethod
    def sampler(self) -> tuple[ModuleType, ...]:
        """The modules whose scalar functions evaluate this kind."""

    @property
    @abstractmethod
    def arguments(self) -> tuple[Any, ...]:
        """What the sampler's functions receive after the position, as one record (NamedTuple)."""

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
        """The texture in words and numbers, SI units, for reports; ``kind`` among them."""

    # --- what a kind may know better --------------------------------------------------------------

    @property
    def content(self) -> str | None:
        """A digest of all that the heights depend on, under which answers are kept between runs.

        ``None`` where that is not known, as of a kind of one's own: nothing of it is kept.
        """
        return None

    @property
    def twist(self) -> float:
        """A proved bound T >= ‖D³h‖ [1/m²], the rate of change of the Hessian; infinite if none.

        With it numbers that depend on second derivatives are certified as closely as others.
        """
        return math.inf

    @property
    def waves(self) -> PlaneWaves | None:
        """The plane waves whose sum the height is; nothing for other heights."""
        return None

    @property
    def single_wave(self) -> SingleWave | None:
        """The one wave that the height is, where closed forms of it hold."""
        return None

    @property
    def ends(self) -> bool:
        """Whether the texture stops at the border of its domain and is mirrored there."""
        return False

    def exact_height(self) -> ExactHeight:
        """Return h(x, y, m, n), the derivative of order (m, n), m + n <= 2, in mpmath.

        Kernels are tested against it. Unless the kind has a formula it is good to double
        precision only: the sampler's own values, continued by Taylor's formula between doubles.
        """
        from asperity.textures.exact import exact_continuation

        return exact_continuation(self.derivatives)

    def cells(self, extent: tuple[float, float] | None = None, margin: float = 0.0) -> Cells | None:
        """Return the cells over which suprema are certified; by default from the bounds alone.

        Args:
            extent: width and depth [m] of the part of the plane to look at, from the origin; the
                domain, or the whole plane, by default.
            margin: how far beyond to look on every side [m].

        Returns:
            The cells; nothing for a kind that needs an extent and got none.
        """
        region = self.domain
        if extent is not None:
            region = Domain(np.zeros(2), np.diag(extent), periodic=False, description="extent")
        return self._bounded(region if region.periodic else region.widened(margin))

    def sampling_cells(self) -> Cells:
        """Return the cells over which suprema are sampled where none are certified."""
        return self.cells() or self._bounded(self.domain)

    def line_pieces(self, line: ScanLine, least: int) -> Pieces | None:
        """Return at least so many pieces of a line; nothing where a kind cannot cut along it."""
        span = line.length * line.direction[None]
        region = Domain(line.start, span, periodic=False, description="line")
        return equal_pieces(self._bounded(region), line, least, 1.0)

    def _bounded(self, region: Domain) -> BoundedCells:
        bounds = DerivativeBounds(*self.extremes, *self.bounds, self.twist)
        return BoundedCells(region, self.derivatives, bounds)

    def sample_counts(self) -> list[int]:
        """Return how many samples along each span of the domain a dense search begins with."""
        if self.is_profile:
            return [_PROFILE_SAMPLES]
        if self.waves is None:
            return [_SIDE_SAMPLES] * 2
        wanted = _SAMPLES_PER_WAVE * np.hypot(*self.domain.spans.T) / self.waves.shortest
        return [int(min(max(count, _LEAST_SAMPLES), _MOST_SAMPLES)) for count in wanted]

    def grid_counts(self) -> list[int]:
        """Return how many points along each span of the domain show every wave."""
        sides = np.hypot(*self.domain.upright()[0].T)
        most = _LINE_POINTS if self.is_profile else _SIDE_POINTS
        if self.waves is None:
            return [most] * len(sides)
        wanted = np.ceil(_POINTS_PER_WAVE * sides / self.waves.shortest)
        return [int(count) for count in np.clip(wanted, 16, most)]

    def texture_part(self) -> TexturePart:
        """Return what of the heights is texture: all of them, where they were written down.

        Measured heights have form and waviness too, which are felt as a shape.
        """
        return TexturePart(self)

    def samples(self) -> tuple[FloatArray, tuple[float, float], bool]:
        """Return heights on a grid of the domain, the nodes of a measured texture.

        Returns:
            Heights [m], shape (ny, nx), (1, nx) for a profile; spacing (x, y) [m]; whether they
            repeat, so that no window is needed.
        """
        points, spacing, repeats = self.domain.grid(self.grid_counts())
        return self.height(points.reshape(-1, 2)).reshape(points.shape[:2]), spacing, repeats

    # --- values -----------------------------------------------------------------------------------

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
            xy: points [m], shape (n, 2), or (2,) for one: then the answer has no first axis
                either.

        Returns:
            Heights [m], shape (n,).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        points, values = self._sample("height_batch", xy, 1)
        return points.answer(values[:, 0])

    def gradient(self, xy: ArrayLike) -> FloatArray:
        """Return the slopes (h_x, h_y) [1], shape (n, 2); see :meth:`height`."""
        points, values = self._sample("slope_batch", xy, 3)
        return points.answer(np.ascontiguousarray(values[:, 1:]))

    def hessian(self, xy: ArrayLike) -> FloatArray:
        """Return the Hessian of h [1/m], shape (n, 2, 2); see :meth:`height`."""
        points, values = self._sample("curvature_batch", xy, 6)
        return points.answer(values[:, [3, 4, 4, 5]].reshape(-1, 2, 2))

    def derivatives(self, xy: ArrayLike) -> FloatArray:
        """Return h, h_x, h_y, h_xx, h_xy, h_yy in SI units, shape (n, 6); see :meth:`height`."""
        points, values = self._sample("curvature_batch", xy, 6)
        return points.answer(values)

    def nearest(self, points: ArrayLike) -> FloatArray:
        """Return the globally nearest surface point of each probe point (the god-object).

        p_h = argmin |p - (X, Y, h(X, Y))|. At a tie one of the nearest points, always the same.

        Args:
            points: probe points [m], shape (n, 3), or (3,) for one.

        Returns:
            Surface points [m], of the same shape.

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = read_points("points", points, 3, "m")
        feet = np.empty((probes.count, 2))
        self._loops.nearest_batch(probes.rows, feet, self.arguments)
        return probes.answer(np.column_stack([feet, self.height(feet)]))

    def _sample(self, loop: str, xy: ArrayLike, width: int) -> tuple[Points, FloatArray]:
        points = read_points("xy", xy, 2, "m")
        out = np.empty((points.count, width))
        getattr(self._loops, loop)(points.rows, out, self.arguments)
        return points, out


@dataclass(frozen=True)
class Kind:
    """A kind of texture that can be asked for by name.

    Attributes:
        name: as on the command line, before the colon.
        summary: one line.
        make: makes the texture from its arguments by name.
        arguments: in the order in which they are listed.
        example: arguments [SI] that show it; none if the defaults do.
        source: where its sizes come from.
    """

    name: str
    summary: str
    make: Callable[..., Texture]
    arguments: tuple[Argument, ...]
    example: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    @property
    def required(self) -> tuple[Argument, ...]:
        """The arguments that have no default."""
        return tuple(argument for argument in self.arguments if argument.required)
