"""Fixtures shared by the tests of reports."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.lab.browser import Browser

import asperity as asp
from asperity.measured.reading.measured_file import show
from asperity.paper.cycle_experiments import (
    ADDED_PANELS,
    FIGURE_5_PANELS,
    DeviceExperiment,
    PassivityExperiment,
    count_cycles,
    device_onset,
    passivity_onsets,
)
from asperity.paper.experiments import Experiments, bump_experiment, scanning_experiment
from asperity.report import html_text
from asperity.report.document.html import render_page
from asperity.report.document.page import Page
from asperity.report.pages.catalogue_report import find_surfaces, surfaces_page
from asperity.report.pages.paper_report import experiment_sections
from asperity.report.pages.run_report import run_page
from asperity.scene import load_scene
from asperity.scene.setup import make_setup
from asperity.surface import Surface
from asperity.textures import Sinusoid

PRESS = Path(__file__).parents[2] / "examples" / "press.toml"


@pytest.fixture(scope="session")
def experiments() -> Experiments:
    """Return all experiments of the paper in reduced size."""
    surface = Surface(Sinusoid(0.1e-3, 1e-3), "A", max_depth=1e-3)
    counts = [count_cycles(*panel, starts=4) for panel in (*FIGURE_5_PANELS, *ADDED_PANELS)]
    return Experiments(
        PassivityExperiment(tuple(counts), passivity_onsets("WH", (0,), 2)),
        scanning_experiment("A"),
        bump_experiment("AD"),
        DeviceExperiment((device_onset("touch", "sinusoid", surface),), ("falcon",)),
    )


@pytest.fixture(scope="session")
def report_pages(
    tmp_path_factory: pytest.TempPathFactory, experiments: Experiments
) -> dict[str, Path]:
    """Return report pages by name, each of another kind of result, of small surfaces."""
    folder = tmp_path_factory.mktemp("pages")
    sinusoid = Sinusoid(0.2e-3, 2e-3, phase=0.3)
    setup = make_setup(load_scene(str(PRESS)), surface={"law": "W"}, duration=0.3)
    heights = 1e-5 * np.random.default_rng(7).normal(size=(48, 64))
    np.save(folder / "rough.npy", heights)
    options = {"pitch": 5e-5, "unit": "m"}
    texts = {
        "comparison": html_text(asp.compare("cloth", device="touch", laws="WAC")),
        "analysis": html_text(asp.analyze(sinusoid, device="touch", law="A")),
        "limits": html_text(asp.limits(sinusoid, device="touch", law="A")),
        "envelope": html_text(
            asp.envelope(["touch", "inverse3"], "BH", wavelengths=[0.5e-3, 1e-3, 5e-3])
        ),
        "measured": html_text(show(folder / "rough.npy", **options)),
        "run": render_page(run_page(setup, setup.simulate())),
        "experiments": render_page(Page("Experiments", "", [], experiment_sections(experiments))),
        "surfaces": render_page(surfaces_page(find_surfaces(("cloth", "sinusoid")), detailed=True)),
    }
    for name, text in texts.items():
        (folder / f"{name}.html").write_text(text, "utf-8")
    return {name: folder / f"{name}.html" for name in texts}


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    """Return a browser for report pages."""
    with Browser("about:blank", tmp_path_factory.mktemp("browser")) as one:
        yield one
