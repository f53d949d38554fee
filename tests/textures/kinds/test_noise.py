"""Noise: spectrum, RMS, period and seed."""

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


def power_spectrum(noise: Noise) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q_x, q_y [rad/m] and power |H|² of every wave, computed from the heights."""
    ny, nx = noise.heights.shape
    qx = 2.0 * np.pi * np.fft.fftfreq(nx, noise.size[0] / nx)
    qy = 2.0 * np.pi * np.fft.fftfreq(ny, noise.size[1] / ny)
    grid = np.meshgrid(qx, qy)
    return grid[0], grid[1], np.abs(np.fft.fft2(noise.heights) / (nx * ny)) ** 2


def radial_slope(q: np.ndarray, values: np.ndarray, low: float, high: float) -> float:
    """Return the exponent of the power, averaged over rings of |q|."""
    edges = np.geomspace(low, high, 13)
    middle, mean = [], []
    for a, b in pairwise(edges):
        ring = (q >= a) & (q < b)
        middle.append(np.log(q[ring]).mean())
        mean.append(np.log(values[ring]).mean())
    return float(np.polyfit(middle, mean, 1)[0])


@pytest.mark.parametrize("hurst", [0.0, 0.3, 0.8, 1.0])
def test_radial_spectrum_falls_with_the_hurst_exponent(hurst: float):
    noise = Noise(1e-5, (8e-3, 6e-3), hurst=hurst, rolloff=2e-3, cutoff=0.1e-3, seed=4)
    qx, qy, p = power_spectrum(noise)
    slope = radial_slope(np.hypot(qx, qy), p, 2 * np.pi / 1.9e-3, 2 * np.pi / 0.101e-3)
    assert slope == pytest.approx(-2.0 - 2.0 * hurst, abs=1e-3)


@pytest.mark.parametrize("hurst", [0.2, 0.9])
def test_spectrum_of_a_profile_falls_one_power_less(hurst: float):
    noise = NoiseProfile(1e-5, 20e-3, hurst=hurst, rolloff=4e-3, cutoff=0.1e-3)
    q = 2.0 * np.pi * np.fft.rfftfreq(len(noise.heights), noise.pitch)
    p = np.abs(np.fft.rfft(noise.heights)) ** 2
    slope = radial_slope(q, p, 2 * np.pi / 3.9e-3, 2 * np.pi / 0.101e-3)
    assert slope == pytest.approx(-1.0 - 2.0 * hurst, abs=1e-3)


def test_spectrum_is_flat_below_the_roll_off():
    noise = Noise(1e-5, 10e-3, rolloff=1e-3, cutoff=0.2e-3)
    qx, qy, p = power_spectrum(noise)
    q = np.hypot(qx, qy)
    flat = p[(q > 0.0) & (q < 2 * np.pi / 1e-3)]
    assert len(flat) > 200
    np.testing.assert_allclose(flat, flat.mean(), rtol=1e-9)
    # Negative control: beyond the roll-off the spectrum is not flat.
    assert p[(q > 2 * np.pi / 0.3e-3) & (q < 2 * np.pi / 0.21e-3)].max() < 0.05 * flat.mean()


@pytest.mark.parametrize("size", [10e-3, (7e-3, 12e-3)])
def test_spectrum_is_zero_beyond_the_cut_off(size: Any):
    noise = Noise(1e-5, size, cutoff=0.4e-3, seed=1)
    qx, qy, p = power_spectrum(noise)
    q = np.hypot(qx, qy) * noise.cutoff / (2.0 * np.pi)
    assert p[q > 1.0 + 1e-9].max() < 1e-28 * p.max()
    just_inside = p[(q > 0.97) & (q < 1.0)]
    assert just_inside.min() > 1e-6 * p.max()


@pytest.mark.parametrize("seed", range(3))
def test_rms_of_the_nodes_is_exact(seed: int):
    noise = Noise(17e-6, (5e-3, 8e-3), seed=seed)
    assert math.sqrt(np.mean(noise.heights**2)) == pytest.approx(17e-6, rel=1e-14)
    assert abs(noise.heights.mean()) < 1e-14 * 17e-6
    profile = NoiseProfile(17e-6, 5e-3, seed=seed)
    assert math.sqrt(np.mean(profile.heights**2)) == pytest.approx(17e-6, rel=1e-14)


def test_rms_of_the_spline_is_approximate():
    noise = Noise(17e-6, 10e-3)
    xy = np.random.default_rng(3).random((40_000, 2)) * 10e-3
    assert noise.height(xy).std() == pytest.approx(17e-6, rel=0.02)


def test_period_is_the_size():
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


def test_heights_are_determined_by_the_seed():
    first = Noise(1e-5, 5e-3, seed=7)
    np.testing.assert_array_equal(first.heights, Noise(1e-5, 5e-3, seed=7).heights)
    other = Noise(1e-5, 5e-3, seed=8).heights
    correlation = np.corrcoef(first.heights.ravel(), other.ravel())[0, 1]
    assert abs(correlation) < 0.5


def test_heights_of_a_seed_are_pinned():
    """Changes of the random numbers or of the order of waves must not go unnoticed."""
    noise = Noise(1e-5, 5e-3, seed=7)
    np.testing.assert_allclose(noise.heights[[0, 5, 200], [0, 60, 31]], PINNED, rtol=1e-9)


def test_finer_pitch_of_a_map_only_adds_nodes():
    coarse = Noise(1e-5, (6e-3, 4e-3), cutoff=0.4e-3, pitch=0.1e-3)
    fine = Noise(1e-5, (6e-3, 4e-3), cutoff=0.4e-3, pitch=0.05e-3)
    np.testing.assert_allclose(fine.heights[::2, ::2], coarse.heights, atol=1e-17, rtol=1e-6)


def test_shorter_cut_off_only_adds_waves():
    long = Noise(1e-5, 6e-3, rolloff=3e-3, cutoff=1e-3, pitch=0.05e-3)
    short = Noise(1e-5, 6e-3, rolloff=3e-3, cutoff=0.4e-3, pitch=0.05e-3)
    first, second = np.fft.fft2(long.heights), np.fft.fft2(short.heights)
    present = np.abs(first) > 1e-9 * np.abs(first).max()
    ratio = second[present] / first[present]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-9)
    assert (np.abs(second) > 1e-9 * np.abs(second).max()).sum() > 4 * present.sum()


def test_scaling_all_lengths_scales_the_surface():
    small = Noise(1e-5, 5e-3, rolloff=2e-3, cutoff=0.5e-3)
    large = Noise(2e-5, 10e-3, rolloff=4e-3, cutoff=1e-3)
    np.testing.assert_allclose(large.heights, 2.0 * small.heights, rtol=1e-9, atol=1e-18)


@pytest.mark.parametrize(("nodes", "error"), [(8, 1.2e-3), (4, 2.8e-2)])
def test_spline_error_for_nodes_per_cut_off(nodes: int, error: float):
    """The error at the shortest wave bounds the error for a ratio of cut-off and pitch."""
    noise = Noise(1e-5, 4e-3, rolloff=0.5e-3, cutoff=0.5e-3, pitch=0.5e-3 / nodes)
    exact = Noise(1e-5, 4e-3, rolloff=0.5e-3, cutoff=0.5e-3, pitch=0.5e-3 / (5 * nodes))
    i, j = np.indices(exact.heights.shape)
    spline = noise.height(np.stack([j, i], -1).reshape(-1, 2) * exact.pitch[0])
    difference = spline - exact.heights.ravel()
    # Both axes contribute, and the error is not zero, as the spline differs from the sum.
    assert 0.02 * error < difference.std() / 1e-5 < 2.0 * error


@settings(max_examples=25, deadline=None)
@given(
    hurst=st.floats(0.0, 1.0),
    seed=st.integers(0, 2**32),
    rolloff=st.floats(1.0, 20.0),
    aspect=st.integers(1, 3),
)
def test_spectrum_is_isotropic(hurst: float, seed: int, rolloff: float, aspect: int):
    """The power depends only on |q|, along x, along y and diagonally, for any period."""
    noise = Noise(
        1e-5, (3e-3 * aspect, 3e-3), hurst=hurst, cutoff=0.3e-3, rolloff=rolloff * 0.3e-3, seed=seed
    )
    qx, qy, p = power_spectrum(noise)
    length = np.hypot(qx, qy) * 3e-3 / (2.0 * np.pi)
    for ring in (5.0, 10.0):  # |(3, 4)| = |(5, 0)|, |(6, 8)| = |(10, 0)|
        on_ring = np.abs(length - ring) < 1e-9
        assert on_ring.sum() >= 12
        np.testing.assert_allclose(p[on_ring], p[on_ring].mean(), rtol=1e-6)
        assert np.ptp(np.arctan2(qy[on_ring], qx[on_ring])) > 5.0


def test_slopes_are_isotropic():
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


def test_pitch_is_adjusted_to_divide_the_size():
    noise = Noise(1e-5, (1e-3, 1.05e-3), cutoff=0.8e-3, pitch=0.1e-3)
    assert noise.heights.shape == (11, 10)
    np.testing.assert_allclose(noise.pitch, (0.1e-3, 1.05e-3 / 11))


def test_noise_textures_are_spline_surfaces():
    assert isinstance(Noise(1e-5, 1e-3), HeightMap)
    assert isinstance(NoiseProfile(1e-5, 1e-3), Profile)
    assert NoiseProfile(1e-5, 1e-3).is_profile


def test_description_has_every_parameter():
    noise = Noise(1e-5, (5e-3, 4e-3), hurst=0.5, cutoff=0.4e-3, seed=9)
    description = noise.describe()
    assert description["kind"] == "noise"
    expected = {
        "rms": 1e-5,
        "size": [5e-3, 4e-3],
        "hurst": 0.5,
        "rolloff": 1e-3,
        "cutoff": 0.4e-3,
        "seed": 9,
        "points": [100, 80],
        "periodic": True,
    }
    assert {name: description[name] for name in expected} == expected
    assert NoiseProfile(1e-5, 5e-3, seed=9).describe()["seed"] == 9
    assert NoiseProfile(1e-5, 5e-3).describe()["kind"] == "noise-profile"


@pytest.mark.parametrize(
    "noise",
    [Noise(1e-5, (5e-3, 4.7e-3), hurst=0.5, pitch=0.07e-3, seed=9), NoiseProfile(3e-6, 1.1e-3)],
    ids=["map", "profile"],
)
def test_repr_gives_the_same_texture(noise: Noise | NoiseProfile):
    rebuilt = eval(repr(noise), {"Noise": Noise, "NoiseProfile": NoiseProfile})
    np.testing.assert_array_equal(rebuilt.heights, noise.heights)
    assert rebuilt.describe() == noise.describe()


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
def test_invalid_arguments_are_refused(argument: str, changed: dict[str, Any]):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Noise(**({"rms": 1e-5, "size": 10e-3} | changed))
    assert caught.value.argument == argument
    if not isinstance(changed.get("size"), tuple):
        with pytest.raises(ParameterError, match=f"^{argument} "):
            NoiseProfile(
                **(
                    {"rms": 1e-5, "size": 10e-3}
                    | changed
                    | ({"size": 1e6} if changed.get("size") == 100.0 else {})
                )
            )


def test_aspect_ratio_of_a_map_is_limited():
    with pytest.raises(ParameterError, match=r"^size must not be longer than 4096 cut-offs"):
        Noise(1e-5, (1.0, 1e-3), cutoff=0.2e-3)


def test_long_profile_has_millions_of_nodes():
    long = NoiseProfile(1e-5, 50.0, cutoff=0.1e-3)
    assert len(long.heights) == 4_000_000


def test_finer_pitch_of_a_profile_only_adds_nodes():
    coarse = NoiseProfile(1e-5, 6e-3, cutoff=0.4e-3, pitch=0.1e-3)
    fine = NoiseProfile(1e-5, 6e-3, cutoff=0.4e-3, pitch=0.05e-3)
    np.testing.assert_allclose(fine.heights[::2], coarse.heights, atol=1e-17, rtol=1e-6)


def test_pitch_of_exactly_a_quarter_of_the_cut_off_is_valid():
    assert Noise(1e-5, 10e-3, cutoff=1e-3, pitch=0.25e-3).heights.shape == (40, 40)
