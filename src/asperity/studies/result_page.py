"""Report of a study: scores with intervals, psychometric functions, participants, exclusions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from asperity.report import page
from asperity.report.loop.loop_pages import find_loop_page
from asperity.report.page import Cell, Media, Page, Row, Section, Table, TableLayout
from asperity.report.sentences.number_text import NOT_AVAILABLE
from asperity.studies.methods import METHODS
from asperity.studies.study_result import POOLED, StudyResult, exclusion_rules

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_NUMBERS = (1, 2, 3)
_INTERVALS = "Bars are 95 % intervals; an end that the data do not bound is left out."


@find_loop_page.register
def study_page(result: StudyResult) -> Page:
    """Return the report of a study."""
    score, used = result.score, len(result.included)
    pooled = _rows_of(result, POOLED)
    table, notes = _score_table(result, pooled), [str(row["interval"]) for row in pooled[:1]]
    return Page(
        title=f"Study: {result.design.question or result.design.kind}",
        answer=_answer(result),
        facts=[
            ("Method", f"{result.design.kind}: {METHODS[result.design.kind].description}"),
            ("Participants", f"{used} of {len(score.participants)} used"),
            ("Trials", str(len(result.trials))),
            ("Seed", str(result.design.seed)),
            ("Units", "SI; lengths in m, stiffness in N/m"),
        ],
        sections=[
            page.terminal_section(table),
            _figure(result, "scores", f"{score.quantity} by participant and pooled"),
            Section("Pooled over participants", [table], notes=notes),
            *_function_sections(result),
            Section("Participants", [_participant_table(result)], notes=[score.interval]),
            Section("Exclusion", [page.pairs_table(_rules(result)), *_excluded(result)],
                    "The rules stand in the study file, and were stated before the study."),
            *page.user_sections(StudyResult, result),
        ],
    )  # fmt: skip


def _rows_of(result: StudyResult, participant: str) -> list[dict[str, Any]]:
    return [row for row in result.iterate_rows() if row["participant"] == participant]


def _answer(result: StudyResult) -> str:
    """Return which condition has the greatest pooled score, and how many differ from the first."""
    rows = _rows_of(result, POOLED)
    scores = [row for row in rows if row["quantity"] == result.score.quantity]
    known = [row for row in scores if row["estimate"] is not None]
    if not known:
        return f"{result.score.quantity}: no participant is used."
    best = max(known, key=lambda row: row["estimate"])
    parts = [f"{result.score.quantity}: {_interval_text(best)}"]
    label = label_text(result, best)
    if len(scores) > 1:
        parts.append(f"for {label}, the greatest of {len(scores)}")
    elif label:
        parts.append(f"for {label}")
    return f"{' '.join(parts)}; {len(result.included)} participants."


def label_text(result: StudyResult, row: Mapping[str, Any]) -> str:
    """Return the condition of a row."""
    return ", ".join(_text(row[key]) for key in result.design.factors if key in row)


def _text(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _number(value: float | None) -> str:
    return NOT_AVAILABLE if value is None else f"{round(value, 12):.4g}"


def _interval_text(row: Mapping[str, Any]) -> str:
    low, high = _number(row["lower"]), _number(row["upper"])
    return f"{_number(row['estimate'])} ({low} to {high})"


def _score_table(result: StudyResult, rows: Sequence[Mapping[str, Any]]) -> Table:
    cells = [
        Row([Cell(label_text(result, row) or "all", "l"),
             *(_number(row[name]) for name in ("estimate", "lower", "upper")), row["quantity"]])
        for row in rows
    ]  # fmt: skip
    headings = (", ".join(result.design.factors) or "condition", "estimate", "from", "to", "of")
    return Table(headings, cells, _NUMBERS, TableLayout(wrap=(0, 4), gap=2))


def _participant_table(result: StudyResult) -> Table:
    rows = []
    for name in result.score.participants:
        share = result.consistency[name]
        text = NOT_AVAILABLE if share is None else f"{share:.0%}"
        found = " · ".join(
            f"{label_text(result, row)} {_interval_text(row)}".strip()
            for row in _rows_of(result, name)
        )
        reason = result.excluded.get(name, "")
        rows.append(Row([Cell(name, "l"), found, text, str(result.omitted[name]), reason]))
    headings = ("participant", result.score.quantity, "consistency", "left out", "excluded")
    return Table(headings, rows, (2, 3), TableLayout(wrap=(1, 4)))


def _rules(result: StudyResult) -> list[tuple[str, str]]:
    rules = exclusion_rules(result.design)
    return [(name.replace("_", " "), f"{value:g}") for name, value in rules.items()]


def _excluded(result: StudyResult) -> list[page.Paragraph]:
    if not result.excluded:
        return [page.Paragraph("Nobody is excluded.")]
    return [page.Paragraph(f"{name}: {reason}.") for name, reason in result.excluded.items()]


def _function_sections(result: StudyResult) -> list[Section]:
    if not METHODS[result.design.kind].has_function or not result.included:
        return []
    text = "share of right answers over the level, with the fitted psychometric functions"
    return [_figure(result, "functions", text)]


def _figure(result: StudyResult, name: str, text: str) -> Section:
    title = {"scores": "Scores", "functions": "Psychometric functions"}[name]
    caption = f"{text[0].upper()}{text[1:]}. {_INTERVALS if name == 'scores' else ''}".strip()
    media = Media.HTML | Media.NOTEBOOK
    draw = partial(_draw, result, name)
    return page.picture_section(title, draw, text, caption, media=media)


def _draw(result: StudyResult, name: str) -> Figure:
    from asperity.studies import result_pictures

    return result_pictures.FIGURES[name](result)
