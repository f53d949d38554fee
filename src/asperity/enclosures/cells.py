"""Cells of a texture, and cells with further coordinates: the depth and the state of an anchor."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.enclosures.taylor import TaylorMath, TaylorModel, TaylorNumber

DERIVATIVE_NAMES = ("h", "hx", "hy", "hxx", "hxy", "hyy")
# How often each name is differentiated by x and by y.
_ORDERS = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
DERIVATIVE_ORDERS = dict(zip(DERIVATIVE_NAMES, _ORDERS, strict=True))
CHUNK_SIZE = 16_384
SAMPLE_COUNT = 4096
EPS = float(np.finfo(float).eps)
# Relative gaps by the number of coordinates.
DEFAULT_GAPS = {1: 1e-6, 2: 1e-6, 3: 1e-4}
REFINED_GAPS = {1: 1e-10, 2: 1e-9, 3: 1e-7}


class Cells(ABC):
    """Cells of a texture: boxes in its coordinates, of equal size on each level.

    Attributes:
        dimensions: number of coordinates.
        default_gap: the relative gap that is reached in reasonable time.
        refined_gap: a smaller gap for a second attempt.
        max_cells: number of cells beyond which division improves little; unlimited by default.
        hessian_bound: proved bound of ‖Hess h‖₂ over all cells [1/m], if it is tight.
    """

    dimensions: int
    default_gap: float
    refined_gap: float | None = None
    max_cells: int | None = None
    hessian_bound: float = math.inf

    @abstractmethod
    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """Return the centres of the first cells, in chunks (n, d), and their half-widths."""

    @abstractmethod
    def sample_coordinates(self, count: int = SAMPLE_COUNT) -> FloatArray:
        """Return initial sample coordinates (n, d) spread over all cells."""

    @abstractmethod
    def enclosures(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, TaylorNumber]:
        """Return enclosures of the named height derivatives on cells."""

    @abstractmethod
    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """Return h, h_x, h_y, h_xx, h_xy, h_yy, shape (n, 6), at coordinates (n, d)."""

    @abstractmethod
    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """Return the points of the plane [m], shape (n, 2), at coordinates (n, d)."""

    @property
    def are_places(self) -> bool:
        """Whether coordinates are places of the plane, which :meth:`to_plane` returns quickly."""
        return True

    def chunk_size(self) -> int:
        """Return the number of cells to evaluate at a time."""
        return CHUNK_SIZE

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        """Return the coordinates clipped to the region if it has a border."""
        return coordinates


def grid_index_chunks(counts: Sequence[int], size: int = CHUNK_SIZE) -> Iterator[NDArray[np.intp]]:
    """Return the indices (n, d) of the cells of a grid, in chunks of at most ``size``."""
    total = math.prod(counts)
    for first in range(0, total, size):
        flat = np.arange(first, min(first + size, total))
        yield np.stack(np.unravel_index(flat, counts), axis=-1)


def low_discrepancy_points(count: int, dimensions: int) -> FloatArray:
    """Return points (n, d) spread evenly over the unit cube (Roberts' generalised golden ratio)."""
    ratio = 2.0
    for _ in range(64):
        ratio = (1.0 + ratio) ** (1.0 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1.0)
    return np.asarray((0.5 + np.arange(1, count + 1)[:, None] * steps) % 1.0)


class ProductCells(Cells):
    """Product of cells with an interval of each further coordinate.

    Args:
        base: the cells of the texture.
        upper_limits: the further coordinates by name with their upper limits; the lower ones are 0.
    """

    def __init__(self, base: Cells, upper_limits: dict[str, float]) -> None:
        self._base = base
        self._extra = upper_limits
        self.max_cells = base.max_cells
        self._upper = np.array(list(upper_limits.values()))
        self.dimensions = base.dimensions + len(upper_limits)
        self.default_gap = max(base.default_gap, DEFAULT_GAPS.get(self.dimensions, 1e-3))
        own = REFINED_GAPS.get(self.dimensions, 1e-6)
        self.refined_gap = None if base.refined_gap is None else max(base.refined_gap, own)

    def initial_cells(self) -> tuple[Iterator[FloatArray], FloatArray]:
        """See :class:`Cells`."""
        chunks, half = self._base.initial_cells()
        level = 0.5 * self._upper
        deep = (np.hstack([centres, np.tile(level, (len(centres), 1))]) for centres in chunks)
        return deep, np.concatenate([half, level])

    def sample_coordinates(self, count: int = SAMPLE_COUNT) -> FloatArray:
        """See :class:`Cells`."""
        flat = self._base.sample_coordinates(count)
        return np.hstack([flat, low_discrepancy_points(len(flat), len(self._upper)) * self._upper])

    def enclosures(
        self, centres: FloatArray, half: FloatArray, names: Sequence[str]
    ) -> dict[str, TaylorNumber]:
        """See :class:`Cells`; the further coordinates are included."""
        n = len(centres)
        flat = self._base.dimensions
        result: dict[str, TaylorNumber] = {}
        for name, model in self._base.enclosures(centres[:, :flat], half[:flat], names).items():
            result[name] = self._lift(model) if isinstance(model, TaylorModel) else model
        for axis, name in enumerate(self._extra, start=flat):
            slopes = np.zeros((self.dimensions, n))
            slopes[axis] = half[axis]
            result[name] = TaylorModel(centres[:, axis], slopes, np.zeros(n))
        return result

    def _lift(self, model: TaylorModel) -> TaylorModel:
        still = np.zeros((len(self._extra), len(model.c)))
        return TaylorModel(model.c, np.concatenate([model.g, still]), model.e)

    def extra_coordinates(self, coordinates: FloatArray) -> dict[str, FloatArray]:
        """Return the further coordinates by name."""
        first = self._base.dimensions
        return {
            name: np.ascontiguousarray(coordinates[:, axis])
            for axis, name in enumerate(self._extra, start=first)
        }

    def derivatives(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._base.derivatives(coordinates[:, : self._base.dimensions])

    def to_plane(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        return self._base.to_plane(coordinates[:, : self._base.dimensions])

    @property
    def are_places(self) -> bool:
        """See :class:`Cells`."""
        return self._base.are_places

    def chunk_size(self) -> int:
        """See :class:`Cells`."""
        return self._base.chunk_size()

    def clip_to_region(self, coordinates: FloatArray) -> FloatArray:
        """See :class:`Cells`."""
        first = self._base.dimensions
        flat = self._base.clip_to_region(coordinates[:, :first])
        return np.hstack([flat, np.clip(coordinates[:, first:], 0.0, self._upper)])


DEPTH_COORDINATE = "depth"
LENGTH_COORDINATE = "deflection_length"
ANGLE_COORDINATE = "deflection_angle"


def cells_with_depth(cells: Cells, depth: float) -> ProductCells:
    """Return cells whose last coordinate is the depth [m]."""
    return ProductCells(cells, {DEPTH_COORDINATE: depth})


def cells_with_deflection(cells: Cells, max_deflection: float, depth: float | None) -> ProductCells:
    """Return cells with length [m] and angle of a deflection, and the depth [m] if given."""
    further = {LENGTH_COORDINATE: max_deflection, ANGLE_COORDINATE: 2.0 * math.pi}
    return ProductCells(cells, further if depth is None else {**further, DEPTH_COORDINATE: depth})


def anchor_enclosures(
    enclosures: dict[str, TaylorNumber], max_deflection: float, *, sliding: bool
) -> dict[str, TaylorNumber]:
    """Return enclosures of the deflection d and of ∂d/∂p_xy, which is I, or I - u uᵀ if dragged.

    The deflection of a dragged anchor has its greatest length.
    """
    angle = enclosures[ANGLE_COORDINATE]
    ux = TaylorMath.cos(angle)
    uy = TaylorMath.sin(angle)
    length = max_deflection if sliding else enclosures[LENGTH_COORDINATE]
    state: dict[str, TaylorNumber] = {"dx": length * ux, "dy": length * uy}
    if not sliding:
        return {**state, "sxx": 1.0, "sxy": 0.0, "syy": 1.0}
    return {**state, "sxx": uy * uy, "sxy": -(ux * uy), "syy": ux * ux}
