"""Surface parameters of heights with closed-form parameters."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.special import ellipe

from asperity.measured import parameters as module
from asperity.measured.parameters import (
    AREAL_PARAMETERS,
    PROFILE_PARAMETERS,
    _autocorrelation,
    compute_parameters,
    correlation_parameters,
    find_parameter,
)

MICRO = 1e-6


def sinusoid(samples: int, slope: float = 0.5, rows: int = 5) -> tuple[Any, tuple[float, float]]:
    """Return four periods of 100 µm along x with the given greatest slope, and the pitch."""
    length = 100e-6
    amplitude = slope * length / (2 * np.pi)
    x = np.arange(4 * samples) * length / samples
    wave = amplitude * np.sin(2 * np.pi * x / length + 0.1)
    return np.tile(wave, (rows, 1)), (length / samples, 3e-6)


def rms_chord_slope(samples: int, slope: float) -> float:
    """Return the RMS slope of the chords between the samples of a sinusoid."""
    return slope / math.sqrt(2) * math.sin(math.pi / samples) / (math.pi / samples)


@pytest.mark.parametrize("slope", [1e-3, 0.5, 3.0])
def test_height_parameters_of_a_sinusoid(slope: float) -> None:
    """Sq = A/√2, Ssk = 0, Sku = 3/2 exactly for whole periods; Sa = 2A/π up to sampling."""
    samples = 400
    heights, pitch = sinusoid(samples, slope)
    values = compute_parameters(heights + 3e-4, pitch)
    amplitude = slope * 100e-6 / (2 * np.pi)
    assert values["Sq"] == pytest.approx(amplitude / math.sqrt(2), rel=1e-11)
    assert values["Ssk"] == pytest.approx(0.0, abs=1e-9)
    assert values["Sku"] == pytest.approx(1.5, rel=1e-11)
    # The rectangle rule at a kink of |sin|, twice a period, is off by at most π²/n² of the mean.
    assert values["Sa"] == pytest.approx(2 * amplitude / math.pi, rel=math.pi**2 / samples**2)
    for symbol, height in (("Sz", 2 * amplitude), ("Sp", amplitude), ("Sv", amplitude)):
        # A crest lies at most half a step from a sample: 1 - cos(π/n) of the amplitude.
        assert 0.0 <= height - values[symbol] <= 2 * amplitude * (1 - math.cos(math.pi / samples))


@pytest.mark.parametrize("samples", [8, 20, 400])
@pytest.mark.parametrize("slope", [1e-3, 0.5, 3.0])
def test_slope_and_area_of_a_sinusoid(samples: int, slope: float) -> None:
    """Sdq is that of the chords; Sdr = 2/π √(1+s²) E(s²/(1+s²)) - 1 up to sampling."""
    heights, pitch = sinusoid(samples, slope)
    values = compute_parameters(np.pad(heights, ((0, 0), (0, 1)), mode="wrap"), pitch)
    assert values["Sdq"] == pytest.approx(rms_chord_slope(samples, slope), rel=1e-10)
    square = slope**2
    exact = 2 / math.pi * math.sqrt(1 + square) * ellipe(square / (1 + square)) - 1
    # Chords shorten the arc: to first order the slopes squared by the factor (sin u / u)².
    u = math.pi / samples
    assert exact * (math.sin(u) / u) ** 2 * (1 - 1e-9) <= values["Sdr"] < exact
    if samples == 400:
        assert values["Sdr"] == pytest.approx(exact, rel=1e-4)


def test_moments_of_a_crossed_sinusoid() -> None:
    """⟨(cos cos)⁴⟩/⟨(cos cos)²⟩² = (3/8)² / (1/4)² = 9/4."""
    x = 2 * np.pi * np.arange(60) / 60
    values = compute_parameters(MICRO * np.outer(np.cos(x), np.cos(x + 0.2)), (1e-6, 1e-6))
    assert values["Sku"] == pytest.approx(9 / 4, rel=1e-11)
    assert values["Sq"] == pytest.approx(MICRO / 2, rel=1e-11)


@pytest.mark.parametrize("duty", [0.5, 0.1, 0.75])
def test_height_parameters_of_a_two_level_grating(duty: float) -> None:
    """Sa = 2 d(1-d) H, Sq = √(d(1-d)) H, Ssk = (1-2d)/√(d(1-d)), Sku = 1/(d(1-d)) - 3."""
    n, high = 200, 5 * MICRO
    line = np.where(np.arange(n) < duty * n, high, 0.0)
    values = compute_parameters(np.tile(line, (4, 3)), (1e-6, 1e-6))
    share = duty * (1 - duty)
    assert values["Sa"] == pytest.approx(2 * share * high, rel=1e-12)
    assert values["Sq"] == pytest.approx(math.sqrt(share) * high, rel=1e-12)
    assert values["Ssk"] == pytest.approx((1 - 2 * duty) / math.sqrt(share), rel=1e-11, abs=1e-11)
    assert values["Sku"] == pytest.approx(1 / share - 3, rel=1e-11)
    assert values["Sp"] == pytest.approx((1 - duty) * high, rel=1e-12)
    assert values["Sv"] == pytest.approx(duty * high, rel=1e-12)
    assert values["Sz"] == pytest.approx(high, rel=1e-12)


def test_slope_and_area_of_a_ramp() -> None:
    """The mean over both triangulations of a cell is exact for a plane of any direction."""
    y, x = np.mgrid[:30, :50] * 1e-6
    for a, b in ((0.3, -0.7), (1e-6, 2e-6), (0.0, 5.0)):
        values = compute_parameters(a * x + b * 2 * y, (1e-6, 2e-6))
        square = a * a + b * b
        assert values["Sdq"] == pytest.approx(math.sqrt(square), rel=1e-9)
        assert values["Sdr"] == pytest.approx(square / (1 + math.sqrt(1 + square)), rel=1e-9)
    ramp = compute_parameters(x, (1e-6, 1e-6))
    assert ramp["Sa"] == pytest.approx(50e-6 / 4, rel=1e-9)
    n = 50  # the variance of n equally spaced values
    assert ramp["Sq"] == pytest.approx(1e-6 * math.sqrt((n * n - 1) / 12), rel=1e-9)


def test_parameters_of_gaussian_noise() -> None:
    """Sa = √(2/π) Sq, Ssk = 0, Sku = 3, Sdq² = 2 · 2 Sq²/p², each within four standard errors."""
    n, sigma, p = 512, 2 * MICRO, 1e-6
    values = compute_parameters(sigma * np.random.default_rng(4).standard_normal((n, n)), (p, p))
    root = n  # square root of the number of samples
    assert values["Sq"] == pytest.approx(sigma, rel=4 / (math.sqrt(2) * root))
    assert values["Sa"] == pytest.approx(math.sqrt(2 / math.pi) * sigma, rel=4 * 0.756 / root)
    assert values["Ssk"] == pytest.approx(0.0, abs=4 * math.sqrt(6) / root)
    assert values["Sku"] == pytest.approx(3.0, abs=4 * math.sqrt(24) / root)
    # Mean squares of 2 n² differences, each sharing samples with its neighbours: var <= 16/(2 n²).
    assert values["Sdq"] == pytest.approx(2 * sigma / p, rel=4 * math.sqrt(8) / (2 * root))


def test_holes_are_excluded() -> None:
    heights = MICRO * np.random.default_rng(3).standard_normal((60, 70))
    with_holes = heights.copy()
    with_holes[20:30, 5:9] = np.nan
    with_holes[0, 0] = np.nan
    values, measured = (
        compute_parameters(with_holes, (1e-6, 1e-6)),
        with_holes[~np.isnan(with_holes)],
    )
    assert values["Sq"] == pytest.approx(measured.std(), rel=1e-12)
    assert values["Sz"] == pytest.approx(np.ptp(measured), rel=1e-12)
    # Facets only where all four corners are known.
    complete_cells = ~np.isnan(
        with_holes[:-1, :-1] + with_holes[1:, :-1] + with_holes[:-1, 1:] + with_holes[1:, 1:]
    )
    along, across = np.diff(with_holes, axis=1) / 1e-6, np.diff(with_holes, axis=0) / 1e-6
    squares = along[:-1] ** 2 + along[1:] ** 2 + across[:, :-1] ** 2 + across[:, 1:] ** 2
    assert values["Sdq"] == pytest.approx(
        math.sqrt(0.5 * squares[complete_cells].mean()), rel=1e-12
    )
    assert values["Sdq"] != compute_parameters(heights, (1e-6, 1e-6))["Sdq"]


def test_result_is_independent_of_the_block_size(monkeypatch: pytest.MonkeyPatch) -> None:
    heights = MICRO * np.random.default_rng(3).standard_normal((61, 70))
    whole = compute_parameters(heights, (1e-6, 2e-6))
    monkeypatch.setattr(module, "_BLOCK", 200)
    assert compute_parameters(heights, (1e-6, 2e-6)) == pytest.approx(whole, rel=1e-11)


@pytest.mark.parametrize(
    ("limit", "sizes"),
    [
        (6, [3, 3, 3, 1]),
        (8, [3, 3, 3, 1]),
        (5, [2] * 6 + [1]),
        (3, [2] * 6 + [1]),
        (1, [2] * 6 + [1]),
    ],
)
def test_blocks_of_a_tall_map_are_whole_rows(
    monkeypatch: pytest.MonkeyPatch, limit: int, sizes: list[int]
) -> None:
    """As many rows as fit into a block, at least one; with the first row of the next as overlap."""
    rows = np.arange(21.0).reshape(7, 3)
    monkeypatch.setattr(module, "_BLOCK", limit)
    blocks = list(module._row_blocks(rows, overlap=1))
    assert [len(block) for block in blocks] == sizes
    assert np.concatenate([block[: max(1, limit // 3)] for block in blocks]) == pytest.approx(rows)
    assert all(block.base is rows or block.base is rows.base for block in blocks)


def test_undefined_parameters_are_none() -> None:
    flat = compute_parameters(np.full((5, 6), 0.1), (1e-6, 1e-6))
    assert (flat["Sq"], flat["Sz"], flat["Sdr"]) == (0.0, 0.0, 0.0)
    assert (flat["Ssk"], flat["Sku"]) == (None, None)
    board = np.indices((8, 8)).sum(axis=0) % 2 * np.where(np.indices((8, 8)).sum(0) % 2, 1, np.nan)
    assert compute_parameters(board, (1e-6, 1e-6))["Sdq"] is None  # no cell has four corners
    line = compute_parameters(np.array([0.0, 1.0, 3.0, 6.0]), (1e-6,))
    assert line["PSm"] is None


def test_extreme_heights_do_not_overflow() -> None:
    wave = np.tile(np.sin(2 * np.pi * np.arange(40) / 40), (4, 1))
    for scale in (1e-120, 1e150):
        assert compute_parameters(scale * wave, (1e-6, 1e-6))["Sku"] == pytest.approx(1.5, rel=1e-9)


# --- profiles -------------------------------------------------------------------------------------


def test_profile_parameters_of_a_sinusoid() -> None:
    heights, pitch = sinusoid(400)
    line = np.pad(heights[0], (0, 1), mode="wrap")
    values = compute_parameters(line, pitch[:1])
    amplitude = 0.5 * 100e-6 / (2 * np.pi)
    assert set(values) == {f"P{one.symbol}" for one in PROFILE_PARAMETERS}
    assert values["Pt"] == values["Pz"]
    assert values["Pdq"] == pytest.approx(rms_chord_slope(400, 0.5), rel=1e-10)
    # Crossings by straight lines between samples: good to the curvature of a sine near its zero.
    assert values["PSm"] == pytest.approx(100e-6, rel=1e-6)
    assert values["Pq"] == pytest.approx(
        amplitude / math.sqrt(2), rel=1e-3
    )  # one more node than whole periods


def test_section_length_is_the_nesting_index() -> None:
    """Peaks 1, 2, 3, 4, 5 µm in five sections: Rp = 3 µm above the mean line, Rt = 5 µm."""
    line = np.zeros(501)
    line[50::100] = MICRO * np.arange(1, 6)
    mean = line.mean()
    values = compute_parameters(line, (2e-6,), nesting=200e-6)
    assert values["Rp"] == pytest.approx(3 * MICRO - mean, rel=1e-9)
    assert values["Rv"] == pytest.approx(mean, rel=1e-9)
    assert values["Rz"] == pytest.approx(3 * MICRO, rel=1e-9)
    assert values["Rt"] == pytest.approx(5 * MICRO, rel=1e-9)
    assert compute_parameters(line, (2e-6,))["Pp"] == pytest.approx(5 * MICRO - mean, rel=1e-9)
    assert compute_parameters(line, (2e-6,), nesting=1.0)["Rz"] == pytest.approx(
        5 * MICRO, rel=1e-9
    )


def test_sections_are_as_long_as_the_nesting_index_in_the_middle_of_a_longer_trace() -> None:
    """5.9 of them: peaks count in the five in the middle, each in its own section."""
    line = np.zeros(591)
    line[[40, 60, 190, 290, 390, 490, 550]] = MICRO * np.array([90, 1, 2, 3, 4, 5, 90])
    evaluated = line[45:546]
    values = compute_parameters(line, (1e-6,), nesting=100e-6)
    assert values["Rp"] == pytest.approx(3 * MICRO - evaluated.mean(), rel=1e-9)
    assert values["Rt"] == pytest.approx(5 * MICRO, rel=1e-9)
    assert values["Rq"] == pytest.approx(evaluated.std(), rel=1e-9)
    short = compute_parameters(line[:149], (1e-6,), nesting=100e-6)  # from 24 to 124
    assert short["Rz"] == pytest.approx(90 * MICRO, rel=1e-9)
    assert compute_parameters(line[30:179], (1e-6,), nesting=100e-6)["Rz"] == pytest.approx(
        MICRO, rel=1e-9
    )


def test_small_zigzag_makes_no_profile_elements() -> None:
    """A zigzag of 2 % of Rz is below the threshold of 10 % for profile elements."""
    x = np.arange(2001) * 1e-6
    wave = MICRO * np.sin(2 * np.pi * x / 200e-6)
    zigzag = 0.04 * MICRO * np.where(np.arange(2001) % 2, 1.0, -1.0)
    noisy = compute_parameters(wave + zigzag, (1e-6,))["PSm"]
    assert noisy is not None
    assert noisy == pytest.approx(200e-6, rel=0.01)
    coarse = compute_parameters(wave + 10 * zigzag, (1e-6,))["PSm"]
    assert coarse is not None
    assert coarse < noisy / 2  # a zigzag of 14 % of Rz counts


def test_element_spacing_interpolates_between_samples() -> None:
    """Two waves of 7.3 samples; crossings rounded to half samples would be 5 % off."""
    x = np.arange(19) * 1e-6
    wave = MICRO * np.sin(2 * np.pi * (x - 1.1e-6) / 7.3e-6)
    # A chord misses the zero of a sine by at most u²/(9 √3) of a sample's length, u = 2π/7.3.
    chord = (2 * np.pi / 7.3) ** 2 / (9 * math.sqrt(3)) * 1e-6
    spacing = module._element_spacing(wave, 1e-6, 0.1 * MICRO)
    assert spacing == pytest.approx(7.3e-6, abs=2 * chord)


def test_gap_does_not_shorten_the_element_spacing() -> None:
    x = np.arange(2001) * 1e-6
    wave = MICRO * np.sin(2 * np.pi * x / 200e-6 + 0.3)
    wave[1000:1030] = np.nan
    assert compute_parameters(wave, (1e-6,))["PSm"] == pytest.approx(200e-6, rel=1e-3)


def test_every_symbol_is_declared_once() -> None:
    symbols = [one.symbol for one in AREAL_PARAMETERS] + [one.symbol for one in PROFILE_PARAMETERS]
    assert len(set(symbols)) == len(symbols)
    assert find_parameter("Sq").unit == "m"
    assert find_parameter("RSm") is find_parameter("PSm")
    with pytest.raises(KeyError):
        find_parameter("Q")


# --- autocorrelation ------------------------------------------------------------------------------


def test_correlation_length_of_a_grating() -> None:
    """Across, cos(2π t/λ) = 0.2 at t = 0.218 λ; along the grooves it does not decay."""
    x = np.arange(400)
    heights = MICRO * np.tile(np.cos(2 * np.pi * x / 20), (50, 1))
    length, ratio = correlation_parameters(heights, (1e-6, 2e-6))
    assert ratio is None
    # Between samples the correlation is read along chords: 1 - cos(π/n) too low, n = 20.
    expected = math.acos(0.2) / (2 * math.pi) * 20e-6
    assert length == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("aspect", [1.0, 3.0])
def test_correlation_of_gaussian_noise(aspect: float) -> None:
    """Noise smoothed by exp(-2 t²/l²) has f = exp(-t²/l²) = 0.2 at t = 1.269 l."""
    from scipy.ndimage import gaussian_filter as smooth

    wide, noise = 8.0, np.random.default_rng(6).standard_normal((900, 900))
    heights = smooth(noise, (wide / 2, aspect * wide / 2), mode="wrap")
    length, ratio = correlation_parameters(heights, (1e-6, 1e-6))
    # About 900²/(10² aspect) independent patches: 1 to 2 % standard error of the mean.
    assert length == pytest.approx(math.sqrt(math.log(5)) * wide * 1e-6, rel=0.06)
    assert ratio == pytest.approx(1 / aspect, rel=0.12)
    heights[100:300, 200:400] = np.nan  # holes are excluded, not taken as zeros
    assert correlation_parameters(heights, (1e-6, 1e-6))[0] == pytest.approx(length, rel=0.03)


def test_autocorrelation_is_the_mean_over_measured_pairs() -> None:
    heights = np.random.default_rng(8).standard_normal((9, 12)) + np.arange(12)
    heights[2, 3] = heights[7, 7] = np.nan
    f = _autocorrelation(heights)
    z = heights - np.nanmean(heights)
    for down, along in ((0, 0), (0, 5), (4, 0), (3, 6), (-4, 2)):
        first = z[max(-down, 0) : 9 - max(down, 0), : 12 - along]
        second = z[max(down, 0) : 9 - max(-down, 0), along:]
        expected = np.nanmean(first * second) / np.nanmean(z * z)
        assert f[down, along] == pytest.approx(expected, rel=1e-10)


def test_correlation_of_a_plane_is_undefined() -> None:
    assert correlation_parameters(np.zeros((20, 20)), (1e-6, 1e-6)) == (None, None)
