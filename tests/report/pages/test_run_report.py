"""The report of a simulated run: sentences, table and page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from tests.report.report_pages import terminal

from asperity.report.document.html import render_page
from asperity.report.pages.run_report import ledger_rows, run_page
from asperity.report.sentences.loop_text import closure_text, run_answer
from asperity.report.sentences.texts import energy_text
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.simulation import Run
from asperity.simulation.trace import StopReason

PRESS = Path(__file__).parents[3] / "examples" / "press.toml"


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup(load_scene(str(PRESS)), surface={"law": "W"}, duration=0.3)


@pytest.fixture(scope="module")
def run(setup: Setup) -> Run:
    return setup.simulate()


def test_energies_are_printed_with_signs() -> None:
    assert energy_text(2.97e-3) == "+2.97 mJ"
    assert energy_text(-4e-7) == "-400 nJ"
    assert energy_text(0.0) == "0 J"
    assert energy_text(math.nan) == "not finite"


def test_ledger_rows_add_up(run: Run) -> None:
    rows = dict(ledger_rows(run))
    assert rows["texture, exact"][3] == energy_text(run.ledger.total)
    assert rows["stored energy, after minus before"][3] == energy_text(
        run.ledger.stored_after - run.ledger.stored_before
    )
    assert run.is_energy_balanced


def test_energy_balance_that_does_not_close_is_reported(setup: Setup, run: Run) -> None:
    assert "does not close" not in run_answer(setup, run)
    wrong = replace(
        run, ledger=replace(run.ledger, dissipated=run.ledger.dissipated * (1.0 + 1e-6))
    )
    assert "does not close" in run_answer(setup, wrong)


def test_infinite_and_nan_energies_are_reported_as_not_finite(setup: Setup, run: Run) -> None:
    nan = (math.nan, 0.0, math.nan)
    wrong = replace(run, ledger=replace(run.ledger, supplied=nan, exchanged=math.inf))
    wrong = replace(wrong, stop=StopReason.DIVERGED)
    for text in (run_answer(setup, wrong), closure_text(wrong)):
        assert "nan" not in text.lower()
    assert "not finite" in run_answer(setup, wrong)
    assert dict(ledger_rows(wrong))["texture, exact"][0] == "not finite"


def test_terminal_and_page_have_the_same_content(setup: Setup, run: Run) -> None:
    text = terminal(run_page(setup, run), 80)
    page = render_page(run_page(setup, run))
    for name, cells in ledger_rows(run):
        assert name.replace("'", "&#39;") in page
        assert cells[3] in page
        assert cells[3] in text
    for sentence in setup.assumptions:
        assert sentence.replace("'", "&#39;") in page
        assert sentence in " ".join(text.split())
