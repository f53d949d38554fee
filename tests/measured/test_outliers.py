"""Outlier detection, with local medians compared to a reference loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.measured import defects
from asperity.measured.defects import (
    _half_window,
    _local_median,
    _pad_by_reflection,
    remove_outliers,
)
from asperity.measured.preparation import prepare
from asperity.measured.reading import RawSurface


def wavy(ny: int = 60, nx: int = 80) -> Any:
    y, x = np.mgrid[:ny, :nx]
    noise = np.random.default_rng(4).uniform(-1e-8, 1e-8, (ny, nx))
    return 1e-6 * np.sin(x / 40.0) * np.cos(y / 30.0) + noise


def extend_by_reflection(line: Any, reach: int) -> Any:
    """Continue a line by reflection through the median of its last three points."""

    def median_of_valid(last_points: Any) -> float:
        valid = [v for v in last_points if not np.isnan(v)]
        return float(np.median(valid)) if valid else float("nan")

    before = [2 * median_of_valid(line[:3]) - line[2 + i] for i in range(reach, 0, -1)]
    after = [2 * median_of_valid(line[-3:]) - line[-3 - i] for i in range(1, reach + 1)]
    return np.concatenate([before, line, after])


def local_median(heights: FloatArray) -> FloatArray:
    return _local_median(_pad_by_reflection(heights, _half_window(heights.shape)), heights.shape)


@pytest.mark.parametrize("shape", [(14, 17), (40,)])
@pytest.mark.parametrize("share", [0.0, 0.2, 0.7])
@pytest.mark.parametrize("block", [3, 2**18])
def test_local_median_matches_a_reference_loop(
    monkeypatch: pytest.MonkeyPatch, shape: tuple[int, ...], share: float, block: int
) -> None:
    monkeypatch.setattr(defects, "_BLOCK", block)
    rng = np.random.default_rng(1)
    heights = rng.standard_normal(shape)
    heights[rng.random(shape) < share] = np.nan
    reach = {1: 4, 2: 2}[len(shape)]
    padded = heights
    for axis in range(len(shape)):
        padded = np.apply_along_axis(extend_by_reflection, axis, padded, reach)
    medians = local_median(heights)
    for index in np.ndindex(shape):
        window = padded[tuple(slice(i, i + 2 * reach + 1) for i in index)]
        expected = np.nan if np.isnan(heights[index]) else np.nanmedian(window)
        np.testing.assert_equal(medians[index], expected)


def test_exactly_the_planted_spikes_are_detected() -> None:
    heights = wavy()
    heights[20:24, 30:50] = np.nan
    planted = [(5, 5), (0, 0), (59, 40), (24, 33), (19, 49), (40, 41), (40, 42), (41, 41)]
    for k, index in enumerate(planted):
        heights[index] += (
            -1
        ) ** k * 4e-7  # smaller than the waves, so a global limit cannot find them
    assert np.abs(wavy()).max() > 4e-7
    before = np.isnan(heights)
    step = remove_outliers(heights, 6.0)
    detected = np.argwhere(np.isnan(heights) & ~before)
    assert sorted(map(tuple, detected.tolist())) == sorted(planted)
    assert step.startswith("outliers: 8 points beyond 6 robust standard deviations, ")


def test_threshold_is_in_standard_deviations() -> None:
    """For normal noise the share of outliers is that of the normal distribution."""
    noise = np.random.default_rng(5).standard_normal((600, 600))
    remove_outliers(noise, 2.0)
    share = float(np.isnan(noise).mean())
    # 0.0455 for a normal distribution; without the factor 1.4826 it would be 0.18.
    assert 0.035 < share < 0.050


def test_spike_on_quantised_heights_is_detected() -> None:
    heights = np.zeros((20, 20))
    heights[7, 8] = 1e-6
    assert "mean absolute deviation" in remove_outliers(heights, 6.0)
    assert np.argwhere(np.isnan(heights)).tolist() == [[7, 8]]


def test_flat_and_constant_surfaces_have_no_outliers() -> None:
    for value in (0.0, 0.1, -3e-7):
        heights = np.full((9, 12), value)
        assert remove_outliers(heights, 1e-6).startswith("outliers: 0 points")
        assert np.isfinite(heights).all()


def test_tilt_causes_no_outliers_at_the_border() -> None:
    y, x = np.mgrid[:30, :40]
    tilted = 3e-6 * x - 2e-6 * y + np.random.default_rng(3).uniform(-1e-9, 1e-9, (30, 40))
    assert remove_outliers(tilted, 8.0).startswith("outliers: 0 points")
    tilted[0, 0] += 2e-4
    line = tilted[0].copy()
    remove_outliers(tilted, 8.0)
    remove_outliers(line, 8.0)
    assert np.argwhere(np.isnan(tilted)).tolist() == [[0, 0]]
    assert np.flatnonzero(np.isnan(line)).tolist() == [0]


@pytest.mark.parametrize("threshold", [3.0, 6.0])
def test_smooth_waves_have_no_outliers(threshold: float) -> None:
    """Crests exceed their local medians; a global limit alone would remove them."""
    y, x = np.mgrid[:90, :100]
    bumps = 1e-6 * np.sin(x / 5.0) * np.sin(y / 6.0) ** 3
    assert remove_outliers(bumps, threshold).startswith("outliers: 0 points")
    assert remove_outliers(bumps[30].copy(), threshold).startswith("outliers: 0 points")
    residual = np.abs(bumps - local_median(bumps))
    assert residual.max() > 3.0 * 1.4826 * np.median(residual)  # a global limit would fail


def test_small_surfaces_have_no_outliers() -> None:
    for shape in ((4, 4), (4,), (4, 30)):
        heights = np.random.default_rng(1).standard_normal(shape)
        remove_outliers(heights, 50.0)
        assert np.isfinite(heights).all()


def test_outliers_are_filled_and_excluded_from_the_height_range() -> None:
    heights = wavy()
    clean = prepare(RawSurface(heights, (1e-6, 1e-6), "test", ()), height_range=1e-5)
    spiked = heights.copy()
    spiked[30, 30] = 1e-3
    with_spike = RawSurface(spiked, (1e-6, 1e-6), "test", ())
    prepared = prepare(with_spike, outliers=10.0, height_range=1e-5)
    assert prepared.steps[0].startswith("outliers: 1 point beyond 10 robust")
    assert prepared.filled_mask is not None
    assert np.argwhere(prepared.filled_mask).tolist() == [[30, 30]]
    np.testing.assert_allclose(prepared.heights, clean.heights, atol=1e-7)
    uncorrected = prepare(with_spike, height_range=1e-5)
    assert np.std(uncorrected.heights) < 0.1 * np.std(clean.heights)  # negative control


@pytest.mark.parametrize("threshold", [0.0, -3.0, np.nan, np.inf, "6"])
def test_invalid_thresholds_are_refused(threshold: Any) -> None:
    with pytest.raises(
        ParameterError, match=r"outliers must be (positive|finite|a number)"
    ) as caught:
        prepare(RawSurface(wavy(), (1e-6, 1e-6), "test", ()), outliers=threshold)
    assert caught.value.argument == "outliers"


def test_threshold_that_removes_too_many_points_is_refused() -> None:
    with pytest.raises(ParameterError, match="at most a quarter can be filled"):
        prepare(RawSurface(wavy(), (1e-6, 1e-6), "test", ()), outliers=0.1)
