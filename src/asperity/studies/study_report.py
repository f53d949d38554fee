"""Report of a study: scores with intervals, psychometric functions, participants, exclusions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from asperity.core.units import count_text, format_quantity
from asperity.report.document.page import (
    Cell,
    Media,
    Page,
    Paragraph,
    Row,
    Section,
    Table,
    TableLayout,
    pairs_table,
    picture_section,
    terminal_section,
)
from asperity.report.pages.sweep_report import find_loop_page
from asperity.report.sentences.texts import NOT_AVAILABLE
from asperity.studies.design import describe_source
from asperity.studies.methods import METHODS
from asperity.studies.study_result import POOLED, StudyResult, analyse, exclusion_rules, label_text
from asperity.studies.study_store import find_derived_files, read_study, read_trials, write_key

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_BARS = "Bars are 95 % intervals; what the data do not bound is left out."
_FUNCTIONS = "Share of right answers over the level, with the fitted psychometric functions"
# Titles of the sections of a study file that the page repeats.
_FACTS = {
    "vary": "Stimuli",
    "method": "Options",
    "texture": "Texture",
    "surface": "Surface",
    "device": "Device",
}
_RULES = "The rules stand in the study file, and were stated before the study."


@find_loop_page.register
def study_page(result: StudyResult) -> Page:
    """Return the report of a study."""
    score = result.score
    design = result.design
    kind = METHODS[design.kind]
    table = _score_table(result)
    scores = f"{score.quantity} by participant and pooled"
    functions = [_figure(result, "Psychometric functions", _FUNCTIONS)]
    pooled = Section("Pooled", [table], notes=[result.included_score.pooled_interval])
    rules = [(name.replace("_", " "), f"{x:g}") for name, x in exclusion_rules(design).items()]
    excluded = [Paragraph(f"{name}: {why}.") for name, why in result.excluded.items()]
    nobody = Paragraph("Nobody is excluded.")
    source = f" – {describe_source(result.simulated)}" if result.simulated else ""
    return Page(
        title=f"Study: {design.question or design.kind}{source}",
        answer=_answer(result),
        facts=[
            ("Method", f"{design.kind}: {kind.description}"),
            ("Answers", f"of {describe_source(result.simulated)}"),
            *_list_stimuli(result),
            ("Participants", f"{len(result.included)} of {len(result.answered)} used"),
            ("Trials", str(len(result.trials))),
            ("Seed", str(design.seed)),
            ("Units", "SI; lengths in m, stiffness in N/m"),
        ],
        sections=[
            terminal_section(table),
            _figure(result, "Scores", scores, f"{scores[0].upper()}{scores[1:]}. {_BARS}"),
            pooled,
            *(functions if kind.has_function and result.included else ()),
            Section("Participants", [_participant_table(result)], notes=[score.interval]),
            Section("Exclusion", [pairs_table(rules), *(excluded or [nobody])], _RULES),
        ],
    )


def _list_stimuli(result: StudyResult) -> list[tuple[str, str]]:
    """Return what was presented, as the study file states it."""
    facts = []
    sections = {"vary": result.design.factors, **result.content}
    for name, title in _FACTS.items():
        texts = []
        for key, value in sections.get(name, {}).items():
            items = value if isinstance(value, (list, tuple)) else [value]
            texts.append(f"{key.replace('_', ' ')} {' / '.join(map(str, items))}")
        if texts:
            facts.append((title, ", ".join(texts)))
    if "texture_force" in sections.get("study", {}):
        force = sections["study"]["texture_force"]
        words = f"that which gives each stimulus a texture force of {force} RMS at the motors"
        facts.append(("Stiffness", words))
    return facts


def _rows_of(result: StudyResult, participant: str) -> list[dict[str, Any]]:
    return [row for row in result.iterate_rows() if row["participant"] == participant]


def _answer(result: StudyResult) -> str:
    """Return which condition has the greatest pooled score, or all where levels bound not all."""
    quantity = result.score.quantity
    rows = [row for row in _rows_of(result, POOLED) if row["quantity"] == quantity]
    known = [row for row in rows if row["estimate"] is not None]
    people = count_text(len(result.included), "participant")
    if result.simulated:
        people = f"{people}: {describe_source(result.simulated)}"
    if not result.included:
        return f"{quantity}: no participant is used."
    if any(row["outside levels"] for row in rows):
        texts = [f"{label_text(result, row)} {_interval_text(row)}".strip() for row in rows]
        return f"{quantity}: {', '.join(texts)}; {people}."
    best = max(known, key=lambda row: row["estimate"])
    which = f", the greatest of {len(known)}" if len(known) > 1 else ""
    label = f" for {text}{which}" if (text := label_text(result, best)) else ""
    return f"{quantity}: {_interval_text(best)}{label}; {people}."


def _number(value: float | None, unit: str) -> str:
    if value is None:
        return NOT_AVAILABLE
    return format_quantity(value, unit) if unit else f"{round(value, 10) + 0.0:.3g}"


def _texts(row: Mapping[str, Any]) -> list[str]:
    """Return the estimate, and the ends of its interval."""
    estimate, *ends = [_number(row[name], row["unit"]) for name in ("estimate", "lower", "upper")]
    return [row["outside levels"] or estimate, *ends]


def _interval_text(row: Mapping[str, Any]) -> str:
    estimate, low, high = _texts(row)
    return f"{estimate} ({low} to {high})"


def _score_table(result: StudyResult) -> Table:
    cells = [
        Row([Cell(label_text(result, row) or "all", "l"), *_texts(row), row["quantity"]])
        for row in _rows_of(result, POOLED)
    ]
    headings = (", ".join(result.design.factors) or "condition", "estimate", "from", "to", "of")
    return Table(headings, cells, (1, 2, 3), TableLayout(wrap=(0, 4), gap=2))


def _participant_table(result: StudyResult) -> Table:
    rows = []
    for name, share in result.consistency.items():
        intervals = [
            f"{label_text(result, row)} {_interval_text(row)}".strip()
            for row in _rows_of(result, name)
        ]
        text = NOT_AVAILABLE if share is None else f"{100.0 * share:.0f} %"
        omitted = str(result.omitted[name])
        reason = result.excluded.get(name, "")
        rows.append(Row([Cell(name, "l"), " · ".join(intervals), text, omitted, reason]))
    headings = ("participant", result.score.quantity, "consistency", "left out", "excluded")
    return Table(headings, rows, (2, 3), TableLayout(wrap=(1, 4)))


def _figure(result: StudyResult, title: str, text: str, caption: str = "") -> Section:
    media = Media.HTML | Media.NOTEBOOK
    draw = partial(_draw, result, title)
    return picture_section(title, draw, text, caption or f"{text}.", media=media)


def _draw(result: StudyResult, title: str) -> Figure:
    from asperity.studies import result_pictures

    draw: Callable[[StudyResult], Figure] = result_pictures.FIGURES[title]
    return draw(result)


def study_report(folder: str | Path) -> StudyResult:
    """Return what the answers in the folder of a study say.

    Args:
        folder: written by ``asperity study run``.

    Raises:
        ParameterError: for a folder of something else, or of another version; without answers.
    """
    study = read_study(folder)
    return analyse(study.design, read_trials(folder), study.content)


def write_report(folder: str | Path, result: StudyResult) -> list[str]:
    """Write key, tables and page of a result into the folder; return the names of the files.

    The key unblinds the study.

    Args:
        folder: of the study.
        result: see :func:`study_report`.

    Raises:
        ParameterError: for a folder that cannot be written.
    """
    write_key(folder)
    result.to_html(Path(folder) / "report.html")
    for name, table in {"trials": result.trial_table, "table": result}.items():
        table.to_csv(Path(folder) / f"{name}.csv")
    return find_derived_files(folder)
