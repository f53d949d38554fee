"""The pictures and tables of the simulated experiments."""

from __future__ import annotations

import re

import numpy as np
from tests.report.report_pages import check_alone, check_alts

from asperity.paper.cycle_experiments import passivity_onsets
from asperity.paper.experiments import Experiments
from asperity.report.document.html import render_page
from asperity.report.document.page import Page, Picture, Table
from asperity.report.pages.paper_report import experiment_sections
from asperity.report.pictures.loop_pictures import onset_figure
from asperity.report.pictures.paper_pictures import cycles_figure, devices_figure


def test_sections_are_in_the_order_of_the_paper(experiments: Experiments) -> None:
    sections = experiment_sections(experiments)
    assert [section.title.split(",")[0] for section in sections] == [
        "V.A",
        "V.A",
        "V.A",
        "V.B",
        "V.B",
        "V.C",
        "Predicted and simulated",
        "Devices in numbers",
    ]
    with_picture = [section for section in sections if isinstance(section.blocks[0], Picture)]
    assert "Not stated by the paper" in with_picture[0].notes[0]
    assert "falcon" in with_picture[-1].notes[1]
    html = render_page(Page("title", "answer", [], sections))
    check_alts(check_alone(html), html)
    alt_texts = re.findall(r'<svg role="img" aria-label="([^"]*)"', html)
    assert html.count("<figure>") == len(alt_texts) == len(with_picture) == 5
    assert all(0 < len(text) < 1000 for text in alt_texts)


def test_every_table_row_has_one_cell_per_heading(experiments: Experiments) -> None:
    tables = [
        block
        for section in experiment_sections(experiments)
        for block in section.blocks
        if isinstance(block, Table)
    ]
    assert len(tables) == 3
    for table in tables:
        assert table.rows
        for row in table.rows:
            assert len(row.cells) == len(table.headings)


def test_onset_at_the_lowest_tested_stiffness_is_marked() -> None:
    def find_marks(laws: str) -> list[bool]:
        figure = onset_figure(passivity_onsets(laws, (2,), 1))
        lines = {line.get_label(): line for line in figure.axes[-1].lines}
        return list(np.isfinite(lines["the least tried"].get_ydata())) if len(lines) > 4 else []

    assert find_marks("WC") == [True]  # C cycles at 50 N/m, the start of the search
    assert find_marks("WH") == []


def test_figures_show_the_experiment_results(experiments: Experiments) -> None:
    figure = cycles_figure(experiments.passivity)
    titles = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "F/8.3" in titles
    assert "2000 N/m" in titles
    rules = devices_figure(experiments)
    assert [axes.get_xlabel() for axes in rules.axes] == [
        "allowed by K₀/q [N/m]",
        "allowed by delay rule [N/m]",
    ]
