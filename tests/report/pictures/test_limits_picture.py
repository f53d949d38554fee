"""The picture of the six limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.analysis.results.check_limits import Limits, limits
from asperity.analysis.results.compare import compare
from asperity.devices import parse_device
from asperity.report.pictures.device_pictures import (
    hand_figure,
    limits_figure,
    shortest_wavelengths,
)
from asperity.textures import Fourier, HeightMap, Sinusoid

BENCH = {
    "max_stiffness": 2000.0,
    "position_resolution": 15e-6,
    "force_resolution": 2e-3,
    "bandwidth": 400.0,
    "update_rate": 1e4,
    "friction": 0.03,
}


@pytest.fixture(scope="module")
def result() -> Limits:
    texture = Fourier([5e-5, 2e-5], [2 * np.pi / 1e-3, 2 * np.pi / 0.2e-3])
    return limits(texture, parse_device(BENCH, "bench"), law="A", stiffness=1450.0)


def shortest_of(result: Limits) -> list[tuple[float, int, str]]:
    return shortest_wavelengths(
        result.device, result.speed, result.time_samples, result.position_samples
    )


def test_shortest_wavelengths_match_hand_calculation(result: Limits) -> None:
    """Limits are α v T, β δ and v/F₀; α δ is listed only where it differs from β δ."""
    assert [(number, round(least, 9)) for least, number, _words in shortest_of(result)] == [
        (1, 50e-6),
        (2, 75e-6),
        (6, 250e-6),
    ]
    other = limits(Sinusoid(5e-5, 1e-3), result.device, law="A", time_samples=8.0)
    assert [(number, round(least, 9)) for least, number, _words in shortest_of(other)] == [
        (2, 75e-6),
        (1, 80e-6),
        (3, 120e-6),
        (6, 250e-6),
    ]


def test_picture_shows_waves_forces_and_limits(result: Limits) -> None:
    upper, lower = limits_figure(result).axes
    assert lower.get_xlabel() == "wavelength [mm]"
    assert upper.get_ylabel() == "amplitude [µm]"
    assert lower.get_ylabel() in {"force [N]", "force [mN]"}
    for axes, values in ((upper, [50.0, 20.0]), (lower, [wave.force for wave in result.waves])):
        scale = 1e3 if axes.get_ylabel() == "force [mN]" else 1.0
        points = {
            (round(float(x), 9), round(float(y), 9))
            for line in axes.lines
            if line.get_marker() == "o"
            for x, y in zip(*line.get_data(), strict=True)
        }
        expected = zip([1.0, 0.2], values, strict=True)
        assert points == {(x, round(y * scale, 9)) for x, y in expected}
    dashed = {
        round(float(line.get_xdata()[0]), 9) for line in upper.lines if line.get_linestyle() == "--"
    }
    assert dashed == {0.05, 0.075, 0.25}
    words = " ".join(text.get_text() for text in lower.texts)
    assert "4: 5 steps of force, 10 mN" in words
    (felt,) = (line for line in lower.lines if str(line.get_label()).startswith("felt above"))
    lengths, needed = (np.asarray(values) for values in felt.get_data())
    frequency = result.speed / (1e-3 * lengths)
    expected = result.grip.threshold(frequency)[1] / result.grip.compliance(
        frequency, 0.1, 0.0, 1450.0
    )
    # Felt is drawn where there are thresholds alone.
    known = result.grip.is_known(frequency)
    assert 0 < known.sum() < len(known)
    expected[~known] = np.nan
    np.testing.assert_allclose(needed, expected * 1e3, rtol=1e-9)  # [mN]


def test_waves_that_meet_every_limit_have_filled_markers(result: Limits) -> None:
    marks = [line for line in limits_figure(result).axes[0].lines if line.get_marker() == "o"]
    filled = [line for line in marks if line.get_markerfacecolor() == line.get_markeredgecolor()]
    open_marks = [line for line in marks if line not in filled]
    assert [list(line.get_xdata()) for line in filled] == [[1.0]]
    assert [list(np.round(line.get_xdata(), 9)) for line in open_marks] == [[0.2]]


def test_pictures_for_missing_device_data_and_flat_surfaces() -> None:
    unknown = limits(Sinusoid(5e-5, 1e-3), parse_device({}, "none"), law="A")
    words = " ".join(text.get_text() for text in limits_figure(unknown).axes[1].texts)
    assert "steps of force" not in words
    flat = limits(HeightMap(np.full((6, 6), 1e-3), 1e-4), parse_device(BENCH, "bench"), law="A")
    assert "flat" in " ".join(text.get_text() for text in limits_figure(flat).axes[0].texts)


@pytest.mark.parametrize("law", ["W", "D", "G"])
def test_force_axis_of_other_laws_is_positive(law: str) -> None:
    """Law W renders no texture force, and a logarithmic axis cannot show zero."""
    figure = limits_figure(limits(Sinusoid(5e-5, 1e-3), parse_device(BENCH, "bench"), law=law))
    figure.canvas.draw()
    low, high = figure.axes[1].get_ylim()
    assert 0.0 < low < high


def test_picture_of_the_hand_shows_the_waves_of_the_best_law() -> None:
    comparison = compare(Sinusoid(1e-6, 1e-3), "touch", "CH")
    (axes,) = hand_figure(comparison).axes
    row = comparison.recommended_row or comparison.nearest_row
    assert row is not None
    assert row.perceptibility is not None
    lines = {str(line.get_label()): line.get_data() for line in axes.lines}
    x, y = lines[f"law {row.law.letter}, {row.tier}"]
    assert list(x) == pytest.approx([100.0])
    assert list(y) == pytest.approx([1e6 * row.perceptibility.hand_motion])
    for label, threshold in zip(
        ("nobody notices below", "felt above"), comparison.grip.threshold(50.0), strict=True
    ):
        x, y = lines[label]
        assert np.interp(np.log(50.0), np.log(x), np.log(y)) == pytest.approx(
            math.log(1e6 * threshold), abs=1e-3
        )
    none = compare(Sinusoid(1e-6, 1e-3), "touch", "W")
    assert "no texture" in hand_figure(none).axes[0].texts[-1].get_text()
