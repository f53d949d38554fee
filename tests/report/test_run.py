"""A simulated run in words, table and page."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from tests.report.pages import terminal

from asperity.report.page import page_html
from asperity.report.run import answer, closing_words, energy, ledger_rows, print_run, run_page
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.simulation import Run
from asperity.simulation.run import Stop

PRESS = Path(__file__).parents[2] / "examples" / "press.toml"


@pytest.fixture(scope="module")
def setup() -> Setup:
    return make_setup(load_scene(str(PRESS)), surface={"law": "W"}, duration=0.3)


@pytest.fixture(scope="module")
def run(setup: Setup) -> Run:
    return setup.simulate()


def test_energies_have_signs() -> None:
    assert energy(2.97e-3) == "+2.97 mJ"
    assert energy(-4e-7) == "-400 nJ"
    assert energy(0.0) == "0 J"
    assert energy(math.nan) == "not finite"


def test_rows_add_up(run: Run) -> None:
    rows = dict(ledger_rows(run))
    assert rows["texture, exact"][3] == energy(run.ledger.total)
    assert rows["stored, after less before"][3] == energy(run.ledger.after - run.ledger.before)
    assert run.closes


def test_a_run_that_does_not_close_is_not_believed(setup: Setup, run: Run) -> None:
    assert "believe no number" not in answer(setup, run)
    wrong = replace(run, ledger=replace(run.ledger, lost=run.ledger.lost * (1.0 + 1e-6)))
    assert "believe no number" in answer(setup, wrong)


def test_numbers_beyond_all_bounds_are_words(setup: Setup, run: Run) -> None:
    nan = (math.nan, 0.0, math.nan)
    wrong = replace(run, ledger=replace(run.ledger, supplied=nan, exchanged=math.inf))
    wrong = replace(wrong, stop=Stop.DIVERGED)
    for text in (answer(setup, wrong), closing_words(wrong)):
        assert "nan" not in text.lower()
    assert "beyond all numbers" in answer(setup, wrong)
    assert dict(ledger_rows(wrong))["texture, exact"][0] == "not finite"


def test_table_and_page_say_the_same(setup: Setup, run: Run) -> None:
    shown = terminal(print_run, setup, run, width=80)
    page = page_html(run_page(setup, run))
    for name, cells in ledger_rows(run):
        assert name.replace("'", "&#39;") in page
        assert cells[3] in page
        assert cells[3] in shown
    for sentence in setup.assumptions:
        assert sentence.replace("'", "&#39;") in page
        assert sentence in " ".join(shown.split())
