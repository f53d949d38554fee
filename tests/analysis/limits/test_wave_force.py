"""The force of each wave, compared with laws computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from asperity.analysis.energy.straight_scan import scan_height
from asperity.analysis.limits import wave_scan as module
from asperity.analysis.limits.spectrum import Spectrum, Wave, compute_spectrum
from asperity.analysis.limits.wave_scan import scan_forces, wave_forces
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

AMPLITUDE, PERIOD, DEPTH = 1e-4, 1e-3, 3e-4
WAVE = Sinusoid(AMPLITUDE, PERIOD, phase=0.7, direction=(3.0, 1.0))
KAPPA = 2 * math.pi / PERIOD


def compute_wave_forces(texture: Texture, law: str, **arguments: float) -> np.ndarray:
    return wave_forces(Surface(texture, law, **arguments), compute_spectrum(texture))


@pytest.mark.parametrize("stiffness", [1000.0, 250.0])
def test_wave_force_of_law_a_is_k_times_the_amplitude(stiffness: float) -> None:
    forces = compute_wave_forces(WAVE, "A", stiffness=stiffness, max_depth=DEPTH)
    assert forces == pytest.approx([stiffness * AMPLITUDE], rel=1e-9)


def test_wave_force_of_law_c_by_hand() -> None:
    """F = k δ (-h', 1), δ = A sin θ - z has amplitude k A vertically and k |z| A κ laterally."""
    height = AMPLITUDE - DEPTH
    forces = compute_wave_forces(WAVE, "C", stiffness=700.0, max_depth=DEPTH)
    expected = 700.0 * AMPLITUDE * math.hypot(1.0, height * KAPPA)
    assert forces == pytest.approx([expected], rel=1e-9)


def test_wave_force_of_law_g_by_hand() -> None:
    """F = k D n, from the Fourier integrals of -h'/s and 1/s at the wave."""

    def part(angle: float, axis: int, other: float) -> float:
        slope = AMPLITUDE * KAPPA * math.cos(angle)
        normal = (-slope, 1.0)[axis] / math.hypot(1.0, slope)
        return normal * math.cos(angle - other) / math.pi

    squares = [
        quad(part, 0.0, 2 * math.pi, args=(axis, other), epsabs=1e-13)[0] ** 2
        for axis in (0, 1)
        for other in (0.0, math.pi / 2)
    ]
    forces = compute_wave_forces(WAVE, "G", max_depth=DEPTH)
    assert forces == pytest.approx([1000.0 * DEPTH * math.sqrt(sum(squares))], rel=1e-8)


def test_wave_force_of_law_f_by_hand() -> None:
    """Sliding at full deflection, f_x = -k D μ (1 - m) with m = (1 + a sin θ)/2."""
    forces = compute_wave_forces(WAVE, "F", max_depth=DEPTH, friction=0.6, modulation_depth=0.5)
    assert forces == pytest.approx([1000.0 * DEPTH * 0.6 * 0.5 / 2.0], rel=1e-9)


def test_wave_force_of_the_smooth_wall_is_zero() -> None:
    assert compute_wave_forces(WAVE, "W", max_depth=DEPTH)[0] < 1e-12


SUMS = {
    "profile": Fourier([3e-5, 1e-5], [2000.0, 6000.0], [0.3, 1.0]),
    "endless profile": Fourier([3e-5, 1e-5], [2000.0, 6000.0 * math.sqrt(2)], [0.3, 1.0]),
    "map": Fourier([3e-5, 1e-5], [[2000.0, 300.0], [-700.0, 5000.0]], [0.3, 1.0]),
    "endless map": Fourier(
        [3e-5, 1e-5, 2e-5], [[2000.0, 300.0], [-700.0, 5000.0], [3000.0, 3100.0]], [0.3, 1.0, 2.0]
    ),
    "opposite": Fourier([3e-5, 1e-5], [[2000.0, 0.0], [-8000.0, 0.0]], [0.3, 1.0]),
}


@pytest.mark.parametrize("name", list(SUMS))
def test_wave_forces_of_a_law_linear_in_the_heights(name: str) -> None:
    texture = SUMS[name]
    forces = compute_wave_forces(texture, "A", stiffness=800.0, max_depth=3e-4)
    assert forces == pytest.approx(800.0 * compute_spectrum(texture).amplitudes, rel=1e-6)


@pytest.mark.parametrize("name", ["map", "endless map"])
def test_waves_are_independent_at_small_slopes(name: str) -> None:
    """For law C the waves do not interact to second order in the slopes."""
    texture = SUMS[name]
    scale = 1e-2
    small = Fourier(scale * texture.amplitudes, texture.wavevectors, texture.phases)
    forces = compute_wave_forces(small, "C", max_depth=1e-4)
    height = scan_height(Surface(small, "C", max_depth=1e-4))
    waves = compute_spectrum(small)
    alone = 1000.0 * waves.amplitudes * np.hypot(1.0, height * 2 * math.pi / waves.wavelengths)
    assert forces == pytest.approx(alone, rel=2e-3)


def test_wave_forces_of_a_map_of_waves() -> None:
    i, j = np.arange(40)[:, None] / 40, np.arange(60)[None, :] / 60
    heights = 5e-5 * np.sin(2 * np.pi * (4 * j + 3 * i)) + 2e-5 * np.sin(2 * np.pi * 12 * j)
    for periodic in (True, False):
        texture = HeightMap(heights, 2e-5, periodic=periodic)
        waves = compute_spectrum(texture)
        forces = compute_wave_forces(texture, "A", stiffness=600.0, max_depth=4e-4)
        np.testing.assert_allclose(forces, 600.0 * waves.amplitudes, rtol=1e-6)


def test_waves_longer_than_the_patch_use_the_longest_resolved_wave(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_SIDE_POINTS", {False: 24, True: 24})
    heights = np.random.default_rng(3).normal(size=(90, 100)) * 1e-6
    texture = HeightMap(heights, 2e-5)
    waves = compute_spectrum(texture)
    forces = compute_wave_forces(texture, "A", stiffness=500.0, max_depth=1e-4)
    np.testing.assert_allclose(forces, 500.0 * waves.amplitudes, rtol=1e-9)
    assert waves.wavelengths[0] > 24 * 2e-5


@pytest.mark.parametrize("periodic", [True, False])
def test_each_band_has_its_own_force_ratio(periodic: bool) -> None:
    """For law C the ratio depends on the wavelength; bands without height use the nearest band."""
    height = 1e-7 - 1e-4
    x = np.arange(256) / 256
    texture = HeightMap(
        np.tile(1e-7 * np.sin(4 * np.pi * x) + 1e-8 * np.sin(32 * np.pi * x), (8, 1)),
        5e-6,
        periodic=periodic,
    )
    surface = Surface(texture, "C", stiffness=500.0, max_depth=1e-4)
    assert scan_height(surface) == pytest.approx(height, rel=1e-2)
    lengths = np.array([256, 128, 50, 38, 16, 11]) * 5e-6
    bands = Spectrum(tuple(Wave(float(length), 1.0, 0.1) for length in lengths), exact=False)
    resolved_lengths = lengths[[1, 1, 1, 4, 4, 4]]
    expected = 500.0 * np.hypot(1.0, height * 2 * np.pi / resolved_lengths)
    np.testing.assert_allclose(wave_forces(surface, bands), expected, rtol=0.05)


def test_wave_forces_of_a_profile_by_bands() -> None:
    heights = np.random.default_rng(3).normal(size=400) * 1e-6
    texture = Profile(heights, 2e-5)
    forces = compute_wave_forces(texture, "A", stiffness=500.0, max_depth=1e-4)
    np.testing.assert_allclose(forces, 500.0 * compute_spectrum(texture).amplitudes, rtol=1e-9)


@pytest.mark.parametrize("law", ["D", "E", "H"])
def test_closest_point_laws_agree_with_the_wall_on_gentle_textures(law: str) -> None:
    gentle = Sinusoid(1e-7, 1e-3)
    forces = compute_wave_forces(gentle, law, max_depth=2e-7)
    assert forces == pytest.approx([1e-4], rel=1e-3)


def test_flat_surface_has_no_wave_forces() -> None:
    assert compute_wave_forces(HeightMap(np.full((5, 5), 1e-3), 1e-3), "A").shape == (0,)


def test_scan_forces_are_evaluated_at_the_scan_height() -> None:
    surface = Surface(WAVE, "C", max_depth=DEPTH)
    xy = np.array([[0.1e-3, 0.2e-3], [0.4e-3, -0.1e-3]])
    probes = np.column_stack([xy, np.full(2, AMPLITUDE - DEPTH)])
    np.testing.assert_array_equal(scan_forces(surface, xy), surface.force(probes))
    sliding = Surface(WAVE, "F", max_depth=DEPTH)
    along = np.array(WAVE.direction) * sliding.max_deflection
    probes[:, 2] = -DEPTH
    expected = sliding.force(probes, np.tile(along, (2, 1)))
    np.testing.assert_array_equal(scan_forces(sliding, xy), expected)


def test_patch_without_contact_moves_to_the_highest_point() -> None:
    """Waves far below a ridge: the first patch of a law that searches touches nothing."""
    x = np.arange(400) * 50e-6
    waves = 5e-6 * np.sin(2 * np.pi * x / 1e-3)
    ridge = 300e-6 * np.exp(-(((x - 16e-3) / 2e-3) ** 2))
    texture = HeightMap(np.tile(waves + ridge, (120, 1)), 50e-6)
    for law in "DH":
        surface = Surface(texture, law, 500.0, max_depth=20e-6)
        points = texture.domain.grid(texture.grid_counts(), 96)[0].reshape(-1, 2)
        assert not scan_forces(surface, points).any()  # the premise
        forces = wave_forces(surface, compute_spectrum(texture))
        assert np.isfinite(forces).all()
        assert forces.max() > 0.0
