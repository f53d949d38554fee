"""The pictures and tables of the simulated experiments."""

from __future__ import annotations

import pytest

from asperity.paper.experiments.beyond import BeyondExperiment, device_onset
from asperity.paper.experiments.bump import bump_experiment
from asperity.paper.experiments.passivity import passivity_experiment
from asperity.paper.experiments.run import Experiments
from asperity.paper.experiments.scanning import scanning_experiment
from asperity.report.page import Grid, Page, Picture, page_html
from asperity.report.pictures.experiment_pictures import (
    cycles_figure,
    devices_figure,
    experiment_parts,
)
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid


@pytest.fixture(scope="module")
def found() -> Experiments:
    surface = Surface(Sinusoid(0.1e-3, 1e-3), "A", max_depth=1e-3)
    return Experiments(
        passivity_experiment("WH", (0,), starts=2),
        scanning_experiment("A"),
        bump_experiment("AD"),
        BeyondExperiment((device_onset("touch", "sinusoid", surface),), ("falcon",)),
    )


def test_parts_in_order(found: Experiments) -> None:
    parts = experiment_parts(found)
    assert [part.title.split(",")[0] for part in parts] == [
        "V.A", "V.A", "V.A", "V.B", "V.B", "V.C", "Predicted and simulated", "Devices in numbers",
    ]  # fmt: skip
    pictures = [part for part in parts if isinstance(part, Picture)]
    assert all(part.source.startswith("data:image/svg+xml") for part in pictures)
    assert "Not stated by the paper" in pictures[0].notes[0]
    assert "falcon" in pictures[-1].notes[1]
    html = page_html(Page("title", "answer", [], parts))
    assert html.count("<figure>") == len(pictures) == 5


def test_tables_have_as_many_cells_as_headings(found: Experiments) -> None:
    for part in experiment_parts(found):
        if isinstance(part, Grid):
            assert part.rows
            for row in part.rows:
                assert len(row.cells) == len(part.headings)


def test_figures_show_what_was_found(found: Experiments) -> None:
    figure = cycles_figure(found.passivity)
    titles = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert "F/8.3" in titles
    assert "2000 N/m" in titles
    rules = devices_figure(found)
    assert [axes.get_xlabel() for axes in rules.axes] == [
        "allowed by K₀/q [N/m]", "allowed by delay rule [N/m]",
    ]  # fmt: skip
