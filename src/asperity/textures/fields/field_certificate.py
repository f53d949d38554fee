"""The certified gain of a baked field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.processes import run_in_threads
from asperity.textures.fields import field_curvature, field_sampler
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_record import (
    OFFSETS,
    PERIODIC,
    RATE,
    UPPER,
    ZERO,
    FieldArguments,
    field_rows,
    field_width,
    largest_coefficient,
)
from asperity.textures.texture import CertifiedNumber

IntArray = NDArray[np.int64]
Progress = Callable[[float], None]
CurvatureBounds = tuple[FloatArray, FloatArray]

# Rounding of a second difference of coefficients, in units of their size, counted generously.
_DIFFERENCE_ROUNDING = 32.0 * float(np.finfo(np.float64).eps)
_COLUMNS_PER_PART = 16
# Weights of three nodes in the Bernstein coefficients of derivatives of order 0, 1, 2.
_BERNSTEIN = np.array(
    [
        [[0.5, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.5, 0.5]],
        [[-1.0, 1.0, 0.0], [-0.5, 0.0, 0.5], [0.0, -1.0, 1.0]],
        [[1.0, -2.0, 1.0], [1.0, -2.0, 1.0], [1.0, -2.0, 1.0]],
    ]
)


def curvature_bounds(
    grid: FieldGrid, field: FieldArguments, progress: Progress | None = None
) -> CurvatureBounds:
    """Return certified bounds of the eigenvalues of Hess T over the whole field.

    Args:
        grid: the nodes.
        field: the coefficients.
        progress: called with the finished fraction.

    Returns:
        Two arrays of shape (2,), for Hess T and for -Hess T: upper bounds of the greatest
        eigenvalue; and (2, 4): the greatest one attained, and where, x, y, z [m].
    """
    bounds = np.zeros((2, 5))
    if grid.border != ZERO:
        bounds[0, :2] = 1.0  # of the flat wall far below
    numbers = _search(bounds, np.zeros((0, 0, 0), np.uint8), field, progress)
    largest = largest_coefficient(field) + float(
        field.stretched_cells[:, OFFSETS:].max(initial=0.0)
    )
    rounding = _DIFFERENCE_ROUNDING * (largest / min(grid.spacing)) ** 2
    best = numbers[np.argmax(numbers[:, :, 1], axis=0), [0, 1]]
    at = grid.positions(best[:, 2 : 2 + len(grid.cells)])
    attained = np.column_stack([best[:, 1], at, grid.height(best[:, 4])])
    return numbers[:, :, 0].max(axis=0) + rounding, attained


def certify_gain(
    grid: FieldGrid, field: FieldArguments, progress: Progress | None = None
) -> tuple[CertifiedNumber, CertifiedNumber]:
    """Return the certified sup ‖Hess T‖ and sup λ_max(Hess T) of a field."""
    upper, attained = curvature_bounds(grid, field, progress)
    one_sided, other = map(_certified_number, upper.tolist(), attained.tolist())
    larger = max(one_sided, other, key=lambda number: number.lower)
    return replace(larger, upper=max(one_sided.upper, other.upper)), one_sided


def _certified_number(upper: float, attained: list[float]) -> CertifiedNumber:
    value, x, y, z = attained
    return CertifiedNumber(value, upper, (x, y, z))


def cells_above(field: FieldArguments, limit: float, cells: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return those of the cells, not 0, in which an eigenvalue may be above the limit.

    A cell is named by the node in its middle; the shape is that of the nodes.
    """
    marks = cells.copy()
    whole = marks if field_rows(field) > 1 else marks[:, None]
    _search(np.full((2, 5), limit), whole, field, None)
    return marks


def _search(
    bounds: FloatArray, marks: NDArray[np.uint8], field: FieldArguments, progress: Progress | None
) -> FloatArray:
    """Return the bounds of each part of the search, (n, 2, 5)."""
    from asperity.kernels.fuse import fuse_module

    loops = fuse_module(field_curvature, field_sampler, *field_sampler.PARTS)
    weights = *hull_weights(field), *product_weights(field)
    width = field_width(field) - 3 + (field.border != PERIODIC)
    parts = [(k, min(k + _COLUMNS_PER_PART, width)) for k in range(0, width, _COLUMNS_PER_PART)]
    numbers = np.repeat(bounds[None], len(parts), axis=0)

    def search(part: int) -> None:
        # Starting from the bounds of the first part, the others evaluate few cells.
        numbers[part] = numbers[0]
        loops.hull_batch(*parts[part], *weights, numbers[part], marks, field)

    run_in_threads(search, range(len(parts)), progress)
    return numbers


def hull_weights(field: FieldArguments) -> tuple[FloatArray, FloatArray]:
    """Return the weights of nodes in the Bernstein coefficients of derivatives of T on a cell.

    A derivative of a quadratic B-spline is represented as a polynomial of degree 2 along each axis,
    whatever its order, so that hulls can be combined.

    Returns:
        Weights of the 9 columns in ∂xx, ∂xy, ∂yy, ∂x, ∂y and 1 at the 9 coefficients in the plane,
        (9, 6, 9), those along the second axis first, or (3, 6, 3) for a profile; and of the 3
        levels in 1, ∂z, ∂zz at the 3 coefficients along z, for the cell of each level,
        (3, 3, 3, levels).
    """
    along = _BERNSTEIN
    across = along if field_rows(field) > 1 else np.array([1.0, 0.0, 0.0]).reshape(3, 1, 1)
    size = 3 * across.shape[1]

    def product(v: int, u: int) -> FloatArray:
        return np.asarray(np.einsum("ea,fb->efab", across[v], along[u])).reshape(size, size)

    rates = np.array([[field.m00, field.m01], [field.m10, field.m11]])
    second = np.array([[product(0, 2), product(1, 1)], [product(1, 1), product(2, 0)]])
    second = np.einsum("ra,rs...,sb->ab...", rates, second, rates)
    first = np.einsum("ra,r...->a...", rates, np.array([product(0, 1), product(1, 0)]))
    plane = np.stack([second[0, 0], second[0, 1], second[1, 1], *first, product(0, 0)], axis=1)
    return np.ascontiguousarray(plane), _upward_weights(field)


def _upward_weights(field: FieldArguments) -> FloatArray:
    """Return the weights of three levels, (coefficient, derivative, level, cell)."""
    along = _BERNSTEIN
    iz = field.iz
    upward = np.stack([along[0], iz * along[1], iz * iz * along[2]], axis=1)
    upward = np.repeat(upward[..., None], field.levels, axis=-1)
    count = len(field.stretched_cells)
    rate, a, b = field.stretched_cells[:, RATE : UPPER + 1].T
    none = 0.0 * a
    lowest = np.array([[a, 1.0 - a, none], [-2.0 * rate * a, 2.0 * rate * a, none]])
    highest = np.array([[none, 1.0 - b, b], [none, -2.0 * rate * b, 2.0 * rate * b]])
    middle = np.array([[none, none + 1.0, none], 0.5 * (lowest[1] + highest[1])])
    upward[:, :2, :, :count] = lowest, middle, highest
    upward[:, 2, :, :count] = rate * (highest[1] - lowest[1])
    return np.ascontiguousarray(upward)


def product_weights(field: FieldArguments) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the pairs of Bernstein coefficients of degree 2 that add to those of degree 4.

    Returns:
        The first pair of each coefficient, and their end; the pairs; and the weight of each, which
        along an axis is C(2, i) C(2, j)/C(4, i + j).
    """
    place = np.add.outer(np.arange(3), np.arange(3))
    weight = np.outer([1, 2, 1], [1, 2, 1]) / np.array([1, 4, 6, 4, 1])[place]
    places = place
    weights = weight
    for _ in range(2 if field_rows(field) > 1 else 1):
        size = 3 * len(places)
        places = (5 * places[:, None, :, None] + place[:, None]).reshape(size, size)
        weights = np.kron(weights, weight)
    order = np.argsort(places, axis=None, kind="stable")
    starts = np.searchsorted(places.ravel()[order], np.arange(places.max() + 2))
    pairs = np.column_stack(np.unravel_index(order, places.shape))
    return starts, pairs, weights.ravel()[order]
