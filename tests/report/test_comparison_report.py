"""The report of a comparison in a terminal, as a page and in a notebook."""

from __future__ import annotations

import re

import pytest
from tests.report.pages import Reader, check_alone, check_alts, terminal

import asperity as asp
from asperity.devices import parse_device
from asperity.report import comparison_table, html_text
from asperity.report.comparison_columns import describe_texture
from asperity.report.comparison_report import comparison_page
from asperity.report.sentences.number_text import limit_text
from asperity.textures.catalogue import CATALOGUE

TEXTURE = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)


@pytest.fixture(scope="module")
def result() -> asp.Comparison:
    return asp.compare(TEXTURE, device="omega.3", laws="WACD", max_depth=0.3e-3)


@pytest.fixture(scope="module")
def page(result: asp.Comparison) -> str:
    return html_text(result)


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("width", [40, 60, 80, 100, 120, 200])
def test_report_fits_the_terminal_width(result: asp.Comparison, width: int, full: bool) -> None:
    text = terminal(comparison_page(result, full), width)
    assert max(len(line) for line in text.splitlines()) <= width
    for row in result.rows:
        lines = [line for line in text.splitlines() if re.match(rf"{row.law.letter} +\S", line)]
        # The row of the table; in narrow or full output also the verdict below it.
        assert len(lines) >= (2 if width < 72 or full else 1)
    assert "…" not in text
    assert "K₀" in text


def test_narrow_table_has_fewer_columns_and_rounded_numbers(result: asp.Comparison) -> None:
    counts = [len(comparison_table(result, width).columns) for width in (30, 40, 60, 80, 120)]
    assert counts == [3, 4, 6, 7, 8]
    stiffnesses = [str(cell) for cell in comparison_table(result, 40).columns[1].cells]
    assert stiffnesses[:2] == ["5000 N/m", limit_text(result.row("A").recommended_stiffness)]


def test_recommendation_answers_the_questions_of_a_new_user(result: asp.Comparison) -> None:
    """The recommendation names the law, the stiffness, whether it is felt, and the reason."""
    text = result.recommendation
    best = result.recommended_row
    assert best is not None
    checks = {
        "which law": f"Use law {best.law.letter} ({best.law.name.replace('-', ' ')})",
        "on what": "on the Force Dimension omega.3",
        "which stiffness": f"start at {limit_text(best.recommended_stiffness)}",
        "is it felt": ": felt.",
        "how much": "RMS of texture",
        "is it proved": "but not proved",
        "why so much": "simulated loops",
    }
    missing = [question for question, words in checks.items() if words not in text]
    assert not missing
    # Ten times smaller, it would have to be 0.4 m long to be felt, on 0.15 m.
    for height, cure in ((1e-7, "magnify it 41 times more"), (1e-8, "No magnification within")):
        faint = asp.compare(asp.Sinusoid(height, 1e-3), "touch", "CH").recommendation
        for words in ("Nothing of this texture will be felt", "moves the held tool", cure):
            assert words in faint


def test_sampled_numbers_are_marked_with_a_tilde() -> None:
    comparison = asp.compare(asp.Sinusoid(amplitude=0.1e-3, period=2e-3), laws="ACF")
    leaks = [str(cell) for cell in comparison_table(comparison, 120).columns[5].cells]
    assert leaks[0][0].isdigit()  # A's leak is certified
    assert leaks[1] == "0"  # C's is zero by theorem
    assert leaks[2].startswith("~")  # F's is the worst of the sampled loops


def test_page_has_a_row_per_law_with_the_letter_alone(page: str) -> None:
    rows = re.findall(r'<tr[^>]*><td class="l">([^<]*)</td>', page)
    assert rows[:4] == ["W", "A", "C", "D"]


def test_page_is_self_contained(page: str) -> None:
    reader = check_alone(page)
    assert len(reader.alts) == 7
    check_alts(reader, page)


def test_page_lists_the_assumptions(result: asp.Comparison, page: str) -> None:
    assert "Assumptions</h2>" in page
    for sentence in result.assumptions:
        assert sentence.split(":")[0][:40].replace("'", "&#39;") in page
    assert "not verified" in page.lower() or ">no<" in page


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    device = parse_device({"name": hostile, "max_stiffness": 1000.0}, "mine")
    text = html_text(asp.compare(TEXTURE, device=device, laws="WA"))
    assert hostile not in text
    assert Reader(text).tags.count("script") == 1 + 7
    check_alone(text)
    assert "&lt;script&gt;" in text


def test_notebook_table_has_a_row_per_law(result: asp.Comparison) -> None:
    text = result._repr_html_()
    assert text.count("<tr") == 1 + len(result.rows)
    assert "<td>∞" not in text
    assert result.recommendation[:20] in text


def description_of(name: str, **arguments: float) -> dict[str, object]:
    return CATALOGUE[name].factory(**arguments).describe()


def test_texture_arguments_are_described_with_units() -> None:
    text = describe_texture(description_of("cloth", yarn_thickness=0.2e-3))
    assert text.startswith("cloth: points 448 × 448, pitch 7.5 µm × 7.5 µm, periodic yes")
    assert "yarn thickness 200 µm, irregularity 0.05, seed 0" in text
    assert "groove angle 30°" in describe_texture(description_of("knurl"))


def test_undeclared_texture_kind_is_described_generically() -> None:
    text = describe_texture(
        {"kind": "moon", "craters": 3, "cutoff": 1e-3, "heights": [1, 2, 3, 4, 5]}
    )
    assert text == "moon: craters 3, cutoff 1 mm, 5 heights"
