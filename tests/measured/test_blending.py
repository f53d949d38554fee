"""Blended borders make surfaces periodic; results are compared with a reference loop."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.defects import blend_borders
from asperity.measured.preparation import prepare
from asperity.measured.reading import RawSurface
from asperity.textures import load_texture

PITCH = (2e-6, 3e-6)


def bumpy(ny: int = 60, nx: int = 50) -> Any:
    y, x = np.mgrid[:ny, :nx]
    return 1e-6 * (np.sin(x / 4.0 + 0.3) + np.cos(y / 5.0) + 0.05 * x - 0.02 * y)


def smooth_step(s: float) -> float:
    return 6 * s**5 - 15 * s**4 + 10 * s**3


@pytest.mark.parametrize("band", [4, 7, 12])
@pytest.mark.parametrize("seed", range(8))
def test_profile_matches_a_reference_loop(band: int, seed: int) -> None:
    n = 40
    heights = np.random.default_rng(seed).standard_normal(n)
    blended, jump = blend_borders(heights, (band,))
    expected = heights[: n - band].copy()
    for i in range(band):
        t = smooth_step((i + 1) / (band + 1))
        expected[i] = t * heights[i] + (1 - t) * heights[n - band + i]
    np.testing.assert_allclose(blended, expected, atol=1e-14)
    assert jump == pytest.approx(abs(heights[0] - heights[-1]))


def test_periodic_surface_is_only_shortened() -> None:
    y, x = np.mgrid[:48, :66]
    periodic = np.sin(2 * np.pi * x / 60) + np.cos(2 * np.pi * y / 20)
    blended, _ = blend_borders(periodic, (6, 8))
    np.testing.assert_allclose(blended, periodic[:40, :60], atol=1e-14)


def test_seam_is_as_smooth_as_the_surface() -> None:
    heights = bumpy()
    blended, _ = blend_borders(heights, (10, 12))
    assert blended.shape == (48, 40)
    steps_inside = np.abs(np.diff(heights, axis=1)).max()
    across = np.abs(blended[:, 0] - blended[:, -1]).max()
    assert across < 1.1 * steps_inside
    assert (
        np.abs(heights[:, 0] - heights[:, 39]).max() > 3 * steps_inside
    )  # shortening alone is not smooth
    assert blended.min() >= heights.min()
    assert blended.max() <= heights.max()


def test_heights_beyond_the_bands_are_unchanged() -> None:
    heights = bumpy()
    blended, _ = blend_borders(heights, (10, 12))
    np.testing.assert_array_equal(blended[12:, 10:], heights[12:48, 10:40])


def test_prepared_surface_and_texture_are_periodic(tmp_path: Any) -> None:
    raw = RawSurface(bumpy(), PITCH, "test", ())
    prepared = prepare(raw, periodic=True)
    assert prepared.periodic
    assert prepared.heights.shape == (54, 45)
    assert "opposite borders blended over 10 µm x 18 µm (a tenth of each side)" in prepared.steps[3]
    assert "which leaves 45 x 54 points" in prepared.steps[3]
    with_width = prepare(raw, periodic=True, blend=30e-6)
    assert with_width.heights.shape == (50, 35)
    assert "blended over 30 µm, which" in with_width.steps[3]
    np.save(tmp_path / "map.npy", bumpy())
    texture = load_texture(tmp_path / "map.npy", pitch=PITCH, periodic=True)
    assert texture.periodic
    xy = np.random.default_rng(1).uniform(0, 1e-4, (20, 2))
    moved = xy + np.array([45 * PITCH[0], -54 * PITCH[1]])
    np.testing.assert_allclose(texture.height(xy), texture.height(moved), atol=1e-15)
    assert not load_texture(tmp_path / "map.npy", pitch=PITCH).periodic


def test_filled_mask_follows_the_blending() -> None:
    heights = bumpy()
    holes = [(1, 30), (50, 20), (59, 49), (30, 47)]
    for index in holes:
        heights[index] = np.nan
    prepared = prepare(RawSurface(heights, PITCH, "test", ()), periodic=True)
    assert prepared.filled_mask is not None
    # Rows from 54 and columns from 45 are blended into rows and columns from 0.
    expected = {(1, 30), (50, 20), (5, 4), (30, 2)}
    assert set(map(tuple, np.argwhere(prepared.filled_mask).tolist())) == expected


def test_minimum_size_of_periodic_surfaces() -> None:
    assert len(prepare(RawSurface(bumpy()[0, :8], (1e-6,), "t", ()), periodic=True).heights) == 4
    for small in (bumpy()[0, :7], bumpy()[:7, :20]):
        raw = RawSurface(small, PITCH[: small.ndim], "test", ())
        with pytest.raises(ParameterError, match="periodic needs at least 8 points along each"):
            prepare(raw, periodic=True)


@pytest.mark.parametrize(
    ("blend", "match"),
    [
        (0.0, "must be positive"),
        (-1e-6, "must be positive"),
        (np.nan, "must be finite"),
        (9e-6, "must be at least 4 samples, 12 µm"),
        (60e-6, "must be at most half the shorter side, 50 µm"),
        (1.0, "must be at most half the shorter side"),
    ],
)
def test_invalid_widths_are_refused(blend: float, match: str) -> None:
    with pytest.raises(ParameterError, match=f"blend {match}") as caught:
        prepare(RawSurface(bumpy(), PITCH, "test", ()), periodic=True, blend=blend)
    assert caught.value.argument == "blend"


def test_width_needs_periodic_and_periodic_must_be_boolean() -> None:
    raw = RawSurface(bumpy(), PITCH, "test", ())
    with pytest.raises(ParameterError, match=r"blend is the width .* needs periodic"):
        prepare(raw, blend=20e-6)
    with pytest.raises(ParameterError, match="periodic must be true or false"):
        prepare(raw, periodic="no")  # wrong type on purpose


# --- borders that fit -----------------------------------------------------------------------------


def seamless(count: int = 64) -> np.ndarray:
    """A map that repeats after ``count`` points, with a slope at its seam."""
    phase = 2.0 * np.pi * np.arange(count) / count
    return 100e-6 * np.sin(phase)[:, None] + 50e-6 * np.cos(2.0 * phase)


@pytest.mark.parametrize("arguments", [{}, {"form": 2}, {"tip_radius": 1e-4}, {"l_cutoff": 6e-3}])
def test_map_whose_borders_fit_is_believed(arguments: dict[str, Any]) -> None:
    """Shifted by part of a period before the preparation or after, it is the same."""
    heights = seamless()
    shifted = np.roll(heights, (11, 23), axis=(0, 1))
    both = [
        prepare(RawSurface(h, (1e-4, 1e-4), "tile", ()), periodic=True, **arguments)
        for h in (heights, shifted)
    ]
    assert both[0].periodic
    np.testing.assert_allclose(
        both[1].heights, np.roll(both[0].heights, (11, 23), axis=(0, 1)), atol=1e-12
    )
    if "l_cutoff" not in arguments:
        np.testing.assert_allclose(both[0].heights, heights, atol=1e-6)
    assert sum("opposite borders fit, so nothing is blended" in step for step in both[0].steps) == 1


def test_borders_that_fit_are_noted() -> None:
    steps = prepare(RawSurface(seamless(), (1e-4, 1e-4), "tile", ())).steps
    assert "if the surface repeats, declare it periodic" in steps[0]
    noise = RawSurface(np.random.default_rng(0).normal(size=(32, 32)) * 1e-6, (1e-5,) * 2, "n", ())
    assert "borders fit" not in " ".join(prepare(noise).steps)
    assert "borders fit" in " ".join(prepare(noise, periodic=True).steps)
    for part in (seamless()[:-1], seamless()[:, 3:], np.square(np.linspace(-1e-4, 1e-4, 64))):
        raw = RawSurface(part, (1e-4,) * part.ndim, "part", ())
        assert "borders fit" not in " ".join(prepare(raw).steps)
        assert "blended over" in " ".join(prepare(raw, periodic=True).steps)
