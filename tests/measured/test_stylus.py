"""Dilation by a ball against closed forms, a reference loop and morphological identities."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.measured import filters
from asperity.measured.filters import dilate
from asperity.measured.preparation import prepare
from asperity.measured.reading import RawSurface

PITCH = (1e-6, 1.5e-6)


def erode(heights: FloatArray, pitch: tuple[float, ...], radius: float) -> FloatArray:
    """Return the erosion by a ball: the dilation of the underside."""
    return -dilate(-heights, pitch, radius)


def close_envelope(heights: FloatArray, pitch: tuple[float, ...], radius: float) -> FloatArray:
    """Return the surface as far as a ball can touch it (closing, ISO 16610-41)."""
    return erode(dilate(heights, pitch, radius), pitch, radius)


def rough(shape: tuple[int, ...] = (24, 31)) -> Any:
    return 1e-6 * np.random.default_rng(2).standard_normal(shape)


def reference_dilation(heights: Any, pitch: tuple[float, ...], radius: float) -> Any:
    """Return the dilation by a loop over all pairs of points of the mirrored surface."""
    shape = heights.shape
    mirrored = np.pad(heights, [(n - 1, n - 1) for n in shape], mode="reflect")
    positions = np.stack(np.indices(mirrored.shape), -1).reshape(-1, len(shape)) * pitch[::-1]
    result = np.empty(shape)
    for index in np.ndindex(shape):
        centre = (np.array(index) + np.array(shape) - 1) * pitch[::-1]
        squares = ((positions - centre) ** 2).sum(axis=1)
        inside = squares <= radius**2
        ball = np.sqrt(radius**2 - squares[inside]) - radius
        result[index] = (mirrored.ravel()[inside] + ball).max()
    return result


@pytest.mark.parametrize("radius", [2.1e-6, 7.2e-6, 3e-5])
def test_map_matches_a_reference_loop(radius: float) -> None:
    heights = rough()
    expected = reference_dilation(heights, PITCH, radius)
    np.testing.assert_allclose(dilate(heights, PITCH, radius), expected, atol=1e-18)


@pytest.mark.parametrize("radius", [2.1e-6, 7.2e-6, 3e-5])
def test_profile_matches_a_reference_loop(radius: float) -> None:
    heights = rough((60,))
    expected = reference_dilation(heights, (1e-6,), radius)
    np.testing.assert_allclose(dilate(heights, (1e-6,), radius), expected, atol=1e-18)


def test_dilated_spike_is_a_spherical_cap() -> None:
    radius, high = 9e-6, 5e-6
    spike = np.zeros((41, 45))
    spike[20, 22] = high
    y, x = np.mgrid[:41, :45]
    squares = ((x - 22) * PITCH[0]) ** 2 + ((y - 20) * PITCH[1]) ** 2
    cap = high - radius + np.sqrt(np.maximum(radius**2 - squares, 0.0))
    expected = np.where(squares <= radius**2, np.maximum(cap, 0.0), 0.0)
    np.testing.assert_allclose(dilate(spike, PITCH, radius), expected, atol=1e-19)
    other = np.where(squares <= radius**2, np.maximum(cap + 1e-9, 0.0), 0.0)
    assert np.max(np.abs(other - expected)) > 1e-10


@pytest.mark.parametrize("height", [0.0, 3e-6])
def test_flat_surface_is_unchanged(height: float) -> None:
    flat = np.full((12, 15), height)
    np.testing.assert_array_equal(dilate(flat, PITCH, 5e-6), flat)
    np.testing.assert_array_equal(close_envelope(flat, PITCH, 5e-6), flat)


def test_dilation_adds_the_tip_radius_to_a_round_ridge() -> None:
    """The centre of the ball follows a circle whose radius is the sum of both radii."""
    radius, tip, n = 50e-6, 20e-6, 2001
    pitch = 60e-6 / (n - 1)
    x = (np.arange(n) - n // 2) * pitch
    ridge = np.sqrt(radius**2 - x**2) - radius
    dilated = dilate(ridge, (pitch,), tip)
    parallel = np.sqrt((radius + tip) ** 2 - x**2) - radius - tip
    # The point of contact must lie on the profile, not on its mirror image: |x| < 30·(70/50) µm.
    inner = np.abs(x) < 0.9 * 30e-6
    assert np.max(np.abs(dilated - parallel)[inner]) < 2 * pitch**2 / tip
    assert np.max(np.abs(dilated - ridge)[inner]) > 1e-6


def test_narrow_groove_is_bridged() -> None:
    """In a slot of width 2 a the ball sinks by R - √(R² - a²)."""
    radius, half = 40e-6, 10
    slot = np.zeros(201)
    slot[100 - half + 1 : 100 + half] = -1e-4
    dilated = dilate(slot, (1e-6,), radius)
    a = half * 1e-6
    assert dilated.min() == pytest.approx(-(radius - np.sqrt(radius**2 - a**2)), rel=1e-9)
    closed = close_envelope(slot, (1e-6,), radius)
    u = (np.arange(201) - 100) * 1e-6
    inside = np.abs(u) < a
    arc = np.sqrt(radius**2 - a**2) - np.sqrt(radius**2 - u[inside] ** 2)
    np.testing.assert_allclose(closed[inside], arc, atol=1e-15)
    np.testing.assert_allclose(closed[~inside], 0.0, atol=1e-19)


@pytest.mark.parametrize("shape", [(24, 31), (70,)])
def test_closing_is_idempotent_and_never_lowers(shape: tuple[int, ...]) -> None:
    heights, pitch = rough(shape), PITCH[: len(shape)]
    once = close_envelope(heights, pitch, 6e-6)
    twice = close_envelope(once, pitch, 6e-6)
    np.testing.assert_allclose(twice, once, atol=1e-18)
    assert (once >= heights - 1e-18).all()
    assert np.max(np.abs(once - heights)) > 1e-7  # closing has an effect
    assert np.max(np.abs(dilate(once, pitch, 6e-6) - once)) > 1e-7  # dilation is not idempotent


def test_tip_smaller_than_the_pitch_changes_nothing() -> None:
    np.testing.assert_array_equal(dilate(rough(), PITCH, 0.9e-6), rough())


def test_preparation_step_states_the_effect_of_the_tip() -> None:
    raw = RawSurface(rough(), PITCH, "test", ())
    plain = prepare(raw)
    scanned = prepare(raw, tip_radius=4e-6, magnify=2.0)
    np.testing.assert_allclose(scanned.heights, 2 * dilate(plain.heights, PITCH, 4e-6), rtol=1e-12)
    change = dilate(plain.heights, PITCH, 4e-6) - plain.heights
    assert scanned.steps[3] == (
        "felt with a tip of radius 4 µm: dilation by a ball (as in ISO 16610-41) lowered by the"
        f" radius, heights raised at {np.mean(change > 0):.3g} of the points, by"
        f" {np.sqrt(np.mean(change**2)) * 1e9:.4g} nm RMS and at most {change.max() * 1e9:.4g} nm"
    )


@pytest.mark.parametrize(
    ("radius", "match"),
    [
        (0.0, "must be positive"),
        (-1e-6, "must be positive"),
        (np.nan, "must be finite"),
        (np.inf, "must be finite"),
        (4e-5, "must be at most the surface's shorter side, 30 µm"),
    ],
)
def test_invalid_radii_are_refused(radius: float, match: str) -> None:
    with pytest.raises(ParameterError, match=f"tip_radius {match}") as caught:
        prepare(RawSurface(rough(), PITCH, "test", ()), tip_radius=radius)
    assert caught.value.argument == "tip_radius"


def test_excessive_number_of_comparisons_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(filters, "_MAX_COMPARISONS", 1e4)
    with pytest.raises(ParameterError, match=r"tip_radius needs .* comparisons at each of 744"):
        dilate(rough(), PITCH, 1e-5)
