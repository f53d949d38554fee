"""Form, waviness and texture of surfaces whose parts are known."""

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
        (
            (300, 150),
            (2e-4, 2e-4),
            False,
            MAX_TEXTURE_WAVELENGTH,
        ),  # 30 mm wide: never longer than 8 mm
        ((9600,), (1.5e-3 / 9600,), False, 0.25e-3),  # five along a profile: 1.25 mm
        ((5001,), (2.5e-6,), False, 2.5e-3),
        ((64, 64), (1e-7, 1e-7), False, 2.5e-6),
        ((64, 64), (1e-5, 1e-5), True, MAX_TEXTURE_WAVELENGTH),
    ],
)
def test_the_default_nesting_index(
    shape: tuple[int, ...], pitch: tuple[float, ...], periodic: bool, expected: float
) -> None:
    assert default_nesting_index(shape, pitch, periodic) == expected


@pytest.mark.parametrize("share", [0.2, 0.7, 1.0, 1.6, 4.0])
def test_a_wave_that_repeats_is_split_as_the_filter_says(share: float) -> None:
    """A wave of length l keeps 1 - 2^-(L/l)² of its amplitude as texture."""
    n, waves, step, amplitude = 240, 12, 1e-5, 3 * MICRO
    length = n * step / waves
    line = amplitude * np.sin(2 * np.pi * waves * np.arange(n) / n + 0.3)
    for heights in (line, np.tile(line, (8, 1)), np.tile(line, (8, 1)).T):
        parts = decompose_surface(
            heights + 5e-3, (step,) * heights.ndim, periodic=True, nesting=share * length
        )
        passed = 2.0 ** -(share**2)
        rms = amplitude / np.sqrt(2)
        assert parts.form.rms < 1e-12 * rms  # no form but the mean
        assert parts.waviness.rms == pytest.approx(passed * rms, rel=1e-9)
        assert parts.texture.rms == pytest.approx((1 - passed) * rms, rel=1e-9)
        np.testing.assert_allclose(
            parts.heights, (1 - passed) * heights, atol=1e-12 * amplitude, rtol=0
        )


def bowed(hole: bool = False) -> tuple[Any, Any, tuple[float, float]]:
    """Return a map: a cylinder on a tilt with grain, its grain, its pitch."""
    ny, nx, pitch = 161, 201, (5e-6, 4e-6)
    y, x = np.mgrid[:ny, :nx] * np.array([pitch[1], pitch[0]])[:, None, None]
    form = 0.2 * x - 0.1 * y + 80.0 * (x - 4e-4) ** 2 + 30.0 * (x - y) * y
    grain = MICRO * np.cos(np.pi * 40 * np.arange(nx) / (nx - 1)) * np.ones((ny, 1))
    heights = form + grain
    if hole:
        heights[40:60, 30:80] = np.nan
    return heights, grain, pitch


@pytest.mark.parametrize("hole", [False, True])
def test_a_bowed_map_falls_into_form_and_grain(hole: bool) -> None:
    """The fit is linear: form of the sum = the known form + what the grain alone is fitted by."""
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
    # What the form takes of the grain is the grain's own fit, and no filter makes that larger.
    own = np.abs(basis @ np.linalg.lstsq(basis, grain[valid], rcond=None)[0]).max()
    passed = 2.0 ** -((2e-4 / 5e-5) ** 2)  # the grain is 50 µm long
    assert np.abs(parts.heights - (1 - passed) * grain).max() < 2 * own < 0.1 * MICRO


def test_what_was_not_measured_counts_nowhere() -> None:
    """The fill of a hole in a flat map, 1 µm above or below, changes no number."""
    heights = np.random.default_rng(1).standard_normal((40, 50)) * MICRO
    heights[10:20, 10:20] = np.nan
    parts = decompose_surface(heights, (1e-5, 1e-5))
    texture = parts.heights[~np.isnan(heights)]
    assert parts.texture == HeightStatistics(float(texture.std()), float(np.ptp(texture)))
    assert parts.waviness.rms > 0.01 * MICRO  # so that the equality means something


def test_a_profile_is_also_a_map_of_one_row() -> None:
    line = np.random.default_rng(1).standard_normal(200) * MICRO
    row = decompose_surface(line[None], (1e-5, 1e-5))
    assert row.heights.shape == (1, 200)
    np.testing.assert_array_equal(row.heights[0], decompose_surface(line, (1e-5,)).heights)
    assert row.nesting == 2.5e-4


def test_parts_of_a_surface_scale_with_it() -> None:
    heights, _, pitch = bowed()
    one = decompose_surface(heights, pitch, nesting=1e-4)
    wide = tuple(20 * step for step in pitch)
    ten = decompose_surface(20 * heights, wide, nesting=2e-3)
    for before, after in zip(
        (one.form, one.waviness, one.texture), (ten.form, ten.waviness, ten.texture), strict=True
    ):
        assert after.rms == pytest.approx(20 * before.rms, rel=1e-9)
        assert after.range == pytest.approx(20 * before.range, rel=1e-9)
    assert decompose_surface(20 * heights, wide).nesting == 8e-3  # of 12.8 mm
    assert decompose_surface(heights, pitch).nesting == 2.5e-4


def test_a_few_points_have_no_more_form_than_they_support() -> None:
    line = np.array([0.0, 1.0, 4.0, 9.0]) * MICRO
    parts = decompose_surface(line, (1e-5,))
    assert parts.form.range == pytest.approx(9 * MICRO, rel=1e-9)  # the line through them


@pytest.mark.parametrize("nesting", [0.0, -1.0, np.nan, np.inf, "1 mm", 1e-3])
def test_a_nesting_index_that_is_none_is_refused(nesting: Any) -> None:
    with pytest.raises(ParameterError) as caught:
        decompose_surface(np.ones(40) * MICRO, (1e-5,), nesting=nesting)
    assert caught.value.argument == "nesting"
