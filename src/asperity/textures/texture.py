"""Abstract base class of height functions, and the record that registers a texture kind."""

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

from asperity.contacts.contact import Contact, ExactHeight
from asperity.core.arguments import Argument
from asperity.core.checks import FloatArray, Points, check_points
from asperity.core.display import Plottable
from asperity.core.files import content_digest, is_shipped, to_plain_data
from asperity.enclosures.cells import Cells
from asperity.measured.prepared import PreparationStage
from asperity.textures.domain import (
    BoundedCells,
    DerivativeBounds,
    Domain,
    GridValues,
    LineSegments,
    ScanLine,
    equal_segments,
)
from asperity.textures.plane_waves import PlaneWaves, SingleWave, WaveCells, wave_segments

__all__ = ["Domain", "ExactHeight", "ScanLine", "Texture", "TextureKind"]

# Points of a grid that resolves a texture: along a profile and along each side of a map, at most;
# per shortest wave, where it is known.
_LINE_POINTS = 2**15
_SIDE_POINTS = 1024
_POINTS_PER_WAVE = 8.0
# Greatest number of independent phases of waves over which suprema are searched.
_MAX_PHASES = 4
# Samples of a dense search: along a profile and along each side of a map whose waves are unknown;
# otherwise per shortest wave, within limits.
_PROFILE_SAMPLES = 4096
_SIDE_SAMPLES = 512
_SAMPLES_PER_WAVE = 24
_MIN_SAMPLES = 64
_MAX_SAMPLES = 1000


@dataclass(frozen=True)
class CertifiedNumber:
    """A certified number of a force field that is attained.

    Attributes:
        lower: attained.
        upper: proved.
        at: where ``lower`` is attained [m].
    """

    lower: float
    upper: float
    at: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class TexturePart:
    """A texture without form and waviness.

    Attributes:
        texture: the remaining texture.
        nesting: wavelength from which waves were removed as waviness [m]; ``None`` if nothing was
            removed.
        form: range of the removed form [m].
        waviness: range of the removed waviness [m].
    """

    texture: Texture
    nesting: float | None = None
    form: float = 0.0
    waviness: float = 0.0


class Texture(Plottable, ABC):
    """A height function h(x, y) [m], twice continuously differentiable.

    A texture kind defines its sampler (scalar functions that are compiled together with a law),
    the record passed to it, its certified extremes and bounds, its domain and scan line. These are
    the abstract members; all others have correct, possibly slow defaults that a kind may override.

    Attributes:
        kind: name of the kind.
        constructor_arguments: declarations of the arguments of the constructor, which are stored as
            attributes of the same names.
        finds_contacts: whether the sampler finds closest points and evaluates law H without a
            search.
        sample_offset: position of a sample in its cell: 0 at the nodes of a spline, where second
            derivatives are extreme.
        file_name: name of the file that the texture was loaded from; empty for none.
        preparation: steps of the preparation of measured heights, as sentences for reports.
        filled_mask: where missing heights have been interpolated; ``None`` for nowhere.
        history: surface parameters as read and after each step of the preparation.
        thin_regions: parts of a baked body that are thinner than twice the depth of its field.
        thin_map: a map of half of their thickness [m]; ``None`` without any.
    """

    kind: ClassVar[str]
    constructor_arguments: ClassVar[tuple[Argument, ...]] = ()
    finds_contacts: ClassVar[bool] = False
    sample_offset: ClassVar[float] = 0.5
    file_name: str = ""
    preparation: tuple[str, ...] = ()
    filled_mask: NDArray[np.bool_] | None = None
    history: tuple[PreparationStage, ...] = ()
    thin_regions: tuple[Any, ...] = ()
    thin_map: NDArray[np.float64] | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Return the state to pickle, without the compiled loops."""
        return {name: value for name, value in vars(self).items() if name != "_loops"}

    @property
    @abstractmethod
    def sampler(self) -> tuple[ModuleType, ...]:
        """The modules whose scalar functions evaluate this kind."""

    @property
    @abstractmethod
    def arguments(self) -> tuple[Any, ...]:
        """Record (NamedTuple) passed to the sampler functions after the position."""

    def closest_lattice(
        self,
        spacing: tuple[float, ...],  # noqa: ARG002 - for kinds that have a lattice
        z: FloatArray,  # noqa: ARG002 - likewise
    ) -> tuple[tuple[ModuleType, ...], list[tuple[Any, ...]]]:
        """Return modules that replace the closest-point search by a quick one, and their records.

        A quick search starts from a lattice and proves nothing: its point is one of the surface
        and mostly the closest. With each further record it is slower and misses fewer. By default
        the search is that of the sampler.

        Args:
            spacing: distance of the places where it is used along each axis of the plane [m].
            z: of the levels of the lattice, rising [m].
        """
        return (), [self.arguments]

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
        """Return the default straight line along which the texture is scanned."""

    # --- optional members -------------------------------------------------------------------------

    def constructor_values(self) -> dict[str, Any]:
        """Return the arguments of the constructor by name, SI units."""
        names = [argument.name for argument in self.constructor_arguments]
        return {name: getattr(self, name) for name in names}

    def __repr__(self) -> str:
        values = ", ".join(f"{name}={value!r}" for name, value in self.constructor_values().items())
        return f"{type(self).__name__}({values})"

    def describe(self) -> dict[str, Any]:
        """Return the kind and its parameters as plain data, SI units, for reports."""
        return {"kind": self.kind} | dict(to_plain_data(self.constructor_values()))

    @cached_property
    def digest(self) -> str | None:
        """Digest of all that the heights depend on, the key of cached results.

        ``None`` for a user-defined kind, which is never cached.
        """
        if not is_shipped(type(self)):
            return None
        return content_digest(type(self).__qualname__, *self._content())

    def _content(self) -> tuple[Any, ...]:
        """Return the numbers that determine the heights."""
        return tuple(self.arguments)

    @property
    def third_derivative_bound(self) -> float:
        """A proved bound T >= ‖D³h‖ [1/m²], the rate of change of the Hessian; infinite if none.

        It tightens certified numbers that depend on second derivatives.
        """
        return math.inf

    @property
    def waves(self) -> PlaneWaves | None:
        """Plane waves whose sum is the height; ``None`` for other heights."""
        return None

    @property
    def single_wave(self) -> SingleWave | None:
        """The only wave of the height, for closed forms; ``None`` for other heights."""
        return None

    def coarsened(self, share: float) -> Texture | None:  # noqa: ARG002 - of kinds with nodes
        """Return the texture with about a share of its nodes along each axis of the plane.

        Returns:
            The texture, whose last step of preparation states what is lost; ``None`` for one
            without nodes, or with too few left.
        """
        return None

    def stored_heights(self) -> FloatArray:
        """Return the heights at the nodes [m] that a file needs besides the description, if any."""
        return np.empty(0)

    @property
    def baked_numbers(self) -> Mapping[str, CertifiedNumber]:
        """Certified numbers of a baked field by the name of their measure; none for heights."""
        return {}

    @property
    def is_body(self) -> bool:
        """Whether the texture is a baked field of a closed body."""
        return False

    @property
    def depth_limit(self) -> float:
        """Greatest max_depth [m] of a surface with this texture: that of a baked field."""
        return math.inf

    def check_law(self, contact: Contact, parameters: Mapping[str, float]) -> None:
        """Raise a ParameterError for a law that cannot be rendered: a baked field renders H."""

    @property
    def is_mirrored(self) -> bool:
        """Whether the texture ends at the border of its domain and is mirrored there."""
        return False

    def exact_height(self) -> ExactHeight:
        """Return h(x, y, m, n), the derivative of order (m, n), m + n <= 2, in mpmath.

        Kernels are tested against it. By default it is accurate to double precision only: values of
        the sampler, continued by Taylor's formula between doubles.
        """
        from asperity.textures.exact_heights import taylor_continuation

        return taylor_continuation(self.derivatives)

    def cells(self, extent: tuple[float, float] | None = None, margin: float = 0.0) -> Cells | None:
        """Return the cells over which suprema are certified; by default from the bounds alone.

        Args:
            extent: width and depth [m] of the rectangle to search, from the origin; by default the
                domain, or the whole plane.
            margin: width by which the rectangle is extended on every side [m].

        Returns:
            The cells; ``None`` for a kind that requires an extent if none is given.
        """
        if self.waves is not None:
            wave_cells = WaveCells(self.waves, extent, margin)
            return wave_cells if wave_cells.dimensions <= _MAX_PHASES else None
        region = self.domain
        if extent is not None:
            region = Domain(np.zeros(2), np.diag(extent), periodic=False, description="extent")
        if not region.periodic:
            region = region.expand(margin)
        return self._bounded_cells(region)

    def sampling_cells(self) -> Cells:
        """Return the cells over which suprema are sampled where they cannot be certified."""
        cells = self.cells()
        if cells is None and self.waves is not None:  # a rectangle of the plane
            cells = WaveCells(self.waves, tuple(np.abs(self.domain.spans).sum(axis=0).tolist()))
        return cells or self._bounded_cells(self.domain)

    def line_segments(self, line: ScanLine, min_count: int) -> LineSegments | None:
        """Return at least ``min_count`` segments of a line; ``None`` where the kind has none."""
        if self.waves is not None:
            return wave_segments(self.waves, line, min_count)
        span = line.length * line.direction[None]
        region = Domain(line.start, span, periodic=False, description="line")
        return equal_segments(self._bounded_cells(region), line, min_count, 1.0)

    def _bounded_cells(self, region: Domain) -> BoundedCells:
        numbers = (*self.extremes, *self.bounds, self.third_derivative_bound)
        bounds = DerivativeBounds(*numbers)
        return BoundedCells(region, self.derivatives, bounds)

    def sample_counts(self) -> list[int]:
        """Return the numbers of initial samples of a dense search along each span of the domain."""
        if self.is_profile:
            return [_PROFILE_SAMPLES]
        if self.waves is None:
            return [_SIDE_SAMPLES] * 2
        counts = _SAMPLES_PER_WAVE * np.hypot(*self.domain.spans.T) / self.waves.shortest_wavelength
        return [int(count) for count in np.clip(counts, _MIN_SAMPLES, _MAX_SAMPLES)]

    def grid_counts(self) -> list[int]:
        """Return the numbers of points along each span of the domain that resolve every wave."""
        sides = np.hypot(*self.domain.orthogonal_spans()[0].T)
        limit = _LINE_POINTS if self.is_profile else _SIDE_POINTS
        if self.waves is None:
            return [limit] * len(sides)
        counts = np.ceil(_POINTS_PER_WAVE * sides / self.waves.shortest_wavelength)
        return [int(count) for count in np.clip(counts, 16, limit)]

    def texture_part(self) -> TexturePart:
        """Return the texture without form and waviness: by default all of it.

        Measured heights also have form and waviness, which are felt as a shape.
        """
        return TexturePart(self)

    def samples(self) -> GridValues:
        """Return heights on a grid of the domain, at the nodes of a spline.

        Returns:
            Heights [m], shape (ny, nx), (1, nx) for a profile; spacing (x, y) [m]; whether they
            are periodic, so that no window is needed.
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
            xy: points [m], shape (n, 2), or (2,) for one; the result then lacks the first axis
                too.

        Returns:
            Heights [m], shape (n,).

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        points, values = self._evaluate("height_batch", xy, 1)
        return points.restore_shape(values[:, 0])

    def gradient(self, xy: ArrayLike) -> FloatArray:
        """Return the slopes (h_x, h_y) [1], shape (n, 2); see :meth:`height`."""
        points, values = self._evaluate("slope_batch", xy, 3)
        return points.restore_shape(np.ascontiguousarray(values[:, 1:]))

    def hessian(self, xy: ArrayLike) -> FloatArray:
        """Return the Hessian of h [1/m], shape (n, 2, 2); see :meth:`height`."""
        points, values = self._evaluate("curvature_batch", xy, 6)
        return points.restore_shape(values[:, [3, 4, 4, 5]].reshape(-1, 2, 2))

    def derivatives(self, xy: ArrayLike) -> FloatArray:
        """Return h, h_x, h_y, h_xx, h_xy, h_yy in SI units, shape (n, 6); see :meth:`height`."""
        points, values = self._evaluate("curvature_batch", xy, 6)
        return points.restore_shape(values)

    def nearest(self, points: ArrayLike) -> FloatArray:
        """Return the globally closest surface point of each probe point (the god-object).

        p_h = argmin |p - (X, Y, h(X, Y))|. At a tie one of the closest points, always the same.

        Args:
            points: probe points [m], shape (n, 3), or (3,) for one.

        Returns:
            Surface points [m], of the same shape.

        Raises:
            ParameterError: for another shape, or positions that are not finite.
        """
        probes = check_points("points", points, 3, "m")
        closest = np.empty((probes.count, 2))
        self._loops.nearest_batch(probes.rows, closest, self.arguments)
        return probes.restore_shape(np.column_stack([closest, self.height(closest)]))

    def _evaluate(self, loop_name: str, xy: ArrayLike, width: int) -> tuple[Points, FloatArray]:
        points = check_points("xy", xy, 2, "m")
        out = np.empty((points.count, width))
        getattr(self._loops, loop_name)(points.rows, out, self.arguments)
        return points, out


@dataclass(frozen=True)
class TextureKind:
    """A texture kind that is available by name.

    Attributes:
        name: as on the command line, before the colon.
        summary: one line.
        factory: function or class that takes the arguments by name and returns the texture.
        arguments: declarations, in the order in which they are listed.
        example: example arguments [SI]; none if the defaults are an example.
        source: source of its dimensions.
    """

    name: str
    summary: str
    factory: Callable[..., Texture]
    arguments: tuple[Argument, ...]
    example: Mapping[str, Any] = field(default_factory=dict)
    source: str = ""

    @classmethod
    def of_class(cls, kind: type[Texture], summary: str, **example: Any) -> TextureKind:
        """Return the record of a texture class with example arguments."""
        return cls(kind.kind, summary, kind, kind.constructor_arguments, example)

    @property
    def required_arguments(self) -> tuple[Argument, ...]:
        """The arguments without a default."""
        return tuple(argument for argument in self.arguments if argument.required)
