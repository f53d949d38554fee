"""Bounds of the second derivatives of a tabulated potential, against hulls of its values."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.contacts.split import potential_hull as hull
from asperity.contacts.split import potential_spline as table
from asperity.core.checks import FloatArray

RNG = np.random.default_rng(32)


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


@pytest.mark.parametrize("rows", [1, 5])
def test_hull_bounds_are_the_greatest_bernstein_coefficients(rows: int) -> None:
    """For both signs and every cell with contact; attained values only at the corners."""
    c = -np.sort(-np.maximum(RNG.normal(size=(rows, 6, 5)), 0.0), axis=2)  # U decreases along z
    c[:, :, 3:] = 0.0
    c[:, :3, :] = 0.0
    rates = np.array([[2.0, 0.5, 0.0], [-0.3, 1.5, 0.0], [0.0, 0.0, 3.0]])
    spline = (c, 0.0, 0.0, 0.0, 2.0, 0.5, -0.3, 1.5, 3.0, True)
    out = np.full((2, 5), np.nan)
    hull.hull_batch(0, 4, out, table.PotentialSpline(*spline))
    lower: list[tuple[float, tuple[float, ...]]] = []
    upper = []
    for sign in (1.0, -1.0):
        best, attained = 0.0, (0.0, (np.nan,) * 3)
        for i in range(max(rows - 2, 1)):
            for j in range(4):
                for m in (1, 2, 3):
                    eigenvalues = np.linalg.eigvalsh(sign * bernstein_hull(c, (i, j, m), rates))[
                        ..., -1
                    ]
                    best = max(best, float(eigenvalues.max()))
                    corners = eigenvalues[:: 1 if rows == 1 else 2, ::2, ::2]
                    e, f, g = np.unravel_index(int(corners.argmax()), corners.shape)
                    position = (j + f - 0.5, 0.0 if rows == 1 else i + e - 0.5, m + g - 0.5)
                    attained = max(attained, (float(corners.max()), position))
        upper.append(best)
        lower.append(attained)
    np.testing.assert_allclose(out[:, 0], upper, rtol=3e-7)
    assert (out[:, 0] >= upper).all()
    np.testing.assert_allclose(out[:, 1], [value for value, _position in lower], rtol=3e-7)
    for result, (_value, position) in zip(out, lower, strict=True):
        np.testing.assert_array_equal(result[2:], position)
    assert (out[:, 0] > out[:, 1] * 1.001).any()
    # Cells outside of contact and those of other columns are skipped.
    empty = np.full((2, 5), np.nan)
    hull.hull_batch(0, 1, empty, table.PotentialSpline(*spline))
    assert not empty[:, :2].any()


def test_raise_bound_never_lowers_a_bound() -> None:
    """The matrix of a corner also raises the attained value and its position."""
    bound = np.array([5.0, 1.0, 7.0, 8.0, 9.0])
    matrix = (3.0, 0.0, 0.0, 2.0, 0.0, -1.0)
    hull.raise_bound(bound, False, matrix, (0.5, 1.5, 2.5))
    np.testing.assert_array_equal(bound, [5.0, 1.0, 7.0, 8.0, 9.0])
    hull.raise_bound(bound, True, matrix, (0.5, 1.5, 2.5))
    np.testing.assert_allclose(bound, [5.0, 3.0, 0.5, 1.5, 2.5], rtol=1e-7)
    hull.raise_bound(bound, True, (6.0, 0.0, 0.0, 2.0, 0.0, -1.0), (3.5, 4.5, 5.5))
    np.testing.assert_allclose(bound, [6.0, 6.0, 3.5, 4.5, 5.5], rtol=2e-7)
    assert bound[0] > 6.0
    hull.raise_bound(bound, False, (9.0, 0.0, 0.0, 2.0, 0.0, -1.0), (0.0, 0.0, 0.0))
    np.testing.assert_allclose(bound, [9.0, 6.0, 3.5, 4.5, 5.5], rtol=2e-7)
