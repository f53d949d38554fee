"""The report of an analysis in a terminal and as a page."""

from __future__ import annotations

import pytest
from tests.report.report_pages import check_alone, check_alts, terminal

from asperity.analysis.results.analyze import Analysis, analyze
from asperity.devices import parse_device
from asperity.report import html_text
from asperity.report.document.html import render_page
from asperity.report.pages.analysis_report import analysis_page
from asperity.surface import Surface
from asperity.textures import Sinusoid

WAVE = Sinusoid(amplitude=0.2e-3, period=1e-3, phase=0.3)
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "max_stiffness": "3 N/mm"}


@pytest.fixture(scope="module")
def groove() -> Analysis:
    return analyze(Surface(WAVE, "A", 700.0, 0.3e-3), parse_device(RIG, "rig"))


@pytest.fixture(scope="module")
def page(groove: Analysis) -> str:
    return html_text(groove)


def test_page_is_self_contained_and_has_every_section(page: str, groove: Analysis) -> None:
    reader = check_alone(page)
    assert len(reader.alts) == 3
    check_alts(reader, page)
    text = page.replace("&#39;", "'").replace("&lt;", "<").replace("&gt;", ">")
    assert text.index(groove.answer) < text.index("<table")
    for sentence in (*groove.assumptions, *(c.assumptions for c in groove.passivity.criteria)):
        assert sentence in text
    for criterion in groove.passivity.criteria:
        assert criterion.formula in text


def test_page_is_reproducible(groove: Analysis, page: str) -> None:
    assert html_text(groove) == page


def test_hostile_names_are_escaped() -> None:
    hostile = "<script>alert(1)</script>"
    device = parse_device({**RIG, "name": hostile}, "mine")
    result = analyze(Surface(WAVE, "W"), device)
    page = render_page(analysis_page(result))
    assert hostile not in page
    assert len(check_alone(page).scripts) == 1


@pytest.mark.parametrize("width", [80, 100])
def test_terminal_shows_verdict_numbers_and_assumptions(groove: Analysis, width: int) -> None:
    text = " ".join(terminal(analysis_page(groove), width).split())
    assert text.startswith(groove.answer)
    for sentence in groove.assumptions:
        assert f"- {sentence}" in text
    assert groove.leak.description in text
    assert groove.continuity.reason in text
