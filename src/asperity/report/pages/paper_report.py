"""Report of the paper's claims: verdicts and simulated experiments; its figures as files."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any, Literal

import matplotlib
from matplotlib.figure import Figure

from asperity.core.errors import ParameterError
from asperity.core.files import write_bytes
from asperity.core.units import format_quantity
from asperity.paper import Result
from asperity.paper.claims import find_claims
from asperity.paper.cycle_experiments import (
    DeviceExperiment,
    DeviceOnset,
    PassivityExperiment,
    passivity_experiment,
)
from asperity.paper.experiments import (
    BumpExperiment,
    Experiments,
    ScanningExperiment,
    bump_experiment,
    scanning_experiment,
)
from asperity.paper.figures import loop_energies
from asperity.report.document import page
from asperity.report.document.page import (
    HEADED,
    Cell,
    Cells,
    Media,
    Page,
    Row,
    Section,
    Table,
    TableLayout,
    default_style,
)
from asperity.report.pages import sweep_report
from asperity.report.pictures import paper_pictures
from asperity.report.pictures.loop_pictures import onset_figure
from asperity.report.pictures.style import to_bytes
from asperity.report.sentences.paper_text import (
    VERDICT_TEXTS,
    evidence_text,
    experiment_summaries,
    fitted_notes,
    loop_energy_text,
    verdict_counts_text,
    wall_summary_text,
)
from asperity.report.sentences.texts import (
    energy_text,
    number_text,
    sentence,
    sentence_case,
    table_notes,
)


def claims_page(
    results: Sequence[Result], experiments: Experiments | None, command: str = ""
) -> Page:
    """Return the report: counts, claims by section with their evidence, figures, experiments.

    Args:
        results: of the claims.
        experiments: the repeated experiments, if any.
        command: what shows the evidence of one claim, with ``{}`` for its name.
    """
    sections = _terminal_sections(results, experiments)
    for name, members in _group_by_section(results):
        sections.append(_claims_section(name, members, command))
    sections += paper_sections()
    guesses: list[str] = []
    if experiments is not None:
        sections += experiment_sections(experiments)
        guesses += [*experiments.passivity.fitted, *experiments.scanning.guessed]
        guesses += [*experiments.bump.guessed, *experiments.devices.guessed]
    sections += [
        section for section in page.assumption_sections(guesses) if Media.HTML in section.media
    ]
    title = "“On the Synthesis of Haptic Textures”, claim by claim"
    facts = [(text.meaning, verdict) for verdict, text in VERDICT_TEXTS.items()]
    return Page(title, verdict_counts_text(results), facts, sections, sentence("claims"))


def _verdict_cell(result: Result) -> Cell:
    return Cell(result.verdict, VERDICT_TEXTS[result.verdict].cell_kind)


def _terminal_sections(results: Sequence[Result], experiments: Experiments | None) -> list[Section]:
    """Return one row per claim and one line per experiment, for a terminal."""
    rows = []
    for section, members in _group_by_section(results):
        rows.append(Row([f"§ {section}", "", ""], style="bold"))
        for result in members:
            numbers = ", ".join(result.equations)
            statement = result.statement
            if numbers:
                statement = f"{numbers}: {statement}"
            if result.evidence.fitted:
                statement += f" ({result.evidence.fitted})"
            rows.append(Row([result.id, _verdict_cell(result), statement]))
    layout = TableLayout(wrap=(2,), gap=2, has_rule=False)
    table = Table(("claim", "verdict", "states"), rows, layout=layout)
    summary = []
    if experiments is not None:
        lines = experiment_summaries(experiments)
        summary = [page.Paragraph(f"{name}: {text}") for name, text in lines]
    return [page.terminal_section(table), *([page.terminal_section(*summary)] if summary else ())]


def evidence_page(results: Sequence[Result], command: str = "") -> Page:
    """Return the report of chosen claims; a terminal shows everything that a verdict rests on."""
    whole = claims_page(results, None, command)
    evidence = map(_evidence_section, results)
    sections = [section for section in whole.sections if Media.HTML in section.media]
    return replace(whole, answer="", sections=[*evidence, *sections])


def _evidence_section(result: Result) -> Section:
    places = ", ".join((*result.equations, f"section {result.section}"))
    details = _evidence_details(result)
    blocks: list[page.Block] = [
        page.Paragraph(result.statement),
        Table((), [Row([_verdict_cell(result)])]),
        page.Paragraph(result.evidence.summary),
        *[page.Paragraph(f"{sentence_case(name)}: {text}") for name, text in details],
    ]
    numbers = result.evidence.numbers.items()
    notes = [f"  {name}: {evidence_text(value)}" for name, value in numbers]
    return Section(f"{result.id} ({places})", blocks, notes=notes, media=HEADED)


def _group_by_section(results: Sequence[Result]) -> list[tuple[str, list[Result]]]:
    grouped = groupby(results, key=lambda result: result.section)
    return [(section, [*members]) for section, members in grouped]


def _claims_section(section: str, members: Sequence[Result], command: str) -> Section:
    headings = ("claim", "equations", "states", "verdict")
    table = Table(headings, [_claim_row(result, command) for result in members])
    return Section(section if section == "Abstract" else f"Section {section}", [table])


def _evidence_details(result: Result) -> list[tuple[str, str]]:
    """Return names and texts of what qualifies the evidence of a claim."""
    evidence = result.evidence
    details = [
        ("not stated by the paper", evidence.fitted),
        ("correction", evidence.correction),
        ("another verdict with", result.flips_under),
    ]
    return [(name, text) for name, text in details if text]


def _claim_row(result: Result, command: str) -> Row:
    evidence = result.evidence
    details = [("found", evidence.summary), *_evidence_details(result)]
    details += [(name, evidence_text(value)) for name, value in evidence.numbers.items()]
    if command:
        details.append(("reproduce", command.format(result.id)))
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
    gained = "; ".join([f"{panel.law} {loop_energy_text(panel)}" for panel in panels])
    loops = partial(paper_pictures.figure_three, panels)
    count = len(panels)
    return [
        page.figure_section("paper.forces", paper_pictures.figure_two),
        page.figure_section("paper.loops", loops, count=count, gained=gained),
    ]


def experiment_sections(experiments: Experiments) -> list[Section]:
    """Return the sections of the experiments in order."""
    onsets = experiments.passivity.onsets
    figure = partial(onset_figure, onsets)
    return [
        _cycle_section(experiments.passivity),
        sweep_report.onset_figure_section("paper.onsets", figure, onsets),
        sweep_report.onset_section("V.A, onsets in numbers", onsets),
        _energy_section(experiments.scanning),
        _stroke_section(experiments.scanning),
        _bump_section(experiments.bump),
        _device_section(experiments),
        _device_table_section(experiments.devices),
    ]


def _cycle_section(experiment: PassivityExperiment) -> Section:
    first = experiment.counts[0]
    notes = fitted_notes(experiment.fitted)
    figure = partial(paper_pictures.cycles_figure, experiment)
    counts = ", ".join([f"{count.cycles} with {count.wall}" for count in experiment.counts])
    values: dict[str, Any] = {"lag": first.delay, "starts": first.starts, "counts": counts}
    return page.figure_section("paper.cycles", figure, notes, **values)


def _energy_section(experiment: ScanningExperiment) -> Section:
    figure = partial(paper_pictures.energies_figure, experiment)
    notes = fitted_notes(experiment.guessed)
    return page.figure_section("paper.energies", figure, notes, count=len(experiment.traces))


def _stroke_section(experiment: ScanningExperiment) -> Section:
    headings = ("law", "hand", "speed", "x", "z", "sum", "field", "±", "paper's", "lost")
    rows = []
    for done in experiment.strokes:
        stroke = done.stroke
        cells: Cells = [
            Cell(stroke.law, "l"),
            done.hand,
            format_quantity(stroke.speed, "m/s"),
            *sweep_report.energy_cells(stroke, "xz"),
            f"{stroke.lost_contact:.1f}",
        ]
        rows.append(Row(cells, law=stroke.law))
    table = Table(headings, rows, numeric_columns=range(2, len(headings)))
    return Section("V.B, every hand and speed", [table], notes=table_notes("paper_strokes"))


def _bump_section(experiment: BumpExperiment) -> Section:
    figure = partial(paper_pictures.bumps_figure, experiment)
    gains = "; ".join(
        [
            f"{run.law} {energy_text(float(run.supplied[-1]))} ({run.entry})"
            for run in experiment.bumps
        ]
    )
    notes = fitted_notes(experiment.guessed)
    return page.figure_section("paper.bumps", figure, notes, gains=gains)


def _device_section(experiments: Experiments) -> Section:
    devices = experiments.devices
    notes = fitted_notes(devices.guessed)
    summary = wall_summary_text(devices)
    if summary:
        notes.append(f"Few misses on the left are weak evidence: {summary}.")
    notes.append(f"Not simulated for lack of an apparent mass: {', '.join(devices.skipped)}.")
    count = len(devices.onsets)
    missed = sum([onset.catalogue_rule_missed for onset in devices.onsets])
    figure = partial(paper_pictures.devices_figure, experiments)
    return page.figure_section("paper.devices", figure, notes, missed=missed, count=count)


def _device_table_section(experiment: DeviceExperiment) -> Section:
    headings = ("device", "surface", "law", "q", "K₀/q", "delay rule", "cycles", "starts", "depth")
    rows = [
        Row(_device_cells(onset), law=onset.prediction.onset.law) for onset in experiment.onsets
    ]
    table = Table(headings, rows, numeric_columns=range(3, len(headings)))
    return Section("Devices in numbers", [table], notes=table_notes("paper_devices"))


def _device_cells(device_onset: DeviceOnset) -> Cells:
    prediction = device_onset.prediction
    allowed = number_text(device_onset.catalogue_rule)
    return [
        device_onset.device,
        device_onset.surface,
        Cell(prediction.onset.law, "l"),
        number_text(prediction.q),
        page.flagged_cell(allowed, device_onset.catalogue_rule_missed),
        sweep_report.delay_rule_cell(prediction),
        *sweep_report.bracket_cells(prediction),
    ]


FileFormat = Literal["svg", "png"]
_DPI = 192  # of a PNG: about 1920 pixels for the 10 inches that all figures are wide
_MARGIN = 0.15  # around the figure [inch]
_HASH_SALT = "asperity"  # of the identifiers in an SVG, which are random without one


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the reproduction.

    Attributes:
        name: of the file, without its suffix.
        claim_names: claims that it shows, as names for
            :func:`~asperity.paper.claims.find_claims`.
        draw: returns the figure, from all experiments or from the one that it needs.
        needs_simulation: whether it needs an experiment.
    """

    name: str
    claim_names: Sequence[str]
    draw: Callable[[Experiments | None], Figure]
    needs_simulation: bool = True

    def shows_any(self, names: Iterable[str]) -> bool:
        """Return whether it shows one of the named claims."""
        ours = {claim.id for name in self.claim_names for claim in find_claims(name)}
        return any(claim.id in ours for name in names for claim in find_claims(name))


def _draw_devices(experiments: Experiments | None) -> Figure:
    assert experiments is not None, "no claim needs this figure alone"
    return paper_pictures.devices_figure(experiments)


def _drawing(
    draw: Callable[[Any], Figure], experiment: str, simulate: Callable[[], Any]
) -> Callable[[Experiments | None], Figure]:
    """Return a drawing of one experiment, which is simulated if none have been."""

    def draw_experiment(experiments: Experiments | None) -> Figure:
        if experiments is None:
            return draw(simulate())
        return draw(getattr(experiments, experiment))

    return draw_experiment


def _simulate_cycles() -> PassivityExperiment:
    """Simulate figure 5 without onsets, which take minutes."""
    return passivity_experiment(delays=())


def _draw_onset_figure(experiment: PassivityExperiment) -> Figure:
    return onset_figure(experiment.onsets)


PAPER_FIGURES = (
    PaperFigure("fig-2", ["fig-2"], lambda _experiments: paper_pictures.figure_two(), False),
    PaperFigure("fig-3", ["fig-3"], lambda _: paper_pictures.figure_three(loop_energies()), False),
    PaperFigure(
        "fig-5", ["fig-5"], _drawing(paper_pictures.cycles_figure, "passivity", _simulate_cycles)
    ),
    PaperFigure(
        "onsets",
        ["sentence-III.B-reduced"],
        _drawing(_draw_onset_figure, "passivity", passivity_experiment),
    ),
    PaperFigure(
        "fig-6",
        ["fig-6"],
        _drawing(paper_pictures.energies_figure, "scanning", scanning_experiment),
    ),
    PaperFigure("fig-7", ["fig-7"], _drawing(paper_pictures.bumps_figure, "bump", bump_experiment)),
    PaperFigure("devices", [], _draw_devices),
)
"""In the order of the paper; additional figures follow those that they belong to."""


def find_figures(
    names: Sequence[str] = (), *, include_simulated: bool = True
) -> tuple[PaperFigure, ...]:
    """Return the figures that show claims; all if none is named.

    Args:
        names: of claims, see :func:`~asperity.paper.claims.find_claims`.
        include_simulated: whether all figures include those of experiments.

    Raises:
        ParameterError: if no figure shows a named claim.

    Example:
        >>> [figure.name for figure in find_figures(["eq-12", "fig-5"])]
        ['fig-3', 'fig-5']
    """
    if not names:
        return tuple(
            [figure for figure in PAPER_FIGURES if include_simulated or not figure.needs_simulation]
        )
    selected = tuple([figure for figure in PAPER_FIGURES if figure.shows_any(names)])
    if not selected:
        available = ", ".join([name for figure in PAPER_FIGURES for name in figure.claim_names])
        reason = f"are not available for {', '.join(names)}, but for {available}"
        raise ParameterError("figures", reason)
    return selected


def create_folder(path: str) -> Path:
    """Return a writable folder, created if it is missing.

    Raises:
        ParameterError: if the path is a file, or the folder cannot be created or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ParameterError("figures", "must be a folder, not a file", path) from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError("figures", f"cannot be created: {reason}", path) from None
    if not os.access(folder, os.W_OK):
        raise ParameterError("figures", "must be a folder that can be written", path)
    return folder


def write_figures(
    figures: Sequence[PaperFigure],
    folder: Path,
    file_format: FileFormat,
    experiments: Experiments | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> tuple[Path, ...]:
    """Draw figures and write each to a file; the same bytes for the same numbers.

    Args:
        figures: the figures.
        folder: destination.
        file_format: of the files.
        experiments: their data; by default each figure computes what it needs.
        progress: called with the name of each figure before it is drawn.

    Raises:
        ParameterError: if a file cannot be written.
    """
    files: dict[Path, bytes] = {}
    with default_style():
        matplotlib.rcParams["svg.hashsalt"] = _HASH_SALT
        for figure in figures:
            progress(figure.name)
            image = _draw_image(figure.draw(experiments), file_format)
            files[folder / f"{figure.name}.{file_format}"] = image
    for path, content in files.items():
        write_bytes("figures", path, content)
    return tuple(files)


def _draw_image(figure: Figure, file_format: str) -> bytes:
    metadata: dict[str, Any] = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
    options: dict[str, Any] = {"dpi": _DPI, "bbox_inches": "tight", "pad_inches": _MARGIN}
    return to_bytes(figure, format=file_format, metadata=metadata[file_format], **options)
