"""The table, the pictures and the page of an analysis."""

from __future__ import annotations

import io
import math
import random
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from rich.console import Console

from asperity.analysis.analyze import Analysis, analyze
from asperity.analysis.bounds.bound import Bound
from asperity.devices import Device, parse_device
from asperity.errors import ParameterError
from asperity.report import html_text, plot, print_analysis
from asperity.report.analysis_html import analysis_html
from asperity.report.pictures.analysis_pictures import analysis_figure, pictures_of
from asperity.report.pictures.analysis_region import (
    gain_window,
    in_window,
    loop_window,
    top_view,
    witness_column,
    working_depth,
)
from asperity.report.words.analysis_words import down_text, interval_text, span_text, up_text
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid, Texture

WAVE = Sinusoid(amplitude=0.2e-3, period=1e-3, phase=0.3)
HILLS = Fourier([4e-5, 3e-5], [[6e3, 1e3], [-2e3, 5e3]])
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "max_stiffness": "3 N/mm"}


@pytest.fixture(scope="module")
def rig() -> Device:
    return parse_device(RIG, "rig")


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


@pytest.fixture(scope="module")
def page(groove: Analysis) -> str:
    return analysis_html(groove)


class _Reader(HTMLParser):
    """Collects what the tests look at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loaded: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loaded += [str(value) for name, value in attrs if name in {"src", "href"}]


def test_bounds_are_rounded_outwards() -> None:
    rng = random.Random(5)
    for _ in range(2000):
        value = 10.0 ** rng.uniform(-4.0, 6.0)
        low, high = float(down_text(value)), float(up_text(value))
        assert low <= value <= high
        assert high - low <= 1.1e-5 * value
    assert down_text(2.0 - 1e-15) == up_text(2.0 + 1e-15) == "2"
    assert down_text(2.0 - 1e-9) == "1.99999"
    assert up_text(2.0 + 1e-9) == "2.00001"
    assert (down_text(1000.0), up_text(120000.0), down_text(0.0)) == ("1000", "120000", "0")


def test_intervals_as_words() -> None:
    assert interval_text(Bound(math.inf, math.inf, "closed form")) == "∞"
    assert interval_text(Bound(1.0, 2.0, "certified")) == "1 to 2"
    assert span_text(0.0, math.inf, "J") == "0 J"
    assert span_text(2e-6, math.inf, "J") == "at least 2 µJ"
    assert span_text(0.0, 3e-9, "J") == "0 to 3 nJ"


def test_every_picture_can_be_had_alone(
    groove: Analysis, god_object: Analysis, hills: Analysis, tmp_path: Path
) -> None:
    expected = {
        "groove": (groove, ["field", "gain", "depth"]),
        "god": (god_object, ["field", "gain", "depth", "jumps"]),
        "hills": (hills, ["field", "gain", "top", "depth"]),
    }
    for tag, (result, names) in expected.items():
        assert list(pictures_of(result)) == names
        for name in names:
            figure = plot(result, picture=name)
            labels = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
            assert any("[" in label for label in labels)
            path = tmp_path / f"{tag}-{name}.png"
            figure.savefig(path)
            assert path.stat().st_size > 3000
        plot(result).savefig(tmp_path / f"{tag}.svg")
    with pytest.raises(ParameterError, match="one of field, gain, depth"):
        plot(groove, picture="jumps")


def test_the_worst_loop_is_drawn_where_it_is(groove: Analysis) -> None:
    """The drawn line is the polygon: its area times curl is its energy, for a field like A's."""
    axes = analysis_figure(groove, "field").axes[0]
    vertices, window = groove.leak.vertices, loop_window(groove)
    drawn = [line for line in axes.lines if len(line.get_xdata()) == len(vertices) + 1]
    assert len(drawn) == 1
    x, z = (np.asarray(values)[:-1] * 1e-3 for values in drawn[0].get_data())
    start = window.stretch.xy(np.zeros(1))[0]
    np.testing.assert_allclose(start[0] + x, vertices[:, 0], atol=1e-12)
    np.testing.assert_allclose(z, vertices[:, 2], atol=1e-12)
    left, right = (1e-3 * edge for edge in axes.get_xlim())
    low, high = (1e-3 * edge for edge in axes.get_ylim())
    assert left <= x.min()
    assert x.max() <= right
    assert low <= z.min()
    assert z.max() <= high


def test_a_conservative_field_has_no_loop_in_its_picture() -> None:
    axes = analysis_figure(analysis("C"), "field").axes[0]
    assert axes.get_title(loc="left") == "conservative: no loop gains"
    mesh = next(item for item in axes.collections if isinstance(item, QuadMesh))
    assert float(np.abs(mesh.get_array()).max()) < 1e-6


@pytest.mark.parametrize("law", ["A", "B", "C", "G"])
def test_the_cross_is_on_the_witness_and_nothing_is_above_q(law: str) -> None:
    result = analysis(law, max_depth=0.25e-3)
    axes = analysis_figure(result, "gain").axes[0]
    crosses = [line for line in axes.lines if line.get_marker() == "x"]
    window = gain_window(result)
    at = in_window(window, np.array(result.q.at))
    assert crosses
    assert at is not None
    x, z = (float(values[0]) * 1e-3 for values in crosses[-1].get_data())
    assert (x, z) == (pytest.approx(at[0], abs=1e-12), pytest.approx(at[1], abs=1e-12))
    # Moved by whole periods, the cross is still a point where the norm is q.
    point = np.array([*window.stretch.xy(np.array([x]))[0], z])
    state = result.surface.jacobian([point])[0]
    gain = np.linalg.norm(state, 2) / result.surface.stiffness
    assert gain == pytest.approx(result.q.lower, rel=1e-6)
    assert working_depth(result.surface, point[None])[0] <= 0.25e-3 * (1 + 1e-9)


def test_the_working_depth_of_every_contact() -> None:
    texture = Sinusoid(1e-4, 1e-3)
    probe = np.array([[0.25e-3, 0.0, -0.3e-3], [0.75e-3, 0.0, 0.2e-3]])
    expected = {"G": [0.3e-3, -0.2e-3], "C": [0.4e-3, -0.3e-3]}
    for law, depth in expected.items():
        found = working_depth(Surface(texture, law), probe)
        np.testing.assert_allclose(found, depth, rtol=1e-12)
    nearest = working_depth(Surface(texture, "E"), probe)
    x = np.linspace(-1e-3, 2e-3, 300_001)
    for depth, point in zip(np.abs(nearest), probe, strict=True):
        distances = np.hypot(x - point[0], texture.height(np.column_stack([x, 0 * x])) - point[2])
        assert depth == pytest.approx(distances.min(), rel=1e-6)
    assert nearest[0] > 0.0 > nearest[1]


@pytest.mark.parametrize("law", ["A", "B", "C", "F", "G"])
def test_the_column_reaches_q_at_the_witness(law: str) -> None:
    result = analysis(law, max_depth=0.25e-3)
    column = witness_column(result)
    at = np.interp(column.witness, column.depth, column.values[:, 0])
    assert at == pytest.approx(result.q.lower, rel=1e-4)
    assert column.values[:, 0].max() <= result.q.upper * (1 + 1e-12)
    np.testing.assert_allclose(
        column.place + column.witness * column.below, result.q.at, atol=1e-12
    )


def test_the_column_of_d_grows_as_the_paper_of_the_medial_axis_says(god_object: Analysis) -> None:
    """Below the crest σ₁ = y/(1 - y), y = δ/onset, from y = 1/2 up to the onset."""
    column = witness_column(god_object)
    y = column.depth / column.witness
    part = (y > 0.55) & (y < 0.95)
    assert part.sum() > 20
    np.testing.assert_allclose(column.values[part, 0], y[part] / (1 - y[part]), rtol=1e-6)


def test_from_above_a_is_its_slope(hills: Analysis) -> None:
    """‖J_A‖/k = √(1 + |∇h|²), whatever the depth."""
    view = top_view(hills)
    rows, columns = view.gain.shape
    x = view.low[0] + (np.arange(columns) + 0.5) * view.size[0] / columns
    y = view.low[1] + (np.arange(rows) + 0.5) * view.size[1] / rows
    xy = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    slope = np.hypot(*HILLS.gradient(xy).T).reshape(rows, columns)
    np.testing.assert_allclose(view.gain, np.hypot(1.0, slope), rtol=1e-6)
    assert view.gain.max() <= hills.q.upper


def test_the_jumps_are_drawn(god_object: Analysis) -> None:
    axes = analysis_figure(god_object, "jumps").axes[0]
    depth, size = axes.lines[0].get_data()
    jumps = god_object.continuity.jumps
    unit = 1e3 if "mN" in axes.get_ylabel() else 1.0
    np.testing.assert_allclose(size, [unit * jump.size for jump in jumps], rtol=1e-12)
    np.testing.assert_allclose(depth, [1e3 * jump.depth for jump in jumps], rtol=1e-12)


def test_page_loads_nothing_and_has_every_section(page: str, groove: Analysis) -> None:
    reader = _Reader(page)
    assert len(reader.loaded) == 3
    assert all(source.startswith("data:image/") for source in reader.loaded)
    assert "script" not in reader.tags
    assert "url(" not in page
    assert "@import" not in page
    assert len(page) < 3_000_000
    text = page.replace("&#39;", "'").replace("&lt;", "<").replace("&gt;", ">")
    assert text.index(groove.answer) < text.index("<table")
    for sentence in (*groove.assumptions, *(c.assumptions for c in groove.passivity.criteria)):
        assert sentence in text
    for criterion in groove.passivity.criteria:
        assert criterion.formula in text
    assert "np.linalg.norm(s.jacobian(" in text
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page


def test_the_page_is_reproducible_and_the_same_by_either_name(groove: Analysis, page: str) -> None:
    assert html_text(groove) == page


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    device = parse_device({**RIG, "name": hostile}, "mine")
    result = analyze(Surface(WAVE, "W"), device)
    page = analysis_html(result, texture=f"asp.load_texture('{hostile}')")
    assert hostile not in page
    assert "script" not in _Reader(page).tags


@pytest.mark.parametrize("width", [80, 100])
def test_the_terminal_shows_verdict_numbers_and_assumptions(groove: Analysis, width: int) -> None:
    console = Console(width=width, file=io.StringIO(), force_terminal=False)
    print_analysis(groove, console)
    text = console.file.getvalue()  # type: ignore[attr-defined]  # a StringIO
    said = " ".join(text.split())
    assert said.startswith(groove.answer)
    for sentence in groove.assumptions:
        assert f"- {sentence}" in said
    assert groove.leak.description in said
    assert groove.continuity.reason in said
