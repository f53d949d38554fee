"""Noise: its spectrum, its rms, its period and its seed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from asperity.core.errors import ParameterError
from asperity.textures import HeightMap, Profile
from asperity.textures.kinds.noise import Noise, NoiseProfile

PINNED = [-2.4059461029986945e-06, 3.0136814907277055e-06, -2.184900591162203e-05]


def power(noise: Noise) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q_x, q_y [rad/m] and power |H|² of every wave, from the heights alone."""
    ny, nx = noise.heights.shape
    qx = 2.0 * np.pi * np.fft.fftfreq(nx, noise.size[0] / nx)
    qy = 2.0 * np.pi * np.fft.fftfreq(ny, noise.size[1] / ny)
    grid = np.meshgrid(qx, qy)
    return grid[0], grid[1], np.abs(np.fft.fft2(noise.heights) / (nx * ny)) ** 2


def radial_slope(q: np.ndarray, values: np.ndarray, low: float, high: float) -> float:
    """Return the exponent of the power averaged over rings of |q|."""
    edges = np.geomspace(low, high, 13)
    middle, mean = [], []
    for a, b in pairwise(edges):
        ring = (q >= a) & (q < b)
        middle.append(np.log(q[ring]).mean())
        mean.append(np.log(values[ring]).mean())
    return float(np.polyfit(middle, mean, 1)[0])


@pytest.mark.parametrize("hurst", [0.0, 0.3, 0.8, 1.0])
def test_the_radial_spectrum_falls_with_the_hurst_exponent(hurst: float):
    noise = Noise(1e-5, (8e-3, 6e-3), hurst=hurst, rolloff=2e-3, cutoff=0.1e-3, seed=4)
    qx, qy, p = power(noise)
    slope = radial_slope(np.hypot(qx, qy), p, 2 * np.pi / 1.9e-3, 2 * np.pi / 0.101e-3)
    assert slope == pytest.approx(-2.0 - 2.0 * hurst, abs=1e-3)


@pytest.mark.parametrize("hurst", [0.2, 0.9])
def test_the_spectrum_of_a_profile_falls_one_power_less(hurst: float):
    noise = NoiseProfile(1e-5, 20e-3, hurst=hurst, rolloff=4e-3, cutoff=0.1e-3)
    q = 2.0 * np.pi * np.fft.rfftfreq(len(noise.heights), noise.pitch)
    p = np.abs(np.fft.rfft(noise.heights)) ** 2
    slope = radial_slope(q, p, 2 * np.pi / 3.9e-3, 2 * np.pi / 0.101e-3)
    assert slope == pytest.approx(-1.0 - 2.0 * hurst, abs=1e-3)


def test_the_spectrum_is_flat_below_the_roll_off():
    noise = Noise(1e-5, 10e-3, rolloff=1e-3, cutoff=0.2e-3)
    qx, qy, p = power(noise)
    q = np.hypot(qx, qy)
    flat = p[(q > 0.0) & (q < 2 * np.pi / 1e-3)]
    assert len(flat) > 200
    np.testing.assert_allclose(flat, flat.mean(), rtol=1e-9)
    # The negative control: beyond the roll-off it is not flat.
    assert p[(q > 2 * np.pi / 0.3e-3) & (q < 2 * np.pi / 0.21e-3)].max() < 0.05 * flat.mean()


@pytest.mark.parametrize("size", [10e-3, (7e-3, 12e-3)])
def test_there_is_no_power_beyond_the_cut_off(size: Any):
    noise = Noise(1e-5, size, cutoff=0.4e-3, seed=1)
    qx, qy, p = power(noise)
    q = np.hypot(qx, qy) * noise.cutoff / (2.0 * np.pi)
    assert p[q > 1.0 + 1e-9].max() < 1e-28 * p.max()
    just_inside = p[(q > 0.97) & (q < 1.0)]
    assert just_inside.min() > 1e-6 * p.max()


@pytest.mark.parametrize("seed", range(3))
def test_the_rms_is_exact_over_the_nodes(seed: int):
    noise = Noise(17e-6, (5e-3, 8e-3), seed=seed)
    assert math.sqrt(np.mean(noise.heights**2)) == pytest.approx(17e-6, rel=1e-14)
    assert abs(noise.heights.mean()) < 1e-14 * 17e-6
    profile = NoiseProfile(17e-6, 5e-3, seed=seed)
    assert math.sqrt(np.mean(profile.heights**2)) == pytest.approx(17e-6, rel=1e-14)


def test_the_rms_of_the_spline_is_close():
    noise = Noise(17e-6, 10e-3)
    xy = np.random.default_rng(3).random((40_000, 2)) * 10e-3
    assert noise.height(xy).std() == pytest.approx(17e-6, rel=0.02)


def test_it_repeats_after_its_size():
    noise = Noise(1e-5, (5e-3, 8e-3))
    np.testing.assert_allclose(noise.domain.spans, np.diag([5e-3, 8e-3]), rtol=1e-14)
    assert noise.domain.periodic
    xy = np.random.default_rng(5).random((50, 2)) * 5e-3
    for span in noise.domain.spans:
        np.testing.assert_allclose(noise.height(xy + span), noise.height(xy), atol=1e-15)
        assert np.abs(noise.height(xy + 0.5 * span) - noise.height(xy)).max() > 1e-6
    profile = NoiseProfile(1e-5, 5e-3)
    assert profile.domain.periodic
    assert profile.domain.spans[0, 0] == pytest.approx(5e-3, rel=1e-14)


def test_the_seed_decides():
    first = Noise(1e-5, 5e-3, seed=7)
    np.testing.assert_array_equal(first.heights, Noise(1e-5, 5e-3, seed=7).heights)
    other = Noise(1e-5, 5e-3, seed=8).heights
    correlation = np.corrcoef(first.heights.ravel(), other.ravel())[0, 1]
    assert abs(correlation) < 0.5


def test_the_same_on_every_machine():
    """Pinned: a change of the random numbers or of the order of the waves must be noticed."""
    noise = Noise(1e-5, 5e-3, seed=7)
    np.testing.assert_allclose(noise.heights[[0, 5, 200], [0, 60, 31]], PINNED, rtol=1e-9)


def test_a_finer_pitch_adds_nodes_only():
    coarse = Noise(1e-5, (6e-3, 4e-3), cutoff=0.4e-3, pitch=0.1e-3)
    fine = Noise(1e-5, (6e-3, 4e-3), cutoff=0.4e-3, pitch=0.05e-3)
    np.testing.assert_allclose(fine.heights[::2, ::2], coarse.heights, atol=1e-17, rtol=1e-6)


def test_a_shorter_cut_off_adds_waves_only():
    long = Noise(1e-5, 6e-3, rolloff=3e-3, cutoff=1e-3, pitch=0.05e-3)
    short = Noise(1e-5, 6e-3, rolloff=3e-3, cutoff=0.4e-3, pitch=0.05e-3)
    first, second = np.fft.fft2(long.heights), np.fft.fft2(short.heights)
    present = np.abs(first) > 1e-9 * np.abs(first).max()
    ratio = second[present] / first[present]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert (np.abs(second) > 1e-9 * np.abs(second).max()).sum() > 4 * present.sum()


def test_all_lengths_together_scale_a_rough_surface():
    small = Noise(1e-5, 5e-3, rolloff=2e-3, cutoff=0.5e-3)
    large = Noise(2e-5, 10e-3, rolloff=4e-3, cutoff=1e-3)
    np.testing.assert_allclose(large.heights, 2.0 * small.heights, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize(("nodes", "error"), [(8, 1.2e-3), (4, 2.8e-2)])
def test_the_spline_follows_the_sum_of_waves(nodes: int, error: float):
    """The stated relation of pitch and cut-off: the error of the shortest wave bounds all."""
    noise = Noise(1e-5, 4e-3, rolloff=0.5e-3, cutoff=0.5e-3, pitch=0.5e-3 / nodes)
    exact = Noise(1e-5, 4e-3, rolloff=0.5e-3, cutoff=0.5e-3, pitch=0.5e-3 / (5 * nodes))
    i, j = np.indices(exact.heights.shape)
    spline = noise.height(np.stack([j, i], -1).reshape(-1, 2) * exact.pitch[0])
    difference = spline - exact.heights.ravel()
    # Measured on both axes at once, and not zero: the spline is not the sum itself.
    assert 0.02 * error < difference.std() / 1e-5 < 2.0 * error


@settings(max_examples=25, deadline=None)
@given(
    hurst=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**32),
    rolloff=st.floats(1.0, 20.0),
    aspect=st.integers(1, 3),
)
def test_it_is_isotropic(hurst: float, seed: int, rolloff: float, aspect: int):
    """The power depends on |q| only: along x, along y and diagonally, for any period."""
    noise = Noise(1e-5, (3e-3 * aspect, 3e-3), hurst=hurst, cutoff=0.3e-3,
                  rolloff=rolloff * 0.3e-3, seed=seed)  # fmt: skip
    qx, qy, p = power(noise)
    length = np.hypot(qx, qy) * 3e-3 / (2.0 * np.pi)
    for ring in (5.0, 10.0):  # |(3, 4)| = |(5, 0)|, |(6, 8)| = |(10, 0)|
        same = np.abs(length - ring) < 1e-9
        assert same.sum() >= 12
        np.testing.assert_allclose(p[same], p[same].mean(), rtol=1e-6)
        assert np.ptp(np.arctan2(qy[same], qx[same])) > 5.0


def test_slopes_are_the_same_in_every_direction():
    noise = Noise(1e-5, 6e-3, seed=2)
    xy = np.random.default_rng(1).random((60_000, 2)) * 6e-3
    slopes = noise.gradient(xy)
    covariance = slopes.T @ slopes / len(slopes)
    assert covariance[0, 0] == pytest.approx(covariance[1, 1], rel=0.05)
    assert abs(covariance[0, 1]) < 0.03 * covariance[0, 0]


def test_defaults_leave_a_margin_to_nyquist():
    noise = Noise(1e-5, (10e-3, 6.4e-3))
    assert noise.cutoff == pytest.approx(0.2e-3)
    assert noise.rolloff == pytest.approx(1.6e-3)
    assert max(noise.pitch) <= 0.025e-3 * (1 + 1e-9)
    assert Noise(1e-5, 10e-3, pitch=0.1e-3).cutoff == pytest.approx(0.8e-3)
    assert Noise(1e-5, 1e-3, cutoff=0.9e-3).rolloff == pytest.approx(0.9e-3)


def test_the_pitch_divides_the_size():
    noise = Noise(1e-5, (1e-3, 1.05e-3), cutoff=0.8e-3, pitch=0.1e-3)
    assert noise.heights.shape == (11, 10)
    np.testing.assert_allclose(noise.pitch, (0.1e-3, 1.05e-3 / 11))


def test_they_are_spline_surfaces():
    assert isinstance(Noise(1e-5, 1e-3), HeightMap)
    assert isinstance(NoiseProfile(1e-5, 1e-3), Profile)
    assert NoiseProfile(1e-5, 1e-3).is_profile


def test_the_description_names_every_parameter():
    noise = Noise(1e-5, (5e-3, 4e-3), hurst=0.5, cutoff=0.4e-3, seed=9)
    described = noise.describe()
    assert described["kind"] == "noise"
    wanted = {"rms": 1e-5, "size": [5e-3, 4e-3], "hurst": 0.5, "rolloff": 1e-3, "cutoff": 0.4e-3,
              "seed": 9, "points": [100, 80], "periodic": True}  # fmt: skip
    assert {name: described[name] for name in wanted} == wanted
    assert NoiseProfile(1e-5, 5e-3, seed=9).describe()["seed"] == 9
    assert NoiseProfile(1e-5, 5e-3).describe()["kind"] == "noise-profile"


@pytest.mark.parametrize(
    "noise",
    [Noise(1e-5, (5e-3, 4.7e-3), hurst=0.5, pitch=0.07e-3, seed=9), NoiseProfile(3e-6, 1.1e-3)],
    ids=["map", "profile"],
)
def test_the_representation_gives_the_same_texture(noise: Noise | NoiseProfile):
    again = eval(repr(noise), {"Noise": Noise, "NoiseProfile": NoiseProfile})
    np.testing.assert_array_equal(again.heights, noise.heights)
    assert again.describe() == noise.describe()


@pytest.mark.parametrize(
    ("argument", "changed"),
    [
        ("rms", {"rms": 0.0}),
        ("rms", {"rms": -1e-5}),
        ("rms", {"rms": math.nan}),
        ("size", {"size": 0.0}),
        ("size", {"size": (1e-3, -1e-3)}),
        ("size", {"size": (1e-3, 1e-3, 1e-3)}),
        ("size", {"size": 100.0, "cutoff": 1e-4}),
        ("hurst", {"hurst": 1.2}),
        ("hurst", {"hurst": -0.1}),
        ("cutoff", {"cutoff": 0.0}),
        ("cutoff", {"cutoff": 11e-3}),
        ("rolloff", {"rolloff": 0.1e-3, "cutoff": 0.2e-3}),
        ("rolloff", {"rolloff": math.inf}),
        ("pitch", {"pitch": 0.0}),
        ("pitch", {"pitch": 0.26e-3, "cutoff": 1e-3}),
        ("seed", {"seed": -1}),
        ("seed", {"seed": 1.5}),
        ("seed", {"seed": "one"}),
    ],
)
def test_arguments_that_cannot_be_used(argument: str, changed: dict[str, Any]):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Noise(**({"rms": 1e-5, "size": 10e-3} | changed))
    assert caught.value.argument == argument
    if not isinstance(changed.get("size"), tuple):
        with pytest.raises(ParameterError, match=f"^{argument} "):
            NoiseProfile(**({"rms": 1e-5, "size": 10e-3} | changed | (
                {"size": 1e6} if changed.get("size") == 100.0 else {})))  # fmt: skip


def test_a_ribbon_is_limited_in_its_length():
    with pytest.raises(ParameterError, match=r"^size must not be longer than 4096 cut-offs"):
        Noise(1e-5, (1.0, 1e-3), cutoff=0.2e-3)


def test_a_long_profile_is_fast():
    long = NoiseProfile(1e-5, 50.0, cutoff=0.1e-3)
    assert len(long.heights) == 4_000_000


def test_a_finer_pitch_adds_nodes_to_a_profile_only():
    coarse = NoiseProfile(1e-5, 6e-3, cutoff=0.4e-3, pitch=0.1e-3)
    fine = NoiseProfile(1e-5, 6e-3, cutoff=0.4e-3, pitch=0.05e-3)
    np.testing.assert_allclose(fine.heights[::2], coarse.heights, atol=1e-17, rtol=1e-6)


def test_a_pitch_of_exactly_a_quarter_is_valid():
    assert Noise(1e-5, 10e-3, cutoff=1e-3, pitch=0.25e-3).heights.shape == (40, 40)
