"""The report of a comparison in a terminal, as a page and in a notebook."""

from __future__ import annotations

import re

import numpy as np
import pytest
from tests.report.report_pages import Reader, check_alone, check_alts, terminal

import asperity as asp
from asperity.core.units import parse_quantity
from asperity.devices import parse_device
from asperity.report import comparison_table, html_text
from asperity.report.pages.comparison_report import comparison_page
from asperity.report.pictures.plotting import plot
from asperity.report.sentences.surface_text import describe_texture
from asperity.report.sentences.texts import limit_text
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
    text = terminal(comparison_page(result, full, why=True), width)
    assert max(len(line) for line in text.splitlines()) <= width
    for row in result.rows:
        lines = [line for line in text.splitlines() if re.match(rf"{row.law.letter} +\S", line)]
        assert len(lines) == 2  # the row of the table, in one line, and the verdict below it
    assert "…" not in text
    assert "K₀" in text


def test_equal_quantities_of_a_page_are_written_alike(page: str) -> None:
    """One number has one spelling: not both 0.041 N and 41 mN."""
    text = re.sub(r"<[^>]+>", " ", page)
    spellings: dict[tuple[float, str], str] = {}
    for number, unit in re.findall(r"(?<![\w.])(\d+(?:\.\d+)?) ([mµ]?[NJ])\b(?![/·])", text):
        value, base = parse_quantity("page", f"{number} {unit}", unit[-1]), unit[-1]
        written = f"{number} {unit}"
        assert spellings.setdefault((round(value, 12), base), written) == written
    assert len(spellings) > 8


def test_narrow_table_has_fewer_columns_and_rounded_numbers(result: asp.Comparison) -> None:
    counts = [len(comparison_table(result, width).columns) for width in (30, 40, 60, 80, 120)]
    assert counts == [3, 4, 6, 6, 7]
    stiffnesses = [str(cell) for cell in comparison_table(result, 40).columns[1].cells]
    best = result.recommended_row
    assert best is not None
    assert best.law.letter not in "WA"
    starts = [limit_text(row.recommended_stiffness) for row in (best, result.row("A"))]
    assert stiffnesses[:3] == [starts[0], "5000 N/m", starts[1]]


def test_recommendation_answers_the_questions_of_a_new_user(result: asp.Comparison) -> None:
    """The recommendation names the law, the stiffness, whether it is felt, and the reason."""
    text = result.recommendation
    best = result.recommended_row
    assert best is not None
    checks = {
        "which law": f"Use law {best.law.letter} ({best.law.name.replace('-', ' ')})",
        "on what": "on the Force Dimension omega.3",
        "which stiffness": f"start at {limit_text(best.recommended_stiffness)}",
        "up to where": "300 µm deep)",
        "is it felt": "is felt.",
        "how much": "its texture of",
        "what to watch": "it loses contact on 33 % of the scan",
    }
    reasons = " ".join(result.reasons)
    assert "but not proved" in reasons
    assert "simulated loops" in reasons
    missing = [question for question, words in checks.items() if words not in text]
    assert not missing
    # The other would have to be longer than the workspace to be felt.
    faint_waves = {(3e-6, 0.3e-3): "magnify it 6.4 times more", (1e-8, 1e-3): "No magnification"}
    for (height, period), cure in faint_waves.items():
        faint = asp.compare(asp.Sinusoid(height, period), "touch", "CH")
        for words in ("Nothing of this texture will be felt", cure):
            assert words in faint.recommendation
        assert "moves the held tool" in " ".join(faint.reasons)


def test_sampled_numbers_are_marked_with_a_tilde() -> None:
    comparison = asp.compare(asp.Sinusoid(amplitude=0.1e-3, period=2e-3), laws="ACF")
    columns = [[str(cell) for cell in one.cells] for one in comparison_table(comparison).columns]
    leaks = dict(zip(columns[0], columns[5], strict=True))
    assert leaks["A"][0].isdigit()  # certified
    assert leaks["C"] == "0"  # zero by theorem
    assert leaks["F"].startswith("~")  # the worst of the sampled loops


def test_page_has_a_row_per_law_the_recommended_one_first(
    result: asp.Comparison, page: str
) -> None:
    rows = re.findall(r'<tr( class="best")?[^>]*><td class="l">([^<]*)</td>', page)
    best = result.recommended_row
    assert best is not None
    others = [letter for letter in "WACD" if letter != best.law.letter]
    assert rows[:4] == [(' class="best"', best.law.letter), *[("", letter) for letter in others]]


def test_page_lists_only_what_goes_wrong(result: asp.Comparison, page: str) -> None:
    """A law that is quiet, felt and continuous is not in that table."""
    section = page.split("What will go wrong</h2>")[1].split("</section>", maxsplit=1)[0]
    listed = re.findall(r'data-law="(\w)"', section)
    assert set(listed) == {row.law.letter for row in result.rows if row.artefacts}
    assert "feels alive" in section
    texture = asp.Sinusoid(0.1e-3, 2e-3)
    quiet = asp.compare(texture, device="omega.3", laws="C", speed=0.3).rows[0]
    assert quiet.artefacts == []
    assert quiet.verdict.startswith("plausible up to")


@pytest.mark.parametrize(("stiffness", "name"), [(None, "force / k"), (500.0, "force")])
def test_forces_of_different_stiffnesses_are_divided_by_it(
    stiffness: float | None, name: str
) -> None:
    """So that a law that starts at a fraction of another's stiffness is seen, too."""
    comparison = asp.compare(TEXTURE, device="omega.3", stiffness=stiffness, laws="WAG")
    starts = [row.surface.stiffness for row in comparison.rows]
    assert (max(starts) > 10 * min(starts)) == (stiffness is None)
    axes = plot(comparison, "force").axes
    assert [one.get_ylabel().split(" [")[0] for one in axes[:1]] == [name]
    peaks = [max(np.abs(line.get_ydata()).max() for line in one.lines) for one in axes[:3]]
    assert min(peaks) > 0.2 * max(peaks)
    scales = {one.get_ylim() for one in axes[:3]}
    assert len(scales) == 1
    curl = plot(comparison, "field").axes[-1]
    assert curl.get_xlabel().startswith("curl / k [1]" if stiffness is None else "curl [N/m]")


def test_page_is_self_contained(page: str) -> None:
    reader = check_alone(page)
    assert len(reader.alts) == 8
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
    assert Reader(text).tags.count("script") == 1 + 8
    check_alone(text)
    assert "&lt;script&gt;" in text


def test_notebook_table_has_a_row_per_law(result: asp.Comparison) -> None:
    text = result._repr_html_()
    assert text.count("<tr") == 1 + 2 * len(result.rows)  # a verdict for each
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
