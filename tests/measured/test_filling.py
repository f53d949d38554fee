"""Holes of any size are filled by harmonic interpolation of their surroundings."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import ParameterError
from asperity.measured import defects
from asperity.measured.defects import fill_in_place

P = 1e-6


def fill_harmonic(
    heights: NDArray[np.float64], pitch: tuple[float, ...] = (1.0, 1.0)
) -> NDArray[np.float64]:
    filled = heights.copy()
    fill_in_place(filled, pitch)
    return filled


def plane(ny: int, nx: int) -> NDArray[np.float64]:
    y, x = np.mgrid[:ny, :nx] * 1.0
    return 3e-6 + 0.02 * P * x - 0.005 * 2 * P * y


def bumpy(ny: int = 40, nx: int = 50) -> NDArray[np.float64]:
    rng = np.random.default_rng(7)
    return np.asarray(1e-6 * rng.standard_normal((ny, nx)) + plane(ny, nx))


def with_holes(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    ny, nx = heights.shape
    result = heights.copy()
    result[ny // 4 : 5 * ny // 8, nx // 5 : 4 * nx // 5] = np.nan
    result[2, 3] = np.nan
    return result


@pytest.mark.parametrize("ratio", [0.05, 1.0, 2.0, 20.0])
def test_filling_continues_a_plane(ratio: float) -> None:
    exact = plane(61, 80)
    filled = fill_harmonic(with_holes(exact), (P, ratio * P))
    assert np.max(np.abs(filled - exact)) < 1e-8 * np.ptp(exact)


def test_filling_is_harmonic_and_keeps_valid_points() -> None:
    heights = with_holes(bumpy())
    heights[0, :5] = heights[-3:, -1] = np.nan  # holes at the outer border, too
    missing = np.isnan(heights)
    filled = fill_harmonic(heights, (P, 2 * P))
    np.testing.assert_array_equal(filled[~missing], heights[~missing])
    mirrored = np.pad(filled, 1, mode="edge")  # no slope across the border
    centre = mirrored[1:-1, 1:-1]
    laplacian = (mirrored[1:-1, 2:] - 2 * centre + mirrored[1:-1, :-2]) / 1.0
    laplacian += (mirrored[2:, 1:-1] - 2 * centre + mirrored[:-2, 1:-1]) / 4.0
    assert np.max(np.abs(laplacian[missing])) < 1e-7 * np.ptp(filled)
    assert np.max(np.abs(laplacian[~missing])) > 0.1 * np.ptp(filled)  # negative control
    assert filled[missing].max() < np.nanmax(heights)
    assert filled[missing].min() > np.nanmin(heights)


def test_filling_of_a_profile_is_linear() -> None:
    n = np.nan
    filled = fill_harmonic(np.array([n, 1.0, n, n, 4.0, 0.0, n]))
    np.testing.assert_allclose(filled, [1, 1, 2, 3, 4, 0, 0])


def test_filling_of_a_large_hole() -> None:
    y, x = np.mgrid[:1000, :1000] / 100.0
    exact = x**2 - y**2 + 3 * x  # harmonic, also for the five-point equation
    heights = exact.copy()
    heights[100:599, 300:800] = np.nan
    assert np.isnan(heights).mean() > 0.249
    assert np.max(np.abs(fill_harmonic(heights) - exact)) < 1e-7 * np.ptp(exact)


def test_hole_that_is_too_large_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(defects, "_GROUP_SIZE", 100)
    monkeypatch.setattr(defects, "_MAX_HOLE", 400)
    with pytest.raises(ParameterError, match="has a hole of 450 points; at most 400 are filled"):
        fill_harmonic(with_holes(bumpy()))


def test_hole_groups_cover_all_missing_points_once() -> None:
    missing = np.random.default_rng(8).random((200, 210)) < 0.4
    groups = list(defects._hole_groups(missing))
    np.testing.assert_array_equal(np.sort(np.concatenate(groups)), np.flatnonzero(missing))


def test_result_is_independent_of_the_grouping_of_holes(monkeypatch: pytest.MonkeyPatch) -> None:
    heights = bumpy(60, 70)
    heights[np.random.default_rng(9).random(heights.shape) < 0.2] = np.nan
    together = fill_harmonic(heights, (P, 2 * P))
    monkeypatch.setattr(defects, "_GROUP_SIZE", 40)
    groups = list(defects._hole_groups(np.isnan(heights)))
    assert len(groups) > 10
    apart = fill_harmonic(heights, (P, 2 * P))
    np.testing.assert_allclose(apart, together, atol=1e-12 * np.ptp(together))
