"""Reports of sweeps: ranges over cases, onsets of limit cycles, energy per stroke over speed.

Also the table of pages of such results, which a comparison need not import.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial, singledispatch
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from asperity.core.units import count_text, format_quantity
from asperity.paper.table_two import TableTwo
from asperity.recording.recording import Recording
from asperity.recording.replay import Replay
from asperity.report.document import page
from asperity.report.document.page import (
    Cell,
    Cells,
    Media,
    Page,
    Row,
    Section,
    Table,
    TableLayout,
    notebook_page,
)
from asperity.report.pages.run_report import (
    LOOP_FOOTER,
    figure_sections,
    ledger_table,
    loop_facts,
    recording_page,
    replay_page,
)
from asperity.report.sentences.loop_text import onset_answer, stroke_answer, work_text
from asperity.report.sentences.texts import NOT_AVAILABLE, millijoules, number_text, table_notes
from asperity.scene.sweeps import OnsetSweep, StrokeSweep
from asperity.simulation import Run
from asperity.simulation.onset import Prediction
from asperity.simulation.scan import Stroke
from asperity.sweeps.sweep_result import CASE, UNIT, SweepResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ONSET_HEADINGS = (
    "law",
    "d",
    "quiet to",
    "cycles",
    "starts",
    "depth",
    "q",
    "paper (1)",
    "delay rule",
    "K₀/q",
)


def onset_cells(prediction: Prediction) -> Cells:
    """Return the cells of a row; rules that allowed a stiffness that cycled are coloured."""
    onset = prediction.onset
    wall_rule = NOT_AVAILABLE
    if prediction.wall_rule is not None:
        wall_rule = number_text(prediction.wall_rule)
    return [
        Cell(onset.law, "l"),
        str(onset.delay),
        number_text(onset.quiet),
        *bracket_cells(prediction),
        number_text(prediction.q),
        number_text(prediction.paper_limit),
        delay_rule_cell(prediction),
        page.flagged_cell(wall_rule, prediction.violates_wall_rule),
    ]


def bracket_cells(prediction: Prediction) -> Cells:
    """Return the stiffness that cycles, the starts that do, and the depth of the handle."""
    onset = prediction.onset
    cycling = "none" if math.isinf(onset.cycling) else number_text(onset.cycling)
    depth = format_quantity(prediction.depth, "m", digits=2)
    return [cycling, f"{onset.cycles}/{onset.starts}", depth]


def delay_rule_cell(prediction: Prediction) -> Cell:
    """Return the stiffness that the delay rule allows, in brackets where it proves nothing."""
    rule = number_text(prediction.delay_rule)
    if not prediction.conservative:
        rule = f"({rule})"
    return page.flagged_cell(rule, prediction.violates_delay_rule)


def _sweep_table(headings: Sequence[str], rows: Sequence[Row], omit: Sequence[int] = ()) -> Table:
    """Return a table whose numbers are wrapped on a narrow console, so that no digit is cut."""
    columns = range(len(headings))
    layout = TableLayout(wrap=columns, omit=omit, gap=2, has_rule=False)
    return Table(headings, rows, columns[1:], layout)


def onset_page(result: OnsetSweep) -> Page:
    """Return the report of the onsets."""
    setup = result.setup
    predictions = result.onsets
    cycle = "A limit cycle: motion that lasts without steps of position and force and is felt."
    in_numbers = onset_section("In numbers, N/m", predictions, cycle)
    return Page(
        title=f"Onset of limit cycles, {setup.device.name}",
        answer=onset_answer(setup, predictions),
        facts=loop_facts(setup),
        sections=[
            replace(in_numbers, title="", caption="", media=Media.TERMINAL),
            onset_figure_section("loop.onsets", page.plot_later(result), predictions),
            in_numbers,
            *page.assumption_sections(setup.assumptions),
        ],
        footer=LOOP_FOOTER,
    )


def onset_figure_section(
    name: str, draw: Callable[[], Figure], predictions: Sequence[Prediction]
) -> Section:
    """Return the figure of the onsets with the texts of a name."""
    laws = ", ".join(dict.fromkeys([prediction.onset.law for prediction in predictions]))
    return page.figure_section(name, draw, laws=laws)


def onset_section(title: str, predictions: Sequence[Prediction], caption: str = "") -> Section:
    """Return onsets and limits in numbers."""
    rows = [Row(onset_cells(prediction), law=prediction.onset.law) for prediction in predictions]
    table = _sweep_table(_ONSET_HEADINGS, rows)
    return Section(title, [table], caption, table_notes("onsets"))


STROKE_HEADINGS = ("law", "speed", "depth", "x", "y", "z", "sum", "field", "±", "paper's", "lost")


def stroke_cells(stroke: Stroke) -> Cells:
    """Return the cells of a row of energies per stroke."""
    depth = format_quantity(stroke.mean_depth, "m", digits=2)
    lost = "" if stroke.stop_message else f"{stroke.lost_contact:.3g}"
    speed = format_quantity(stroke.speed, "m/s")
    return [Cell(stroke.law, "l"), speed, depth, *energy_cells(stroke, "xyz"), lost]


def energy_cells(stroke: Stroke, axes: str) -> Cells:
    """Return energies along axes, their sum, that of the field, variation and the paper's sum."""
    if stroke.stop_message:
        stopped = Cell("stopped", summary="Why", details=[("stopped", stroke.stop_message)])
        return [*[""] * len(axes), stopped, "", "", ""]
    return [
        *[millijoules(stroke.energy["xyz".index(axis)]) for axis in axes],
        millijoules(stroke.total),
        page.flagged_cell(millijoules(stroke.field), stroke.gains_energy),
        millijoules(stroke.spread + stroke.error, signed=False),
        millijoules(sum(stroke.same_sample)),
    ]


def strokes_page(result: StrokeSweep) -> Page:
    """Return the report of the strokes."""
    setup = result.setup
    strokes = result.strokes
    laws = ", ".join(dict.fromkeys([stroke.law for stroke in strokes]))
    stops = sorted({stroke.stop_message for stroke in strokes if stroke.stop_message})
    (note,) = table_notes("strokes")
    notes = [f"{note} The y axis is in the report and in the JSON."]
    notes += [f"Stopped: it {stop}" for stop in stops]
    rows = [Row(stroke_cells(stroke), law=stroke.law) for stroke in strokes]
    table = _sweep_table(STROKE_HEADINGS, rows, omit=(STROKE_HEADINGS.index("y"),))
    return Page(
        title=f"Energy per stroke, {setup.device.name}",
        answer=stroke_answer(strokes),
        facts=loop_facts(setup),
        sections=[
            page.terminal_section(table, notes=notes),
            page.figure_section("loop.strokes", page.plot_later(result), laws=laws),
            Section("In numbers", [table], notes=[note]),
            *page.assumption_sections(setup.assumptions),
        ],
        footer=LOOP_FOOTER,
    )


_HEADINGS = ("number", "of", "least", "at", "greatest", "at")
_MAX_ERRORS = 20
_LEFT_OUT = "Failed cases and unbounded values are left out."


def sweep_page(result: SweepResult) -> Page:
    """Return the report of a sweep."""
    plan = result.plan
    keys = ", ".join([plan.column(key) for key in plan.arguments])
    failures = "1 case fails"
    if len(result.errors) != 1:
        failures = f"{len(result.errors) or 'no'} cases fail"
    table = _range_table(result)
    errors = _error_tables(result)
    names = [name for name in result.run.shown if name in result.columns]
    return Page(
        title=f"Sweep of {plan.source}: {plan.template.run}",
        answer=f"{count_text(len(plan), 'case')} of {plan.template.run} over {keys}: {failures}.",
        facts=[(key, text) for key, text in plan.vary.items()],
        sections=[
            page.terminal_section(table, *errors),
            *[_figure_section(result, name, keys) for name in names],
            Section("Ranges", [table]),
            *[Section("Failed cases", [table]) for table in errors],
        ],
        footer=page.PAPER_CITATION,
    )


def _figure_section(result: SweepResult, name: str, keys: str) -> Section:
    text = f"{name} over {keys}"
    caption = f"{text}: a line for each other choice, or a map on one scale of colours. {_LEFT_OUT}"
    media = Media.HTML | Media.NOTEBOOK
    return page.picture_section(name, partial(_draw, result, name), text, caption, media=media)


def _draw(result: SweepResult, name: str) -> Figure:
    from asperity.report.pictures.loop_pictures import sweep_figure

    return sweep_figure(result, name)


def _range_table(result: SweepResult) -> Table:
    """Return least and greatest value of each shown number, by law or other columns of a case."""
    extremes: dict[tuple[str, str], tuple[dict[str, Any], dict[str, Any]]] = {}
    for case in result.iterate_rows():
        group = " ".join([str(case[name]) for name in result.run.index[:1] if name in case])
        for name in result.run.shown:
            if case.get(name) is not None:
                least, greatest = extremes.get((name, group), (case, case))
                least = min(least, case, key=itemgetter(name))
                greatest = max(greatest, case, key=itemgetter(name))
                extremes[name, group] = (least, greatest)
    rows = []
    for (name, group), (least, greatest) in extremes.items():
        ends = [*_extreme(result, name, least), *_extreme(result, name, greatest)]
        rows.append(Row([Cell(UNIT.sub(r"\1", name), "l"), group, *ends]))
    return Table(_HEADINGS, rows, (2, 4), TableLayout(wrap=(0, 3, 5), gap=2, has_rule=False))


def _extreme(result: SweepResult, name: str, row: dict[str, Any]) -> list[str]:
    columns = [result.plan.column(key) for key in result.plan.arguments]
    return [
        _value_text(name, row[name]),
        ", ".join([_value_text(column, row[column]) for column in columns]),
    ]


def _value_text(column: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    match = UNIT.fullmatch(column)
    return format_quantity(value, match[2] if match else "")


def _error_tables(result: SweepResult) -> list[Table]:
    """Return the errors, if any, how often each occurred, and its first case."""
    if not result.errors:
        return []
    firsts = {error: index for index, error in reversed(result.errors.items())}
    counts: Iterable[tuple[str, int]] = Counter(result.errors.values()).most_common(_MAX_ERRORS)
    rows = [Row([str(count), str(firsts[error]), error]) for error, count in counts]
    headings = ("cases", f"first {CASE}", "error")
    return [Table(headings, rows, (0, 1), TableLayout(wrap=(2,)))]


@singledispatch
def find_loop_page(_result: Any) -> Page | None:
    """Return the page of a result; ``None`` for a result without one."""
    return None


find_loop_page.register(Recording, recording_page)
find_loop_page.register(Replay, replay_page)
find_loop_page.register(OnsetSweep, onset_page)
find_loop_page.register(StrokeSweep, strokes_page)
find_loop_page.register(SweepResult, sweep_page)


@find_loop_page.register
def _run_page(result: Run) -> Page:
    answer = f"{work_text(result.surface, result)}."
    page = notebook_page(answer, ledger_table(result))
    return Page("", answer, (), [*page.sections, *figure_sections(result)])


@find_loop_page.register
def _table_two_page(result: TableTwo) -> Page:
    head, *rows = result.cells()
    return notebook_page(result.parameters, Table(head, [Row(cells) for cells in rows]))
