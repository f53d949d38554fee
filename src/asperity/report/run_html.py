"""A simulated run as one HTML file that needs no network."""

from __future__ import annotations

from asperity.report.page import Grid, Page, Picture, Row, page_html
from asperity.report.pictures import style
from asperity.report.pictures.run_picture import run_figure
from asperity.report.words.run_words import answer, closing_words, facts, ledger_rows
from asperity.scene.setup import Setup
from asperity.simulation import Run

FOOTER = "after Campion and Hayward, “On the Synthesis of Haptic Textures”, section V"


def run_html(setup: Setup, run: Run) -> str:
    """Return the report of a run, its trace in memory."""
    parts: list[Picture | Grid] = []
    if len(run.time) > 1:
        caption = (
            "Brown: the body, as high as it is below the handle. The exact energy is the work of "
            "the held force on the true motion; the paper's sum multiplies command and step of the "
            "same sample, which turns the sign of what sampling adds."
        )
        source = style.data_uri(run_figure(setup, run))
        parts.append(Picture("Motion, force, energy, phase", caption, source))
    rows = [Row([name, *cells]) for name, cells in ledger_rows(run)]
    headings = ("energy", "x", "y", "z", "sum")
    parts.append(
        Grid("Where the energy went", closing_words(run), headings, rows, numbers=(1, 2, 3, 4))
    )
    title = f"Law {setup.surface.law.letter} in the loop, {setup.device.name}"
    return page_html(
        Page(title, answer(setup, run), facts(setup, run), parts, setup.assumptions, FOOTER)
    )
