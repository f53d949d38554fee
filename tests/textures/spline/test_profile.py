"""Profiles: one-dimensional splines."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from asperity.core.errors import ParameterError
from asperity.textures import HeightMap, Profile

Check = Callable[..., Any]
both_kinds = pytest.mark.parametrize("texture", ["profile", "periodic profile"], indirect=True)


def on_line(x: np.ndarray) -> np.ndarray:
    return np.column_stack([x, np.sin(1e4 * x)])  # y does not matter


@both_kinds
def test_height_matches_scipy_splines(texture: Profile):
    nodes = np.concatenate([np.arange(9), np.random.default_rng(1).uniform(-12, 20, 100)])
    mode = "grid-wrap" if texture.periodic else "mirror"
    expected = map_coordinates(texture.heights, [nodes], order=3, mode=mode)
    heights = texture.height(on_line(texture.origin + nodes * texture.pitch))
    largest = np.abs(texture.heights).max()
    np.testing.assert_allclose(heights, expected, rtol=0, atol=1e-12 * largest)
    np.testing.assert_allclose(heights[:9], texture.heights, rtol=0, atol=1e-13 * largest)


@both_kinds
def test_slopes_and_hessian_are_derivatives(texture: Profile, check_derivatives: Check):
    rng = np.random.default_rng(2)
    nodes = rng.integers(-12, 20, 60) + rng.uniform(0.1, 0.9, 60)
    check_derivatives(texture, on_line(texture.origin + nodes * texture.pitch), step=3e-6)


@both_kinds
def test_second_derivatives_are_continuous_across_nodes(texture: Profile):
    nodes = np.arange(40) - 15.0
    size = np.abs(texture.heights).max()
    scale = np.array([1, 3e-4, 1, 9e-8, 1, 1]) / size
    before = texture.derivatives(on_line(texture.origin + (nodes - 1e-9) * texture.pitch))
    after = texture.derivatives(on_line(texture.origin + (nodes + 1e-9) * texture.pitch))
    assert np.abs((after - before) * scale).max() < 1e-6


@both_kinds
def test_profile_equals_a_map_of_equal_rows(texture: Profile):
    """Two independent samplers give the same derivatives."""
    rows = HeightMap(
        np.tile(texture.heights, (5, 1)),
        texture.pitch,
        periodic=texture.periodic,
        origin=(texture.origin, 0.0),
    )
    xy = np.random.default_rng(3).uniform(-3e-3, 5e-3, (60, 2))
    second = texture.bounds[1]
    expected = texture.derivatives(xy)
    scale = np.array([1e-4, 1, 1, second, second, second])
    assert np.abs((rows.derivatives(xy) - expected) / scale).max() < 1e-11


def test_finite_profile_is_mirrored_with_zero_slope_at_its_ends(make_texture: Check):
    texture = make_texture("profile")
    length = texture.domain.spans[0, 0]
    assert length == pytest.approx(8 * 3e-4)
    inner = np.random.default_rng(4).random(30) * length
    for start, image in ((0.0, -inner), (2 * length, -inner), (4 * length, inner)):
        mirrored = texture.height(on_line(texture.origin + start + image))
        straight = texture.height(on_line(texture.origin + inner))
        np.testing.assert_allclose(mirrored, straight, rtol=0, atol=1e-15)
    ends = on_line(texture.origin + np.array([0.0, length]))
    assert np.abs(texture.gradient(ends)).max() < 1e-13


def test_periodic_profile_repeats(make_texture: Check):
    texture = make_texture("periodic profile")
    span = texture.domain.spans[0]
    assert span[0] == pytest.approx(9 * 3e-4)
    xy = on_line(np.random.default_rng(5).uniform(-3e-3, 3e-3, 30))
    for times in (-2, 1, 3):
        ahead = texture.height(xy + times * span)
        np.testing.assert_allclose(ahead, texture.height(xy), rtol=0, atol=1e-15)


@both_kinds
def test_scan_line_is_the_profile(texture: Profile):
    line = texture.scan_line()
    np.testing.assert_array_equal(line.start, [texture.origin, 0.0])
    np.testing.assert_array_equal(line.direction, [1.0, 0.0])
    assert line.length == pytest.approx(texture.domain.spans[0, 0])
    assert line.periodic == texture.periodic == texture.domain.periodic
    assert texture.is_profile


@both_kinds
@pytest.mark.parametrize("seed", range(3))
def test_extremes_are_certified_and_attained(texture: Profile, seed: int, sampled_extremes: Check):
    heights = np.random.default_rng(seed).normal(size=4 + 5 * seed) * 1e-4
    random = Profile(heights, 3e-4, periodic=texture.periodic, origin=0.1e-3)
    low, high = random.extremes
    sampled_low, sampled_high = sampled_extremes(random, 4000)
    rounding = 1e-12 * (high - low)
    assert low - rounding <= sampled_low <= low + rounding
    assert high - rounding <= sampled_high <= high + rounding


@pytest.mark.parametrize(
    "heights",
    [
        [1.0, 1.0, 1.0, 1.0],
        [0.0, 1.0, 2.0, 3.0],
        [0.0, 0.0, 1.0, 0.0, 0.0],
        [4.0, 1.0, 0.0, 1.0, 4.0],
    ],
    ids=["flat", "ramp", "spike", "parabola"],
)
def test_extremes_where_a_coefficient_of_the_slope_vanishes(heights: list[float]):
    texture = Profile(np.array(heights) * 1e-4, 1e-3)
    low, high = texture.extremes
    x = np.linspace(0.0, (len(heights) - 1) * 1e-3, 8001)
    sampled = texture.height(on_line(x))
    assert low <= sampled.min() + 1e-18
    assert sampled.max() - 1e-18 <= high
    assert (sampled.min() - low, high - sampled.max()) == pytest.approx((0.0, 0.0), abs=1e-11)


@both_kinds
def test_bounds_are_never_exceeded_and_tight(texture: Profile, sampled_bounds: Check):
    slope, second = sampled_bounds(texture, 9000)
    assert texture.bounds[0] / 2.0 < slope <= texture.bounds[0]
    assert texture.bounds[1] / 1.01 < second <= texture.bounds[1]  # attained at a node


@pytest.mark.parametrize(
    ("argument", "arguments"),
    [
        ("heights", {"heights": [0.0, 1.0, 0.0]}),
        ("heights", {"heights": np.zeros((4, 4))}),
        ("heights", {"heights": [0.0, 1.0, math.nan, 0.0]}),
        ("heights", {"heights": "high"}),
        ("pitch", {"pitch": 0.0}),
        ("pitch", {"pitch": (1e-3, 1e-3)}),
        ("pitch", {"pitch": math.inf}),
        ("origin", {"origin": math.nan}),
        ("origin", {"origin": (0.0, 0.0)}),
    ],
)
def test_invalid_arguments_are_refused(argument: str, arguments: dict[str, Any]):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Profile(**({"heights": [0.0, 1.0, 0.0, 1.0], "pitch": 1e-3} | arguments))
    assert caught.value.argument == argument
