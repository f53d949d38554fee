"""Fourier textures: formula, period and certified extremes."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

from asperity.core.errors import ParameterError
from asperity.textures import Fourier, Sinusoid
from asperity.textures.kinds.fourier_sampler import expand_waves

Check = Callable[..., Any]
ROOT2 = math.sqrt(2.0)
KINDS = ["fourier", "fourier profile"]


@pytest.mark.parametrize("texture", KINDS, indirect=True)
def test_height_is_the_sum_of_waves(texture: Fourier, scatter: Check):
    xy = scatter(texture, 30, seed=1, stretch=3.0)
    expected = np.zeros(30)
    for a, wave, phase in zip(texture.amplitudes, texture.wavevectors, texture.phases, strict=True):
        expected += a * np.sin(xy @ wave + phase)
    np.testing.assert_allclose(texture.height(xy), expected, rtol=0, atol=1e-17)


@pytest.mark.parametrize("texture", KINDS, indirect=True)
def test_slopes_and_hessian_are_derivatives(
    texture: Fourier, scatter: Check, check_derivatives: Check
):
    check_derivatives(texture, scatter(texture, 50, seed=2), step=1e-7)


def test_one_wave_equals_a_sinusoid(scatter: Check):
    wave = Sinusoid(0.4e-3, 1.5e-3, phase=0.7, direction=(2.0, 1.0))
    k = 2 * math.pi / 1.5e-3 * np.array([2.0, 1.0]) / math.sqrt(5.0)
    sum_of_one = Fourier([0.4e-3], [k], [0.7])
    xy = scatter(wave, 20, seed=3)
    np.testing.assert_allclose(sum_of_one.derivatives(xy), wave.derivatives(xy), rtol=1e-9)
    np.testing.assert_allclose(sum_of_one.extremes, wave.extremes, rtol=1e-15)
    np.testing.assert_allclose(sum_of_one.bounds, wave.bounds, rtol=1e-12)
    np.testing.assert_allclose(sum_of_one.domain.spans, wave.domain.spans, rtol=1e-12)


def test_scalar_wavenumbers_give_a_profile_along_x():
    profile = Fourier([1e-4, 2e-4], [2000.0, 3000.0])
    np.testing.assert_array_equal(profile.wavevectors, [[2000.0, 0.0], [3000.0, 0.0]])
    assert profile.is_profile
    assert np.hypot(*profile.domain.spans[0]) == pytest.approx(2 * math.pi / 1000.0)


# --- period ---------------------------------------------------------------------------------------

REPEATING = {
    "profile, ratio 2:3": [[2000.0, 1000.0], [3000.0, 1500.0]],
    "profile, ratio 64:63": [[6400.0, 0.0], [6300.0, 0.0]],
    "square": [[3000.0, 0.0], [0.0, 3000.0]],
    "hexagonal": [[2000.0, 0.0], [-1000.0, 1000.0 * math.sqrt(3)], [1000.0, 1000.0 * math.sqrt(3)]],
    "oblique": [[2100.0, 300.0], [-500.0, 1700.0], [1600.0, 2000.0], [4700.0, -1100.0]],
    "opposite": [[2000.0, 500.0], [-2000.0, -500.0]],
}


def waves(vectors: list[list[float]]) -> Fourier:
    count = len(vectors)
    return Fourier(1e-4 / (1 + np.arange(count)), vectors, 0.3 + np.arange(count))


@pytest.mark.parametrize("vectors", REPEATING.values(), ids=list(REPEATING))
def test_domain_is_a_period(vectors: list[list[float]], scatter: Check):
    texture = waves(vectors)
    assert texture.domain.periodic
    xy = scatter(texture, 20, seed=4)
    for span in texture.domain.spans:
        np.testing.assert_allclose(
            texture.height(xy + span), texture.height(xy), rtol=0, atol=1e-11 * 2e-4
        )


@pytest.mark.parametrize("vectors", REPEATING.values(), ids=list(REPEATING))
def test_domain_is_the_smallest_period(vectors: list[list[float]]):
    """The cell has the area (length) of the lattice of all integer combinations."""
    texture = waves(vectors)
    sums = [
        np.array(m) @ np.array(vectors)
        for m in itertools.product(range(-3, 4), repeat=min(len(vectors), 4))
        if len(vectors) <= 4
    ]
    if texture.is_profile:
        lengths = np.hypot(*np.array(sums).T)
        if "6400" not in str(vectors):  # the smallest combination needs larger integers
            least = lengths[lengths > 1.0].min()
            assert np.hypot(*texture.domain.spans[0]) == pytest.approx(2 * math.pi / least)
        return
    areas = [abs(a[0] * b[1] - a[1] * b[0]) for a, b in itertools.combinations(sums, 2)]
    least = min(area for area in areas if area > 1.0)
    area = abs(np.linalg.det(texture.domain.spans))
    assert area == pytest.approx(4 * math.pi**2 / least, rel=1e-9)


@pytest.mark.parametrize("vectors", REPEATING.values(), ids=list(REPEATING))
def test_scan_line_is_a_period(vectors: list[list[float]]):
    texture = waves(vectors)
    line = texture.scan_line()
    assert line.periodic
    points = line.points(17)
    ahead = texture.height(points + line.length * line.direction)
    np.testing.assert_allclose(ahead, texture.height(points), rtol=0, atol=1e-11 * 2e-4)


def test_scan_line_is_along_x_if_the_sum_is_periodic_along_x():
    np.testing.assert_allclose(waves(REPEATING["hexagonal"]).scan_line().direction, [1.0, 0.0])


APERIODIC = {
    "profile": [[2000.0, 0.0], [2000.0 * ROOT2, 0.0]],
    "plane": [[2000.0, 0.0], [0.0, 2000.0], [2000.0 * ROOT2, 700.0]],
}


@pytest.mark.parametrize("vectors", APERIODIC.values(), ids=list(APERIODIC))
def test_domain_of_an_aperiodic_sum(vectors: list[list[float]]):
    texture = waves(vectors)
    assert not texture.domain.periodic
    assert not texture.scan_line().periodic
    assert "never repeats" in texture.domain.description
    longest = 2 * math.pi / np.hypot(*np.array(vectors).T).min()
    np.testing.assert_allclose(np.hypot(*texture.domain.spans.T), 16 * longest)
    assert texture.is_profile == (len(vectors) == 2)


# --- extremes and bounds --------------------------------------------------------------------------


@pytest.mark.parametrize("vectors", REPEATING.values(), ids=list(REPEATING))
def test_extremes_of_a_period_are_certified_and_attained(
    vectors: list[list[float]], sampled_extremes: Check
):
    texture = waves(vectors)
    low, high = texture.extremes
    sampled_low, sampled_high = sampled_extremes(texture, 6000 if texture.is_profile else 150)
    rounding = 1e-12 * (high - low)
    assert low - rounding <= sampled_low <= low + rounding
    assert high - rounding <= sampled_high <= high + rounding


@pytest.mark.parametrize("seed", range(12))
def test_extremes_of_random_harmonics(seed: int):
    """Several crests have nearly the same height, so the search must compare them all."""
    rng = np.random.default_rng(seed)
    orders, count = np.arange(1, 8), 200_000
    texture = Fourier(rng.normal(size=7), orders.astype(float), rng.uniform(0.0, 7.0, 7))
    angles = np.arange(count) * (2 * np.pi / count)
    heights = np.zeros(count)
    for a, order, phase in zip(texture.amplitudes, orders, texture.phases, strict=True):
        heights += a * np.sin(order * angles + phase)
    low, high = texture.extremes
    sampling_error = (
        0.5 * texture.bounds[1] * (np.pi / count) ** 2
    )  # of the maximum between two samples
    assert heights.max() <= high <= heights.max() + sampling_error
    assert heights.min() - sampling_error <= low <= heights.min()


def test_extremes_with_free_phases_are_the_sum_of_amplitudes():
    """Crests of three unrelated waves in the plane coincide arbitrarily closely."""
    texture = waves(APERIODIC["plane"])
    total = texture.amplitudes.sum()
    np.testing.assert_allclose(texture.extremes, (-total, total), rtol=1e-15)
    rng = np.random.default_rng(6)
    heights = texture.height(rng.uniform(-1.0, 1.0, (200_000, 2)))
    assert 0.98 * total < heights.max() <= total
    assert -total <= heights.min() < -0.98 * total


def test_extremes_of_an_aperiodic_profile_are_certified():
    """Wavenumbers 1, √2 and 1 + √2 have two free phases, which determine the third."""
    amplitudes, phases = np.array([1.0, 0.8, 0.7]) * 1e-4, np.array([0.3, 1.0, 2.9])
    texture = Fourier(amplitudes, 2000.0 * np.array([1.0, ROOT2, 1.0 + ROOT2]), phases)

    def height(angles: np.ndarray) -> float:
        angles = np.array([angles[0], angles[1], angles[0] + angles[1]]) + phases
        return float(amplitudes @ np.sin(angles)) / 1e-4

    starts = list(itertools.product(np.linspace(0.0, 6.0, 7), repeat=2))
    highest = max(-minimize(lambda a: -height(a), s, tol=1e-14).fun for s in starts)
    lowest = min(minimize(height, s, tol=1e-14).fun for s in starts)
    np.testing.assert_allclose(texture.extremes, (lowest * 1e-4, highest * 1e-4), rtol=1e-11)
    assert texture.extremes[1] < 0.99 * amplitudes.sum()  # not the trivial bound


def test_extremes_with_many_equal_crests():
    """An egg box, sin x + sin y, with its third harmonics."""
    box = Fourier([1e-4, 1e-4, 2e-5, 2e-5], [[1e3, 0], [0, 1e3], [3e3, 0], [0, 3e3]])
    # sin t + 0.2 sin 3t = 1.6 s - 0.8 s³, s = sin t, is greatest at s² = 2/3.
    peak = 2e-4 * math.sqrt(2 / 3) * (1.6 - 0.8 * 2 / 3)
    np.testing.assert_allclose(box.extremes, (-peak, peak), rtol=1e-13)


@pytest.mark.parametrize("texture", KINDS, indirect=True)
def test_bounds_are_never_exceeded_and_within_a_factor_of_two(
    texture: Fourier, sampled_bounds: Check
):
    slope, second = sampled_bounds(texture, 4000 if texture.is_profile else 300)
    assert 0.5 * texture.bounds[0] < slope <= texture.bounds[0]
    assert 0.5 * texture.bounds[1] < second <= texture.bounds[1]


def test_bounds_are_attained_where_all_phases_are_free():
    """The slope of sin x + sin √2 x comes arbitrarily close to the bound."""
    texture = Fourier([1e-4, 1e-4], [1000.0, 1000.0 * ROOT2])
    x = np.linspace(0.0, 20.0, 400_001)
    slope = np.abs(texture.gradient(np.column_stack([x, 0 * x]))[:, 0]).max()
    assert (1 - 1e-4) * texture.bounds[0] < slope <= texture.bounds[0]


# --- arguments ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("argument", "amplitudes", "wavevectors", "phases"),
    [
        ("amplitudes", [], [], None),
        ("amplitudes", [[1e-3]], [[1e3, 0]], None),
        ("amplitudes", [math.nan], [[1e3, 0]], None),
        ("wavevectors", [1e-3], [[1e3, 0], [2e3, 0]], None),
        ("wavevectors", [1e-3], [1e3, 0.0], None),
        ("wavevectors", [1e-3, 1e-3], [[1e3, 0], [0, 0]], None),
        ("wavevectors", [1e-3, 1e-3], [1e3, 0.0], None),
        ("wavevectors", [1e-3], [[1e3, math.inf]], None),
        ("wavevectors", [1e-3], ["steep"], None),
        ("wavevectors", [1e-3], 1e3, None),
        ("phases", [1e-3], [[1e3, 0]], [0.0, 1.0]),
        ("phases", [1e-3], [[1e3, 0]], [math.nan]),
    ],
)
def test_invalid_arguments_are_refused(
    argument: str, amplitudes: Any, wavevectors: Any, phases: Any
):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Fourier(amplitudes, wavevectors, phases)
    assert caught.value.argument == argument


def test_description_and_repr_give_the_same_texture():
    texture = waves(REPEATING["oblique"])
    description = texture.describe()
    assert description.pop("kind") == "fourier"
    xy = [[1e-4, 2e-4]]
    assert Fourier(**description).height(xy) == texture.height(xy)
    assert eval(repr(texture)).height(xy) == texture.height(xy)


# --- bounds of the search -------------------------------------------------------------------------


@pytest.mark.parametrize("reach", [0.05, 0.4, 1.5])
@pytest.mark.parametrize("count", [3, 20])
def test_expansion_bounds_the_change_of_q_over_a_box(count: int, reach: float):
    """Q differs from its value at the centre, and h from its tangent plane, by no more."""
    rng = np.random.default_rng(count)
    k = rng.uniform(0.3, 1.5, count)
    turn = rng.uniform(0.0, 7.0, count)
    waves = k[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    texture = Fourier(rng.uniform(0.1, 0.5, count), waves, turn)
    largest = []
    for x, y, gap in rng.normal(size=(40, 3)) * [20.0, 20.0, 2.0]:
        height = float(texture.height(np.array([[x, y]]))[0])
        derivatives, (change, lift, _third) = expand_waves(
            x, y, height - gap, reach, texture.arguments
        )
        expected = texture.derivatives(np.array([[x, y]]))[0]
        np.testing.assert_allclose(derivatives, expected, rtol=0, atol=1e-13 * count)
        step = rng.uniform(-1.0, 1.0, (400, 2)) * reach / math.sqrt(2.0)
        step[::4] *= reach / np.linalg.norm(step[::4], axis=1)[:, None]
        h, hx, hy, hxx, hxy, hyy = texture.derivatives(step + np.array([x, y])).T
        h0, ax, ay, axx, axy, ayy = expected
        above = h - height + gap
        xx = hx * hx + above * hxx - ax * ax - gap * axx
        xy = hx * hy + above * hxy - ax * ay - gap * axy
        yy = hy * hy + above * hyy - ay * ay - gap * ayy
        norm = np.abs(0.5 * (xx + yy)) + np.hypot(0.5 * (xx - yy), xy)
        assert norm.max() <= change * (1.0 + 1e-9) + 1e-12
        assert np.abs(h - h0 - step @ [ax, ay]).max() <= lift * (1.0 + 1e-9) + 1e-12
        largest.append(norm.max() / change)
    if reach < 0.1:  # to first order the bound is attained up to the norm of a cubic form
        assert max(largest) > 0.7
