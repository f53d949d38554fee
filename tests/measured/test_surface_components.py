"""Form, waviness and texture of surfaces with known components."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.form import (
    MAX_TEXTURE_WAVELENGTH,
    HeightStatistics,
    decompose_surface,
    default_nesting_index,
)

MICRO = 1e-6


@pytest.mark.parametrize(
    ("shape", "pitch", "periodic", "expected"),
    [
        ((256, 918), (2.58e-6, 2.58e-6), False, 0.25e-3),  # 0.66 mm along y
        ((918, 256), (2.58e-6, 2.58e-6), False, 0.25e-3),
        ((11, 41), (2e-4, 8e-5), False, 0.8e-3),  # exactly as long along y
        ((11, 41), (2e-4, 7.9e-5), False, 0.25e-3),
        ((300, 150), (2e-4, 2e-4), False, MAX_TEXTURE_WAVELENGTH),  # 30 mm wide: limited to 8 mm
        ((9600,), (1.5e-3 / 9600,), False, 0.25e-3),  # a fifth of the profile is 1.25 mm
        ((5001,), (2.5e-6,), False, 2.5e-3),
        ((64, 64), (1e-7, 1e-7), False, 2.5e-6),
        ((64, 64), (1e-5, 1e-5), True, MAX_TEXTURE_WAVELENGTH),
    ],
)
def test_default_nesting_index(
    shape: tuple[int, ...], pitch: tuple[float, ...], periodic: bool, expected: float
) -> None:
    assert default_nesting_index(shape, pitch, periodic) == expected


@pytest.mark.parametrize("share", [0.2, 0.7, 1.0, 1.6, 4.0])
def test_periodic_wave_is_split_by_the_filter_transmission(share: float) -> None:
    """The texture has 1 - 2^-(L/l)² of the amplitude of a wave of length l."""
    n, waves, step, amplitude = 240, 12, 1e-5, 3 * MICRO
    length = n * step / waves
    line = amplitude * np.sin(2 * np.pi * waves * np.arange(n) / n + 0.3)
    for heights in (line, np.tile(line, (8, 1)), np.tile(line, (8, 1)).T):
        parts = decompose_surface(
            heights + 5e-3, (step,) * heights.ndim, periodic=True, nesting=share * length
        )
        transmission = 2.0 ** -(share**2)
        rms = amplitude / np.sqrt(2)
        assert parts.form.rms < 1e-12 * rms  # only the mean is form
        assert parts.waviness.rms == pytest.approx(transmission * rms, rel=1e-9)
        assert parts.texture.rms == pytest.approx((1 - transmission) * rms, rel=1e-9)
        np.testing.assert_allclose(
            parts.heights, (1 - transmission) * heights, atol=1e-12 * amplitude, rtol=0
        )


def bowed(hole: bool = False) -> tuple[Any, Any, tuple[float, float]]:
    """Return a tilted, curved map with grain, the grain alone, and the pitch."""
    ny, nx, pitch = 161, 201, (5e-6, 4e-6)
    y, x = np.mgrid[:ny, :nx] * np.array([pitch[1], pitch[0]])[:, None, None]
    form = 0.2 * x - 0.1 * y + 80.0 * (x - 4e-4) ** 2 + 30.0 * (x - y) * y
    grain = MICRO * np.cos(np.pi * 40 * np.arange(nx) / (nx - 1)) * np.ones((ny, 1))
    heights = form + grain
    if hole:
        heights[40:60, 30:80] = np.nan
    return heights, grain, pitch


@pytest.mark.parametrize("hole", [False, True])
def test_bowed_map_is_split_into_form_and_grain(hole: bool) -> None:
    """The fit is linear: the form is the known form plus the fit of the grain."""
    heights, grain, pitch = bowed(hole)
    valid = ~np.isnan(heights)
    v, u = np.mgrid[-1:1:161j, -1:1:201j]  # type: ignore[misc]  # a grid's complex step
    basis = np.stack([u**0, u, v, u * u, u * v, v * v])[:, valid].T
    form = basis @ np.linalg.lstsq(basis, heights[valid], rcond=None)[0]
    parts = decompose_surface(heights, pitch, nesting=2e-4)
    assert parts.form == HeightStatistics(
        pytest.approx(form.std(), rel=1e-9), pytest.approx(np.ptp(form), rel=1e-9)
    )
    np.testing.assert_array_equal(np.isnan(parts.heights), ~valid)
    assert parts.texture.range < parts.form.range / 10
    if hole:
        return
    # The form contains the fit of the grain, which the filters do not amplify.
    fit_of_grain = np.abs(basis @ np.linalg.lstsq(basis, grain[valid], rcond=None)[0]).max()
    passed = 2.0 ** -((2e-4 / 5e-5) ** 2)  # the grain is 50 µm long
    assert np.abs(parts.heights - (1 - passed) * grain).max() < 2 * fit_of_grain < 0.1 * MICRO


def test_filled_points_are_excluded_from_the_statistics() -> None:
    """The statistics are those of the measured points."""
    heights = np.random.default_rng(1).standard_normal((40, 50)) * MICRO
    heights[10:20, 10:20] = np.nan
    parts = decompose_surface(heights, (1e-5, 1e-5))
    texture = parts.heights[~np.isnan(heights)]
    assert parts.texture == HeightStatistics(float(texture.std()), float(np.ptp(texture)))
    assert parts.waviness.rms > 0.01 * MICRO  # so that the equality is not trivial


def test_map_of_one_row_equals_the_profile() -> None:
    line = np.random.default_rng(1).standard_normal(200) * MICRO
    row = decompose_surface(line[None], (1e-5, 1e-5))
    assert row.heights.shape == (1, 200)
    np.testing.assert_array_equal(row.heights[0], decompose_surface(line, (1e-5,)).heights)
    assert row.nesting == 2.5e-4


def test_components_scale_with_the_surface() -> None:
    heights, _, pitch = bowed()
    original = decompose_surface(heights, pitch, nesting=1e-4)
    scaled_pitch = tuple(20 * step for step in pitch)
    scaled = decompose_surface(20 * heights, scaled_pitch, nesting=2e-3)
    for before, after in zip(
        (original.form, original.waviness, original.texture),
        (scaled.form, scaled.waviness, scaled.texture),
        strict=True,
    ):
        assert after.rms == pytest.approx(20 * before.rms, rel=1e-9)
        assert after.range == pytest.approx(20 * before.range, rel=1e-9)
    assert decompose_surface(20 * heights, scaled_pitch).nesting == 8e-3  # 12.8 mm wide
    assert decompose_surface(heights, pitch).nesting == 2.5e-4


def test_degree_of_the_form_is_limited_for_few_points() -> None:
    line = np.array([0.0, 1.0, 4.0, 9.0]) * MICRO
    parts = decompose_surface(line, (1e-5,))
    assert parts.form.range == pytest.approx(9 * MICRO, rel=1e-9)  # the line through them


@pytest.mark.parametrize("nesting", [0.0, -1.0, np.nan, np.inf, "1 mm", 1e-3])
def test_invalid_nesting_indices_are_refused(nesting: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        decompose_surface(np.ones(40) * MICRO, (1e-5,), nesting=nesting)
    assert caught.value.argument == "nesting"
