"""Bounds of the second derivatives of a baked potential, against those at many points."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.textures.fields import field_curvature as hull
from asperity.textures.fields.field_certificate import cells_above, hull_weights, product_weights
from asperity.textures.fields.field_grid import FieldGrid, SingleArray
from asperity.textures.fields.field_record import MIRRORED, PERIODIC, FieldArguments
from asperity.textures.fields.field_sampler import field_expansion

RNG = np.random.default_rng(32)
STEPS = np.array([[1.0, 0.2], [-0.1, 1.3]])
NO_MARKS = np.zeros((0, 0, 0), np.uint8)


def random_grid(axes: int, border: int, noise: float = 0.1) -> tuple[FieldGrid, SingleArray]:
    """Return a grid with 3 cells below its floor, and depths near 4 - z, with noise above it."""
    grid = FieldGrid(STEPS[:axes], (4, 3)[:axes], np.zeros(2), 12, 1.1, 0.0, 3, border)
    z = grid.height(np.arange(12))
    size = np.where(np.arange(12) > grid.below + 2, noise, 0.02)
    depth = 4.0 - z + size * RNG.normal(size=grid.node_counts)
    return grid, np.maximum(depth, -grid.margin).astype(np.float32)


def bounds_of(field: FieldArguments, first: int = 0, last: int = 4) -> FloatArray:
    found = np.zeros((2, 5))
    weights = *hull_weights(field), *product_weights(field)
    hull.hull_batch(first, last, *weights, found, NO_MARKS, field)
    return found


def hessians(field: FieldArguments, points: FloatArray) -> FloatArray:
    """Return Hess T at points (n, 3)."""
    entries = np.array([field_expansion(*p, field)[1:] for p in points])
    return entries[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)


def random_points(grid: FieldGrid, count: int) -> FloatArray:
    """Return points above the bottom, and below it as far as the field fades."""
    nodes = RNG.uniform(0.0, 1.0, (count, len(grid.cells))) * grid.cells
    xy, z = grid.positions(nodes), RNG.uniform(-8.0 * 1.1, 5.0, count)
    return np.column_stack([xy, z])


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED])
@pytest.mark.parametrize("axes", [1, 2])
def test_bounds_hold_at_all_points_and_are_nearly_attained(axes: int, border: int) -> None:
    grid, depth = random_grid(axes, border)
    field = grid.arguments(depth, 3.9)
    points = random_points(grid, 6000)
    eigenvalues = np.linalg.eigvalsh(hessians(field, points))
    found = bounds_of(field, 0, 4 + (border == MIRRORED))
    found[0, 0] = max(found[0, 0], 1.0)  # of the flat wall far below
    assert eigenvalues[:, -1].max() <= found[0, 0]
    assert -eigenvalues[:, 0].min() <= found[1, 0]
    assert found[0, 0] <= 1.5 * found[0, 1]  # looser where cells are as large as the depth
    for sign, row in zip((1.0, -1.0), found, strict=True):
        place = grid.positions(row[None, 2 : 2 + axes])[0]
        around = np.array([*place, grid.height(row[4])]) + 1e-9 * RNG.normal(size=(200, 3))
        attained = (sign * np.linalg.eigvalsh(hessians(field, around))).max()
        assert row[1] * (1.0 - 1e-6) <= attained <= row[0]
        assert row[1] >= 0.6 * (sign * eigenvalues[points[:, 2] > 0.0]).max()
    # Negative control: with a greater lift the field exceeds its bound below the floor.
    steep = field._replace(lift=field.lift + 20.0)
    assert np.linalg.eigvalsh(hessians(steep, points))[:, -1].max() > 1.2 * found[0, 0]


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED])
@pytest.mark.parametrize("axes", [1, 2])
def test_cells_above_a_limit_are_those_that_may_exceed_it(axes: int, border: int) -> None:
    """At no point of the other cells, and in each of these the bound does."""
    grid, depth = random_grid(axes, border)
    field = grid.arguments(depth, 3.9)
    limit = 0.5 * (1.0 + bounds_of(field, 0, 4 + (border == MIRRORED))[:, 0].max())
    every = np.ones(grid.node_counts, np.uint8)
    marks = cells_above(field, limit, every)
    assert 0.0 < marks.mean() < 0.5
    points = random_points(grid, 6000)
    eigenvalues = np.linalg.eigvalsh(hessians(field, points))
    exceeds = np.maximum(eigenvalues[:, -1], -eigenvalues[:, 0]) > limit
    nodes = points[:, :2] @ np.linalg.pinv(STEPS[:axes])
    level = grid.below + 0.5 + points[:, 2] / grid.level_spacing
    cells = np.rint(np.column_stack([nodes, level])).astype(int)
    cells %= np.array(grid.node_counts)
    above = (points[:, 2] > 0.0) & exceeds
    assert above.any()
    assert marks[tuple(cells[above].T)].all()
    # Of fewer cells it returns those of them that it returned before.
    some = (RNG.uniform(size=every.shape) < 0.5).astype(np.uint8)
    np.testing.assert_array_equal(cells_above(field, limit, some), marks & some)
    np.testing.assert_array_equal(cells_above(field, 1e3, every), 0)


def test_cells_outside_of_the_body_and_of_other_columns_are_skipped() -> None:
    grid, depth = random_grid(2, MIRRORED)
    depth[:4] = -grid.margin
    field = grid.arguments(depth)
    assert not bounds_of(field, 0, 2).any()
    assert (bounds_of(field, 2, 4)[:, 0] > 0.01).all()


def test_bernstein_coefficients_reproduce_the_spline() -> None:
    """On the middle cell Σ b_i B_i(u) is the quadratic spline, and for its derivatives."""
    c0, c1, c2 = RNG.normal(size=3)
    u = np.linspace(0.0, 1.0, 7)
    basis = np.stack([(1 - u) ** 2, 2 * u * (1 - u), u * u])
    spline = 0.5 * (c0 * (1 - u) ** 2 + c1 * (1 + 2 * u - 2 * u * u) + c2 * u * u)
    slope = c0 * (u - 1) + c1 * (1 - 2 * u) + c2 * u
    grid, depth = random_grid(1, PERIODIC)
    field = grid.arguments(depth)
    _plane, upward = hull_weights(field)
    for order, expected in enumerate((spline, slope, np.full(7, c0 - 2 * c1 + c2))):
        found = upward[:, order, :, 0] @ (c0, c1, c2) / field.iz**order
        np.testing.assert_allclose(found @ basis, expected, rtol=1e-12, atol=1e-14)


def test_bounds_hold_where_cells_are_stretched() -> None:
    """And those of the same coefficients on equal cells do not."""
    knots = np.array([-30.0, -18.0, -6.0, 0.0, 3.0, 5.0, 6.1])
    grid = FieldGrid(STEPS, (4, 3), np.zeros(2), 12, 1.1, -6.0, 1, PERIODIC, knots)
    depth = 12.0 - grid.height(np.arange(12)) + 0.2 * RNG.normal(size=grid.node_counts)
    stored = (depth - grid.offsets()).astype(np.float32)
    field = grid.arguments(stored, 18.0)
    points = random_points(grid, 6000)
    points[:, 2] = RNG.uniform(-40.0, 12.0, len(points))
    eigenvalues = np.linalg.eigvalsh(hessians(field, points))
    upper, lower = bounds_of(field)[:, 0]
    assert eigenvalues[:, -1].max() <= upper
    assert -eigenvalues[:, 0].min() <= lower
    assert eigenvalues[:, -1].max() > 0.5 * upper
    assert bounds_of(grid.arguments(stored * 0.0, 18.0))[0, 0] != upper


def test_eigenvalues_and_minors_agree_with_lapack() -> None:
    for _ in range(200):
        m = RNG.normal(size=(3, 3))
        m = m + m.T
        entries = m[0, 0], m[0, 1], m[0, 2], m[1, 1], m[1, 2], m[2, 2]
        top = float(np.linalg.eigvalsh(m)[-1])
        assert hull.largest_eigenvalue_3x3(*entries) == pytest.approx(top, rel=1e-7)
        for margin, is_below in ((1e-6, True), (-1e-6, False), (-2.0, False), (5.0, True)):
            assert (hull.least_minor(top + margin * (1.0 + abs(top)), *entries) > 0.0) == is_below
    assert hull.largest_eigenvalue_3x3(2.0, 0.0, 0.0, 2.0, 0.0, 2.0) == 2.0
    diagonal: Any = (1.0, 0.0, 0.0, 1.0, 0.0, 1.0)
    assert hull.least_minor(1.0, *diagonal) <= 0.0
    assert hull.least_minor(1.5, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0) <= 0.0
