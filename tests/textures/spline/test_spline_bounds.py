"""The certified maximum of a spline surface, against dense sampling."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.optimize import minimize
from tests.helpers.allocations import traced_peak

from asperity.textures import HeightMap
from asperity.textures.spline.spline_bounds import max_height


def spline_values(coefficients: np.ndarray, v: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the tensor B-spline on the grid v × u, by SciPy."""
    along = []
    for count, t in zip(coefficients.shape, (v, u), strict=True):
        knots = np.arange(-3.0, count + 1.0)
        along.append(BSpline.design_matrix(t, knots, 3).toarray())
    return np.asarray(along[0] @ coefficients @ along[1].T)


def sampled_maximum(coefficients: np.ndarray) -> float:
    """Return the greatest value on a dense grid, refined by local optimization."""
    ny, nx = (n - 3 for n in coefficients.shape)
    v, u = np.linspace(0, ny, 60 * ny + 1), np.linspace(0, nx, 60 * nx + 1)
    values = spline_values(coefficients, v, u)
    best = float(values.max())
    for flat in np.argsort(values.ravel())[-6:]:
        i, j = np.unravel_index(flat, values.shape)
        result = minimize(
            lambda p: -spline_values(coefficients, p[:1], p[1:])[0, 0],
            [v[i], u[j]],
            bounds=[(0, ny), (0, nx)],
            method="L-BFGS-B",
            options={"ftol": 1e-16, "gtol": 1e-9},
        )
        best = max(best, -float(result.fun))
    return best


@pytest.mark.parametrize("shape", [(4, 4), (4, 11), (9, 5), (12, 13)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_maximum_is_certified_and_attained(shape: tuple[int, int], seed: int):
    coefficients = np.random.default_rng(seed).normal(size=shape)
    greatest = max_height(coefficients)
    assert greatest == pytest.approx(sampled_maximum(coefficients), rel=0, abs=2e-12)


def test_maximum_on_the_border_of_two_batches():
    coefficients = np.random.default_rng(4).normal(size=(600, 6))
    coefficients[[255, 256, 257, 258], 2:4] += 3.0  # the maximum is on the border of two batches
    v, u = np.linspace(0, 597, 597 * 20 + 1), np.linspace(0, 3, 61)
    sampled = spline_values(coefficients, v, u).max()
    assert sampled <= max_height(coefficients) <= sampled + 0.01


@pytest.mark.parametrize("value", [0.0, 0.1, -2e-5])
def test_maximum_of_a_constant(value: float):
    assert max_height(np.full((9, 7), value)) == pytest.approx(value, rel=1e-15, abs=0)


def test_maximum_of_a_slope_is_in_a_corner():
    i, j = np.mgrid[-1:6, -1:8]
    assert max_height(2.0 * i - 3.0 * j) == pytest.approx(2.0 * 4.0, rel=1e-15)


def test_maximum_scales_with_the_coefficients():
    coefficients = np.random.default_rng(5).normal(size=(8, 8))
    assert max_height(1e-9 * coefficients) == pytest.approx(
        1e-9 * max_height(coefficients), rel=1e-13
    )


def test_extremes_of_ridges_take_bounded_memory():
    """A ridge attains its maximum along a whole line, where subdivision must stop."""
    grooves = np.tile(1e-4 * np.sin(2 * np.pi * np.arange(16) / 8 + 0.3), (16, 1))
    texture = HeightMap(grooves, 1e-4, periodic=True)
    peak = traced_peak(lambda: texture.extremes)
    high = texture.extremes[1]
    x = np.linspace(0.0, 16e-4, 16_001)
    sampled = texture.height(np.column_stack([x, np.zeros_like(x)])).max()
    assert sampled <= high <= sampled * (1 + 1e-6)
    assert peak < 100e6
