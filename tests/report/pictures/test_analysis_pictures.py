"""The pictures of an analysis and their data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.analysis.results.analyze import Analysis, analyze
from asperity.core.errors import ParameterError
from asperity.devices import parse_device
from asperity.report import plot
from asperity.report.pictures.analysis_pictures import available_pictures
from asperity.report.pictures.analysis_windows import (
    gain_window,
    loop_window,
    project_on_window,
    top_view,
    witness_profile,
    working_depth,
)
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid, Texture

WAVE = Sinusoid(amplitude=0.2e-3, period=1e-3, phase=0.3)
HILLS = Fourier([4e-5, 3e-5], [[6e3, 1e3], [-2e3, 5e3]])
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "max_stiffness": "3 N/mm"}


def analysis(law: str, texture: Texture = WAVE, **arguments: float) -> Analysis:
    return analyze(Surface(texture, law, **arguments), parse_device(RIG, "rig"))


@pytest.fixture(scope="module")
def groove() -> Analysis:
    return analysis("A", stiffness=700.0, max_depth=0.3e-3)


@pytest.fixture(scope="module")
def god_object() -> Analysis:
    return analysis("D")


@pytest.fixture(scope="module")
def hills() -> Analysis:
    return analysis("A", HILLS, max_depth=0.1e-3)


def test_every_picture_can_be_plotted_alone(
    groove: Analysis, god_object: Analysis, hills: Analysis, tmp_path: Path
) -> None:
    expected = {
        "groove": (groove, ["field", "gain", "depth"]),
        "god": (god_object, ["field", "gain", "depth"]),
        "hills": (hills, ["field", "gain", "top", "depth"]),
    }
    for tag, (result, names) in expected.items():
        assert list(available_pictures(result)) == names
        for name in names:
            figure = plot(result, picture=name)
            labels = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
            assert any("[" in label for label in labels)
            path = tmp_path / f"{tag}-{name}.png"
            figure.savefig(path)
            assert path.stat().st_size > 3000
        plot(result).savefig(tmp_path / f"{tag}.svg")
    with pytest.raises(ParameterError, match="one of field, gain, depth"):
        plot(groove, picture="top")


def test_worst_loop_is_drawn_at_its_vertices(groove: Analysis) -> None:
    """The line in the picture is the polygon of the leak, inside the axes."""
    axes = plot(groove, "field").axes[0]
    vertices, window = groove.leak.vertices, loop_window(groove)
    polygons = [line for line in axes.lines if len(line.get_xdata()) == len(vertices) + 1]
    assert len(polygons) == 1
    x, z = (np.asarray(values)[:-1] * 1e-3 for values in polygons[0].get_data())
    start = window.segment.xy(np.zeros(1))[0]
    np.testing.assert_allclose(start[0] + x, vertices[:, 0], atol=1e-12)
    np.testing.assert_allclose(z, vertices[:, 2], atol=1e-12)
    left, right = (1e-3 * edge for edge in axes.get_xlim())
    low, high = (1e-3 * edge for edge in axes.get_ylim())
    assert left <= x.min()
    assert x.max() <= right
    assert low <= z.min()
    assert z.max() <= high


def test_picture_of_a_conservative_field_has_no_loop() -> None:
    axes = plot(analysis("C"), "field").axes[0]
    assert axes.get_title(loc="left") == "conservative: no loop gains energy"
    (image,) = axes.images
    assert float(np.abs(image.get_array()).max()) < 1e-6


def test_pixels_show_the_curl_where_it_is() -> None:
    """Pixels are close to the exact curl at their places; mirrored ones are not."""
    result = analysis("B")
    axes, window = plot(result, "field").axes[0], loop_window(result)
    pixels = np.ma.filled(axes.images[0].get_array(), np.nan)
    rows, columns = pixels.shape
    along = (np.arange(columns) + 0.5) / columns * window.segment.length
    z = window.bottom + (np.arange(rows) + 0.5) / rows * (window.top - window.bottom)
    xy = window.segment.xy(along)
    points = np.column_stack([np.tile(xy, (rows, 1)), np.repeat(z, columns)])
    above = (points[:, 2] - result.surface.texture.height(points[:, :2])).reshape(rows, columns)
    J, direction = result.surface.jacobian(points), window.segment.line.direction
    exact = (J[:, :2, 2] @ direction - J[:, 2, :2] @ direction).reshape(rows, columns)
    inside, pixel = above < 0.0, z[1] - z[0]
    assert np.isfinite(pixels[inside]).all()
    assert np.isnan(pixels[above > 3.0 * pixel + np.abs(np.gradient(above, axis=1))]).all()
    scale = np.abs(exact[inside]).max()
    assert np.median(np.abs(pixels - exact)[inside]) < 0.01 * scale
    deep = above < -2.0 * pixel
    for mirrored in (pixels[::-1], pixels[:, ::-1]):
        assert np.nanmedian(np.abs(mirrored - exact)[deep]) > 0.1 * scale


@pytest.mark.parametrize("law", ["A", "B", "C", "G"])
def test_cross_marks_the_witness_of_q(law: str) -> None:
    result = analysis(law, max_depth=0.25e-3)
    axes = plot(result, "gain").axes[0]
    crosses = [line for line in axes.lines if line.get_marker() == "x"]
    window = gain_window(result)
    at = project_on_window(window, np.array(result.q.at))
    assert crosses
    assert at is not None
    x, z = (float(values[0]) * 1e-3 for values in crosses[-1].get_data())
    assert (x, z) == (pytest.approx(at[0], abs=1e-12), pytest.approx(at[1], abs=1e-12))
    # Moved by whole periods, the cross is still a point where the norm is q.
    point = np.array([*window.segment.xy(np.array([x]))[0], z])
    state = result.surface.jacobian([point])[0]
    gain = np.linalg.norm(state, 2) / result.surface.stiffness
    assert gain == pytest.approx(result.q.lower, rel=1e-6)
    assert working_depth(result.surface, point[None])[0] <= 0.25e-3 * (1 + 1e-9)


def test_working_depth_of_every_contact() -> None:
    texture = Sinusoid(1e-4, 1e-3)
    probe = np.array([[0.25e-3, 0.0, -0.3e-3], [0.75e-3, 0.0, 0.2e-3]])
    expected = {"G": [0.3e-3, -0.2e-3], "C": [0.4e-3, -0.3e-3]}
    for law, depth in expected.items():
        actual = working_depth(Surface(texture, law), probe)
        np.testing.assert_allclose(actual, depth, rtol=1e-12)
    nearest = working_depth(Surface(texture, "E"), probe)
    x = np.linspace(-1e-3, 2e-3, 300_001)
    for depth, point in zip(np.abs(nearest), probe, strict=True):
        distances = np.hypot(x - point[0], texture.height(np.column_stack([x, 0 * x])) - point[2])
        assert depth == pytest.approx(distances.min(), rel=1e-6)
    assert nearest[0] > 0.0 > nearest[1]


@pytest.mark.parametrize("law", ["A", "B", "C", "F", "G"])
def test_witness_profile_reaches_q_at_the_witness(law: str) -> None:
    result = analysis(law, max_depth=0.25e-3)
    column = witness_profile(result)
    at = np.interp(column.witness_depth, column.depth, column.values[:, 0])
    assert at == pytest.approx(result.q.lower, rel=1e-4)
    assert column.values[:, 0].max() <= result.q.upper * (1 + 1e-12)
    np.testing.assert_allclose(
        column.start + column.witness_depth * column.direction, result.q.at, atol=1e-12
    )


def test_witness_profile_of_law_d_matches_the_closed_form(god_object: Analysis) -> None:
    """Below the crest σ₁ = y/(1 - y), y = δ/onset, from y = 1/2 up to the onset."""
    column = witness_profile(god_object)
    y = column.depth / column.witness_depth
    part = (y > 0.55) & (y < 0.95)
    assert part.sum() > 20
    np.testing.assert_allclose(column.values[part, 0], y[part] / (1 - y[part]), rtol=1e-6)


def test_top_view_of_law_a_shows_the_slope(hills: Analysis) -> None:
    """‖J_A‖/k = √(1 + |∇h|²), whatever the depth."""
    view, gain = top_view(hills)
    rows, columns = gain.shape
    x = view.low[0] + (np.arange(columns) + 0.5) * view.size[0] / columns
    y = view.low[1] + (np.arange(rows) + 0.5) * view.size[1] / rows
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    slope = np.hypot(*HILLS.gradient(xy).T).reshape(rows, columns)
    np.testing.assert_allclose(gain, np.hypot(1.0, slope), rtol=1e-6)
    assert gain.max() <= hills.q.upper
