"""The table, the pictures and the page."""

from __future__ import annotations

import io
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import asperity as asp
from asperity.devices import parse_device
from asperity.errors import ParameterError
from asperity.report import comparison_table, html_text, plot, print_comparison
from asperity.report.pictures.gain_picture import gain_figure
from asperity.report.pictures.merit_picture import merit_figure
from asperity.report.pictures.spectrum_picture import device_limits, line_spectrum, spectrum_figure
from asperity.report.pictures.vertical_cut import curl_field, stretch_of
from asperity.surface import Surface

TEXTURE = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)


@pytest.fixture(scope="module")
def result() -> asp.Comparison:
    return asp.compare(TEXTURE, device="omega.3", laws="WACD", max_depth=0.3e-3)


@pytest.fixture(scope="module")
def page(result: asp.Comparison) -> str:
    return html_text(result)


class _Reader(HTMLParser):
    """Collects what the tests look at."""

    def __init__(self) -> None:
        super().__init__()
        self.resources: list[str] = []
        self.tags: list[str] = []
        self.first_cells: list[str] = []
        self._first = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        values = dict(attrs)
        self.resources += [str(values[name]) for name in ("src", "href") if name in values]
        self._first = tag == "td" and values.get("class") == "l"

    def handle_data(self, data: str) -> None:
        if self._first:
            self.first_cells.append(data)
            self._first = False


def read(text: str) -> _Reader:
    reader = _Reader()
    reader.feed(text)
    return reader


def terminal(result: asp.Comparison, width: int) -> str:
    console = Console(width=width, file=io.StringIO(), force_terminal=False)
    print_comparison(result, console)
    return console.file.getvalue()  # type: ignore[attr-defined]  # a StringIO


@pytest.mark.parametrize("width", [80, 100, 120])
def test_the_answer_fits_the_terminal(result: asp.Comparison, width: int) -> None:
    text = terminal(result, width)
    assert max(len(line) for line in text.splitlines()) <= width
    for row in result.rows:
        found = [line for line in text.splitlines() if re.match(rf"{row.law.letter} +\S", line)]
        assert len(found) >= 2  # the table's row and the verdict
    assert "…" not in text
    assert "K₀" in text


def test_sampled_numbers_carry_a_mark() -> None:
    found = asp.compare(asp.Sinusoid(amplitude=0.1e-3, period=2e-3), laws="ACF")
    leaks = [str(cell) for cell in comparison_table(found, 120).columns[7].cells]
    assert leaks[0][0].isdigit()  # A's leak is certified
    assert leaks[1] == "0"  # C's is zero by theorem
    assert leaks[2].startswith("~")  # F's is the worst loop that was tried


def test_page_has_a_row_per_law_with_the_letter_alone(page: str) -> None:
    assert read(page).first_cells[:4] == ["W", "A", "C", "D"]


def test_page_loads_nothing(page: str) -> None:
    reader = read(page)
    assert reader.resources
    assert all(resource.startswith("data:image/") for resource in reader.resources)
    assert "script" not in reader.tags
    assert "@import" not in page
    assert "url(" not in page
    assert len(page) < 3_000_000


def test_page_says_what_was_assumed(result: asp.Comparison, page: str) -> None:
    assert "What was assumed" in page
    for sentence in result.assumptions:
        assert sentence.split(":")[0][:40].replace("'", "&#39;") in page
    assert "not verified" in page.lower() or ">no<" in page
    assert "prefers-color-scheme: dark" in page
    assert "@media print" in page


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    device = parse_device({"name": hostile, "max_stiffness": 1000.0}, "mine")
    text = html_text(asp.compare(TEXTURE, device=device, laws="WA"))
    assert hostile not in text
    assert "script" not in read(text).tags
    assert "&lt;script&gt;" in text


def test_every_picture_has_axes_with_units(result: asp.Comparison) -> None:
    surface = Surface(TEXTURE, "A", max_depth=0.3e-3)
    for figure in (
        plot(result), plot(surface), plot(TEXTURE),
        merit_figure(result), gain_figure(result), spectrum_figure(TEXTURE, result.device),
    ):  # fmt: skip
        labels = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
        labels += [axes.get_ylabel() for part in figure.subfigs for axes in part.axes]
        assert any("[" in label or "strength" in label for label in labels)


def test_every_picture_of_the_report_can_be_had_alone(
    result: asp.Comparison, tmp_path: Path
) -> None:
    for name in ("surface", "spectrum", "force", "field", "gain", "merit"):
        for ending in ("png", "svg"):
            path = tmp_path / f"{name}.{ending}"
            plot(result, picture=name).savefig(path)
            assert path.stat().st_size > 3000
    with pytest.raises(ParameterError, match="one of surface, spectrum"):
        plot(result, picture="curl")


def test_no_picture_for_anything_else() -> None:
    with pytest.raises(TypeError, match="no picture is known"):
        plot(3)


def test_drawn_curl_is_zero_for_c_and_not_for_a() -> None:
    stretch = stretch_of(TEXTURE, 2e-3, 4e-3)
    fields = {
        letter: curl_field(Surface(TEXTURE, letter, 1000.0, 0.3e-3), stretch, -0.4e-3, 20, 30)
        for letter in "AC"
    }
    assert np.nanmax(np.abs(fields["C"].curl)) < 1e-9
    # k h' at its greatest, up to the cells' size.
    assert np.nanmax(np.abs(fields["A"].curl)) == pytest.approx(
        1000.0 * 2 * np.pi * 0.2 / 2, rel=0.05
    )


def test_drawn_gain_of_a_is_its_norm() -> None:
    """‖J_A‖ = k √(1 + h'²), at every depth."""
    stretch = stretch_of(TEXTURE, 2e-3, 4e-3)
    field = curl_field(Surface(TEXTURE, "A", 700.0, 0.3e-3), stretch, -0.4e-3, 20, 3)
    middles = 0.5 * (field.along[1:, 0] + field.along[:-1, 0])
    slope = TEXTURE.gradient(stretch.xy(middles))[:, 0]
    expected = np.tile(np.hypot(1.0, slope)[:, None], (1, 3))
    np.testing.assert_allclose(field.gain, expected, rtol=1e-12)


def test_filled_places_are_pale_in_the_picture() -> None:
    heights = 1e-4 * np.random.default_rng(0).normal(size=(40, 60))
    filled = np.zeros((40, 60), dtype=bool)
    filled[:, 30:] = True
    pictures = [
        plot(asp.HeightMap(heights, 1e-4, filled=mask)).axes[0].images[0].get_array()
        for mask in (None, filled)
    ]
    change = np.abs(np.asarray(pictures[1]) - np.asarray(pictures[0])).max(axis=2)
    middle = change.shape[1] // 2
    assert change[:, : middle - 2].max() == 0.0
    assert change[:, middle + 2 :].mean() > 0.1


def test_notebook_table_has_a_row_per_law(result: asp.Comparison) -> None:
    text = result._repr_html_()
    assert text.count("<tr>") == 1 + len(result.rows)
    assert "<td>∞" not in text
    assert result.recommendation[:20] in text


def test_spectrum_of_a_sinusoid_is_its_amplitude() -> None:
    wavelength, amplitude = line_spectrum(TEXTURE)
    assert wavelength[0] == pytest.approx(2e-3)
    assert amplitude[0] == pytest.approx(0.2e-3, rel=1e-9)
    assert amplitude[1:].max() < 1e-12


def test_device_limits_by_hand() -> None:
    device = parse_device(
        {"position_resolution": "10 um", "update_rate": "1 kHz", "bandwidth": "200 Hz"}, "mine"
    )
    assert [least for least, _ in device_limits(device)] == pytest.approx([5e-5, 5e-4, 5e-4])
