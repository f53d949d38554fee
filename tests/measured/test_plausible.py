"""Implausible heights, as from a wrong unit, are refused; those of real surfaces are not."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.preparation import MAX_MEAN_SLOPE, check_plausible, mean_slope, prepare
from asperity.measured.reading import RawSurface, read_surface

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real surfaces (../shared/data) missing")
RNG = np.random.default_rng(7)
ROUGH = 1e-6 * RNG.normal(size=(30, 40)).cumsum(axis=1)  # 1 µm per step


def make_raw(heights: np.ndarray, *, has_units: bool = False) -> RawSurface:
    pitch = (2.5e-6, 4e-6)[: heights.ndim]
    return RawSurface(heights, pitch, "part.npy", (), has_units=has_units)


def test_heights_of_metres_at_a_pitch_of_micrometres_are_refused() -> None:
    heights = ROUGH * 5.9 / np.ptp(ROUGH)
    slope = mean_slope(heights, (2.5e-6, 4e-6))
    with pytest.raises(ParameterError) as caught:
        prepare(make_raw(heights))
    message = str(caught.value)
    assert message.startswith(
        "height_range must be given: heights that span 5.9 m at a pitch of 2.5"
    )
    assert f"mean slope of {slope:.3g}" in message
    assert "in um: unit='um'" in message
    assert "if they are right: height_range=5.9" in message


def test_height_range_confirms_implausible_heights() -> None:
    heights = ROUGH * 5.9 / np.ptp(ROUGH)
    prepared = prepare(make_raw(heights), height_range=5.9)
    assert np.ptp(prepared.heights) > 1.0


def test_hint_for_a_file_with_units_is_a_height_range() -> None:
    """A file with units accepts no unit, so the message suggests a height range."""
    heights = ROUGH * 0.02 / np.ptp(ROUGH)
    with pytest.raises(ParameterError, match="in um: a height range of 20 nm"):
        check_plausible(make_raw(ROUGH, has_units=True), heights, (1e-6, 1e-6))


@pytest.mark.parametrize("factor", [1e3, 1e6, 1e9])
def test_wrong_unit_of_a_rough_surface_is_refused(factor: float) -> None:
    prepare(make_raw(ROUGH))
    with pytest.raises(ParameterError, match="height_range"):
        prepare(make_raw(ROUGH * factor))


def test_profile_of_many_metres_without_a_unit_is_refused() -> None:
    """Slopes do not depend on the unit of a point list, so the span is checked instead."""
    far = RawSurface(np.linspace(0.0, 15.0, 50), (1.0,), "part.txt", (), has_units=False)
    with pytest.raises(ParameterError, match=r"span 15 m look not to be in metres.*unit='mm'"):
        prepare(far, pitch=1.0)
    prepare(RawSurface(far.heights, (1.0,), "part.txt", (), has_units=True), pitch=1.0)


def test_mean_slope_overflow_is_refused() -> None:
    heights = np.resize([0.0, 1.5e308], 40)
    with pytest.raises(ParameterError, match="mean slope of inf"):
        check_plausible(make_raw(heights), heights, (1e-6,))


def test_limit_applies_to_the_mean_slope_of_the_steeper_axis() -> None:
    saw = np.resize([0.0, 1.0], (6, 8)) * 1e-6 * MAX_MEAN_SLOPE
    for heights in (saw, saw.T):
        check_plausible(make_raw(heights), heights, (1.001e-6, 1.001e-6))
        with pytest.raises(ParameterError, match="mean slope of 10"):
            check_plausible(make_raw(heights), heights, (0.999e-6, 0.999e-6))
    assert math.degrees(math.atan(MAX_MEAN_SLOPE)) == pytest.approx(84.3, abs=0.05)


def test_mean_slope_ignores_missing_points() -> None:
    assert mean_slope(np.full((4, 4), np.nan), (1.0, 1.0)) == 0.0
    assert mean_slope(np.ones(5), (1.0,)) == 0.0
    assert mean_slope(np.array([0.0, np.nan, 2.0, 3.0]), (1.0,)) == 1.0


def test_mean_slope_of_a_long_map() -> None:
    heights = np.tile([0.0, 3.0], (5000, 2))
    assert mean_slope(heights, (1.0, 1.0)) == 3.0


@needs_data
@pytest.mark.parametrize("name", ["sample-land.x3p", "testing.x3p", "dektak-1.csv", "frt-2.frt"])
def test_real_surfaces_are_far_from_the_limit(name: str) -> None:
    """Real slopes are far below the limit; heights in a wrong unit are above it."""
    if name.endswith(".frt"):
        pytest.importorskip("SurfaceTopography", reason="the extra 'formats' is not installed")
    surface = read_surface(DATA / name)
    assert surface.pitch is not None
    slope = mean_slope(surface.heights, surface.pitch)
    assert 1e-4 < slope < MAX_MEAN_SLOPE / 30
    check_plausible(surface, surface.heights, surface.pitch)
    with pytest.raises(ParameterError, match="height_range"):
        check_plausible(surface, surface.heights * 1e6, surface.pitch)
