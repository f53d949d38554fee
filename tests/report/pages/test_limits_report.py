"""The report of the six limits in a terminal and as a page."""

from __future__ import annotations

import numpy as np
import pytest
from markupsafe import escape
from tests.report.report_pages import check_alone, check_alts, terminal

from asperity.analysis.results.check_limits import Limits, limits
from asperity.devices import parse_device
from asperity.report import html_text
from asperity.report.pages.limits_report import MAX_WAVES, limits_page, listed_waves
from asperity.textures import Fourier, HeightMap, Sinusoid

BENCH = {
    "max_stiffness": 2000.0,
    "position_resolution": 15e-6,
    "force_resolution": 2e-3,
    "bandwidth": 400.0,
    "update_rate": 1e4,
    "friction": 0.03,
}
MANY = Fourier(np.geomspace(1e-5, 1e-6, 20), 2 * np.pi / np.geomspace(2e-3, 2e-4, 20))


@pytest.fixture(scope="module")
def result() -> Limits:
    texture = Fourier([5e-5, 2e-5], [2 * np.pi / 1e-3, 2 * np.pi / 0.2e-3])
    return limits(texture, parse_device(BENCH, "bench"), law="A", stiffness=1450.0)


@pytest.mark.parametrize("width", [80, 100, 120])
def test_report_fits_the_terminal_width(result: Limits, width: int) -> None:
    text = terminal(limits_page(result), width=width)
    assert max(len(line) for line in text.splitlines()) <= width
    assert "…" not in text
    assert " ".join(text.split()).startswith(result.answer)
    for sentence in result.assumptions:
        assert sentence.split()[0] in text


def test_waves_are_marked_per_limit(result: Limits) -> None:
    lines = [line.split() for line in terminal(limits_page(result), width=100).splitlines()]
    long = next(words for words in lines if words[:2] == ["1", "mm"])
    short = next(words for words in lines if words[:2] == ["200", "µm"])
    assert long[-8:] == ["y", "y", "y", "y", "y", "below", "0.4", "m/s"]
    assert short[-8:] == ["y", "y", "y", "y", "n", "below", "0.08", "m/s"]


def test_long_list_of_waves_is_shortened_with_a_note() -> None:
    result = limits(MANY, parse_device(BENCH, "bench"), law="A")
    listed = listed_waves(result)
    assert len(listed) == MAX_WAVES
    assert [wave.wavelength for wave in listed] == sorted(
        (wave.wavelength for wave in listed), reverse=True
    )
    least = min(wave.share for wave in listed)
    assert sum(wave.share > least for wave in result.waves) == MAX_WAVES - 1
    assert "And 4 more with less" in terminal(limits_page(result), width=100)
    assert "And 4 more with less" in html_text(result)


def test_page_is_self_contained_and_complete(result: Limits) -> None:
    page = html_text(result)
    reader = check_alone(page)
    assert len(reader.alts) == 1
    check_alts(reader, page)
    for number in range(1, 7):
        assert str(number) in reader.cells
    for sentence in result.assumptions:
        assert str(escape(sentence.split(":")[0][:40])) in page
    assert "not verified" in page.lower()


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    bench = parse_device({**BENCH, "name": hostile, "notes": [hostile]}, "bench")
    result = limits(Sinusoid(5e-5, 1e-3), bench, law="A")
    page = html_text(result)
    assert hostile not in page
    assert len(check_alone(page).scripts) == 1
    assert hostile not in result._repr_html_()


def test_page_is_reproducible(result: Limits) -> None:
    assert html_text(result) == html_text(result)


def test_page_of_a_flat_surface_has_no_waves() -> None:
    flat = limits(HeightMap(np.full((6, 6), 1e-3), 1e-4), parse_device(BENCH, "bench"), law="A")
    page = html_text(flat)
    assert "there is no texture to feel" in page
    assert "Wave by wave" not in page
