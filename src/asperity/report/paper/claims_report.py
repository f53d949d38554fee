"""Report of the paper's claims: verdicts, simulated experiments and figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from typing import Any

from asperity.paper import VERDICTS, Result
from asperity.paper.claim import Number
from asperity.paper.experiments import Experiments
from asperity.paper.experiments.cycle_counts import PassivityExperiment
from asperity.paper.experiments.device_onsets import DeviceExperiment, DeviceOnset
from asperity.paper.experiments.strokes import BumpExperiment, ScanningExperiment
from asperity.paper.figures import loop_energies
from asperity.report import page
from asperity.report.loop import sweep_report
from asperity.report.loop.run_report import energy_text
from asperity.report.page import HEADED, Cell, Cells, Media, Page, Row, Section, Table, TableLayout
from asperity.report.pictures import paper_pictures
from asperity.report.pictures.paper_pictures import loop_energy_text
from asperity.report.sentences.texts import sentence, table_data, table_notes

_MORE_NOTE = "The evidence of one claim: asperity reproduce --claim ID"


def verdict_counts_text(results: Sequence[Result]) -> str:
    """Return the number of claims by verdict: "Of 60 claims 55 hold, ..."."""
    counts = {verdict: sum(r.verdict == verdict for r in results) for verdict in VERDICTS}
    verdicts = table_data("verdicts")
    parts = [f"{count} {verdicts[verdict]['plural']}" for verdict, count in counts.items()]
    return f"Of {len(results)} claims {', '.join(parts)}."


def evidence_text(value: Number) -> str:
    """Return a number of the evidence as text."""
    if isinstance(value, list):
        return ", ".join(f"{item:.10g}" for item in value)
    return value if isinstance(value, str) else f"{value:.10g}"


def claims_page(results: Sequence[Result], experiments: Experiments | None) -> Page:
    """Return the report: counts, claims by section with their evidence, figures, experiments."""
    sections = _terminal_sections(results, experiments)
    sections += [_claims_section(name, members) for name, members in _group_by_section(results)]
    sections += paper_sections()
    guesses: list[str] = []
    if experiments is not None:
        sections += experiment_sections(experiments)
        guesses += [*experiments.passivity.fitted, *experiments.scanning.guessed]
        guesses += [*experiments.bump.guessed, *experiments.devices.guessed]
    sections += page.user_sections(Result, results, experiments)
    sections += [one for one in page.assumption_sections(guesses) if Media.HTML in one.media]
    title = "“On the Synthesis of Haptic Textures”, claim by claim"
    facts = [(one["fact"], verdict) for verdict, one in table_data("verdicts").items()]
    return Page(title, verdict_counts_text(results), facts, sections, sentence("claims"))


def _verdict_cell(result: Result) -> Cell:
    return Cell(result.verdict, table_data("verdicts")[result.verdict]["kind"])


def _terminal_sections(results: Sequence[Result], experiments: Experiments | None) -> list[Section]:
    """Return one row per claim and one line per experiment, for a terminal."""
    rows = []
    for section, members in _group_by_section(results):
        rows.append(Row([f"§ {section}", "", ""], style="bold"))
        for result in members:
            numbers = ", ".join(result.equations)
            statement = f"{numbers}: {result.statement}" if numbers else result.statement
            if result.evidence.fitted:
                statement += f" ({result.evidence.fitted})"
            rows.append(Row([result.id, _verdict_cell(result), statement]))
    layout = TableLayout(wrap=(2,), gap=2, has_rule=False)
    table = Table(("claim", "verdict", "states"), rows, layout=layout)
    lines = experiments.summary_lines if experiments is not None else ()
    summary = [page.Paragraph(f"{name}: {text}") for name, text in lines]
    return [
        page.terminal_section(table),
        *([page.terminal_section(*summary)] if summary else ()),
        page.terminal_section(notes=[_MORE_NOTE]),
    ]


def evidence_page(results: Sequence[Result]) -> Page:
    """Return the report of chosen claims; a terminal shows everything that a verdict rests on."""
    whole = claims_page(results, None)
    evidence = map(_evidence_section, results)
    sections = [section for section in whole.sections if Media.HTML in section.media]
    return replace(whole, answer="", sections=[*evidence, *sections])


def _evidence_section(result: Result) -> Section:
    places = ", ".join((*result.equations, f"section {result.section}"))
    details = _evidence_details(result)[1:]
    blocks: list[page.Block] = [
        page.Paragraph(result.statement),
        Table((), [Row([_verdict_cell(result)])]),
        page.Paragraph(result.evidence.summary),
        *[page.Paragraph(f"{name[0].upper()}{name[1:]}: {text}") for name, text in details],
    ]
    numbers = result.evidence.numbers.items()
    notes = [f"  {name}: {evidence_text(value)}" for name, value in numbers]
    return Section(f"{result.id} ({places})", blocks, notes=notes, media=HEADED)


def _group_by_section(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    grouped = groupby(results, key=lambda result: result.section)
    return [(section, [*members]) for section, members in grouped]


def _claims_section(section: str, members: Sequence[Result]) -> Section:
    headings = ("claim", "equations", "states", "verdict")
    table = Table(headings, [_claim_row(result) for result in members])
    return Section(section if section == "Abstract" else f"Section {section}", [table])


def _evidence_details(result: Result) -> list[tuple[str, str]]:
    """Return names and texts of the evidence of a claim."""
    evidence = result.evidence
    details = [
        ("found", evidence.summary),
        ("not stated by the paper", evidence.fitted),
        ("correction", evidence.correction),
        ("another verdict with", result.flips_under),
    ]
    return [(name, text) for name, text in details if text]


def _claim_row(result: Result) -> Row:
    evidence = result.evidence
    details = _evidence_details(result)
    details += [(name, evidence_text(value)) for name, value in evidence.numbers.items()]
    details.append(("reproduce", f"asperity reproduce --claim {result.id}"))
    cells: Cells = [
        Cell(result.id, "l"),
        ", ".join(result.equations),
        Cell(result.statement, subtext=evidence.fitted, details=details),
        _verdict_cell(result),
    ]
    return Row(cells, id=result.id)


def paper_sections() -> list[Section]:
    """Return figures 2 and 3 of the paper."""
    panels = loop_energies()
    gained = "; ".join(f"{panel.law} {loop_energy_text(panel)}" for panel in panels)
    loops = partial(paper_pictures.figure_three, panels)
    count = len(panels)
    return [
        page.figure_section("paper.forces", paper_pictures.figure_two),
        page.figure_section("paper.loops", loops, count=count, gained=gained),
    ]


def experiment_sections(experiments: Experiments) -> list[Section]:
    """Return the sections of the experiments in order."""
    return [
        _cycle_section(experiments.passivity),
        sweep_report.onset_figure_section("paper.onsets", experiments.passivity.onsets),
        sweep_report.onset_section("V.A, onsets in numbers", experiments.passivity.onsets),
        _energy_section(experiments.scanning),
        _stroke_section(experiments.scanning),
        _bump_section(experiments.bump),
        _device_section(experiments),
        _device_table_section(experiments.devices),
    ]


def _cycle_section(experiment: PassivityExperiment) -> Section:
    first = experiment.counts[0]
    notes = _fitted_notes(experiment.fitted)
    figure = partial(paper_pictures.cycles_figure, experiment)
    counts = ", ".join(f"{one.cycles} with {one.wall}" for one in experiment.counts)
    values: dict[str, Any] = {"lag": first.delay, "starts": first.starts, "counts": counts}
    return page.figure_section("paper.cycles", figure, notes, **values)


def _fitted_notes(sentences: Sequence[str]) -> list[str]:
    return [f"Not stated by the paper: {'; '.join(sentences)}."]


def _energy_section(experiment: ScanningExperiment) -> Section:
    figure = partial(paper_pictures.energies_figure, experiment)
    notes = _fitted_notes(experiment.guessed)
    return page.figure_section("paper.energies", figure, notes, count=len(experiment.traces))


def _stroke_section(experiment: ScanningExperiment) -> Section:
    headings = ("law", "hand", "speed", "x", "z", "sum", "field", "±", "paper's", "lost")
    rows = []
    for one in experiment.strokes:
        law, speed, _depth, x, _y, *rest, _lost = sweep_report.stroke_cells(one.stroke)
        lost = f"{one.stroke.lost_contact:.1f}"
        rows.append(Row([law, one.hand, speed, x, *rest, lost], law=one.stroke.law))
    table = Table(headings, rows, numeric_columns=range(2, len(headings)))
    return Section("V.B, every hand and speed", [table], notes=table_notes("paper_strokes"))


def _bump_section(experiment: BumpExperiment) -> Section:
    figure = partial(paper_pictures.bumps_figure, experiment)
    gains = "; ".join(
        f"{one.law} {energy_text(float(one.supplied[-1]))} ({one.entry})"
        for one in experiment.bumps
    )
    notes = _fitted_notes(experiment.guessed)
    return page.figure_section("paper.bumps", figure, notes, gains=gains)


def _device_section(experiments: Experiments) -> Section:
    devices = experiments.devices
    notes = _fitted_notes(devices.guessed)
    if devices.wall_summary:
        notes.append(f"Few misses on the left are weak evidence: {devices.wall_summary}.")
    notes.append(f"Not simulated for lack of an apparent mass: {', '.join(devices.skipped)}.")
    count = len(devices.onsets)
    missed = sum(one.catalogue_rule_missed for one in devices.onsets)
    figure = partial(paper_pictures.devices_figure, experiments)
    return page.figure_section("paper.devices", figure, notes, missed=missed, count=count)


def _device_table_section(experiment: DeviceExperiment) -> Section:
    headings = ("device", "surface", "law", "q", "K₀/q", "delay rule", "cycles", "starts", "depth")
    rows = [Row(_device_cells(one), law=one.prediction.onset.law) for one in experiment.onsets]
    table = Table(headings, rows, numeric_columns=range(3, len(headings)))
    return Section("Devices in numbers", [table], notes=table_notes("paper_devices"))


def _device_cells(device_onset: DeviceOnset) -> Cells:
    law, _delay, _quiet, cycling, starts, depth, q, _paper, rule, _wall = sweep_report.onset_cells(
        device_onset.prediction
    )
    kind = "no" if device_onset.catalogue_rule_missed else ""
    allowed = Cell(sweep_report.stiffness_number(device_onset.catalogue_rule), kind)
    names = [device_onset.device, device_onset.surface]
    return [*names, law, q, allowed, rule, cycling, starts, depth]
