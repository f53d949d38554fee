"""Pages of results of the simulation and the paper, which a comparison need not import."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from asperity.paper.table_two import TableTwo
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report.document.page import Page, Row, Table, notebook_page
from asperity.report.pages import run_report, sweep_report
from asperity.report.pages.sweep_report import sweep_page
from asperity.report.sentences.loop_text import work_text
from asperity.scene.sweeps import OnsetSweep, StrokeSweep
from asperity.simulation import Run
from asperity.sweeps.sweep_result import SweepResult


@singledispatch
def find_loop_page(_result: Any) -> Page | None:
    """Return the page of a result; ``None`` for a result without one."""
    return None


find_loop_page.register(Recording, run_report.recording_page)
find_loop_page.register(Replay, run_report.replay_page)
find_loop_page.register(OnsetSweep, sweep_report.onset_page)
find_loop_page.register(StrokeSweep, sweep_report.strokes_page)
find_loop_page.register(SweepResult, sweep_page)


@find_loop_page.register
def _run_page(result: Run) -> Page:
    answer = f"{work_text(result.surface, result)}."
    page = notebook_page(answer, run_report.ledger_table(result))
    return Page("", answer, (), [*page.sections, *run_report.figure_sections(result)])


@find_loop_page.register
def _table_two_page(result: TableTwo) -> Page:
    head, *rows = result.cells()
    return notebook_page(result.parameters, Table(head, [Row(cells) for cells in rows]))
