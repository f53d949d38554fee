"""The pictures and tables of the simulated experiments."""

from __future__ import annotations

import numpy as np
from tests.report.pages import check_alone, check_alts

from asperity.paper.experiments.cycle_counts import passivity_onsets
from asperity.paper.experiments.experiment_suite import Experiments
from asperity.report.html import render_page, render_picture
from asperity.report.page import Page, Picture, Table
from asperity.report.paper.claims_report import experiment_sections
from asperity.report.pictures.loop_pictures import onset_figure
from asperity.report.pictures.paper_pictures import cycles_figure, devices_figure


def test_sections_in_order(found: Experiments) -> None:
    sections = experiment_sections(found)
    assert [section.title.split(",")[0] for section in sections] == [
        "V.A", "V.A", "V.A", "V.B", "V.B", "V.C", "Predicted and simulated", "Devices in numbers",
    ]  # fmt: skip
    drawn = [section for section in sections if isinstance(section.blocks[0], Picture)]
    for section in drawn:
        assert isinstance(section.blocks[0], Picture)
        picture = render_picture(section.blocks[0])
        assert picture.svg.startswith("<svg ")
        assert len(picture.alt_text) < 1000
    assert "Not stated by the paper" in drawn[0].notes[0]
    assert "falcon" in drawn[-1].notes[1]
    html = render_page(Page("title", "answer", [], sections))
    check_alts(check_alone(html), html)
    assert html.count("<figure>") == len(drawn) == 5


def test_tables_have_as_many_cells_as_headings(found: Experiments) -> None:
    tables = [
        block for section in experiment_sections(found) for block in section.blocks
        if isinstance(block, Table)
    ]  # fmt: skip
    assert len(tables) == 3
    for table in tables:
        assert table.rows
        for row in table.rows:
            assert len(row.cells) == len(table.headings)


def test_an_onset_that_may_be_lower_is_marked() -> None:
    def marked(laws: str) -> list[bool]:
        figure = onset_figure(passivity_onsets(laws, (2,), 1))
        lines = {line.get_label(): line for line in figure.axes[-1].lines}
        return list(np.isfinite(lines["the least tried"].get_ydata())) if len(lines) > 4 else []

    assert marked("WC") == [True]  # C cycles at 50 N/m, where the search begins
    assert marked("WH") == []


def test_figures_show_what_was_found(found: Experiments) -> None:
    figure = cycles_figure(found.passivity)
    titles = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "F/8.3" in titles
    assert "2000 N/m" in titles
    rules = devices_figure(found)
    assert [axes.get_xlabel() for axes in rules.axes] == [
        "allowed by K₀/q [N/m]", "allowed by delay rule [N/m]",
    ]  # fmt: skip
