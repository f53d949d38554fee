"""Bounds of the second derivatives of a baked potential, against hulls of its values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.textures.fields import field_curvature as hull
from asperity.textures.fields.field_certificate import hull_weights
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.field_sampler import MIRRORED, PERIODIC

RNG = np.random.default_rng(32)
RATES = np.array([[2.0, 0.5, 0.0], [-0.3, 1.5, 0.0], [0.0, 0.0, 3.0]])


def bernstein_hull(c: FloatArray, cell: tuple[int, int, int], rates: FloatArray) -> FloatArray:
    """Return the Bernstein coefficients (3, 3, 3, 3, 3) of Hess U on a cell, from values of U."""
    i, j, m = cell
    t = np.array([-0.5, 0.0, 0.5])  # converts values at these points to coefficients
    bernstein = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])
    weights = [
        np.stack([0.5 * (0.5 - t) ** 2, 0.75 - t * t, 0.5 * (0.5 + t) ** 2]),
        np.stack([t - 0.5, -2.0 * t, t + 0.5]),
        np.outer([1.0, -2.0, 1.0], np.ones(3)),
    ]
    is_profile = len(c) == 1
    block = c[i : i + 1 if is_profile else i + 3, j : j + 3, m - 1 : m + 2]
    across_weights = (
        [np.ones((1, 3)), np.zeros((1, 3)), np.zeros((1, 3))] if is_profile else weights
    )
    hess = np.zeros((3, 3, 3, 3, 3))
    for r in range(3):
        for s in range(3):
            orders = [(r == axis) + (s == axis) for axis in range(3)]  # along u, v, w
            parts = across_weights[orders[1]], weights[orders[0]], weights[orders[2]]
            values = np.einsum("ijk,ie,jf,kg->efg", block, *parts)
            hess[..., r, s] = np.einsum("efg,Ee,Ff,Gg->EFG", values, *[bernstein] * 3)
    return np.asarray(np.einsum("ra,efgrs,sb->efgab", rates, hess, rates))


def random_grid(axes: int, border: int) -> tuple[FieldGrid, FloatArray, FloatArray]:
    """Return a grid, random potentials that decrease along z, and its nodes per metre (3, 3)."""
    cells = (4, 3)[:axes]
    steps = np.linalg.inv(RATES[:2, :2]).T[:axes]
    grid = FieldGrid(steps, cells, np.zeros(2), 6, 1.0 / RATES[2, 2], 0.0, border)
    c = np.sort(np.maximum(RNG.normal(size=grid.node_counts), 0.0), axis=-1)[..., ::-1].copy()
    c[..., 4:] = 0.0
    c[:2] = 0.0
    rates = np.diag([0.0, 0.0, RATES[2, 2]])
    rates[:axes, :2] = np.linalg.pinv(steps).T
    return grid, c.astype(np.float32), rates


@pytest.mark.parametrize("border", [PERIODIC, MIRRORED])
@pytest.mark.parametrize("axes", [1, 2])
def test_hull_bounds_are_the_greatest_bernstein_coefficients(axes: int, border: int) -> None:
    """For both signs and every cell with contact; attained values only at the corners."""
    grid, c, rates = random_grid(axes, border)
    field = grid.arguments(c)
    stored = c.astype(float).reshape(grid.cells[0] + (border == MIRRORED), -1, grid.levels)
    stored = stored[grid.stored_nodes(0)].swapaxes(0, 1)
    if axes == 2:
        stored = stored[grid.stored_nodes(1)]
    found = np.zeros((2, 5))
    hull.hull_batch(0, 4, *hull_weights(field), found, field)
    for sign, result in zip((1.0, -1.0), found, strict=True):
        best, attained = 0.0, {}
        for i, j, m in np.ndindex(max(len(stored) - 2, 1), 4, grid.levels - 2):
            matrices = sign * bernstein_hull(stored, (i, j, m + 1), rates)
            eigenvalues = np.linalg.eigvalsh(matrices)[..., -1]
            best = max(best, float(eigenvalues.max()))
            corners = eigenvalues[:: 1 if axes == 1 else 2, ::2, ::2]
            for (e, f, g), value in np.ndenumerate(corners):
                place = (j + f - 0.5, 0.0 if axes == 1 else i + e - 0.5, m + g + 0.5)
                attained[place] = max(attained.get(place, 0.0), value)
        assert best * (1.0 - 1e-14) <= result[0] <= best * (1.0 + 3e-7)
        assert result[1] == pytest.approx(max(attained.values()), rel=3e-7)
        assert attained[tuple(result[2:])] == pytest.approx(result[1], rel=3e-7)
    assert axes == 1 or (found[:, 0] > found[:, 1] * 1.001).any()


def test_cells_outside_of_the_body_and_of_other_columns_are_skipped() -> None:
    grid, c, _rates = random_grid(2, MIRRORED)
    c[:4] = 0.0
    field, empty = grid.arguments(c), np.full((2, 5), 0.125)
    hull.hull_batch(0, 2, *hull_weights(field), empty, field)
    assert (empty == 0.125).all()
    hull.hull_batch(2, 4, *hull_weights(field), empty, field)
    assert (empty[:, :2] > 0.125).all()


def test_bernstein_coefficients_reproduce_the_spline() -> None:
    """On the middle cell Σ b_i B_i(u) is the quadratic spline, and for its derivatives."""
    c0, c1, c2 = RNG.normal(size=3)
    u = np.linspace(0.0, 1.0, 7)
    basis = np.stack([(1 - u) ** 2, 2 * u * (1 - u), u * u])
    spline = 0.5 * (c0 * (1 - u) ** 2 + c1 * (1 + 2 * u - 2 * u * u) + c2 * u * u)
    slope = c0 * (u - 1) + c1 * (1 - 2 * u) + c2 * u
    grid, c, _rates = random_grid(1, PERIODIC)
    field = grid.arguments(c)
    _plane, upward = hull_weights(field)
    for order, expected in enumerate((spline, slope, np.full(7, c0 - 2 * c1 + c2))):
        found = upward[:, order] @ (c0, c1, c2) / field.iz**order
        np.testing.assert_allclose(found @ basis, expected, rtol=1e-12, atol=1e-14)


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


def test_raise_bound_never_lowers_a_bound() -> None:
    """The matrix of a corner also raises the attained value and its position."""
    bounds = np.full((2, 5), -1.0)
    bounds[1] = 5.0, 1.0, 7.0, 8.0, 9.0
    bound = bounds[1]
    matrix = (3.0, 0.0, 0.0, 2.0, 0.0, -1.0)
    hull.raise_bound(bounds, 1, False, matrix, (0.5, 1.5, 2.5))
    np.testing.assert_array_equal(bound, [5.0, 1.0, 7.0, 8.0, 9.0])
    hull.raise_bound(bounds, 1, True, matrix, (0.5, 1.5, 2.5))
    np.testing.assert_allclose(bound, [5.0, 3.0, 0.5, 1.5, 2.5], rtol=1e-7)
    hull.raise_bound(bounds, 1, True, (6.0, 0.0, 0.0, 2.0, 0.0, -1.0), (3.5, 4.5, 5.5))
    np.testing.assert_allclose(bound, [6.0, 6.0, 3.5, 4.5, 5.5], rtol=2e-7)
    assert bound[0] > 6.0
    hull.raise_bound(bounds, 1, False, (9.0, 0.0, 0.0, 2.0, 0.0, -1.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(bound, [9.0, 6.0, 3.5, 4.5, 5.5], rtol=2e-7)
    assert (bounds[0] == -1.0).all()
