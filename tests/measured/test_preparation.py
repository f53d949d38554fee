"""Fill, level, filter and magnify, each against an independent computation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from asperity.core.errors import ParameterError
from asperity.measured.defects import fill_in_place
from asperity.measured.filters import ALPHA, gaussian_filter
from asperity.measured.preparation import magnify_surface, prepare
from asperity.measured.prepared import PreparedSurface
from asperity.measured.reading import RawSurface
from asperity.textures import load_texture

P = 1e-6
DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)


def surface(heights: NDArray[np.float64], **changes: Any) -> RawSurface:
    pitch = (P,) if heights.ndim == 1 else (P, 2 * P)
    fields: dict[str, Any] = {"pitch": pitch, "source": "test", "notes": ()}
    return RawSurface(heights, **(fields | changes))


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


# --- steps ---------------------------------------------------------------------------------------


def test_step_states_the_number_of_missing_points() -> None:
    heights = bumpy(20, 30)
    heights.ravel()[[33, 34, 70, 71, 72, 73, 74, 200, 300, 400, 500, 501]] = np.nan
    result = prepare(surface(heights))
    steps = result.steps
    assert (
        steps[1]
        == "filled 12 missing points of 600 (2 %) by harmonic interpolation on the fitted tilt"
    )
    assert prepare(surface(bumpy())).steps[1] == "no missing points"


def test_steps_are_in_the_order_of_the_rows() -> None:
    heights = bumpy(20, 30)
    heights[4:6, 4:6] = np.nan
    result = prepare(surface(heights), magnify=2.0, on_stage=lambda *_stage: None)
    assert [step.split()[0].rstrip(":") for step in result.steps] == [
        "levelled",
        "filled",
        "filtered",
        "magnified",
    ]
    names = [stage.name.split()[0] for stage in result.history]
    assert names == ["as", "levelled", "holes", "S-filter", "magnified"]


# --- levelling -------------------------------------------------------------------------------


def test_levelling_removes_a_plane_and_states_its_slopes() -> None:
    prepared = prepare(surface(plane(30, 40)))
    assert np.max(np.abs(prepared.heights)) < 1e-14 * 3e-6 * 1e3
    assert "least-squares plane, slopes 0.02 and -0.005" in prepared.steps[0]


def test_levelling_fits_the_valid_points_only() -> None:
    heights = bumpy()
    heights[5:25, 3:20] = np.nan
    valid = ~np.isnan(heights)
    y, x = np.nonzero(valid)
    basis = np.column_stack([np.ones(x.size), x, y])
    fit, *_ = np.linalg.lstsq(basis, heights[valid], rcond=None)
    rows, columns = np.indices(heights.shape)
    flat = heights.copy()
    fill_in_place(flat, (P, 2 * P))
    flat -= fit[0] + fit[1] * columns + fit[2] * rows
    expected = gaussian_filter(flat, (P, 2 * P), 8 * P)
    filtered = prepare(surface(heights), s_cutoff=8 * P).heights
    np.testing.assert_allclose(filtered, expected, atol=1e-17)


@pytest.mark.parametrize("form", [1, 2])
def test_hole_at_the_border_continues_the_form(form: int) -> None:
    """Filling before removing the form would leave a hill in the hole, as high as the form."""
    y, x = np.mgrid[:50, :60] * 1.0
    shape = 0.02 * P * x + (form - 1) * 1e-2 * P * ((x - 30) ** 2 + y**2)
    wave = 1e-3 * P * np.cos(np.pi * x / 5)
    heights = shape + wave
    heights[:, 50:] = np.nan
    prepared = prepare(surface(heights), form=form, s_cutoff=4 * P)
    assert np.max(np.abs(prepared.heights)) < 3e-3 * P
    assert np.ptp(shape) > 1.0 * P
    assert prepared.filled_mask is not None
    np.testing.assert_array_equal(prepared.filled_mask, np.isnan(heights))


def test_levelling_of_a_profile() -> None:
    x = np.arange(50.0)
    prepared = prepare(surface(1e-6 + 0.3 * P * x))
    assert np.max(np.abs(prepared.heights)) < 1e-18
    assert prepared.steps[0] == "levelled: subtracted the least-squares line, slope 0.3"


# --- filtering -------------------------------------------------------------------------------


@pytest.mark.parametrize("cutoff", [2.0, 3.7, 11.0, 40.0])
@pytest.mark.parametrize("waves", [1, 5, 17, 40])
def test_filter_transmission_for_a_profile(cutoff: float, waves: int) -> None:
    n, step = 81, 0.5
    wave = np.cos(np.pi * waves * np.arange(n) / (n - 1))  # crests or troughs at the border
    length = 2 * (n - 1) * step / waves
    expected = np.exp(-np.pi * (ALPHA * cutoff / length) ** 2)
    filtered = gaussian_filter(wave, (step,), cutoff)
    np.testing.assert_allclose(filtered, expected * wave, atol=1e-12)


def test_transmission_at_the_cutoff_is_one_half() -> None:
    assert pytest.approx(0.4697, abs=5e-5) == ALPHA
    wave = np.cos(2 * np.pi * np.arange(101) / 10)
    np.testing.assert_allclose(gaussian_filter(wave, (P,), 10 * P), wave / 2, atol=1e-12)


def test_transmission_of_a_map_with_unequal_pitch() -> None:
    ny, nx, px, py, cutoff = 41, 61, 1e-6, 3e-6, 9e-6
    y, x = np.mgrid[:ny, :nx]
    kx, ky = 13 / (2 * (nx - 1) * px), 4 / (2 * (ny - 1) * py)  # waves per metre
    wave = np.cos(2 * np.pi * kx * px * x) * np.cos(2 * np.pi * ky * py * y)
    expected = np.exp(-np.pi * (ALPHA * cutoff) ** 2 * (kx**2 + ky**2))
    np.testing.assert_allclose(gaussian_filter(wave, (px, py), cutoff), expected * wave, atol=1e-12)


def test_filter_equals_convolution_with_the_standard_weights() -> None:
    """Convolve with the sampled weighting function, mirrored at the border nodes."""
    rng = np.random.default_rng(3)
    heights = rng.standard_normal(200)
    cutoff, reach = 12.0, 60
    x = np.arange(-reach, reach + 1.0)
    weights = np.exp(-np.pi * (x / (ALPHA * cutoff)) ** 2) / (ALPHA * cutoff)
    assert weights.sum() == pytest.approx(1.0, abs=1e-9)
    expected = np.convolve(np.pad(heights, reach, mode="reflect"), weights, mode="valid")
    np.testing.assert_allclose(gaussian_filter(heights, (1.0,), cutoff), expected, atol=1e-9)
    half_sample = np.convolve(np.pad(heights, reach, mode="symmetric"), weights, mode="valid")
    assert np.max(np.abs(half_sample - expected)) > 1e-3  # negative control: another border differs


def test_default_cutoff_is_stated() -> None:
    prepared = prepare(surface(bumpy()))
    assert prepared.steps[2] == (
        "filtered: Gaussian ISO 16610-61, cut-off 8 µm (chosen from the sampling: 4 samples)"
    )
    same = prepare(surface(bumpy()), s_cutoff=8e-6)
    np.testing.assert_array_equal(prepared.heights, same.heights)
    assert same.steps[2] == "filtered: Gaussian ISO 16610-61, cut-off 8 µm"
    smallest = prepare(surface(bumpy(4, 4), pitch=(P, P)))
    assert "3 samples" in smallest.steps[2]


# --- magnifying, pitch and heights -----------------------------------------------------------


def test_magnification() -> None:
    plain = prepare(surface(bumpy()))
    large = prepare(surface(bumpy()), magnify=20)
    np.testing.assert_allclose(large.heights, 20 * plain.heights, rtol=1e-14)
    assert large.pitch == pytest.approx((20 * P, 40 * P), rel=1e-14)
    assert large.steps[-1] == "magnified 20 times laterally and in height"
    tall = prepare(surface(bumpy()), magnify=20, magnify_height=5)
    np.testing.assert_allclose(tall.heights, 5 * plain.heights, rtol=1e-14)
    assert tall.pitch == large.pitch
    assert tall.steps[-1] == "magnified 20 times laterally and 5 times in height"


def test_missing_pitch_is_required_and_file_pitch_can_be_replaced() -> None:
    with pytest.raises(ParameterError, match="pitch must be given"):
        prepare(surface(bumpy(), pitch=None))
    with_pitch = prepare(surface(bumpy(), pitch=None), pitch=3e-6)
    assert with_pitch.pitch == (3e-6, 3e-6)
    assert with_pitch.steps[0] == "pitch 3 µm as given"
    replaced = prepare(surface(bumpy()), pitch=(3e-6, 4e-6))
    assert replaced.pitch == (3e-6, 4e-6)
    assert replaced.steps[0] == "pitch 3 µm x 4 µm as given instead of the file's 1 µm x 2 µm"
    assert prepare(surface(bumpy()[0]), pitch=[2e-6]).pitch == (2e-6,)


def test_one_message_names_all_that_an_image_lacks() -> None:
    """With values that can be pasted; what was given is not asked for again."""
    raw = replace(surface(bumpy(), pitch=None), relative=True, has_units=False)
    match = r"pitch and height_range must be given: .* such as pitch=5e-05 height_range=0.0002$"
    with pytest.raises(ParameterError, match=match):
        prepare(raw)
    with pytest.raises(ParameterError, match=r"pitch must be given: .* add pitch=5e-05$"):
        prepare(raw, height_range=1e-4)
    with pytest.raises(ParameterError, match=r"height_range is required: .* height_range=0.0002$"):
        prepare(raw, pitch=1e-5)
    text = replace(raw, lacks_unit=True)
    with pytest.raises(ParameterError, match=r"pitch and unit must be given: .*unit='um'$"):
        prepare(text)


def test_height_range_scales_relative_heights() -> None:
    counts = np.round(bumpy() * 1e8) + 100.0
    counts[4, 4] = np.nan
    raw = surface(counts, has_units=False, notes=("counts",))
    with pytest.raises(ParameterError, match="height_range must be given"):
        prepare(raw)
    scaled = prepare(raw, height_range=5e-6)
    low, high = np.nanmin(counts), np.nanmax(counts)
    same = prepare(surface((counts - low) / (high - low) * 5e-6))
    np.testing.assert_allclose(scaled.heights, same.heights, atol=1e-12 * 5e-6)
    assert scaled.steps[0] == "counts"
    assert scaled.steps[1].endswith("to 5 µm peak to valley")


def test_flat_surface_is_accepted_without_a_height_range() -> None:
    prepared = prepare(surface(np.full((5, 6), 2e-6)))
    np.testing.assert_allclose(prepared.heights, 0, atol=1e-20)
    with pytest.raises(ParameterError, match=r"height_range .* flat"):
        prepare(surface(np.full((5, 6), 2e-6)), height_range=1e-6)


def test_input_is_not_changed() -> None:
    heights = with_holes(bumpy())
    before = heights.copy()
    prepare(surface(heights), magnify=3, height_range=1e-6)
    np.testing.assert_array_equal(heights, before)


# --- refusals --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"magnify": 0.0}, "magnify must be positive"),
        ({"magnify": -2.0}, "magnify must be positive"),
        ({"magnify": np.nan}, "magnify must be finite"),
        ({"magnify_height": np.inf}, "magnify_height must be finite"),
        ({"s_cutoff": 0.0}, "s_cutoff must be positive"),
        ({"s_cutoff": np.nan}, "s_cutoff must be finite"),
        ({"s_cutoff": 3.9e-6}, "s_cutoff must be at least two samples, 4 µm"),
        ({"s_cutoff": 1e-4}, "s_cutoff must be at most the surface's length, 78 µm"),
        ({"pitch": 0.0}, "pitch must be positive"),
        ({"pitch": (1e-6, np.nan)}, "pitch must be finite"),
        ({"pitch": (1e-6, 1e-6, 1e-6)}, "pitch must be one number or"),
        ({"height_range": -1.0}, "height_range must be positive"),
    ],
)
def test_invalid_arguments_are_refused(arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(ParameterError, match=match) as caught:
        prepare(surface(bumpy()), **arguments)
    assert caught.value.argument == next(iter(arguments))


def test_magnification_that_overflows_is_refused() -> None:
    with pytest.raises(ParameterError, match="magnify makes the surface too large"):
        magnify_surface(PreparedSurface(np.full((4, 4), 1e300), (1.0, 1.0), ()), 1e10)


def test_limits_of_the_cutoff_are_accepted() -> None:
    prepare(surface(bumpy()), s_cutoff=4e-6)
    prepare(surface(bumpy()), s_cutoff=78e-6)


@pytest.mark.parametrize(
    ("heights", "match"),
    [
        (np.zeros((1, 30)), "smallest accepted map is 4 x 4, got 1 x 30"),
        (np.zeros((30, 3)), "got 30 x 3"),
        (np.zeros(3), "at least 4 points, got 3"),
        (np.full((5, 5), np.nan), "all heights are missing"),
        (np.where(np.arange(400).reshape(20, 20) < 101, np.nan, 1.0), "misses 25.2 %"),
        (np.array([0, 1, np.inf, 3, 4]), "infinite heights"),
        (np.array([0, 1e308, -1e308, 3, 4]), "too large"),
    ],
)
def test_invalid_surfaces_are_refused(heights: NDArray[np.float64], match: str) -> None:
    with pytest.raises(ParameterError, match=match):
        prepare(surface(heights))


def test_a_quarter_missing_is_accepted() -> None:
    heights = bumpy(20, 20)
    heights.ravel()[:100] = np.nan
    assert np.isfinite(prepare(surface(heights)).heights).all()


def test_more_than_a_quarter_missing_needs_max_missing() -> None:
    heights = bumpy(20, 20)
    heights.ravel()[:109] = np.nan
    with pytest.raises(ParameterError, match=r"misses 27.3 % .* a quarter .* max_missing=0.28"):
        prepare(surface(heights))
    with pytest.raises(ParameterError, match=r"misses 27.3 % .* at most 27.0 % can be filled"):
        prepare(surface(heights), max_missing=0.27)
    prepared = prepare(surface(heights), max_missing=0.28)
    assert prepared.filled_mask is not None
    assert prepared.filled_mask.sum() == 109
    for wrong in (0.0, 1.0, -0.1, 28.0, np.nan, "0.3"):
        with pytest.raises(ParameterError, match="max_missing must lie between 0 and 1"):
            prepare(surface(heights), max_missing=wrong)  # partly of wrong type


@needs_data
@pytest.mark.parametrize(
    ("name", "shape", "max_missing"),
    [
        ("sample-land.x3p", (256, 918), None),
        ("testing.x3p", (20, 30), None),
        ("dektak-1.csv", (9600,), None),
        ("frt-2.frt", (300, 150), 0.28),
    ],
)
def test_real_surfaces_are_prepared(
    name: str, shape: tuple[int, ...], max_missing: float | None
) -> None:
    if name.endswith("frt"):
        pytest.importorskip("SurfaceTopography", reason="the extra 'formats' is not installed")
    texture = load_texture(DATA / name, max_missing=max_missing, outliers=10.0, form=2)
    assert texture.heights.shape == shape
    assert np.isfinite(texture.heights).all()
    if max_missing is not None:
        with pytest.raises(ParameterError, match=r"misses 27.4 % .* max_missing=0.28"):
            load_texture(DATA / name)
