"""Height maps: C² splines through the nodes, mirrored or periodic, with certified bounds."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from asperity.core.errors import ParameterError
from asperity.textures import HeightMap, Profile
from asperity.textures.spline.bspline_kernels import find_cell

Check = Callable[..., Any]
MAPS = ["map", "steep map", "periodic map"]
every_map = pytest.mark.parametrize("texture", MAPS, indirect=True)


def away_from_nodes(texture: HeightMap, count: int, seed: int) -> np.ndarray:
    """Return points (n, 2) inside cells of the map and of its repetitions."""
    rng = np.random.default_rng(seed)
    cells = rng.integers(-12, 20, (count, 2)) + rng.uniform(0.1, 0.9, (count, 2))
    return texture.origin + cells * texture.pitch


def node_positions(texture: HeightMap) -> np.ndarray:
    i, j = np.indices(texture.heights.shape)
    return texture.origin + np.stack([j, i], -1).reshape(-1, 2) * texture.pitch


@every_map
def test_spline_interpolates_the_nodes(texture: HeightMap):
    heights = texture.height(node_positions(texture))
    rounding = 1e-14 * np.abs(texture.heights).max()
    np.testing.assert_allclose(heights, texture.heights.ravel(), rtol=0, atol=10 * rounding)


@every_map
def test_height_matches_scipy_splines(texture: HeightMap, scatter: Check):
    xy = scatter(texture, 200, seed=1, stretch=3.0)
    u = (xy - texture.origin) / texture.pitch
    mode = "grid-wrap" if texture.periodic else "mirror"
    expected = map_coordinates(texture.heights, [u[:, 1], u[:, 0]], order=3, mode=mode)
    largest = np.abs(texture.heights).max()
    np.testing.assert_allclose(texture.height(xy), expected, rtol=0, atol=1e-12 * largest)


@every_map
def test_slopes_and_hessian_are_derivatives(texture: HeightMap, check_derivatives: Check):
    check_derivatives(texture, away_from_nodes(texture, 60, seed=2), step=3e-6)


@every_map
def test_second_derivatives_are_continuous_across_cells(texture: HeightMap):
    ny, nx = texture.heights.shape
    rng = np.random.default_rng(3)
    along = rng.uniform(-3, 20, 60)
    lines = np.arange(60) - 15  # includes positions beyond both borders
    step = 1e-9
    for axis in (0, 1):
        cells = np.stack([lines, along] if axis == 0 else [along, lines], -1)
        move = step * np.eye(2)[axis]
        before = texture.derivatives(texture.origin + (cells - move) * texture.pitch)
        after = texture.derivatives(texture.origin + (cells + move) * texture.pitch)
        size = np.abs(texture.heights).max()
        scale = np.array([1, *2 * [3e-4], *3 * [9e-8]]) / size
        assert np.abs((after - before) * scale).max() < 1e-6, (axis, nx, ny)


def test_finite_map_is_mirrored_at_its_border_nodes(make_texture: Check):
    texture = make_texture("map")
    rng = np.random.default_rng(4)
    size = np.array(texture.domain.spans).diagonal()
    inner = rng.random((40, 2)) * size
    heights = texture.height(texture.origin + inner)
    images = [-inner, 2 * size - inner, inner + 2 * size, inner * [-1, 1], inner - 4 * size]
    for image in images:
        mirrored = texture.height(texture.origin + image)
        np.testing.assert_allclose(mirrored, heights, rtol=0, atol=1e-15)
    flipped = texture.derivatives(texture.origin - inner)
    signs = np.array([1, -1, -1, 1, 1, 1])
    straight = texture.derivatives(texture.origin + inner) * signs
    np.testing.assert_allclose(flipped, straight, rtol=1e-8, atol=1e-9)
    mirrored_along_x = texture.derivatives(texture.origin + inner * [-1, 1])
    signs = np.array([1, -1, 1, 1, -1, 1])
    straight = texture.derivatives(texture.origin + inner) * signs
    np.testing.assert_allclose(mirrored_along_x, straight, rtol=1e-8, atol=1e-9)


def test_normal_slope_at_the_border_is_zero(make_texture: Check):
    texture = make_texture("map")
    along = np.linspace(0.0, 1.0, 11)[:, None]
    width, depth = texture.domain.spans.diagonal()
    for corner in (0.0, width):
        edge = texture.origin + np.hstack([np.full_like(along, corner), along * depth])
        assert np.abs(texture.gradient(edge)[:, 0]).max() < 1e-13
    for corner in (0.0, depth):
        edge = texture.origin + np.hstack([along * width, np.full_like(along, corner)])
        assert np.abs(texture.gradient(edge)[:, 1]).max() < 1e-13


def test_period_of_a_periodic_map_is_its_number_of_nodes(make_texture: Check):
    texture = make_texture("periodic map")
    ny, nx = texture.heights.shape
    np.testing.assert_allclose(texture.domain.spans, np.diag([nx * 3e-4, ny * 4e-4]))
    xy = away_from_nodes(texture, 40, seed=5)
    for span in texture.domain.spans:
        ahead = texture.derivatives(xy + span)
        np.testing.assert_allclose(ahead, texture.derivatives(xy), rtol=1e-9, atol=1e-9)
    assert texture.domain.periodic
    assert texture.scan_line().periodic


def test_domain_of_a_finite_map_ends_at_its_last_nodes(make_texture: Check):
    texture = make_texture("map")
    ny, nx = texture.heights.shape
    np.testing.assert_allclose(texture.domain.spans, np.diag([(nx - 1) * 3e-4, (ny - 1) * 4e-4]))
    np.testing.assert_array_equal(texture.domain.origin, texture.origin)
    assert not texture.domain.periodic
    assert not texture.is_profile


@every_map
def test_scan_line_crosses_the_middle(texture: HeightMap):
    line = texture.scan_line()
    width, depth = texture.domain.spans.diagonal()
    middle = np.array([0.0, depth / 2])
    np.testing.assert_allclose(line.start, texture.origin + middle)
    assert line.length == pytest.approx(width)
    np.testing.assert_array_equal(line.direction, [1.0, 0.0])
    assert line.periodic == texture.periodic


@every_map
def test_extremes_are_certified_and_attained(texture: HeightMap, sampled_extremes: Check):
    low, high = texture.extremes
    sampled_low, sampled_high = sampled_extremes(texture, 240)
    rounding = 1e-12 * (high - low)
    assert low - rounding <= sampled_low <= low + rounding
    assert high - rounding <= sampled_high <= high + rounding
    assert high > texture.heights.max()  # the spline overshoots the nodes


@every_map
def test_bounds_of_rough_maps_are_never_exceeded(texture: HeightMap, sampled_bounds: Check):
    """White noise is the worst case for bounds from the convex hull of the coefficients."""
    slope, second = sampled_bounds(texture, 400)
    assert texture.bounds[0] / 4.5 < slope <= texture.bounds[0]
    assert texture.bounds[1] / 3.5 < second <= texture.bounds[1]


def test_bounds_of_smooth_maps_are_tight(sampled_bounds: Check):
    i, j = np.mgrid[0:48, 0:48]
    heights = 1e-4 * np.sin(2 * np.pi * (2 * i + j) / 48 + 0.3)
    texture = HeightMap(heights, 1e-4, periodic=True)
    slope, second = sampled_bounds(texture, 400)
    assert texture.bounds[0] / 1.02 < slope <= texture.bounds[0]
    assert texture.bounds[1] / 1.25 < second <= texture.bounds[1]


def test_derivatives_of_a_plane_and_a_parabola():
    """Derivatives are exact in the middle of a large map, far from the mirrored border."""
    i, j = np.mgrid[0:41, 0:41] - 20
    parabola = HeightMap(1e-6 * j**2, 1e-4)
    middle = np.array([[2e-3, 2e-3]])
    assert parabola.hessian(middle)[0, 0, 0] == pytest.approx(200.0, rel=1e-9)
    tilted = HeightMap(1e-6 * (3 * i + 4 * j), 1e-4)
    np.testing.assert_allclose(tilted.gradient(middle), [[0.04, 0.03]], rtol=1e-9)
    assert tilted.bounds[0] >= 0.05


def test_pitches_and_origin_transform_positions():
    heights = np.random.default_rng(6).normal(size=(5, 6)) * 1e-4
    plain = HeightMap(heights, 1.0)
    stretched = HeightMap(heights, (2e-3, 5e-4), origin=(0.1, -0.2))
    u = np.random.default_rng(7).uniform(-3, 9, (20, 2))
    xy = np.array([0.1, -0.2]) + u * [2e-3, 5e-4]
    expected = plain.derivatives(u) / [1, 2e-3, 5e-4, 4e-6, 1e-6, 2.5e-7]
    np.testing.assert_allclose(stretched.derivatives(xy), expected, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("shape", [(1200,), (1200, 9), (9, 1200)])
@pytest.mark.parametrize("height", [-1.0, 1e-9])
def test_coefficients_with_subnormal_squares_are_zero(shape: tuple[int, ...], height: float):
    """Coefficients decay beside a spike; arithmetic with subnormal numbers is ten times slower.

    The others are equal to those of SciPy.
    """
    from scipy.ndimage import spline_filter

    heights = np.zeros(shape)
    heights[tuple(n // 2 for n in shape)] = height
    texture = Profile(heights, 1e-4) if len(shape) == 1 else HeightMap(heights, 1e-4)
    coefficients = texture.coefficients
    size = np.abs(coefficients[coefficients != 0.0])
    assert size.min() > 1e-91 * abs(height)
    exact = spline_filter(heights, order=3, mode="mirror")
    inner = coefficients[(slice(1, -1),) * len(shape)]
    large = np.abs(exact) > 1e-90 * np.abs(exact).max()
    assert not large.all()
    np.testing.assert_array_equal(inner, np.where(large, exact, 0.0))


def test_flat_map_has_constant_height():
    flat = HeightMap(np.full((5, 5), 1e-4), 1e-3)
    assert flat.extremes == (1e-4, 1e-4)
    assert flat.bounds[0] < 1e-15
    np.testing.assert_allclose(flat.height([[0.3e-3, 7.1e-3]]), 1e-4, rtol=1e-14)


@pytest.mark.parametrize(
    ("argument", "heights", "options"),
    [
        ("heights", np.zeros((3, 9)), {}),
        ("heights", np.zeros((9, 3)), {}),
        ("heights", np.zeros(9), {}),
        ("heights", np.zeros((4, 4, 4)), {}),
        ("heights", np.full((4, 4), np.nan), {}),
        ("heights", [["a"] * 4] * 4, {}),
        ("pitch", np.zeros((4, 4)), {"pitch": 0.0}),
        ("pitch", np.zeros((4, 4)), {"pitch": -1e-3}),
        ("pitch", np.zeros((4, 4)), {"pitch": math.nan}),
        ("pitch", np.zeros((4, 4)), {"pitch": (1e-3, 0.0)}),
        ("pitch", np.zeros((4, 4)), {"pitch": (1e-3, 1e-3, 1e-3)}),
        ("pitch", np.zeros((4, 4)), {"pitch": "1 kg"}),
        ("origin", np.zeros((4, 4)), {"origin": (0.0, 0.0, 0.0)}),
        ("origin", np.zeros((4, 4)), {"origin": (0.0, math.inf)}),
    ],
)
def test_invalid_arguments_are_refused(argument: str, heights: Any, options: dict[str, Any]):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        HeightMap(heights, **({"pitch": 1e-3} | options))
    assert caught.value.argument == argument


def test_description_has_size_and_preparation():
    texture = HeightMap(np.zeros((4, 6)), (1e-3, 2e-3), preparation=["levelled"])
    assert texture.describe() == {
        "kind": "heightmap",
        "points": [6, 4],
        "pitch": [1e-3, 2e-3],
        "periodic": False,
        "preparation": ["levelled"],
    }
    assert "6 x 4" in repr(texture)


@pytest.mark.parametrize("periodic", [True, False])
def test_no_place_however_far_is_outside_of_the_map(periodic: bool) -> None:
    """Rounding may leave nothing of a place far away: it is then some place inside."""
    for u in [sign * m * 10.0**e for sign in (-1, 1) for m in (1.2345, 7.1) for e in range(308)]:
        cell, place, _sign = find_cell(u, 0.0, 1.0, 7, periodic)
        assert 0 <= cell < 7
        assert 0.0 <= place <= 1.0
