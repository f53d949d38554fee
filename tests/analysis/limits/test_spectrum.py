"""The spectrum of a texture: exact for sums, by Parseval's theorem for measured surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis.energy.straight_scan import parallel_line_points
from asperity.analysis.limits import spectrum as module
from asperity.analysis.limits.spectrum import Spectrum, band_variances, compute_spectrum, tip_gain
from asperity.analysis.limits.wave_scan import wave_forces
from asperity.scene import load_scene
from asperity.surface import Surface
from asperity.textures import Fourier, Grating, HeightMap, Noise, NoiseProfile, Profile, Sinusoid
from asperity.textures.kinds.prepare_synthetic import prepare_texture


def total_variance(spectrum: Spectrum) -> float:
    """Return Σ a²/2, the variance of the heights according to the spectrum."""
    return float(np.sum(spectrum.amplitudes**2)) / 2.0


def hann_variance(heights: np.ndarray) -> float:
    """Return the variance of heights under a Hann window, by its definition."""
    window = np.ones(())
    for count in heights.shape:
        one = np.sin(np.pi * (np.arange(count) + 0.5) / count) ** 2 if count > 1 else np.ones(1)
        window = np.multiply.outer(window, one)
    mean = np.sum(window * heights) / np.sum(window)
    return float(np.sum((window * (heights - mean)) ** 2) / np.sum(window**2))


@pytest.mark.parametrize(
    ("name", "tolerance"), [("sinusoid:amplitude=20um,period=0.5mm", 0.01), ("sandpaper", 0.06)]
)
def test_what_a_tip_feels_is_that_of_the_dilated_texture(name: str, tolerance: float) -> None:
    band = 0.4e-3, 0.8333e-3
    texture = load_scene(name).texture
    gains = []
    for radius in (0.25e-3, 0.5e-3):
        variances = []
        for one in (texture, prepare_texture(texture, tip_radius=radius)):
            line = one.scan_line()
            points = parallel_line_points(one, line, 4096)
            heights = one.height(points.reshape(-1, 2)).reshape(points.shape[:2])
            spacing = line.length / 4096, 1.0
            bands = band_variances(heights[:, None], spacing, line.periodic)
            within = (bands.wavelength >= band[0]) & (bands.wavelength <= band[1])
            variances.append(bands.variance[within].sum())
        gains.append(tip_gain(texture, radius, band))
        expected = math.sqrt(variances[1] / variances[0])
        assert gains[-1] == pytest.approx(expected, rel=tolerance)
    assert gains[1] < gains[0] < 0.94
    assert tip_gain(texture, 1e-6, band) == pytest.approx(1.0, abs=2e-2)


def test_a_band_without_waves_has_no_gain_of_a_tip() -> None:
    assert tip_gain(Sinusoid(2e-5, 5e-4), 5e-4, (1e-3, 2e-3)) is None
    assert tip_gain(Profile(np.zeros(50), 1e-4), 5e-4, (1e-3, 2e-3)) is None


def test_spectrum_of_a_sinusoid_is_one_wave() -> None:
    spectrum = compute_spectrum(Sinusoid(0.3e-3, 1.7e-3, phase=0.4, direction=(1.0, -2.0)))
    (wave,) = spectrum.waves
    assert spectrum.exact
    assert (wave.wavelength, wave.amplitude, wave.share, wave.phase) == (1.7e-3, 0.3e-3, 1.0, 0.4)
    assert wave.vector is not None
    assert np.hypot(*wave.vector) == pytest.approx(2 * math.pi / 1.7e-3, rel=1e-14)


def test_spectrum_of_a_sum_lists_its_waves_by_wavelength() -> None:
    spectrum = compute_spectrum(
        Fourier([1e-4, -3e-4], [[4000.0, 3000.0], [-600.0, 800.0]], [0.2, 1.0])
    )
    assert spectrum.exact
    assert spectrum.wavelengths == pytest.approx([2 * math.pi / 1000, 2 * math.pi / 5000])
    assert spectrum.amplitudes == pytest.approx([3e-4, 1e-4])
    assert [wave.share for wave in spectrum.waves] == pytest.approx([0.9, 0.1])


def test_heights_of_a_sum_are_reconstructed_from_its_spectrum() -> None:
    texture = Fourier(
        [1e-4, -3e-4, 2e-4], [[4e3, 3e3], [-600.0, 800.0], [-4e3, -3e3]], [0.2, 1.0, 2.0]
    )
    xy = np.random.default_rng(0).normal(size=(50, 2)) * 1e-3
    total = sum(
        wave.amplitude * np.sin(xy @ np.array(wave.vector) + wave.phase)
        for wave in compute_spectrum(texture).waves
    )
    np.testing.assert_allclose(total, texture.height(xy), atol=1e-15)
    assert len(compute_spectrum(texture).waves) == 2  # vectors equal up to sign are one wave


@pytest.mark.parametrize(
    ("vectors", "phases", "amplitude"),
    [
        ([[1e3, 0.0], [1e3, 0.0]], [0.0, math.pi / 2], math.sqrt(2.0)),
        ([[1e3, 0.0], [-1e3, 0.0]], [0.3, math.pi - 0.3], 2.0),
        ([[0.0, 1e3], [0.0, -1e3]], [0.0, 0.0], None),  # they cancel
    ],
)
def test_waves_with_parallel_equal_vectors_are_merged(
    vectors: list[list[float]], phases: list[float], amplitude: float | None
) -> None:
    spectrum = compute_spectrum(Fourier([1e-4, 1e-4], vectors, phases))
    if amplitude is None:
        assert spectrum.waves == ()
    else:
        assert spectrum.amplitudes == pytest.approx([1e-4 * amplitude], rel=1e-12)


@pytest.mark.parametrize("count", [240, 243])
def test_spectrum_of_a_periodic_profile_recovers_its_waves(count: int) -> None:
    x = np.arange(count) / count
    heights = 2e-5 * np.sin(2 * np.pi * 3 * x + 0.4) + 5e-6 * np.cos(2 * np.pi * 40 * x) + 7e-3
    spectrum = compute_spectrum(Profile(heights, 6e-3 / count, periodic=True))
    strong = [wave for wave in spectrum.waves if wave.share > 1e-12]
    assert [wave.wavelength for wave in strong] == pytest.approx([2e-3, 0.15e-3], rel=1e-12)
    assert [wave.amplitude for wave in strong] == pytest.approx([2e-5, 5e-6], rel=1e-9)
    assert not spectrum.exact


def test_spectrum_of_a_periodic_map_is_radial() -> None:
    """An oblique wave is listed with its wavelength, not with its period along x."""
    ny, nx, px, py = 60, 90, 2e-5, 5e-5
    i, j = np.arange(ny)[:, None] / ny, np.arange(nx)[None, :] / nx
    oblique = 3e-5 * np.sin(2 * np.pi * (5 * j - 2 * i) + 0.7)
    across = 1e-5 * np.sin(2 * np.pi * 20 * i)
    spectrum = compute_spectrum(HeightMap(oblique + across, (px, py), periodic=True))
    strong = [wave for wave in spectrum.waves if wave.share > 1e-12]
    first = 1.0 / math.hypot(5 / (nx * px), 2 / (ny * py))
    assert [wave.wavelength for wave in strong] == pytest.approx([first, 3e-3 / 20], rel=1e-12)
    assert [wave.amplitude for wave in strong] == pytest.approx([3e-5, 1e-5], rel=1e-9)


@pytest.mark.parametrize(("ny", "nx"), [(31, 40), (40, 31), (32, 32), (1, 57)])
@pytest.mark.parametrize("periodic", [True, False])
def test_spectrum_has_the_variance_of_the_heights(ny: int, nx: int, periodic: bool) -> None:
    heights = np.random.default_rng(5).normal(size=(ny, nx)) * 1e-5 + 3e-4
    if ny == 1:
        texture = Profile(heights[0], 1e-5, periodic=periodic)
    else:
        texture = HeightMap(heights, (1e-5, 3e-5), periodic=periodic)
    spectrum = compute_spectrum(texture)
    assert total_variance(spectrum) == pytest.approx(np.var(heights), rel=1e-10, abs=0.0)
    assert sum(wave.share for wave in spectrum.waves) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("count", [4, 5, 8, 16])
def test_one_period_of_a_sinusoid_has_its_variance(count: int) -> None:
    heights = 1e-6 * np.sin(2 * np.pi * np.arange(count) / count)
    spectrum = compute_spectrum(Profile(heights, 1e-3 / count))
    assert total_variance(spectrum) == pytest.approx(0.5e-12, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("periods", [2.5, 4.2, 10.0, 33.3])
@pytest.mark.parametrize("phase", [0.0, 0.8, 1.57])
def test_sinusoid_that_is_cut_off_has_its_amplitude(periods: float, phase: float) -> None:
    angles = 2 * np.pi * periods * np.arange(2000) / 2000
    spectrum = compute_spectrum(Profile(3e-6 * np.sin(angles + phase), 5e-6))
    assert math.sqrt(2.0 * total_variance(spectrum)) == pytest.approx(3e-6, rel=0.02)


def test_a_patch_counts_the_same_wherever_it_is() -> None:
    """1 mm of waves of 0.2 mm in a profile of 10 mm."""
    x = np.arange(2000) * 5e-6
    largest = []
    for centre in (0.5e-3, 2e-3, 5e-3, 9e-3):
        near = np.abs(x - centre) < 0.5e-3
        texture = Profile(np.where(near, 5e-6 * np.sin(2 * np.pi * x / 0.2e-3), 0.0), 5e-6)
        spectrum = compute_spectrum(texture)
        assert total_variance(spectrum) == pytest.approx(1.25e-12, rel=1e-6, abs=0.0)
        surface = Surface(texture, "C", stiffness=500.0, max_depth=20e-6)
        largest.append(wave_forces(surface, spectrum).max())
    assert max(largest) < 1.2 * min(largest)


def test_wave_on_a_finite_map_has_its_wavelength_and_amplitude() -> None:
    x = np.arange(400) * 1e-5
    heights = np.tile(2e-5 * np.sin(2 * np.pi * x / 1.37e-4 + 0.3), (300, 1))
    spectrum = compute_spectrum(HeightMap(heights, 1e-5))
    best = max(spectrum.waves, key=lambda wave: wave.share)
    assert best.wavelength == pytest.approx(1.37e-4, rel=0.003)
    assert math.sqrt(2.0 * total_variance(spectrum)) == pytest.approx(2e-5, rel=0.003)
    assert best.share > 0.99


def test_noise_has_its_specified_spectrum() -> None:
    """With isotropic power q^(-2 - 2H) an octave has 2^(2H) times the variance of the next."""
    rough = Noise(rms=1e-5, size=10e-3, hurst=0.5, rolloff=10e-3, cutoff=0.1e-3, seed=2)
    spectrum = compute_spectrum(rough)
    assert total_variance(spectrum) == pytest.approx(1e-10, rel=1e-9)
    lengths, squares = spectrum.wavelengths, spectrum.amplitudes**2

    def octave_variance(longest: float) -> float:
        return float(squares[(lengths <= longest) & (lengths > longest / 2)].sum())

    assert octave_variance(1.6e-3) / octave_variance(0.8e-3) == pytest.approx(2.0, rel=0.12)
    assert octave_variance(0.8e-3) / octave_variance(0.4e-3) == pytest.approx(2.0, rel=0.06)
    assert lengths.min() >= 0.1e-3 * (1 - 1e-9)


def test_spectrum_of_a_grating_has_odd_harmonics() -> None:
    spectrum = compute_spectrum(Grating(height=2e-4, period=3e-3, duty=0.5, edge=0.3e-3))
    strong = [wave.wavelength for wave in spectrum.waves if wave.share > 1e-4]
    assert strong[:3] == pytest.approx([3e-3, 1e-3, 0.6e-3], rel=1e-9)


def test_spectrum_of_many_waves_is_by_bands() -> None:
    rng = np.random.default_rng(7)
    angles = rng.uniform(0, 2 * np.pi, 80)
    lengths = np.geomspace(2e-4, 2e-3, 80)
    vectors = 2 * np.pi / lengths[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    amplitudes = rng.uniform(1e-6, 3e-6, 80)
    spectrum = compute_spectrum(Fourier(amplitudes, vectors, rng.uniform(0, 6, 80)))
    assert not spectrum.exact
    assert total_variance(spectrum) == pytest.approx(0.5 * float(amplitudes @ amplitudes), rel=0.1)
    weight = spectrum.amplitudes**2
    inside = (spectrum.wavelengths > 1.7e-4) & (spectrum.wavelengths < 2.4e-3)
    assert weight[inside].sum() / weight.sum() > 0.98


def test_flat_texture_has_no_waves() -> None:
    assert compute_spectrum(HeightMap(np.full((6, 7), 3e-3), 1e-4)).waves == ()
    assert compute_spectrum(Profile(np.full(9, 3e-3), 1e-4, periodic=True)).waves == ()
    assert compute_spectrum(HeightMap(np.zeros((6, 7)), 1e-4)).waves == ()


def test_band_variances_do_not_depend_on_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.random.default_rng(1).normal(size=(2, 37, 20))
    whole = band_variances(values, (1e-5, 2e-5), False)
    monkeypatch.setattr(module, "_ROWS_PER_BLOCK", 5)
    parts = band_variances(values, (1e-5, 2e-5), False)
    np.testing.assert_array_equal(parts.number, whole.number)
    np.testing.assert_allclose(parts.variance, whole.variance, rtol=1e-12)
    np.testing.assert_allclose(parts.wavelength, whole.wavelength, rtol=1e-12)


@pytest.mark.parametrize(("ny", "nx"), [(31, 40), (32, 32), (1, 57)])
def test_band_variances_of_a_window_have_its_variance(ny: int, nx: int) -> None:
    heights = np.random.default_rng(5).normal(size=(ny, nx)) * 1e-5 + 3e-4
    bands = band_variances(heights[None], (1e-5, 3e-5), False)
    assert bands.variance.sum() == pytest.approx(hann_variance(heights), rel=1e-10, abs=0.0)


def test_band_variances_of_components_are_added() -> None:
    values = np.random.default_rng(1).normal(size=(2, 16, 20))
    both = band_variances(values, (1e-5, 2e-5), True)
    each = [band_variances(values[i : i + 1], (1e-5, 2e-5), True) for i in range(2)]
    np.testing.assert_allclose(both.variance, each[0].variance + each[1].variance, rtol=1e-12)


@pytest.mark.parametrize("periodic", [True, False])
def test_grid_of_a_map_is_its_samples(periodic: bool) -> None:
    heights = np.random.default_rng(2).normal(size=(9, 12)) * 1e-5
    texture = HeightMap(heights, (1e-5, 3e-5), periodic=periodic, origin=(1e-3, -2e-3))
    points, spacing, repeats = texture.domain.grid(texture.grid_counts())
    assert (points.shape, repeats) == ((9, 12, 2), periodic)
    assert spacing == pytest.approx((1e-5, 3e-5), rel=1e-12)
    np.testing.assert_allclose(
        texture.height(points.reshape(-1, 2)).reshape(9, 12), heights, atol=1e-15
    )
    np.testing.assert_array_equal(texture.samples()[0], heights)


def test_limited_grid_is_the_centre_of_the_map() -> None:
    texture = HeightMap(np.random.default_rng(2).normal(size=(20, 31)), 1e-5, periodic=True)
    points, spacing, repeats = texture.domain.grid(texture.grid_counts(), max_count=8)
    assert (points.shape, repeats) == ((8, 8, 2), False)
    assert spacing == pytest.approx((1e-5, 1e-5))
    heights = texture.height(points.reshape(-1, 2)).reshape(8, 8)
    np.testing.assert_allclose(heights, texture.heights[6:14, 11:19], atol=1e-12)


def test_grid_of_a_skew_period_is_a_rectangle() -> None:
    texture = Fourier([1e-4, 1e-4], [[2e3, 0.0], [1.1e3, 1.5e3]])
    points, spacing, repeats = texture.domain.grid(texture.grid_counts())
    assert not repeats
    along, across = points[0, 1] - points[0, 0], points[1, 0] - points[0, 0]
    assert float(along @ across) == pytest.approx(0.0, abs=1e-15)
    assert (np.hypot(*along), np.hypot(*across)) == pytest.approx(spacing)


def test_spectrum_of_a_noise_profile_has_its_variance() -> None:
    texture = NoiseProfile(rms=2e-6, size=5e-3, seed=1)
    assert total_variance(compute_spectrum(texture)) == pytest.approx(4e-12, rel=1e-9)


def test_spectrum_to_dict() -> None:
    content = compute_spectrum(Sinusoid(1e-4, 1e-3)).to_dict()
    assert content["wavelengths"] == [1e-3]
    assert content["amplitudes"] == [1e-4]
