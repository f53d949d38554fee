"""Pages of results of the simulation and the paper, which a comparison need not import."""

from __future__ import annotations

from functools import singledispatch
from typing import Any

from asperity.paper.table_two import TableTwo
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report.loop.run_report import (
    figure_sections,
    ledger_table,
    recording_page,
    replay_page,
    work_text,
)
from asperity.report.page import Page, Row, Table, notebook_page
from asperity.simulation import Run


@singledispatch
def find_loop_page(result: Any) -> Page | None:
    """Return the page of a result; ``None`` for a result without one."""
    del result  # used by the registered functions
    return None


find_loop_page.register(Recording, recording_page)
find_loop_page.register(Replay, replay_page)


@find_loop_page.register
def _run_page(result: Run) -> Page:
    page = notebook_page(f"{work_text(result.surface, result)}.", ledger_table(result))
    return Page("", page.answer, (), [*page.sections, *figure_sections(result)])


@find_loop_page.register
def _table_two_page(result: TableTwo) -> Page:
    head, *rows = result.cells()
    return notebook_page(result.parameters, Table(head, [Row(cells) for cells in rows]))
