"""The table, the picture and the page of the six limits."""

from __future__ import annotations

import io
from html.parser import HTMLParser

import numpy as np
import pytest
from rich.console import Console

from asperity.analysis.limits.device_limits import limits
from asperity.analysis.limits.limit_result import Limits
from asperity.devices import parse_device
from asperity.report.limits_html import limits_html
from asperity.report.limits_table import MOST_WAVES, print_limits, shown_waves
from asperity.report.pictures.limits_picture import limits_figure, shortest
from asperity.textures import Fourier, HeightMap, Sinusoid

BENCH = {
    "max_stiffness": 2000.0, "position_resolution": 15e-6, "force_resolution": 2e-3,
    "bandwidth": 400.0, "update_rate": 1e4, "friction": 0.03,
}  # fmt: skip
MANY = Fourier(np.geomspace(1e-5, 1e-6, 20), 2 * np.pi / np.geomspace(2e-3, 2e-4, 20))


@pytest.fixture(scope="module")
def result() -> Limits:
    texture = Fourier([5e-5, 2e-5], [2 * np.pi / 1e-3, 2 * np.pi / 0.2e-3])
    return limits(texture, parse_device(BENCH, "bench"), law="A")


class _Reader(HTMLParser):
    """Collects what the tests look at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loaded: list[str] = []
        self.cells: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loaded += [str(value) for name, value in attrs if name in {"src", "href"}]

    def handle_data(self, data: str) -> None:
        if self.tags and self.tags[-1] == "td" and data.strip():
            self.cells.append(data.strip())


def terminal(result: Limits, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), force_terminal=False)
    print_limits(result, console)
    return console.file.getvalue()  # type: ignore[attr-defined]  # a StringIO


@pytest.mark.parametrize("width", [80, 100, 120])
def test_the_answer_fits_the_terminal(result: Limits, width: int) -> None:
    text = terminal(result, width)
    assert max(len(line) for line in text.splitlines()) <= width
    assert "…" not in text
    assert " ".join(text.split()).startswith(result.answer)
    for sentence in result.assumptions:
        assert sentence.split()[0] in text


def test_waves_are_marked(result: Limits) -> None:
    lines = [line.split() for line in terminal(result, 100).splitlines()]
    long = next(words for words in lines if words[:2] == ["1", "mm"])
    short = next(words for words in lines if words[:2] == ["200", "µm"])
    assert long[-8:] == ["y", "y", "y", "y", "y", "below", "0.4", "m/s"]
    assert short[-8:] == ["y", "y", "y", "y", "n", "below", "0.08", "m/s"]


def test_a_long_list_of_waves_is_cut_and_that_is_said() -> None:
    result = limits(MANY, parse_device(BENCH, "bench"), law="A")
    shown = shown_waves(result)
    assert len(shown) == MOST_WAVES
    assert [wave.wavelength for wave in shown] == sorted(
        (wave.wavelength for wave in shown), reverse=True
    )
    least = min(wave.share for wave in shown)
    assert sum(wave.share > least for wave in result.waves) == MOST_WAVES - 1
    assert "and 4 more with less" in terminal(result, 100)
    assert "And 4 more with less" in limits_html(result)


def test_the_shortest_waves_by_hand(result: Limits) -> None:
    """α v T, β δ and v/F₀; α δ is drawn only where it differs."""
    assert [(number, round(least, 9)) for least, number, _words in shortest(result)] == [
        (1, 50e-6), (2, 75e-6), (6, 250e-6),
    ]  # fmt: skip
    other = limits(Sinusoid(5e-5, 1e-3), result.device, law="A", time_samples=8.0)
    assert [(number, round(least, 9)) for least, number, _words in shortest(other)] == [
        (2, 75e-6), (1, 80e-6), (3, 120e-6), (6, 250e-6),
    ]  # fmt: skip


def test_the_picture_shows_waves_forces_and_limits(result: Limits) -> None:
    upper, lower = limits_figure(result).axes
    assert lower.get_xlabel() == "wavelength [mm]"
    assert upper.get_ylabel() == "amplitude [µm]"
    assert lower.get_ylabel() in {"force [N]", "force [mN]"}
    for axes, values in ((upper, [50.0, 20.0]), (lower, [wave.force for wave in result.waves])):
        scale = 1e3 if axes.get_ylabel() == "force [mN]" else 1.0
        drawn = {
            (round(float(x), 9), round(float(y), 9))
            for line in axes.lines if line.get_marker() == "o"
            for x, y in zip(*line.get_data(), strict=True)
        }  # fmt: skip
        expected = zip([1.0, 0.2], values, strict=True)
        assert drawn == {(x, round(y * scale, 9)) for x, y in expected}
    dashed = {
        round(float(line.get_xdata()[0]), 9) for line in upper.lines if line.get_linestyle() == "--"
    }
    assert dashed == {0.05, 0.075, 0.25}
    words = " ".join(text.get_text() for text in lower.texts)
    assert "4: 5 steps of force, 10 mN" in words
    assert "dry friction of the device, 30 mN" in words


def test_waves_that_meet_every_limit_are_filled(result: Limits) -> None:
    marks = [line for line in limits_figure(result).axes[0].lines if line.get_marker() == "o"]
    filled = [line for line in marks if line.get_markerfacecolor() == line.get_markeredgecolor()]
    empty = [line for line in marks if line not in filled]
    assert [list(line.get_xdata()) for line in filled] == [[1.0]]
    assert [list(np.round(line.get_xdata(), 9)) for line in empty] == [[0.2]]


def test_pictures_of_what_is_not_known_and_of_what_is_flat() -> None:
    unknown = limits(Sinusoid(5e-5, 1e-3), parse_device({}, "none"), law="A")
    words = " ".join(text.get_text() for text in limits_figure(unknown).axes[1].texts)
    assert "not known" in words
    flat = limits(HeightMap(np.full((6, 6), 1e-3), 1e-4), parse_device(BENCH, "bench"), law="A")
    assert "flat" in " ".join(text.get_text() for text in limits_figure(flat).axes[0].texts)
    assert "there is no texture to feel" in limits_html(flat)


@pytest.mark.parametrize("law", ["W", "D", "G"])
def test_pictures_of_other_laws_can_be_drawn(law: str) -> None:
    """W pushes with nothing, which a logarithmic axis must bear."""
    figure = limits_figure(limits(Sinusoid(5e-5, 1e-3), parse_device(BENCH, "bench"), law=law))
    figure.canvas.draw()
    low, high = figure.axes[1].get_ylim()
    assert 0.0 < low < high


def test_the_page_loads_nothing_and_says_everything(result: Limits) -> None:
    page = limits_html(result)
    reader = _Reader(page)
    assert len(reader.loaded) == 1
    assert reader.loaded[0].startswith("data:image/")
    assert "script" not in reader.tags
    assert "@import" not in page
    assert "url(" not in page
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page
    for number in range(1, 7):
        assert str(number) in reader.cells
    for sentence in result.assumptions:
        assert sentence.split(":")[0][:40] in page
    assert "not verified" in page.lower()


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    bench = parse_device({**BENCH, "name": hostile, "notes": [hostile]}, "bench")
    result = limits(Sinusoid(5e-5, 1e-3), bench, law="A")
    page = limits_html(result)
    assert hostile not in page
    assert "script" not in _Reader(page).tags
    assert hostile not in result._repr_html_()


def test_the_page_is_reproducible(result: Limits) -> None:
    assert limits_html(result) == limits_html(result)
