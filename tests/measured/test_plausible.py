"""Heights in a wrong unit are asked about; those of real surfaces, in their own unit, never are."""

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
GROUND = 1e-6 * RNG.normal(size=(30, 40)).cumsum(axis=1)  # 1 µm a step


def raw(heights: np.ndarray, *, has_units: bool = False) -> RawSurface:
    pitch = (2.5e-6, 4e-6)[: heights.ndim]
    return RawSurface(heights, pitch, "part.npy", (), has_units=has_units)


def test_a_relief_of_metres_at_a_pitch_of_micrometres_is_asked_about() -> None:
    heights = GROUND * 5.9 / np.ptp(GROUND)
    slope = mean_slope(heights, (2.5e-6, 4e-6))
    with pytest.raises(ParameterError) as caught:
        prepare(raw(heights))
    said = str(caught.value)
    assert said.startswith("height_range must be given: heights that span 5.9 m at a pitch of 2.5")
    assert f"mean slope of {slope:.3g}" in said
    assert "in um: unit='um' (--unit um)" in said
    assert "if they are right: height_range=5.9 (--height-range 5.9m)" in said


def test_it_is_so() -> None:
    heights = GROUND * 5.9 / np.ptp(GROUND)
    prepared = prepare(raw(heights), height_range=5.9)
    assert np.ptp(prepared.heights) > 1.0


def test_a_file_that_names_its_unit_is_scaled() -> None:
    """Where the file names a unit, --unit is refused: its height is what can be said."""
    heights = GROUND * 0.02 / np.ptp(GROUND)
    with pytest.raises(ParameterError, match=r"in um: height_range=2e-08 \(--height-range 0\.02um"):
        check_plausible(raw(GROUND, has_units=True), heights, (1e-6, 1e-6))


@pytest.mark.parametrize("wrong", [1e3, 1e6, 1e9])
def test_a_wrong_unit_is_noticed_on_rough_surfaces(wrong: float) -> None:
    prepare(raw(GROUND))
    with pytest.raises(ParameterError, match="height_range"):
        prepare(raw(GROUND * wrong))


def test_heights_of_many_metres_in_no_unit_are_asked_about() -> None:
    """A list of points whose unit is not known is steep in none."""
    far = RawSurface(np.linspace(0.0, 15.0, 50), (1.0,), "part.txt", (), has_units=False)
    with pytest.raises(ParameterError, match=r"span 15 m look not to be in metres.*--unit mm"):
        prepare(far)
    prepare(RawSurface(far.heights, (1.0,), "part.txt", (), has_units=True))


def test_heights_near_the_largest_float_are_steep() -> None:
    heights = np.resize([0.0, 1.5e308], 40)
    with pytest.raises(ParameterError, match="mean slope of inf"):
        check_plausible(raw(heights), heights, (1e-6,))


def test_the_limit_is_the_mean_slope_of_the_steeper_axis() -> None:
    saw = np.resize([0.0, 1.0], (6, 8)) * 1e-6 * MAX_MEAN_SLOPE
    for heights in (saw, saw.T):
        check_plausible(raw(heights), heights, (1.001e-6, 1.001e-6))
        with pytest.raises(ParameterError, match="mean slope of 10"):
            check_plausible(raw(heights), heights, (0.999e-6, 0.999e-6))
    assert math.degrees(math.atan(MAX_MEAN_SLOPE)) == pytest.approx(84.3, abs=0.05)


def test_missing_points_and_plains_have_no_slope() -> None:
    assert mean_slope(np.full((4, 4), np.nan), (1.0, 1.0)) == 0.0
    assert mean_slope(np.ones(5), (1.0,)) == 0.0
    assert mean_slope(np.array([0.0, np.nan, 2.0, 3.0]), (1.0,)) == 1.0


def test_long_maps_are_looked_at_line_by_line() -> None:
    heights = np.tile([0.0, 3.0], (5000, 2))
    assert mean_slope(heights, (1.0, 1.0)) == 3.0


@needs_data
@pytest.mark.parametrize("name", ["sample-land.x3p", "testing.x3p", "dektak-1.csv", "frt-2.frt"])
def test_real_surfaces_are_far_from_the_limit(name: str) -> None:
    """And a unit that is wrong a thousandfold would be noticed on the rough ones."""
    if name.endswith(".frt"):
        pytest.importorskip("SurfaceTopography", reason="the extra 'formats' is not installed")
    surface = read_surface(DATA / name)
    assert surface.pitch is not None
    slope = mean_slope(surface.heights, surface.pitch)
    assert 1e-4 < slope < MAX_MEAN_SLOPE / 30
    check_plausible(surface, surface.heights, surface.pitch)
    with pytest.raises(ParameterError, match="height_range"):
        check_plausible(surface, surface.heights * 1e6, surface.pitch)
